"""Whether a design was judged before, by the same programs."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from pathlib import Path
from platform import python_version

_PACKAGE = Path(__file__).parents[1]
# Whatever computes a verdict; another version of it may come to another one.
_PROGRAMS = ("slewctl", "numpy", "scipy", "control", "cvxpy", "clarabel")


def version(package: str = "slewctl") -> str:
    """Return the installed version of a package, or "unknown"."""
    try:
        return installed(package)
    except PackageNotFoundError:
        return "unknown"


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
    versions = [f"python {python_version()}", *(f"{name} {version(name)}" for name in _PROGRAMS)]
    return "\n".join([*versions, code.hexdigest()])
