"""Runs clang-tidy over assay's own sources, in parallel, and only where something changed since it last passed.

A file that passes leaves an empty file named by the hash of everything the verdict depends on: clang-tidy, its
configuration, the compile command, the source and every header of ours it includes (from ninja's record of the last
build; headers from elsewhere count by path and size).
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import time

PRUNE_AFTER_DAYS = 60


def included_files(build):
    """Object file -> the files it was compiled from, absolute."""
    text = subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True, check=True).stdout
    result, current = {}, None
    for line in text.splitlines():
        if line.startswith("    "):
            current.append(os.path.normpath(os.path.join(build, line.strip())))
        elif ": #deps" in line:
            current = result.setdefault(line.split(": #deps")[0], [])
    return result


class Hasher:
    def __init__(self, root, base):
        self.root, self.base, self.known = root, base, {}

    def file(self, path):
        if path not in self.known:
            try:
                inside = path.startswith(self.root + "/") and "/.cache/" not in path
                content = pathlib.Path(path).read_bytes() if inside else str(os.path.getsize(path)).encode()
            except OSError:
                content = b"absent"
            self.known[path] = hashlib.sha256(content).hexdigest()
        return self.known[path]

    def key(self, command, files):
        digest = hashlib.sha256(self.base)
        digest.update(command.encode())
        for path in sorted(files):
            digest.update(f"{path}\0{self.file(path)}\n".encode())
        return digest.hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", required=True)
    parser.add_argument("--build", required=True, help="a build folder whose build is complete")
    parser.add_argument("--clang-tidy", required=True)
    parser.add_argument("--cache", required=True)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    root, build = os.path.realpath(args.root), os.path.realpath(args.build)

    # the configuration: every .clang-tidy of the tree can count for a file below it
    configs = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard", "*.clang-tidy"],
                             capture_output=True, text=True, check=True).stdout.split()
    base = subprocess.run([args.clang_tidy, "--version"], capture_output=True, check=True).stdout
    for config in sorted(configs):
        base += config.encode() + pathlib.Path(root, config).read_bytes()

    cache = pathlib.Path(args.cache)
    cache.mkdir(parents=True, exist_ok=True)
    for old in cache.iterdir():
        if time.time() - old.stat().st_mtime > PRUNE_AFTER_DAYS * 86400:
            old.unlink(missing_ok=True)

    # one job a source, although several targets may compile it
    includes = included_files(build)
    hasher = Hasher(root, base)
    jobs = {}
    for entry in json.loads(pathlib.Path(build, "compile_commands.json").read_text()):
        source = os.path.normpath(os.path.join(entry["directory"], entry["file"]))
        if not source.startswith(root + "/") or source.startswith((build + "/", root + "/.cache/", root + "/build/")):
            continue
        # CMake names the output in the command alone
        output = re.search(r" -o (\S+)", entry["command"])
        files = includes.get(output.group(1)) if output else None
        key = hasher.key(entry["command"], files) if files else None
        jobs.setdefault(source, []).append(key)
    todo = []
    for source, keys in sorted(jobs.items()):
        key = None if None in keys else hashlib.sha256("".join(sorted(keys)).encode()).hexdigest()
        passed = cache / key if key else None
        if passed and passed.exists():
            os.utime(passed)
        else:
            todo.append((source, passed))

    def check(job):
        source, passed = job
        run = subprocess.run([args.clang_tidy, "-p", build, "--quiet", source], capture_output=True, text=True)
        if run.returncode == 0 and passed:
            passed.touch()
        return source, run

    print(f"clang-tidy: {len(jobs)} files, {len(todo)} of them to check", flush=True)
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(max(1, args.jobs)) as pool:
        for source, run in pool.map(check, todo):
            if run.returncode != 0:
                failed += 1
                print(f"--- {os.path.relpath(source, root)}\n{run.stdout.strip()}", flush=True)
                if not run.stdout.strip():
                    print(run.stderr.strip(), flush=True)
    print(f"clang-tidy: {failed} files with findings", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
