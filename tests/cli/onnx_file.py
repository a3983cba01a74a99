"""Writes small ONNX files: the protocol buffers of the format, as far as the tests need them."""

import struct

FLOAT, INT64, BOOL = 1, 7, 9


def varint(value):
    out = b""
    while value >= 128:
        out += bytes([value % 128 + 128])
        value //= 128
    return out + bytes([value])


def number(field, value):
    return varint(field * 8) + varint(value)


def message(field, content):
    content = content.encode() if isinstance(content, str) else content
    return varint(field * 8 + 2) + varint(len(content)) + content


def port(name, shape, kind=FLOAT):
    """An input or output; a size of -1 is dynamic."""
    sizes = b"".join(message(1, message(2, "n") if size < 0 else number(1, size)) for size in shape)
    return message(1, name) + message(2, message(1, number(1, kind) + message(2, sizes)))


def tensor(name, shape, values, kind=FLOAT):
    raw = struct.pack(f"<{len(values)}{ {FLOAT: 'f', INT64: 'q', BOOL: '?'}[kind]}", *values)
    return b"".join(number(1, size) for size in shape) + number(2, kind) + message(8, name) + message(9, raw)


def node(operator, inputs, outputs, attributes=b""):
    return b"".join(message(1, each) for each in inputs) + b"".join(message(2, each) for each in outputs) + \
        message(4, operator) + attributes


def graph(nodes, tensors, inputs, outputs):
    return b"".join(message(1, each) for each in nodes) + message(2, "graph") + \
        b"".join(message(5, each) for each in tensors) + b"".join(message(11, each) for each in inputs) + \
        b"".join(message(12, each) for each in outputs)


def model(content):
    return number(1, 8) + message(7, content) + message(8, message(1, "") + number(2, 17))


def linear(rows, columns, weights, shape=None):
    """actions = obs times a matrix, row by row."""
    return model(graph([node("MatMul", ["obs", "w"], ["actions"])], [tensor("w", [rows, columns], weights)],
                       [port("obs", shape or [1, rows])], [port("actions", [1, columns])]))


def endless():
    """A loop that never ends: the action grows until then."""
    body = graph([node("Identity", ["c"], ["c2"]), node("Add", ["x", "x"], ["y"])], [],
                 [port("i", [], INT64), port("c", [], BOOL), port("x", [1, 1])], [port("c2", [], BOOL), port("y", [1, 1])])
    attribute = message(5, message(1, "body") + message(6, body) + number(20, 5))
    return model(graph([node("ReduceSum", ["obs"], ["sum"]), node("Loop", ["most", "go", "sum"], ["actions"], attribute)],
                       [tensor("most", [], [2**62], INT64), tensor("go", [], [True], BOOL)], [port("obs", [1, 4])],
                       [port("actions", [1, 1])]))


def huge(elements):
    """Takes memory for so many numbers when it is run."""
    return model(graph([node("ReduceSum", ["obs"], ["sum"]), node("Expand", ["sum", "size"], ["many"]),
                        node("ReduceSum", ["many"], ["actions"])],
                       [tensor("size", [2], [1, elements], INT64)], [port("obs", [1, 4])], [port("actions", [1, 1])]))
