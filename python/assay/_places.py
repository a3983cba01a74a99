"""Where the parts of the package lie."""

from __future__ import annotations

import pathlib

from . import errors

FOLDER = pathlib.Path(__file__).resolve().parent
ENGINES = FOLDER / "program/lib/assay/engines"


def program() -> pathlib.Path:
    """The executable `assay`."""
    path = FOLDER / "program/bin/assay"
    if not path.is_file():
        raise errors.MachineError(f"the package has no program: '{path}' is missing; install the package again")
    return path
