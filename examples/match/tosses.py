#!/usr/bin/env python3
"""Writes the tosses of a clone of github.com/DAIRLab/contact-nets as one CSV file: tosses.py CLONE tosses.csv

The authors' files are PyTorch tensors; they are read here without PyTorch, and without running what a pickle may ask for.
"""

import pathlib
import pickle
import struct
import sys
from array import array

LENGTH = 0.0524  # m, the authors' unit: half of the cube's side
RATE = 148.0     # Hz
HEADER = "toss,time,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"
TYPES = {"FloatStorage": "f", "DoubleStorage": "d"}


class Tensors(pickle.Unpickler):
    """Gives for a tensor its storage's key, offset, shape and strides."""

    def find_class(self, module, name):
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return lambda storage, offset, shape, strides, *_: (storage, offset, shape, strides)
        if (module, name) == ("collections", "OrderedDict"):
            return dict
        if module == "torch" and name in TYPES:
            return TYPES[name]
        raise pickle.UnpicklingError(f"{module}.{name} is no part of a tensor of numbers")

    def persistent_load(self, saved):
        _, code, key, *_ = saved
        return key, code


def tensor_rows(path):
    with open(path, "rb") as file:
        for _ in range(3):  # magic number, protocol, system
            Tensors(file).load()
        (key, code), offset, (*outer, rows, columns), (*_, row, column) = Tensors(file).load()
        keys = Tensors(file).load()
        if keys != [key] or any(length != 1 for length in outer):
            sys.exit(f"{path} is no tensor of one toss: the repository has changed")
        count, = struct.unpack("<q", file.read(8))
        values = array(code)
        values.frombytes(file.read(count * values.itemsize))
    return [[values[offset + i * row + j * column] for j in range(columns)] for i in range(rows)]


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    files = sorted((pathlib.Path(sys.argv[1]) / "data/tosses_processed").glob("*.pt"), key=lambda file: int(file.stem))
    if not files:
        sys.exit(f"'{sys.argv[1]}' has no data/tosses_processed/*.pt: give a clone of DAIRLab/contact-nets")
    with open(sys.argv[2], "w") as out:
        print(HEADER, file=out)
        for file in files:
            for i, state in enumerate(tensor_rows(file)):
                lengths = [LENGTH * x for x in state[0:3] + state[7:10]]
                numbers = [i / RATE, *lengths[:3], *state[3:7], *lengths[3:], *state[10:13]]
                print(file.stem, *(f"{x:.6f}" for x in numbers), sep=",", file=out)


if __name__ == "__main__":
    main()
