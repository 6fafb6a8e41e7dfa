"""The smallest number of samples for which a problem has a solution."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def fewest(
    solved: Callable[[int], T | None],
    first: int,
    doublings: int,
    *,
    none: int = 0,
    most: int = sys.maxsize,
) -> T | None:
    """Return the solution of the smallest number that has one, None if there is none.

    Parameters
    ----------
    solved : callable
        Returns the solution for a number, or None; a larger number has one too.
    first : int
        Tried first, and doubled until there is a solution.
    doublings : int
        How many numbers are tried before there is none.
    none : int
        A number without a solution.
    most : int
        Larger numbers are not tried.

    Examples
    --------
    >>> fewest(lambda n: n if n >= 11 else None, 3, 6)
    11
    >>> fewest(lambda n: n if n >= 11 else None, 3, 6, most=10) is None
    True
    """
    low, high, found = none, first, None
    for _ in range(doublings):
        if high > most:
            break
        found = solved(high)
        if found is not None:
            break
        low, high = high, 2 * high
    while found is not None and high - low > 1:
        middle = (low + high) // 2
        better = solved(middle)
        if better is None:
            low = middle
        else:
            high, found = middle, better
    return found
