"""Engines, contenders and systems; engines that are written in Python.

Worker processes read this module with the standard library alone.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
from typing import Any

_registered: dict[str, type] = {}
_files: dict[str, str] = {}  # by engine: "" where it was not defined in a file
_loading: list[str] = []  # files that a worker loads just now
_folder: list[str] = []  # the folder of plugins, at most one


def engines() -> Any:
    """What `assay engines --json` tells of every engine: contenders, settings with units and defaults, capabilities, build;
    and of those that are absent, why."""
    from ._program import call_json

    return call_json("engines", "--json")


def contenders() -> list[str]:
    """Names of all contenders: engines with settings."""
    from ._program import core

    return core().contenders()


def systems() -> list[dict]:
    """What `assay systems --json` tells of each model that comes with assay."""
    from ._program import call_json

    return call_json("systems", "--json")["systems"]


def engine(name: str):
    """Registers an engine written in Python under `name`:

        @assay.engine("my-engine")
        class MyEngine(assay.adapter.Engine): ...

    Its contenders can be simulated in this process at once, and take part in campaigns, whose workers load the file that
    defines the class: it should be one that can be imported, without side effects, and import what is no part of the standard
    library inside create(). A class of a notebook or of the prompt can be simulated and not measured. An engine that is
    registered again under its name keeps its first definition in this process; a new process sees the new one."""
    if not name or not all(c.isascii() and (c.isalnum() or c == "-") and not c.isupper() for c in name):
        from .errors import InputError

        raise InputError(f"the engine is called '{name}': give a name of lower-case letters, digits and hyphens")

    def register(cls: type) -> type:
        from .adapter import Engine
        from .errors import InputError

        if not isinstance(cls, type) or not issubclass(cls, Engine):
            raise InputError(f"engine '{name}' is no class derived from assay.adapter.Engine: derive it from that")
        if _loading:
            _registered[name] = cls
            return cls
        if name in _registered:
            raise InputError(f"there is an engine '{name}' already: give the new one another name, or start a new process")
        module = sys.modules.get(cls.__module__)
        file = getattr(module, "__file__", None) or ""
        _registered[name], _files[name] = cls, os.path.abspath(file) if file else ""
        path = _write_plugin(name)
        try:
            from ._program import core

            core().add_engine(path)
        except Exception:
            del _registered[name], _files[name]
            shutil.rmtree(path, ignore_errors=True)
            raise
        return cls

    return register


def folder() -> str:
    """The folder of the plugins of this process's engines; "" where it has none."""
    return _folder[0] if _folder else ""


_PLUGIN = '''"""Made by assay.engine: the engine '{name}' of {file}, {hash}."""
import importlib.util
import sys


def _package():
    if "assay" not in sys.modules:
        spec = importlib.util.spec_from_file_location("assay", {init!r}, submodule_search_locations=[{package!r}])
        sys.modules["assay"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["assay"])
    import assay._engines

    return assay._engines


Engine = _package().engine_of({name!r}, {file!r}, {prefix!r}, {packages!r})
'''


def _write_plugin(name: str) -> str:
    if not _folder:
        _folder.append(tempfile.mkdtemp(prefix="assay-engines-"))
        atexit.register(shutil.rmtree, _folder[0], ignore_errors=True)
    path, file = os.path.join(_folder[0], f"assay-engine-{name}"), _files[name]
    package = os.path.dirname(os.path.abspath(__file__))
    packages = [each for each in sys.path if os.path.basename(each) in ("site-packages", "dist-packages")]
    digest = "no file"
    if file:
        with open(file, "rb") as source:
            digest = hashlib.sha256(source.read()).hexdigest()
    os.makedirs(path)
    with open(os.path.join(path, "engine.py"), "w", encoding="utf-8") as out:
        out.write(_PLUGIN.format(name=name, file=file, hash=digest, init=os.path.join(package, "__init__.py"), package=package,
                                 prefix=sys.prefix, packages=packages))
    # what a worker may read
    with open(os.path.join(path, "environment.txt"), "w", encoding="utf-8") as out:
        folders = [sys.prefix, sys.base_prefix, *packages, package, os.path.dirname(file)]
        out.write("".join(f"{each}\n" for each in dict.fromkeys(folders) if each))
    return path


def engine_of(name: str, file: str, prefix: str, packages: list[str]) -> type:
    """What a plugin calls: the class that was registered as `name`, in this process or in `file`."""
    if name not in _registered:
        if not file:
            raise ImportError(f"engine '{name}' was defined in a notebook or at a prompt, which worker processes cannot read: "
                              f"put it into a file and import that")
        folder_of_file = os.path.dirname(file)
        if folder_of_file not in sys.path:
            sys.path.append(folder_of_file)
        spec = importlib.util.spec_from_file_location("assay_engine_file_" + hashlib.sha256(file.encode()).hexdigest()[:12], file)
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module
        _loading.append(file)
        try:
            spec.loader.exec_module(module)
        finally:
            _loading.pop()
        if name not in _registered:
            raise ImportError(f"'{file}' registers no engine '{name}' when it is imported: use @assay.engine(\"{name}\") there")
    return type(_registered[name].__name__, (_registered[name],), {"environment": prefix, "packages": packages})


def conformance(*contenders: str, tests: Any = ()) -> Any:
    """The conformance suite, as `assay conformance --json` tells it: of each contender each test with its status ("pass",
    "fail", "deviation", "not-applicable"), figure and tolerance. `tests`: names, default all."""
    from ._program import call_json

    chosen = [word for test in tests for word in ("--test", test)]
    return call_json("conformance", *contenders, *chosen, "--json", accept=(1,))
