"""Whether a design was judged before, by the same programs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path
from platform import python_version

from slewctl.versions import PROGRAMS, installed

_PACKAGE = Path(__file__).parents[1]


def fingerprint(text: str) -> str:
    """Return a digest of a design file's text and of the programs that judge it.

    Two runs with one fingerprint come to the same verdicts: it covers the text, the versions
    of Python, slewctl and the packages that it computes with, and slewctl's own code, which
    may change in a working copy without a change of version.
    """
    return digest("\0".join([_programs(), text]))


def digest(text: str) -> str:
    """Return a digest of a text alone."""
    return "sha256:" + sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _sources(folder: str, inside: str = "") -> Iterator[str]:
    """Yield the names of all Python files of a folder and those in it, with slashes."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                yield inside + entry.name
            elif entry.is_dir():
                yield from _sources(entry.path, f"{inside}{entry.name}/")


@cache
def _programs() -> str:
    code = sha256()
    for name in sorted(_sources(str(_PACKAGE))):
        code.update(name.encode() + b"\0")
        with open(f"{_PACKAGE}{os.sep}{name}", "rb") as file:  # a Path for each costs more
            code.update(file.read())
    versions = [f"python {python_version()}", *(f"{name} {installed(name)}" for name in PROGRAMS)]
    return "\n".join([*versions, code.hexdigest()])
