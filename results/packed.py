"""The database of results in any form that they have here: a directory, its database, or that packed as assay.sqlite.xz;
and the hash by which the program notices that content is not what was written."""

import ctypes
import lzma
import pathlib


class Hash128(ctypes.Structure):
    _fields_ = [("low", ctypes.c_uint64), ("high", ctypes.c_uint64)]


def content_hash(content):
    """That of src/base/hash.h, by the library that the program is built with."""
    xxh128 = ctypes.CDLL("libxxhash.so.0").XXH3_128bits
    xxh128.argtypes, xxh128.restype = [ctypes.c_char_p, ctypes.c_size_t], Hash128
    found = xxh128(content, len(content))
    return f"{found.high:016x}{found.low:016x}"


def database(results, scratch):
    """Path of the database; a packed one is unpacked into the folder `scratch`, which is made. A directory may hold either."""
    results = pathlib.Path(results)
    if results.is_dir():
        results /= "assay.sqlite"
    if not results.exists() and results.suffix == ".sqlite":
        results = results.with_suffix(".sqlite.xz")
    if results.suffix != ".xz":
        return results
    path = pathlib.Path(scratch) / "assay.sqlite"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(lzma.decompress(results.read_bytes()))
    return path
