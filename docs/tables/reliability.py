"""The table of reliability.md, from tests that ran.

    update.py reliability --run BUILD    runs the tests with faults in a build folder, then writes the table
    update.py reliability FOLDER         writes the table from lines that tests left in FOLDER (ASSAY_RELIABILITY=FOLDER)

A test leaves a line only when it has passed. Where a line of the page was not left again, nothing is written, unless
--allow-missing names it under the table as not run here, or --forget drops it, as where its test is gone or renamed.
"""

import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

from .common import DOCS, write

PAGE = DOCS / "lab/reliability.md"
# Tests that leave lines.
TESTS = ("Runs|Fault|StoreFaults|cli.faults|cli.campaign.(Interrupted|FullDisk|BadDirectories)|cli.shards.Refusals|cli.slurm|cli.untrusted|"
         "cli.run_robot.RunRobot.a_programme")
ABSENT = "- not run here: "


def shown(text):
    return text.replace("|", "\\|")


def table(rows):
    lines = [("fault", "tries", "outcome", "lost"), ("---", "---:", "---", "---")]
    lines += [(row["fault"], str(row["tries"]), row["outcome"], row["lost"]) for row in rows]
    return "".join("| " + " | ".join(shown(cell) for cell in line) + " |\n" for line in lines)


def faults_of(page):
    """What the page has a line for, or names as not run."""
    block = page[page.index("<!-- faults: begin -->"):page.index("<!-- faults: end -->")]
    lines = [line[2:].replace("\\|", "\0").split(" | ")[0].replace("\0", "\\|") for line in block.splitlines() if line.startswith("| ")]
    return set(lines[2:]) | {line.removeprefix(ABSENT) for line in block.splitlines() if line.startswith(ABSENT)}


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text("utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def skipped_by_ctest(junit):
    return [case.get("name") for case in xml.etree.ElementTree.parse(junit).getroot().iter("testcase")
            if case.find("skipped") is not None]


def block_of(folder, page, arguments, skipped=()):
    """The generated part of the page; ends the program where lines would be lost."""
    left = [json.loads(file.read_text("utf-8")) for file in sorted(pathlib.Path(folder).glob("*.json"))]
    rows = sorted((line for line in left if "fault" in line), key=lambda row: row["fault"])
    if not rows:
        sys.exit(f"update.py: no test has left a line in {folder}")
    missing = sorted(faults_of(page) - {shown(row["fault"]) for row in rows})
    skipped = sorted({*skipped, *(f"{line['skipped']} ({line['reason']})" for line in left if "skipped" in line)})
    if missing and not (arguments.allow_missing or arguments.forget):
        sys.exit("\n".join(["update.py: these lines of the page were not left again; run their tests, or give "
                            "--allow-missing or --forget:", *missing, f"skipped: {', '.join(skipped) or 'none'}"]))
    run = (f"\nRun on {datetime.date.today().isoformat()}, {processor()}, {platform.system()} {platform.release()}; "
           f"skipped: {', '.join(skipped) or 'none'}.\n")
    absent = [] if arguments.forget else missing
    return table(rows) + run + ("\n" + "".join(f"{ABSENT}{fault}\n" for fault in absent) if absent else "")


def add_arguments(parser):
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--run")
    parser.add_argument("--allow-missing", action="store_true")
    parser.add_argument("--forget", action="store_true")
    parser.add_argument("--page", type=pathlib.Path, default=PAGE)


def update(options):
    if (options.run is None) == (options.folder is None):
        sys.exit("update.py reliability: give either a folder of lines that tests have left, or --run BUILD")
    page = options.page.read_text("utf-8")
    if options.folder is not None:
        block = block_of(options.folder, page, options)
    else:
        with tempfile.TemporaryDirectory() as folder:
            junit = pathlib.Path(folder) / "junit.xml"
            subprocess.run(["ctest", "--test-dir", options.run, "-R", TESTS, "--output-on-failure", "--output-junit", str(junit)],
                           check=True, env={**os.environ, "ASSAY_RELIABILITY": folder})
            block = block_of(folder, page, options, skipped_by_ctest(junit))
    write(options.page, {"faults": block})
