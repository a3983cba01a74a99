"""What the writers of pages share: tables in Markdown, generated blocks of a page, committed databases."""

import contextlib
import fractions
import pathlib
import sqlite3
import sys
import tempfile

DOCS = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(DOCS.parent / "results"))
import packed  # noqa: E402
import standing  # noqa: E402


def milliseconds(timestep):
    """0.25 as "1/4", as the program writes it."""
    return str(fractions.Fraction(timestep))


def table(header, rows):
    lines = [header, ["---"] * len(header), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def updated(text, new):
    """The page's text with its generated blocks replaced."""
    for name, block in new.items():
        begin_mark, end_mark = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
        begin = text.index(begin_mark) + len(begin_mark)
        text = text[:begin] + block + text[text.index(end_mark, begin):]
    return text


def write(page, blocks):
    page.write_text(updated(page.read_text(encoding="utf-8"), blocks), encoding="utf-8")


@contextlib.contextmanager
def opened(results):
    """The path and a connection to the database of a results directory, or of one packed as assay.sqlite.xz."""
    with tempfile.TemporaryDirectory() as scratch:
        path = packed.database(results, scratch)
        with contextlib.closing(sqlite3.connect(path)) as db:
            yield path, db
