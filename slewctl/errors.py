"""What can go wrong, in the user's words: what was wrong, where, and what to do.

Every error that slewctl raises on purpose is a `SlewctlError`; the command line
prints its one line and exits with status 2.  The `check_*` functions refuse
impossible numbers in the same words everywhere.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from functools import partial
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from slewctl.escape import one_line

P = ParamSpec("P")
T = TypeVar("T")

# Characters of a value, of what is wrong and of the remedy that a person reads.
_MOST_SHOWN = 60
_MOST_WHAT = 500
_MOST_REMEDY = 250
# Faults of one file that are told at once.
_MOST_FAULTS = 20


class SlewctlError(Exception):
    """Base of all errors that slewctl raises on purpose.

    Parameters
    ----------
    what : str
        What was wrong, with the offending value.
    where : str, optional
        The place: a file and key, or a name such as ``hub.inertia``.
    remedy : str or callable, optional
        What the user can do about it; a callable is asked for it only when it is told, since
        a nearest name takes time and of thousands of faults few are told.
    """

    def __init__(self, what: str, *, where: str = "", remedy: str | Callable[[], str] = "") -> None:
        self.what, self.where, self._remedy = what, where, remedy
        super().__init__(what, where)

    @property
    def remedy(self) -> str:
        """What the user can do about it."""
        return self._remedy if isinstance(self._remedy, str) else self._remedy()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle with its keywords: an error may come back from another process."""
        return partial(type(self), where=self.where, remedy=self.remedy), (self.what,)

    def within(self, place: str, separator: str = ": ") -> SlewctlError:
        """Return the same error with `place`, such as a file, before its own place."""
        return self.at(f"{place}{separator}{self.where}" if self.where else place)

    def at(self, where: str) -> SlewctlError:
        """Return the same error at another place."""
        return type(self)(self.what, where=where, remedy=self._remedy)

    def __str__(self) -> str:
        place = f"{one_line(self.where)}: " if self.where else ""
        advice = f"; {clipped(self.remedy, _MOST_REMEDY)}" if self.remedy else ""
        return f"{place}{clipped(self.what, _MOST_WHAT)}{advice}"


class InputError(SlewctlError, ValueError):
    """A value that the user gave is impossible, unknown or of the wrong shape."""


class FaultsError(InputError):
    """Several faults of one file, told one a line.

    Parameters
    ----------
    faults : sequence of SlewctlError
        At least one.
    """

    def __init__(self, faults: Sequence[SlewctlError]) -> None:
        self.faults = tuple(faults)
        first = self.faults[0]
        super().__init__(first.what, where=first.where, remedy=first._remedy)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.faults,)

    def within(self, place: str, separator: str = ": ") -> SlewctlError:
        """Return the same faults with `place` before the place of each."""
        return FaultsError([fault.within(place, separator) for fault in self.faults])

    def at(self, where: str) -> SlewctlError:
        """Return the same faults, all at another place."""
        return FaultsError([fault.at(where) for fault in self.faults])

    def __str__(self) -> str:
        lines = [str(fault) for fault in told_faults(self)]
        more = len(self.faults) - len(lines)
        return "\n".join([*lines, f"and {more} more faults"] if more else lines)


def faults_of(error: SlewctlError) -> tuple[SlewctlError, ...]:
    """Return the single faults that an error tells of."""
    return error.faults if isinstance(error, FaultsError) else (error,)


def told_faults(error: SlewctlError) -> tuple[SlewctlError, ...]:
    """Return those single faults of an error that are told one by one."""
    return faults_of(error)[:_MOST_FAULTS]


class Faults:
    """The faults of a file, or of a call, found so far: all of them are told at once."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], SlewctlError] = {}

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, faults: Iterable[SlewctlError]) -> None:
        """Add faults; one that is known is not told twice."""
        for fault in faults:
            self._found.setdefault((fault.where, fault.what), fault)

    def attempt(self, make: Callable[P, T], *args: P.args, **keys: P.kwargs) -> T | None:
        """Return what `make` returns, or None after adding what it refuses."""
        try:
            return make(*args, **keys)
        except SlewctlError as error:
            self.add(faults_of(error))
            return None

    def settled(self, made: T | None) -> T:
        """Return what was made, if nothing is wrong at all."""
        self.tell()
        return cast(T, made)

    def tell(self) -> None:
        """Raise what was found, if anything was."""
        found = list(self._found.values())
        if len(found) == 1:
            raise found[0]
        if found:
            raise FaultsError(found)


class DesignError(SlewctlError):
    """No controller can be designed: an assumption of the method does not hold."""


class BreakdownError(SlewctlError):
    """The arithmetic came to an end that nobody had foreseen."""


class AccuracyError(SlewctlError):
    """A result was computed but its independent check does not confirm it."""


def clipped(text: str, most: int) -> str:
    """Return text on one line and no longer than `most`, with dots for what is left out."""
    # What is cut off need not be looked through.
    line = one_line(" ".join(text[: 2 * most].split()))
    return line if len(line) <= most and len(text) <= 2 * most else f"{line[: most - 3]}..."


class _Shown(reprlib.Repr):
    """A `repr` that looks at the beginning of a value only, and never fails."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxother = 4, _MOST_SHOWN, _MOST_SHOWN

    def repr_int(self, x: int, level: int) -> str:
        """Return a number, or how long it is: Python prints no longer ones."""
        bits = x.bit_length()
        return repr(x) if bits < 4 * _MOST_SHOWN else f"a whole number of {bits} bits"


