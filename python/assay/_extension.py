"""The extension, which has models and the three functions."""

from __future__ import annotations

import functools
import sys

from . import adapter, errors  # noqa: F401  the extension's host of adapters in Python looks for assay_adapter
from ._places import program


@functools.lru_cache(maxsize=None)
def core():
    """Told where engines and models are."""
    if sys.version_info < (3, 10):
        raise errors.MachineError("models and simulations in the process need Python 3.10 or newer, and this is "
                                  f"{sys.version_info[0]}.{sys.version_info[1]}: assay.run(), results and the command work here")
    from . import _core  # which an older Python cannot load

    _core.set_program(str(program()))
    return _core
