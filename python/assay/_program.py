"""The program in the package: what it is called with, its environment, and its errors as exceptions."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import sysconfig
from typing import Any

from . import _plugins, errors
from ._places import FOLDER, program  # noqa: F401

SONAME = "libpython3.11.so.1.0"  # what the host of adapters in Python is built for


def interpreter() -> dict[str, str]:
    """Where a process of assay's own finds the interpreter for adapters in Python: its standard library, and the library
    that the interpreter itself uses where it has one (else that of the package). Python 3.11 alone has them."""
    if sys.version_info[:2] != (3, 11):
        return {}
    found = {"ASSAY_PYTHON_HOME": sys.base_prefix}
    folder = sysconfig.get_config_var("LIBDIR") or ""
    for each in (folder, os.path.join(sys.base_prefix, "lib")):
        if os.path.isfile(os.path.join(each, SONAME)):
            found["ASSAY_PYTHON_LIBRARY"] = os.path.join(each, SONAME)
            break
    return found


def environment() -> dict[str, str]:
    """Of every process that the package starts."""
    variables = {**os.environ, **{k: v for k, v in interpreter().items() if k not in os.environ}}
    folders = [_plugins.folder(), os.environ.get("ASSAY_ENGINE_PATH", "")]
    if any(folders):
        variables["ASSAY_ENGINE_PATH"] = ":".join(each for each in folders if each)
    variables["NO_COLOR"] = "1"
    return variables


def words(options: dict[str, Any]) -> list[str]:
    """Options of a command: retry=True is --retry, contenders=["a", "b"] is --contenders a,b; None is left out."""
    found = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            found.append(option)
        elif isinstance(value, dict):
            for key, each in value.items():
                found += [option, f"{key}={each}"]
        elif isinstance(value, (list, tuple)):
            found += [option, ",".join(str(each) for each in value)]
        else:
            found += [option, str(value)]
    return found


def raise_for(status: int, said: str) -> None:
    """The program's last sentence as the exception that its status stands for."""
    if status == 0:
        return
    if status < 0:
        raise errors.RunError(f"the program was ended by {signal.Signals(-status).name}")
    lines = [line for line in said.splitlines() if line.startswith("assay: ")]
    # a refusal of several problems is a list below its first line
    text = "\n".join(line[len("assay: "):] for line in lines[-1:])
    listed = [line for line in lines if line.startswith("assay:   ")]
    if listed and lines[-1] == listed[-1]:
        first = next(line for line in reversed(lines) if not line.startswith("assay:   "))
        text = "\n".join([first[len("assay: "):], *(line[len("assay: "):] for line in listed)])
    text = text or said.strip() or f"the program ended with status {status} and said nothing"
    raise (errors.InputError if status == 2 else errors.RunError)(text)


def call(*arguments: Any, accept: tuple[int, ...] = ()) -> str:
    """Standard output of `assay ARGUMENTS`. `accept`: statuses that are answers, too."""
    done = subprocess.run([program(), *map(str, arguments)], env=environment(), capture_output=True, encoding="utf-8",
                          errors="replace", stdin=subprocess.DEVNULL, check=False)
    if done.returncode not in accept or not done.stdout:
        raise_for(done.returncode, done.stderr)
    return done.stdout


def call_json(*arguments: Any, accept: tuple[int, ...] = ()) -> Any:
    return json.loads(call(*arguments, accept=accept))
