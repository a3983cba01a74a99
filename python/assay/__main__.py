"""The command `assay` of the package: the program itself takes this process's place."""

import os
import sys

from ._program import interpreter, program


def main() -> None:
    for name, value in interpreter().items():
        os.environ.setdefault(name, value)
    path = str(program())
    os.execv(path, ["assay", *sys.argv[1:]])


if __name__ == "__main__":
    main()
