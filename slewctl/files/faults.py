"""All faults of a file, so that they are told at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from slewctl.errors import Faults, InputError

__all__ = ["Faults", "missing", "placed"]

P = ParamSpec("P")
T = TypeVar("T")


def missing(where: str) -> InputError:
    """Return the refusal of a file without a key or table that it needs."""
    return InputError("missing", where=where, remedy="add it")


def placed(where: str, make: Callable[P, T], *args: P.args, **keys: P.kwargs) -> T:
    """Return what `make` returns; its refusals name their key in the table at `where`."""
    try:
        return make(*args, **keys)
    except InputError as error:
        raise error.at(f"{where}.{error.where.rpartition('.')[2]}") from error
