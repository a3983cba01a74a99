"""Packages for a machine without a network, in parts of at most 20 MiB.

parts.py pack DIR NAME WHEEL... [--leave-out PATTERN]...   unpacks wheels, compresses their files without those that match, and splits
parts.py split DIR NAME FILE PATH                         splits one compressed file (.xz) that belongs at PATH among the packages
parts.py join DIR SITE NAME...                            checks and unpacks what is there of NAME, on the other machine

DIR gets NAME.json with the length and SHA-256 of each part. `join` names the parts that are missing, and does nothing twice.
"""

import argparse
import fnmatch
import hashlib
import io
import json
import lzma
import os
import sys
import tarfile
import zipfile

MOST = 20 * 2 ** 20


def write_parts(folder, name, kind, data, path=""):
    os.makedirs(folder, exist_ok=True)
    parts = []
    for start in range(0, len(data), MOST):
        part = data[start:start + MOST]
        file = f"{name}.{start // MOST:03d}"
        with open(os.path.join(folder, file), "wb") as out:
            out.write(part)
        parts.append({"file": file, "bytes": len(part), "sha256": hashlib.sha256(part).hexdigest()})
    with open(os.path.join(folder, name + ".json"), "w", encoding="utf-8") as out:
        json.dump({"kind": kind, "path": path, "parts": parts}, out, indent=1)
        out.write("\n")
    print(f"{name}: {len(data) / 2 ** 20:.1f} MiB in {len(parts)} parts")


def pack(options):
    memory = io.BytesIO()
    with lzma.open(memory, "wb", preset=options.preset) as compressed, tarfile.open(fileobj=compressed, mode="w|") as tar:
        for wheel in options.wheels:
            with zipfile.ZipFile(wheel) as files:
                for entry in files.infolist():
                    if entry.is_dir() or any(fnmatch.fnmatch(entry.filename, pattern) for pattern in options.leave_out):
                        continue
                    member = tarfile.TarInfo(entry.filename)
                    member.size, member.mode = entry.file_size, 0o755
                    tar.addfile(member, files.open(entry))
    write_parts(options.folder, options.name, "tar", memory.getvalue())


def split(options):
    with open(options.file, "rb") as file:
        write_parts(options.folder, options.name, "file", file.read(), options.path)


def join(options):
    for name in options.names:
        mark = os.path.join(options.site, f".{name}.joined")
        if os.path.exists(mark):
            continue
        try:
            with open(os.path.join(options.folder, name + ".json"), encoding="utf-8") as file:
                made = json.load(file)
        except OSError:
            sys.exit(f"'{name}.json' is missing in {options.folder}: bring it with the parts")
        data, missing = [], []
        for part in made["parts"]:
            path = os.path.join(options.folder, part["file"])
            if not os.path.exists(path):
                missing.append(part["file"])
                continue
            with open(path, "rb") as file:
                data.append(file.read())
            if hashlib.sha256(data[-1]).hexdigest() != part["sha256"]:
                sys.exit(f"'{part['file']}' has other bytes than were packed: bring it again")
        if missing:
            sys.exit(f"parts of {name} are missing: {', '.join(missing)}")
        os.makedirs(options.site, exist_ok=True)
        plain = lzma.decompress(b"".join(data))
        if made["kind"] == "tar":
            with tarfile.open(fileobj=io.BytesIO(plain)) as tar:
                # before Python 3.11.4 there is no filter; the hashes say that the parts are ours
                tar.extractall(options.site, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
        else:
            path = os.path.join(options.site, made["path"])
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as out:
                out.write(plain)
            os.chmod(path, 0o755)
        with open(mark, "w", encoding="utf-8"):
            pass
        print(f"{name} is in {options.site}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("pack")
    one.add_argument("folder"), one.add_argument("name"), one.add_argument("wheels", nargs="+")
    one.add_argument("--leave-out", action="append", default=[])
    one.add_argument("--preset", type=int, default=6)
    one.set_defaults(call=pack)
    one = commands.add_parser("split")
    for name in ("folder", "name", "file", "path"):
        one.add_argument(name)
    one.set_defaults(call=split)
    one = commands.add_parser("join")
    one.add_argument("folder"), one.add_argument("site"), one.add_argument("names", nargs="+")
    one.set_defaults(call=join)
    options = parser.parse_args()
    options.call(options)


if __name__ == "__main__":
    main()
