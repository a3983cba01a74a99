"""Measured motion: what logs can tell, and which contender moves as the robot does."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import tempfile
from typing import Any, Mapping, Optional, Union

from . import _program
from ._results import table_of
from .errors import InputError

Path = Union[str, os.PathLike]
_ERRORS = ("held_out", "untuned", "floor")


class Match:
    """What `assay match` found, `folder/match.json`.

    found   all of it, as the program writes it
    folder  where it lies, with the fitted models in `models`"""

    def __init__(self, folder: Path):
        self.folder = pathlib.Path(folder)
        file = self.folder / "match.json"
        try:
            self.found = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"'{file}' cannot be read ({error}): give the folder of an assay match that has ended") from error

    def contenders(self, frame: str = "pandas") -> Any:
        """A row for each contender, best first as the program ranks them: its error held out, before fitting, and of noise."""
        rows = []
        for each in self.found["contenders"]:
            row = {"contender": each["contender"], "failure": each["failure"], "as_good_as_best": each.get("as_good_as_best")}
            for name in _ERRORS:
                row.update({f"{name}_{unit}": value for unit, value in (each.get(name) or {}).items()})
            rows.append(row)
        return table_of(rows, list(dict.fromkeys(name for row in rows for name in row)), frame)

    def parameters(self, frame: str = "pandas") -> Any:
        """A row for each parameter of each contender: its value, the ends of its 95 % interval, whether it is identified."""
        columns = ["contender", "name", "unit", "status", "value", "low", "high", "model", "with"]
        rows = [{"contender": each["contender"], **parameter} for each in self.found["contenders"]
                for parameter in each.get("parameters", [])]
        return table_of(rows, columns, frame)

    def logs(self, frame: str = "pandas") -> Any:
        """A row for each log and contender."""
        rows = []
        for each in self.found["contenders"]:
            for log in each.get("logs", []):
                row = {"contender": each["contender"]}
                for name, value in log.items():
                    if isinstance(value, dict):
                        row.update({f"{name}_{unit}": number for unit, number in value.items()})
                    else:
                        row[name] = value
                rows.append(row)
        return table_of(rows, list(dict.fromkeys(name for row in rows for name in row)), frame)

    def __repr__(self) -> str:
        return f"Match('{self.folder}', {len(self.found['contenders'])} contenders)"


@dataclasses.dataclass(frozen=True)
class LogCheck:
    """What `assay match --check --json` tells.

    logs      of each its samples, rate and quantities with range and noise
    findings  what is wrong with them, a warning or a remark, each with its fix
    spoiled   spans of time that are not scored, and why"""

    logs: list
    findings: list
    spoiled: list

    def table(self, frame: str = "pandas") -> Any:
        """The findings, worst first."""
        return table_of(self.findings, ["severity", "kind", "log", "line", "quantity", "message", "fix"], frame)

    def __repr__(self) -> str:
        wrong = sum(finding["severity"] == "wrong" for finding in self.findings)
        return f"LogCheck({len(self.logs)} logs, {len(self.findings)} findings, {wrong} wrong)"


def _files(logs: Any, folder: pathlib.Path) -> list[str]:
    """Paths of logs; tables are written as files into `folder`."""
    if logs is None:
        return []
    if isinstance(logs, (str, os.PathLike)):
        return [os.fspath(logs)]
    if hasattr(logs, "to_csv"):
        logs = {"log": logs}
    if not isinstance(logs, Mapping):
        return [os.fspath(each) for each in logs]
    files = []
    for name, table in logs.items():
        if not hasattr(table, "to_csv"):
            raise InputError(f"the log '{name}' is a {type(table).__name__}: give pandas tables by name, or paths")
        if pathlib.PurePath(name).name != name:
            raise InputError(f"'{name}' is no name of a log: leave the slashes out")
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name}.csv"
        table.to_csv(file, index=False)
        files.append(os.fspath(file))
    return files


def _arguments(model: Path, files: list[str], config: Optional[Path], options: dict[str, Any]) -> list[str]:
    words = [os.fspath(model)]
    for file in files:
        words += ["--log", file]
    if config is not None:
        words += ["--config", os.fspath(config)]
    return words + _program.words(options)


def check_logs(model: Path, logs: Any, *, config: Optional[Path] = None, **options: Any) -> LogCheck:
    """What measured logs can tell, before anything is fitted. `logs` is a path, several, a pandas table, or tables by name."""
    with tempfile.TemporaryDirectory() as folder:
        files = _files(logs, pathlib.Path(folder))
        found = _program.call_json("match", *_arguments(model, files, config, options), "--check", "--json")
    return LogCheck(found["logs"], found["findings"], found["spoiled"])


def match(model: Path, logs: Any, out: Path, *, config: Optional[Path] = None, **options: Any) -> Match:
    """Fits contenders to measured motion, and says which of them moves as the robot does. `logs` as in check_logs(); tables
    are kept in `out`. Options are those of `assay match`: match(file, logs, "matched", contenders=["mujoco-euler", "dart"]).
    None in place of logs fits to another contender: match(file, None, "matched", like="mujoco-euler")."""
    files = _files(logs, pathlib.Path(out) / "logs")
    _program.call("match", *_arguments(model, files, config, options), "--out", os.fspath(out))
    return Match(out)
