"""Makes a committed folder from a results directory: publish.py ASSAY RESULTS FOLDER [--compact] [--dirty].

Writes values.csv, manifest.json, assay.sqlite.xz, report.html and figures/ to FOLDER. ASSAY writes the report again, with
replays of the stored states; the states themselves stay in RESULTS. Where RESULTS has the database of FOLDER without states,
only the report and the figures are written again, and the report keeps the replays that FOLDER's report has. With --compact
FOLDER gets no report and no figures. Results of a program with uncommitted sources are refused, unless --dirty is given and the
folder's README says what they were.
"""

import contextlib
import json
import lzma
import pathlib
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile

import packed

# Of a policy's configuration, which an option names by its absolute path.
FOLDERS = re.compile(r"(config=)/[^\"\s]*?/(examples/)")
REPLAYS = re.compile(r'(<script[^>]*id="assay-replays"[^>]*>)(.*?)(</script>)', re.S)


def keep_replays(old, new):
    """The page `new` with the replays of the page `old`."""
    kept = REPLAYS.search(old).group(2)
    page, count = REPLAYS.subn(lambda match: match.group(1) + kept + match.group(3), new, count=1)
    assert count == 1, "the report has no element for replays"
    return page


def manifest_hash(db):
    """What the program stores of the manifest's rows: src/results/store/cell_hash.cc."""
    rows = db.execute("SELECT CAST(key AS BLOB), CAST(value AS BLOB) FROM manifest ORDER BY key")
    return hash_of(rows)


def systems_hash(db):
    return hash_of(db.execute("SELECT CAST(json AS BLOB), CAST(name AS BLOB) FROM systems ORDER BY rowid"))


def hash_of(rows):
    return packed.content_hash(b"".join(b"t" + struct.pack("<Q", len(text)) + text for row in rows for text in row))


def publish(program, results, folder, compact):
    folder.mkdir(parents=True, exist_ok=True)
    if not compact:
        subprocess.run([program, "report", results], check=True)
    if not compact and (folder / "report.html").exists() and not any((results / "trajectories").glob("*")):
        page = keep_replays((folder / "report.html").read_text("utf-8"), (results / "report.html").read_text("utf-8"))
        (folder / "report.html").write_text(page, "utf-8")
        if (results / "figures").is_dir():
            shutil.copytree(results / "figures", folder / "figures", dirs_exist_ok=True)
        return
    subprocess.run([program, "export", results, "--format", "csv", "--out", folder / "values.csv"], check=True)
    if not compact:
        shutil.copy(results / "report.html", folder)
        shutil.rmtree(folder / "figures", ignore_errors=True)
        if (results / "figures").is_dir():  # the paper's, of campaigns with its systems
            shutil.copytree(results / "figures", folder / "figures")
    with contextlib.closing(sqlite3.connect(results / "assay.sqlite")) as db, tempfile.TemporaryDirectory() as scratch:
        manifest = dict(db.execute("SELECT key, value FROM manifest ORDER BY key"))
        manifest["cells"] = dict(db.execute("SELECT outcome, count(*) FROM cells GROUP BY outcome ORDER BY outcome"))
        manifest["contenders"] = [
            dict(zip(("name", "engine", "version", "settings"), row)) | {"build": json.loads(row[4])}
            for row in db.execute("SELECT name, engine, version, settings, build_json FROM contenders ORDER BY rowid")]
        # Without free pages and without the files of an interrupted writer.
        small = pathlib.Path(scratch) / "assay.sqlite"
        db.execute("VACUUM INTO ?", (str(small),))
        # The command and the systems' files without the folders of the machine that they were given on.
        manifest["command"] = re.sub(r"(?<!\S)/\S*/", "", manifest.get("command", ""))  # merged results have none
        with contextlib.closing(sqlite3.connect(small)) as copy, copy:
            copy.execute("UPDATE manifest SET value = ? WHERE key = 'command'", (manifest["command"],))
            for name, text in copy.execute("SELECT name, json FROM systems").fetchall():
                copy.execute("UPDATE systems SET json = ? WHERE name = ?", (FOLDERS.sub(r"\1/assay/\2", text), name))
            if copy.execute("PRAGMA user_version").fetchone()[0] > 1:  # version 1 has no hashes
                copy.execute("UPDATE hashes SET hash = ? WHERE name = 'manifest'", (manifest_hash(copy),))
                copy.execute("UPDATE hashes SET hash = ? WHERE name = 'systems'", (systems_hash(copy),))
        subprocess.run([program, "status", scratch], check=True, stdout=subprocess.DEVNULL)  # it can be opened
        (folder / "assay.sqlite.xz").write_bytes(lzma.compress(small.read_bytes(), preset=9))
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


def commit_of(results):
    with contextlib.closing(sqlite3.connect(results / "assay.sqlite")) as db:
        return (db.execute("SELECT value FROM manifest WHERE key = 'commit'").fetchone() or [""])[0]


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word not in ("--compact", "--dirty")]
    if len(given) != 3:
        sys.exit("usage: publish.py ASSAY RESULTS FOLDER [--compact] [--dirty]")
    if "--dirty" not in sys.argv and commit_of(pathlib.Path(given[1])).endswith("-dirty"):
        sys.exit(f"'{given[1]}' was measured with uncommitted sources: commit, build and measure again, or add --dirty and say in its README what they were")
    publish(given[0], pathlib.Path(given[1]), pathlib.Path(given[2]), "--compact" in sys.argv)
