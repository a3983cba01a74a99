from ._program import call

_, __version__, __commit__ = call("--version").split()
__commit__ = __commit__.strip("()")
