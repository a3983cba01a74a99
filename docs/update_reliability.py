#!/usr/bin/env python3
"""Writes the table of docs/reliability.md from tests that ran.

    update_reliability.py --run BUILD    runs the tests with faults in a build folder, then writes the table
    update_reliability.py FOLDER         writes the table from lines that tests left in FOLDER (ASSAY_RELIABILITY=FOLDER)

A test leaves a line only when it has passed.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

from update_claims import updated

PAGE = pathlib.Path(__file__).with_name("reliability.md")
# Tests that leave lines.
TESTS = "Runs|Fault|StoreFaults|cli.faults|cli.campaign.(Interrupted|FullDisk|BadDirectories)|cli.shards.Refusals|cli.slurm|cli.untrusted"


def table(folder):
    rows = sorted((json.loads(file.read_text("utf-8")) for file in pathlib.Path(folder).glob("*.json")),
                  key=lambda row: row["fault"])
    if not rows:
        sys.exit(f"update_reliability.py: no test has left a line in {folder}")
    lines = [("fault", "tries", "outcome", "lost"), ("---", "---:", "---", "---")]
    lines += [(row["fault"], str(row["tries"]), row["outcome"], row["lost"]) for row in rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def main(arguments):
    if len(arguments) == 2 and arguments[0] == "--run":
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["ctest", "--test-dir", arguments[1], "-R", TESTS, "--output-on-failure"], check=True,
                           env={**os.environ, "ASSAY_RELIABILITY": folder})
            block = table(folder)
    elif len(arguments) == 1 and not arguments[0].startswith("-"):
        block = table(arguments[0])
    else:
        sys.exit(__doc__)
    PAGE.write_text(updated(PAGE.read_text("utf-8"), {"faults": block}), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
