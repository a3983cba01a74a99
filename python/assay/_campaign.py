"""Campaigns: the program measures in worker processes of its own, and this process shows how far it is."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
from typing import Any, Callable, Union

from . import _program
from ._progress import shown_by
from ._results import Results

Path = Union[str, os.PathLike]


def run(what: Path, out: Path, *, progress: Union[bool, Callable[[dict], Any]] = True, **options: Any) -> Results:
    """Measures a campaign (a TOML file, or the name of one that comes with assay), or finds the best contender for a robot (an
    MJCF or URDF file, or a system's name), into the folder `out`. What is there already is not measured again: after an
    interrupt, or a kill, the same call resumes.

    progress  True: a bar in a notebook, a line on a terminal; False: nothing; or a function that gets each event, a dict
              (docs/python.md lists them)
    options   those of `assay run`: run("my_robot.urdf", "results", minutes=3, error="1mm", contenders=["mujoco-*", "ode-*"]);
              jobs=1, retry=True, shard="1/8", full=True

    An engine registered by `assay.engine` takes part under the names of its contenders. Raises InputError for what cannot be
    used, RunError when there is no answer; KeyboardInterrupt when it is interrupted, with every finished cell stored."""
    return _measure(["run", os.fspath(what)], out, progress, options)


def paper(out: Path, *, quick: bool = False, progress: Union[bool, Callable[[dict], Any]] = True, **options: Any) -> Results:
    """The paper's whole campaign, the report, and the verdicts on the paper's claims, as `assay paper` does it. quick: a short
    one, some minutes."""
    return _measure(["paper", *(["--quick"] if quick else [])], out, progress, options)


def _measure(command: list[str], out: Path, progress: Any, options: dict[str, Any]) -> Results:
    arguments = [str(_program.program()), *command, "--out", os.fspath(out), "--progress", "json", *_program.words(options)]
    shown = shown_by(progress)
    said: list[str] = []
    # a session of its own: a terminal's Ctrl-C reaches it once, through us
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as answer, \
            subprocess.Popen(arguments, env=_program.environment(), stdin=subprocess.DEVNULL, stdout=answer,
                             stderr=subprocess.PIPE, encoding="utf-8", errors="replace", start_new_session=True) as child:
        try:
            for line in child.stderr:
                event = _event(line)
                if event is None:
                    said.append(line)
                else:
                    shown.event(event)
            status = child.wait()
        except BaseException:
            # what is finished is stored before it ends
            child.send_signal(signal.SIGINT)
            for _ in child.stderr:
                pass
            child.wait()
            raise
        answer.seek(0)
        summary = answer.read()
    shown.end(summary)
    # a search that found nothing says so in its answer
    _program.raise_for(status, "".join(said) if any(line.startswith("assay: ") for line in said) else summary)
    results = Results(out)
    results.summary = summary
    return results


def _event(line: str) -> Any:
    if not line.startswith("{"):
        return None
    try:
        event = json.loads(line)
    except json.JSONDecodeError:
        return None
    return event if "event" in event else None
