"""The table of releases.md.

RESULTS is what `assay bisect` writes, bisect.json or that as .xz.
"""

import json
import lzma
import pathlib

from .common import DOCS, table, write
from .engines import quantity


def course(path):
    text = path.read_bytes()
    return json.loads(lzma.decompress(text) if path.suffix == ".xz" else text)


def releases_table(found):
    rows = []
    for change in found["changes"]:
        what = "rounding" if change["rounding"] else f"{quantity(change['distance_m'], 'm', 3)} in the mean, {quantity(change['largest_m'], 'm', 3)} at most"
        causes = list(dict.fromkeys(f"{probe['probe']} ({probe['condition']})" if probe["condition"] else probe["probe"] for probe in change["probes"]))
        restored = ", ".join(f"`{each['setting']}`" for each in change["restoring"][:2])
        shown = ", ".join(causes[:3]) + (f" and {len(causes) - 3} more" if len(causes) > 3 else "")
        rows.append([f"{change['before']} to {change['after']}", what, shown or "none", restored or "–"])
    return table(["releases", "bodies of the humanoid apart", "probes that differ", "as before with"], rows)


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "releases.md")


def update(options):
    write(options.page, {"humanoid": releases_table(course(options.results))})
