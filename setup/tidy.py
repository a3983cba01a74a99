"""Runs clang-tidy over assay's own sources, in parallel, and only where something changed since it last passed.

What passed is in a file of the repository, a line "HASH SOURCE" for each way in which a source is compiled, so that a fresh clone
need not find out again. The hash covers what the verdict depends on: clang-tidy, its configuration, the compile command, the source and
every file of the repository that it includes. Headers from elsewhere count by the folder they come from, whose name has
the engine's version in it. The file is rewritten with what this run found out: commit it with the change.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def compile_commands(build):
    """(source, folder, command as words) of every source: those of a unity build are taken apart."""
    for entry in json.loads(pathlib.Path(build, "compile_commands.json").read_text()):
        file = os.path.normpath(os.path.join(entry["directory"], entry["file"]))
        words = shlex.split(entry["command"])
        sources = [file]
        if "/Unity/unity_" in file:
            sources = INCLUDE.findall(pathlib.Path(file).read_text())
        for source in sources:
            yield source, entry["directory"], [source if word == file else word for word in words]


class Hasher:
    def __init__(self, root, build, base, places):
        self.root, self.build, self.base = root, build, base
        self.places = sorted(places, key=lambda place: -len(place[0]))  # one may begin as another does
        self.includes, self.hashes = {}, {}

    def ours(self, path):
        return path.startswith(self.root + "/") and not path.startswith(self.root + "/build/")

    def included(self, path, folders):
        """The repository's files that `path` includes, itself first; what a build makes is not among them."""
        found, todo = [], [path]
        while todo:
            file = todo.pop()
            if file in found:
                continue
            found.append(file)
            if file not in self.includes:
                text = pathlib.Path(file).read_bytes()
                self.hashes[file] = hashlib.sha256(text).hexdigest()
                self.includes[file] = INCLUDE.findall(text.decode())
            for name in self.includes[file]:
                for folder in [os.path.dirname(file), *folders]:
                    candidate = os.path.normpath(os.path.join(folder, name))
                    if self.ours(candidate) and os.path.isfile(candidate):
                        todo.append(candidate)
                        break
        return found

    def key(self, source, words):
        folders = [word[2:] for word in words if word.startswith("-I")]
        command = " ".join(word for before, word in zip([""] + words, words) if word not in ("-c", "-o") and before != "-o")
        for place, name in self.places:
            command = command.replace(place, name)
        digest = hashlib.sha256(self.base + command.encode())
        for path in sorted(self.included(source, folders)):
            digest.update(f"{os.path.relpath(path, self.root)}\0{self.hashes[path]}\n".encode())
        return digest.hexdigest()[:20]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", required=True)
    parser.add_argument("--build", required=True, help="a build folder whose build is complete")
    parser.add_argument("--engines", required=True, help="the folder of downloads and engines")
    parser.add_argument("--clang-tidy", required=True)
    parser.add_argument("--passed", required=True, help="the file of what passed")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    root, build = os.path.realpath(args.root), os.path.realpath(args.build)

    # the configuration: every .clang-tidy of the tree can count for a file below it
    tracked = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"],
                             capture_output=True, text=True, check=True).stdout.split("\n")
    base = subprocess.run([args.clang_tidy, "--version"], capture_output=True, check=True).stdout
    for config in sorted(path for path in tracked if path.endswith(".clang-tidy")):
        base += config.encode() + pathlib.Path(root, config).read_bytes()

    ledger = pathlib.Path(args.passed)
    passed = {}
    if ledger.exists():
        for line in ledger.read_text().splitlines():
            if line and not line.startswith("#"):
                key, source = line.split(" ", 1)
                passed.setdefault(source, set()).add(key)

    # one job a source, although several targets may compile it
    hasher = Hasher(root, build, base, [(build, "BUILD"), (root, "ROOT"), (os.path.realpath(args.engines), "CACHE"),
                                        (args.engines, "CACHE")])
    keys, commands = {}, []
    for source, folder, words in compile_commands(build):
        if hasher.ours(source):
            keys.setdefault(source, set()).add(hashlib.sha256(hasher.key(source, words).encode()).hexdigest()[:20])
            commands.append({"directory": folder, "file": source, "arguments": words})
    name = {source: os.path.relpath(source, root) for source in keys}
    # lines of other ways to compile a source that did not change stay: those of an engine that is not installed here
    todo = [source for source in sorted(keys) if not keys[source] <= passed.get(name[source], set())]
    database = pathlib.Path(build, "tidy")
    database.mkdir(exist_ok=True)
    (database / "compile_commands.json").write_text(json.dumps(commands))

    def check(source):
        return source, subprocess.run([args.clang_tidy, "-p", str(database), "--quiet", source], capture_output=True, text=True)

    print(f"clang-tidy: {len(keys)} files, {len(todo)} of them to check", flush=True)
    failed = 0
    # a file that is in no build here, for want of its engine, keeps its line
    passed = {source: some for source, some in passed.items() if source in tracked}
    try:
        with concurrent.futures.ThreadPoolExecutor(max(1, args.jobs)) as pool:
            for source, run in pool.map(check, todo):
                if run.returncode == 0:
                    passed[name[source]] = keys[source]
                    continue
                failed += 1
                passed.pop(name[source], None)
                print(f"--- {name[source]}\n{run.stdout.strip()}", flush=True)
                if not run.stdout.strip():
                    print(run.stderr.strip(), flush=True)
    finally:
        text = "# Sources in which clang-tidy found nothing, each with a hash of what that depends on (setup/checks/tidy.py, which writes it).\n"
        text += "".join(f"{key} {source}\n" for source in sorted(passed) for key in sorted(passed[source]))
        if not ledger.exists() or ledger.read_text() != text:
            part = ledger.with_suffix(".part")
            part.write_text(text)
            part.replace(ledger)
    print(f"clang-tidy: {failed} files with findings", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
