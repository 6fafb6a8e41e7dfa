"""Whether a design was judged before, by the same programs."""

from __future__ import annotations

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


@cache
def _programs() -> str:
    code = sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        code.update(path.relative_to(_PACKAGE).as_posix().encode() + b"\0")
        code.update(path.read_bytes())
    versions = [f"python {python_version()}", *(f"{name} {installed(name)}" for name in PROGRAMS)]
    return "\n".join([*versions, code.hexdigest()])
