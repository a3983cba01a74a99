"""What the package does not contain and fetches on request into the user's cache, checked against pinned hashes."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys
import tempfile
import zipfile

from . import _program
from .errors import InputError, MachineError

_NAMES = ("libraries",)


def cache() -> pathlib.Path:
    """As src/base/paths.h has it."""
    for variable, below in (("ASSAY_CACHE", ""), ("XDG_CACHE_HOME", "assay"), ("HOME", ".cache/assay")):
        if os.environ.get(variable):
            return pathlib.Path(os.environ[variable], below)
    raise InputError("HOME, XDG_CACHE_HOME and ASSAY_CACHE are all unset: set ASSAY_CACHE to a folder for downloads")


def fetch(what: str = "libraries") -> list[pathlib.Path]:
    """Fetches "libraries": CoACD (decompose=True) and ONNX Runtime (policies), some 20 MB from the Python package index. Their
    wheels are unpacked and not installed. Returns their folders; what is there is not fetched again."""
    if what not in _NAMES:
        raise InputError(f"there is no '{what}' to fetch: give {', '.join(_NAMES)}")
    pins = _program.FOLDER / f"{what}.txt"
    lines = [line for line in pins.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    folders = []
    for line in lines:
        package, version = line.split()[0].split("==")
        folder = cache() / what / f"{package}-{version}"
        folders.append(folder)
        if folder.is_dir():
            continue
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            scratch = tempfile.TemporaryDirectory(dir=folder.parent, prefix=".fetch-")
        except OSError as error:
            raise MachineError(f"cannot write to '{folder.parent}' ({error.strerror}): set ASSAY_CACHE to a folder of yours") from None
        with scratch as work:
            pinned = pathlib.Path(work, "pins.txt")
            pinned.write_text(line + "\n", encoding="utf-8")
            done = subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check",
                                   "--require-hashes", "--no-deps", "--only-binary", ":all:", "--implementation", "cp",
                                   "--python-version", "3.11", "--abi", "abi3", "--abi", "cp311", "--platform",
                                   "manylinux_2_17_x86_64", "--platform", "manylinux_2_28_x86_64", "-d", work, "-r", pinned],
                                  capture_output=True, encoding="utf-8", errors="replace", check=False)
            wheels = list(pathlib.Path(work).glob("*.whl"))
            if done.returncode != 0 or len(wheels) != 1:
                said = [line for line in done.stderr.splitlines() if line.strip()]
                raise MachineError(f"{package} {version} cannot be fetched from the Python package index: is there a network, or behind a "
                                   f"proxy https_proxy set? pip says: {said[-1].strip() if said else 'nothing'}")
            part = pathlib.Path(work, "part")
            with zipfile.ZipFile(wheels[0]) as archive:
                archive.extractall(part)
            try:
                part.rename(folder)
            except OSError:
                if not folder.is_dir():  # else another process was faster
                    raise
    return folders
