"""Flexible modes by number, as options name them."""

from __future__ import annotations

from collections.abc import Iterable

from slewctl.errors import InputError, check_count, check_each


def check_mode(number: object, modes: int, where: str) -> int:
    """Return the number of one of so many flexible modes; refuse one that there is not."""
    mode = check_count(number, where)
    if mode > modes:
        have = "1 flexible mode" if modes == 1 else f"{modes} flexible modes"
        raise InputError(
            f"the design model has {have}, no mode {mode}",
            where=where,
            remedy=f"name modes up to {modes}, or raise model.n",
        )
    return mode


def check_modes(given: Iterable[object], modes: int, where: str) -> tuple[int, ...]:
    """Return numbers of flexible modes, each once."""
    numbers = check_each(given, where, lambda number, at: check_mode(number, modes, at))
    return tuple(dict.fromkeys(numbers))