_REPR = _Shown()


def shown(value: object) -> str:
    """Return `value` for a message: on one line, and not longer than a line."""
    return clipped(_REPR.repr(value), _MOST_SHOWN)


def check_number(value: object, name: str) -> float:
    """Return `value` as a float; refuse what is not a finite real number."""
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return number
    raise InputError(f"{shown(value)} is not a finite number", where=name, remedy="give a number")


def check_positive(value: object, name: str) -> float:
    """Return `value` as a float; refuse what is not greater than zero."""
    number = check_number(value, name)
    if number <= 0:
        raise InputError(f"{number:g} is not positive", where=name, remedy="give a value > 0")
    return number


def check_nonnegative(value: object, name: str) -> float:
    """Return `value` as a float; refuse negative numbers."""
    number = check_number(value, name)
    if number < 0:
        raise InputError(f"{number:g} is negative", where=name, remedy="give a value >= 0")
    return number


def check_damping_ratio(value: object, name: str) -> float:
    """Return `value` as a float; refuse what is not in [0, 1)."""
    ratio = check_number(value, name)
    if not 0 <= ratio < 1:
        raise InputError(
            f"{ratio:g} is not in [0, 1)",
            where=name,
            remedy="give ζ as a fraction, for example 0.005 for half a percent",
        )
    return ratio


def check_count(value: object, name: str, least: int = 1) -> int:
    """Return `value` as an int; refuse what is not a whole number >= `least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError(
            f"{shown(value)} is not a whole number >= {least}",
            where=name,
            remedy=f"give a whole number >= {least}",
        )
    return int(value)


def check_given(value: T | None, name: str, meaning: str) -> T:
    """Return `value`; refuse None where there is no default and say what to give."""
    if value is None:
        raise InputError("missing", where=name, remedy=f"give {meaning}")
    return value


def check_type(value: object, kind: type[T], name: str) -> T:
    """Return `value`; refuse what is of another type."""
    if isinstance(value, kind):
        return value
    raise InputError(f"{shown(value)} is no {kind.__name__}", where=name, remedy="give one")


def check_types(values: object, kind: type[T], name: str) -> list[T]:
    """Return `values` as a list; refuse what is no list of this type, or empty."""
    found = list(values) if isinstance(values, Iterable) and not isinstance(values, str) else []
    if found and all(isinstance(value, kind) for value in found):
        return found
    raise InputError(
        f"{shown(values)} is no list of {kind.__name__}", where=name, remedy="give at least one"
    )


def check_path(value: object, name: str) -> Path:
    """Return the path of a file; refuse what is none."""
    if isinstance(value, str | PathLike):
        return Path(value)
    raise InputError(f"{shown(value)} is no path", where=name, remedy="give the path of a file")


def check_paths(values: object, name: str) -> list[Path]:
    """Return the paths of one file or of several; refuse what is none."""
    if isinstance(values, Iterable) and not isinstance(values, str | PathLike):
        return [check_path(value, name) for value in values]
    return [check_path(values, name)]


def check_choice(value: object, choices: Iterable[str], name: str) -> str:
    """Return `value`; refuse what is not among `choices` and suggest the nearest."""
    known = sorted(choices)
    if isinstance(value, str) and value in known:
        return value
    raise InputError(
        f"unknown name {shown(value)}",
        where=name,
        remedy=partial(suggest, value if isinstance(value, str) else shown(value), known),
    )


def check_each(
    values: Iterable[object], name: str, check: Callable[[object, str], T]
) -> tuple[T, ...]:
    """Return what `check` makes of each element, which it is given with a name of its own."""
    return tuple(check(value, f"{name}.{place}") for place, value in enumerate(values))


def suggest(wrong: str, known: Iterable[str]) -> str:
    """Return the remedy for a misspelt name: the nearest known one, or all of them."""
    names = sorted(known)
    near = get_close_matches(wrong[:_MOST_SHOWN], names, n=1)
    return f"did you mean {near[0]!r}?" if near else "known: " + ", ".join(names)
