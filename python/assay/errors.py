"""What goes wrong, with the sentences of the program."""


class AssayError(Exception):
    """Every error of assay."""


class InputError(AssayError, ValueError):
    """Something given cannot be used: a file, a name, a number, an array. One sentence with the offending value and how to
    mend it."""


class MachineError(AssayError, OSError):
    """The machine does not do what it should: a full disk, a folder that cannot be written, a process that does not start."""


class EngineError(AssayError, RuntimeError):
    """An engine failed when it was created or stepped."""


class UnsupportedError(EngineError):
    """An engine does not do what the model asks for, and says so before a step is taken."""


class RunError(AssayError, RuntimeError):
    """The program came to no result: it says why, or how it ended."""
