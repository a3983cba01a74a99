"""The database of results in any form that they have here: a directory, its database, or that packed as assay.sqlite.xz."""

import lzma
import pathlib


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
