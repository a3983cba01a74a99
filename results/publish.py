"""Makes a committed folder from a results directory: publish.py ASSAY RESULTS FOLDER.

Writes values.csv, manifest.json, assay.sqlite.xz, report.html and figures/ to FOLDER. ASSAY writes the report again, with
replays of the stored states; the states themselves stay in RESULTS.
"""

import contextlib
import json
import lzma
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile


def publish(program, results, folder):
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([program, "report", results], check=True)
    subprocess.run([program, "export", results, "--format", "csv", "--out", folder / "values.csv"], check=True)
    shutil.copy(results / "report.html", folder)
    shutil.rmtree(folder / "figures", ignore_errors=True)
    shutil.copytree(results / "figures", folder / "figures")
    with contextlib.closing(sqlite3.connect(results / "assay.sqlite")) as db, tempfile.TemporaryDirectory() as scratch:
        manifest = dict(db.execute("SELECT key, value FROM manifest ORDER BY key"))
        manifest["cells"] = dict(db.execute("SELECT outcome, count(*) FROM cells GROUP BY outcome ORDER BY outcome"))
        manifest["contenders"] = [
            dict(zip(("name", "engine", "version", "settings"), row)) | {"build": json.loads(row[4])}
            for row in db.execute("SELECT name, engine, version, settings, build_json FROM contenders ORDER BY rowid")]
        # Without free pages and without the files of an interrupted writer.
        packed = pathlib.Path(scratch) / "packed.sqlite"
        db.execute("VACUUM INTO ?", (str(packed),))
        (folder / "assay.sqlite.xz").write_bytes(lzma.compress(packed.read_bytes(), preset=9))
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit("usage: publish.py ASSAY RESULTS FOLDER")
    publish(sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]))
