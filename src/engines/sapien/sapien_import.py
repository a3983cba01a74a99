"""SAPIEN's physics without the rest of its package.

`import sapien` also imports its renderer's set-up, its loaders of files and their packages (OpenCV, lxml, requests and more).
The module with the physics needs none of them, but links the denoiser of the renderer, which the package loads from its own
folder first."""

import ctypes
import importlib.util
import os
import sys
import types


def load():
    """(the module with entities and scenes, the module with PhysX)."""
    if "sapien" not in sys.modules:
        found = importlib.util.find_spec("sapien")
        folder = os.path.dirname(found.origin)
        package = types.ModuleType("sapien")
        package.__path__, package.__spec__ = [folder], found
        sys.modules["sapien"] = package
        os.environ["SAPIEN_PACKAGE_PATH"] = folder
        for part in ("_core", ""):
            ctypes.CDLL(os.path.join(folder, "oidn_library", f"libOpenImageDenoise{part}.so.2.0.1"))
    import sapien.pysapien

    return sapien.pysapien, sapien.pysapien.physx
