"""Packages whose names are loaded when they are asked for (PEP 562).

To import slewctl, or one of its rooms, then costs next to nothing.  A package lists its names
once, as imports under ``if TYPE_CHECKING``, where type checkers and editors find them too.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def attach(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a package.

    Parameters
    ----------
    package, file : str
        Its ``__name__`` and ``__file__``.
    """
    homes = _homes(ast.parse(Path(file).read_text(encoding="utf-8")))

    def getattribute(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, original = homes[name]
        home = import_module(module)
        inside = hasattr(home, original)  # else a module of the package
        found = getattr(home, original) if inside else import_module(f"{module}.{original}")
        setattr(sys.modules[package], name, found)  # the next one to ask finds it at once
        return found

    def names() -> list[str]:
        return sorted(vars(sys.modules[package]).keys() | homes.keys())

    return getattribute, names


def _homes(tree: ast.Module) -> dict[str, tuple[str, str]]:
    """Return where each name imported under ``if TYPE_CHECKING`` lives, and how it is called."""
    return {
        alias.asname or alias.name: (found.module, alias.name)
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for found in block.body
        if isinstance(found, ast.ImportFrom) and found.module
        for alias in found.names
    }
