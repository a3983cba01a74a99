"""What an engine in Python is written with: the classes of assay_adapter, which worker processes use, too.

docs/extending.md, "In Python", shows one; `assay.engine` registers a class of it.
"""

import importlib.util
import sys

from ._places import ENGINES


def _load():
    # in a worker the host has imported it already
    if "assay_adapter" not in sys.modules:
        spec = importlib.util.spec_from_file_location("assay_adapter", ENGINES / "python/assay_adapter.py")
        sys.modules["assay_adapter"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["assay_adapter"])
    return sys.modules["assay_adapter"]


_NAMES = ("Capabilities", "Contender", "Deviation", "Engine", "EngineFailure", "Limitation", "Setting", "Settings", "State",
          "Unsupported", "approximated", "exact", "pinned", "refused")
_module = _load()
globals().update({name: getattr(_module, name) for name in _NAMES})
__all__ = list(_NAMES)
