"""The keys of campaigns in files.md, as the program lists them."""

import pathlib
import re
import subprocess

from .common import DOCS, write


def keys_block(listed):
    """`assay list campaign-keys` without its heading and introduction, one level of headings deeper."""
    return "\n" + re.sub(r"^##", "###", listed[listed.index("## The campaign"):], flags=re.MULTILINE) + "\n"


def add_arguments(parser):
    parser.add_argument("program", metavar="ASSAY")
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "files.md")


def update(options):
    listed = subprocess.run([options.program, "list", "campaign-keys"], capture_output=True, text=True, check=True).stdout
    write(options.page, {"campaign-keys": keys_block(listed)})
