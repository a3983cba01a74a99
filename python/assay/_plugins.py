"""Engines written in Python as plugins: those of this process, and what a worker loads of them.

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

_registered: dict[str, type] = {}
_files: dict[str, str] = {}  # by engine: "" where it was not defined in a file
_loading: list[str] = []  # files that a worker loads just now
_folder: list[str] = []  # the folder of plugins, at most one


def register(name: str, cls: type) -> str:
    """Keeps the class; returns the path of its plugin, "" where a worker loads the class. KeyError: the name is taken."""
    if _loading:
        _registered[name] = cls
        return ""
    if name in _registered:
        raise KeyError(name)
    module = sys.modules.get(cls.__module__)
    file = getattr(module, "__file__", None) or ""
    _registered[name], _files[name] = cls, os.path.abspath(file) if file else ""
    return _write_plugin(name)


def forget(name: str, path: str) -> None:
    del _registered[name], _files[name]
    shutil.rmtree(path, ignore_errors=True)


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
    import assay._plugins

    return assay._plugins


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
