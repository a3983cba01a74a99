from ._program import core

__version__: str = core().version
__commit__: str = core().commit
