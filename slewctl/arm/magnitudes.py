"""Values in SI units that an arm can have: far beyond any real one, far from overflow."""

from __future__ import annotations

from slewctl.errors import InputError, check_nonnegative, check_positive

SHORTEST, LONGEST = 1e-9, 1e9  # m
SOONEST, LATEST = 1e-9, 1e9  # s
LEAST, MOST = 1e-40, 1e40  # of everything else, in its SI unit


def check_length(value: object, name: str) -> float:
    """Return a length in m as a float; refuse one beyond every arm."""
    return _within(check_positive(value, name), SHORTEST, LONGEST, name)


def check_duration(value: object, name: str) -> float:
    """Return a duration in s as a float; refuse one beyond every clock."""
    return _within(check_positive(value, name), SOONEST, LATEST, name)


def check_size(value: object, name: str) -> float:
    """Return a positive value as a float; refuse one beyond every arm."""
    return _within(check_positive(value, name), LEAST, MOST, name)


def check_size_or_zero(value: object, name: str) -> float:
    """Return a value that may vanish as a float; refuse one beyond every arm."""
    return _within(check_nonnegative(value, name), 0.0, MOST, name)


def _within(number: float, least: float, most: float, name: str) -> float:
    if not least <= number <= most:
        raise InputError(
            f"{number:g} is not from {least:g} to {most:g}",
            where=name,
            remedy="check the units: SI units are meant",
        )
    return number
