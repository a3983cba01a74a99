"""Asks the conformance suite once about contenders that the tests' campaigns name, for all of them:
verdicts.py FOLDER CONTENDER..."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from harness import BALL, BALL_CAMPAIGN, PROGRAM


def main(folder, *usual):
    shutil.rmtree(folder, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix="assay-verdicts-") as work:
        work = pathlib.Path(work)
        env = {key: value for key, value in os.environ.items() if not key.startswith("ASSAY_")}
        env["XDG_CACHE_HOME"] = str(work / "cache")
        (work / "ball.xml").write_text(BALL, encoding="utf-8")
        listed = subprocess.run([PROGRAM, "engines", "--json"], env=env, check=True, capture_output=True, text=True).stdout
        there = {row["contender"] for row in json.loads(listed)["contenders"]}
        contenders = [name for name in usual if name in there]
        (work / "ball.toml").write_text(BALL_CAMPAIGN.replace('["null"]', json.dumps(contenders)), encoding="utf-8")
        subprocess.run([PROGRAM, "run", "ball.toml", "--out", "results"], cwd=work, env=env, check=True)
        kept = work / "cache/assay/conformance"
        if len(list(kept.iterdir())) != len(contenders):
            sys.exit(f"{len(list(kept.iterdir()))} verdicts of {len(contenders)} contenders")
        shutil.copytree(kept, folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
