"""Results directories, through the program's own exports: nothing here reads the database."""

from __future__ import annotations

import csv
import io
import json
import os
import pathlib
import tempfile
from typing import Any, Mapping, Optional, Union

from . import _program
from .errors import InputError, RunError

Path = Union[str, os.PathLike]

_NUMBERS = ("timestep_ms", "value", "low", "high")


def table_of(rows: list[dict], columns: list[str], frame: str) -> Any:
    """Rows as a pandas or a polars table, or as they are ("dicts"). What is missing is NaN in pandas and null in polars."""
    if frame == "dicts":
        return [{name: row.get(name) for name in columns} for row in rows]
    data = {name: [row.get(name) for row in rows] for name in columns}
    if frame == "pandas":
        return _imported("pandas").DataFrame(data, columns=columns)
    if frame == "polars":
        polars = _imported("polars")
        numbers = {name for name in columns if all(isinstance(each, (int, float, type(None))) for each in data[name])
                   and any(isinstance(each, (int, float)) for each in data[name])}
        return polars.DataFrame(data, schema={name: polars.Float64 if name in numbers or name in _NUMBERS else polars.String
                                              for name in columns}, strict=False)
    raise InputError(f"frame is '{frame}': give pandas, polars or dicts")


def _imported(name: str) -> Any:
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise InputError(f"{name} is not installed: pip install {name}, or give another frame") from error


class Results:
    """A results directory. Cheap to make; every method asks the program, and running campaigns can be read."""

    def __init__(self, folder: Path):
        self.folder = pathlib.Path(folder)
        self.summary = ""  # what the program printed at the end of the campaign that made this object
        if not (self.folder / "assay.sqlite").is_file():
            raise InputError(f"'{self.folder}' holds no results: give the folder that a campaign wrote")

    def __repr__(self) -> str:
        return f"Results('{self.folder}')"

    def values(self, frame: str = "pandas") -> Any:
        """Every measured value, one a row: system, contender, timestep_ms, measure (the value's name), value, unit ("1" for
        ratios), outcome ("ok", "unstable", "diverged", "timeout", "crashed", "unsupported"), low and high (the 95 % interval).
        A cell that failed has a row without a value. `frame`: "pandas", "polars" or "dicts"."""
        text = _program.call("export", self.folder, "--format", "csv")
        rows: list[dict] = list(csv.DictReader(io.StringIO(text)))
        for row in rows:
            for name in _NUMBERS:
                row[name] = float(row[name]) if row[name] else None
        return table_of(rows, ["system", "contender", "timestep_ms", "measure", "value", "unit", "outcome", "low", "high"], frame)

    def trajectories(self) -> dict[tuple[str, str], Mapping[str, Any]]:
        """States of the kept runs by (system, contender): arrays time (T,) s, position (T, B, 3) m, orientation (T, B, 4)
        (w, x, y, z), velocity (T, B, 3) m/s, angular_velocity (T, B, 3) rad/s, angle and rate (T, J) rad and rad/s, and the
        names `bodies` and `hinges`; docs/files.md."""
        import numpy

        found = {}
        with tempfile.TemporaryDirectory(prefix="assay-states-") as out:
            _program.call("export", self.folder, "--trajectories", "npz", "--out", out)
            with open(os.path.join(out, "index.csv"), newline="", encoding="utf-8") as index:
                for row in csv.DictReader(index):
                    with numpy.load(os.path.join(out, row["file"])) as run:
                        found[row["system"], row["contender"]] = {name: run[name] for name in run.files}
        return found

    def recommend(self, system: str = "all", *, error: Optional[str] = None, measure: Optional[str] = None,
                  penetration: Optional[str] = None, slip: Optional[str] = None, realtime: Optional[float] = None,
                  limits: Optional[Mapping[str, str]] = None) -> dict:
        """The fastest contender and timestep within limits, as `assay recommend --json` tells it: recommend("humanoid",
        error="1mm", realtime=5, limits={"energy_drift_relative": "0.1%"}). "recommended" is None where nothing qualifies;
        "relaxations" says what to relax, "nearest" is what comes closest, and "excluded" says who was left out and why.
        Contacts are limited by default; penetration="any" and slip="any" do without. `system`: a name, or "all"
        together."""
        return _program.call_json("recommend", self.folder, system, "--json", *_program.words({
            "error": error, "measure": measure, "penetration": penetration, "slip": slip, "realtime": realtime,
            "limit": dict(limits) if limits else None}), accept=(1,))

    def claims(self) -> Any:
        """The verdicts on the paper's claims, with the figures."""
        return _program.call_json("claims", self.folder, "--json")

    def transfer(self) -> Any:
        """In which engines a policy works: `assay report --transfer --json`."""
        return _program.call_json("transfer", self.folder, "--json")

    def status(self) -> dict:
        """How far the campaign is: cells "planned" and "done", seconds left ("left_s")."""
        return _program.call_json("status", self.folder, "--json")

    def compare(self, after: Union["Results", Path], **options: Any) -> "Comparison":
        """What changed from these results to `after`, beyond the noise. Options are those of `assay compare`: threshold="2%",
        control="ode-step", across_machines=True, across_programs=True."""
        other = after.folder if isinstance(after, Results) else pathlib.Path(after)
        return Comparison(_program.call_json("compare", self.folder, other, "--format", "json", *_program.words(options)),
                          [str(self.folder), str(other)], options)

    def report(self) -> pathlib.Path:
        """Writes report.html, one file that works offline, and the paper's figures as SVG and PDF. Returns its path."""
        _program.call("report", self.folder)
        return self.folder / "report.html"

    def data(self) -> dict:
        """Everything the report shows, as `assay report --json` prints it: systems, contenders with capabilities and builds,
        conformance, cells with values, fronts, looks; web/src/data.ts names the fields."""
        return _program.call_json("report", self.folder, "--json")


class Comparison:
    """What changed between two results directories.

    data  as `assay compare --format json` prints it"""

    def __init__(self, data: dict, folders: list[str], options: Mapping[str, Any]):
        self.data, self._folders, self._options = data, folders, dict(options)

    def changes(self, frame: str = "pandas") -> Any:
        """One row for each value in both: system, contender, timestep_ms, measure, value (its name), unit, a, b, ratio b / a with
        its 95 % interval low to high, change ("worse", "better", ... in the words of the document), text."""
        columns = ["system", "contender", "timestep_ms", "measure", "value", "unit", "a", "b", "ratio", "low", "high", "change",
                   "text", "outcome_a", "outcome_b"]
        return table_of(self.data["rows"], columns, frame)

    def regressions(self, share: str = "5%", allow_gaps: bool = False) -> str:
        """"" where nothing got worse by at least `share` beyond the noise, else the sentence with which `assay compare
        --fail-on-regression` ends a CI. InputError where that cannot be said: cells or times are missing, unless allow_gaps=True."""
        try:
            _program.call("compare", *self._folders, "--fail-on-regression", share, *_program.words(self._options),
                          *(["--allow-gaps"] if allow_gaps else []))
        except RunError as error:
            return str(error)
        return ""

    def markdown(self) -> str:
        """The same as a document."""
        return _program.call("compare", *self._folders, *_program.words(self._options))

    def __repr__(self) -> str:
        return f"Comparison({json.dumps(self._folders)}, {len(self.data['rows'])} values)"
