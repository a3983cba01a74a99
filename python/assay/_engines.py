"""Engines, contenders and systems; engines that are written in Python."""

from __future__ import annotations

from typing import Any

from . import _plugins, adapter
from ._extension import core
from ._program import call_json
from .errors import InputError


def engines() -> Any:
    """What `assay list engines --json` tells of every engine: contenders, settings with units and defaults, capabilities, build;
    and of those that are absent, why."""
    return call_json("engines", "--json")


def contenders() -> list[str]:
    """Names of all contenders: engines with settings."""
    return core().contenders()


def systems() -> list[dict]:
    """What `assay list systems --json` tells of each model that comes with assay."""
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
        raise InputError(f"the engine is called '{name}': give a name of lower-case letters, digits and hyphens")

    def register(cls: type) -> type:
        if not isinstance(cls, type) or not issubclass(cls, adapter.Engine):
            raise InputError(f"engine '{name}' is no class derived from assay.adapter.Engine: derive it from that")
        try:
            path = _plugins.register(name, cls)
        except KeyError:
            raise InputError(f"there is an engine '{name}' already: give the new one another name, or start a new process") from None
        if path:
            try:
                core().add_engine(path)
            except Exception:
                _plugins.forget(name, path)
                raise
        return cls

    return register


def conformance(*contenders: str, tests: Any = ()) -> Any:
    """The conformance suite, as `assay conformance --json` tells it: of each contender each test with its status ("pass",
    "fail", "deviation", "not-applicable"), figure and tolerance. `tests`: names, default all."""
    chosen = [word for test in tests for word in ("--test", test)]
    return call_json("conformance", *contenders, *chosen, "--json", accept=(1,))
