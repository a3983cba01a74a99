"""The moving picture of the README: one robot in engines side by side, all from the same start.

Runs the contenders of committed results again at a timestep and draws them with `assay draw`, so the engines have to be installed.
The file says in a comment what it shows; tests/cli/test_pictures.py compares that with the results.
"""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

from .common import DOCS, opened

PAGE = DOCS / "engines.gif"
RESULTS = DOCS.parent / "results/intel-xeon-2-cores/assay.sqlite.xz"
SYSTEM, TIMESTEP_MS, SIZE = "humanoid", 4, "900x560"
CONTENDERS = ["mujoco-euler", "ode-quick", "physx-d6-pgs", "havok", "bullet-mb", "dart"]
MOST_BYTES = 2_000_000

COMMENT, TRAILER = b"\x21\xfe", b"\x3b"  # of a GIF


def recipe(results):
    """What the picture shows, by the database of `results`: the model and the settings and versions of the contenders."""
    with opened(results) as (_, db):
        facts = json.loads(db.execute("SELECT json FROM systems WHERE name = ?", (SYSTEM,)).fetchone()[0])
        rows = {name: [version, settings] for name, version, settings in db.execute("SELECT name, version, settings FROM contenders")}
    return {"system": SYSTEM, "model": facts["model_hash"], "seconds": facts["duration_s"], "timestep_ms": TIMESTEP_MS, "size": SIZE,
            "contenders": {name: rows[name] for name in CONTENDERS}}


def with_comment(gif, text):
    data = text.encode()
    blocks = b"".join(bytes([len(part)]) + part for part in (data[at:at + 255] for at in range(0, len(data), 255)))
    assert gif.endswith(TRAILER)
    return gif[:-1] + COMMENT + blocks + b"\0" + TRAILER


def comment_of(gif):
    """The text of the comment that the file ends with, "" for none."""
    begin = len(gif)
    while (begin := gif.rfind(COMMENT, 0, begin)) >= 0:
        at, text = begin + len(COMMENT), b""
        while at < len(gif) and gif[at]:
            text += gif[at + 1:at + 1 + gif[at]]
            at += 1 + gif[at]
        if gif[at:] == b"\0" + TRAILER:
            return text.decode()
    return ""


def add_arguments(parser):
    parser.add_argument("program", help="./assay")
    parser.add_argument("results", nargs="?", default=RESULTS, type=pathlib.Path)


def update(options):
    shown = recipe(options.results)
    listed = json.loads(subprocess.run([options.program, "engines", "--json"], capture_output=True, check=True).stdout)["contenders"]
    versions = {row["contender"]: row["version"] for row in listed}
    for name, (version, _) in shown["contenders"].items():
        if versions.get(name) != version:
            sys.exit(f"the results have '{name}' of version {version}, here it is {versions.get(name, 'not installed')}")
    with tempfile.TemporaryDirectory() as folder, opened(options.results) as (path, _):
        shutil.copy(path, pathlib.Path(folder) / "assay.sqlite")
        movie = pathlib.Path(folder) / "engines.gif"
        subprocess.run([options.program, "draw", folder, SYSTEM, "--contenders", ",".join(CONTENDERS), "--timestep", str(TIMESTEP_MS),
                        "--size", SIZE, "--out", movie], check=True)
        gif = with_comment(movie.read_bytes(), json.dumps(shown, sort_keys=True))
    if len(gif) > MOST_BYTES:
        sys.exit(f"the picture has {len(gif)} bytes, more than {MOST_BYTES}: make it smaller (SIZE)")
    PAGE.write_bytes(gif)
