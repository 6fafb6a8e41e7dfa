"""What the digits of a result depend on beside the input: the versions of the programs."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version

# By the names under which they are installed: another version may come to other digits.
PROGRAMS = ("slewctl", "numpy", "scipy", "control", "cvxpy-base", "clarabel")


@cache
def versions() -> Mapping[str, str]:
    """Return the versions of Python, to its minor one, of slewctl and of what it computes with."""
    python = ".".join(platform.python_version_tuple()[:2])
    return {"python": python} | {name: installed(name) for name in PROGRAMS}


def difference(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """Return in words where versions differ from ours; empty where they do not."""
    return ", ".join(
        f"{name} {theirs.get(name, 'unknown')} (here {own})"
        for name, own in ours.items()
        if theirs.get(name) != own
    )


@cache
def installed(package: str = "slewctl") -> str:
    """Return the installed version of a package, or "unknown"."""
    try:
        return version(package)
    except PackageNotFoundError:  # run from its source
        return "unknown"
