#!/usr/bin/env python3
"""Writes the generated tables and figures of the pages: update.py PAGE ARGUMENT...; update.py PAGE --help has its arguments."""

import argparse
import importlib

# Each is a file of tables/, with add_arguments(parser) and update(options); its docstring is its help.
PAGES = ["claims", "contacts", "engines", "files", "many-worlds", "movie", "reality", "releases", "reliability", "robots", "self-consistency", "settings"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    pages = parser.add_subparsers(metavar="PAGE", required=True)
    for name in PAGES:
        module = importlib.import_module("tables." + name.replace("-", "_"))
        own = pages.add_parser(name, help=module.__doc__.splitlines()[0], description=module.__doc__,
                               formatter_class=argparse.RawDescriptionHelpFormatter)
        module.add_arguments(own)
        own.set_defaults(update=module.update)
    options = parser.parse_args()
    options.update(options)


if __name__ == "__main__":
    main()
