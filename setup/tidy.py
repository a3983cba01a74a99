"""Runs clang-tidy over assay's own sources, in parallel: those that changed lately, or all of them.

Lately is since the last release tag or, where none is reachable, in the day before the newest commit, and in the working tree. A
changed header counts for the source of the same name. With a limit of time the newest changes come first, and it says how many were
left: those of earlier runs.
"""

import argparse
import concurrent.futures
import datetime
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import time

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


class Changes:
    def __init__(self, root):
        self.root = root

    def git(self, *arguments):
        done = subprocess.run(["git", "-C", self.root, *arguments], capture_output=True, text=True)
        return done.stdout.split("\n")[:-1] if done.returncode == 0 else []

    def since(self):
        """The newest commit that does not count any more; none where all do."""
        tag = self.git("describe", "--tags", "--abbrev=0", "--match", "v*")
        if tag:
            return tag[0]
        newest = self.git("log", "-1", "--format=%cI")
        if not newest:
            return None
        day_before = datetime.datetime.fromisoformat(newest[0]) - datetime.timedelta(days=1)
        older = self.git("rev-list", "-1", f"--before={day_before.isoformat()}", "HEAD")
        return older[0] if older else None

    def files(self, since):
        """Paths from the root of what changed since that commit, committed or not, the newest changes first."""
        listed = self.git("ls-files", "--others", "--exclude-standard") + self.git("diff", "--name-only", "HEAD")
        listed += self.git("log", "--format=", "--name-only", f"{since}..HEAD") if since else self.git("ls-files")
        return list(dict.fromkeys(listed))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", required=True)
    parser.add_argument("--build", required=True, help="a build folder whose build is complete")
    parser.add_argument("--clang-tidy", required=True)
    parser.add_argument("--all", action="store_true", help="every source, not only those that changed lately")
    parser.add_argument("--since", help="what changed since this commit")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="no source is begun after that time")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    root, build = os.path.realpath(args.root), os.path.realpath(args.build)

    sources, commands = {}, []
    for source, folder, words in compile_commands(build):
        if source.startswith(root + "/") and not source.startswith(root + "/build/"):
            sources.setdefault(source, os.path.relpath(source, root))  # one job a source, although several targets may compile it
            commands.append({"directory": folder, "file": source, "arguments": words})
    database = pathlib.Path(build, "tidy")
    database.mkdir(exist_ok=True)
    (database / "compile_commands.json").write_text(json.dumps(commands))

    todo, what = sorted(sources), "all"
    if not args.all:
        changes = Changes(root)
        since = args.since or changes.since()
        stems = [os.path.splitext(file)[0] for file in changes.files(since)]
        newest = {stem: place for place, stem in reversed(list(enumerate(stems)))}
        todo = [source for source in todo if os.path.splitext(sources[source])[0] in newest]
        todo.sort(key=lambda source: newest[os.path.splitext(sources[source])[0]])
        what = f"those that changed since {since[:12]}" if since else "all, for there is no older commit"

    end = time.monotonic() + args.seconds

    def check(source):
        if time.monotonic() > end:
            return source, None
        return source, subprocess.run([args.clang_tidy, "-p", str(database), "--quiet", source], capture_output=True, text=True)

    print(f"clang-tidy: {len(todo)} of {len(sources)} files ({what})", flush=True)
    failed = left = 0
    with concurrent.futures.ThreadPoolExecutor(max(1, args.jobs)) as pool:
        for source, run in pool.map(check, todo):
            left += run is None
            if run is None or run.returncode == 0:
                continue
            failed += 1
            print(f"--- {sources[source]}\n{run.stdout.strip()}", flush=True)
            if not run.stdout.strip():
                print(run.stderr.strip(), flush=True)
    if left:
        print(f"clang-tidy: {left} files were left for want of time: ./test --all takes all", flush=True)
    print(f"clang-tidy: {failed} files with findings", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
