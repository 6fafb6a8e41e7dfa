"""Enlarging the polynomial basis until the frequencies stop falling."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis import Polynomial

T = TypeVar("T")
_TARGET = 1e-11
_MOST_FUNCTIONS = 400


def converged(
    arm: Arm, modes: int, solve: Callable[[Polynomial], T], values: Callable[[T], Array]
) -> tuple[T, Array, int]:
    """Return the first solution whose `modes` lowest frequencies have settled.

    Parameters
    ----------
    arm : Arm
        Its breakpoints are the edges of the panels.
    modes : int
    solve : callable
        Returns a solution in a polynomial basis.
    values : callable
        Returns a solution's frequencies, increasing, in any unit.

    Returns
    -------
    solution
    errors : ndarray, shape (modes,)
        Relative change of each frequency in the last enlargement, plus rounding.
    functions : int
        How many polynomial functions the solution has.
    """
    edges = arm.beam.breakpoints
    panels = len(edges) + 1
    functions = panels * (3 + 2 * modes // panels) + 12
    coarse = solve(Polynomial(functions, edges))
    while True:
        functions += max(4 * panels, functions // 4)
        fine = solve(Polynomial(functions, edges))
        exact = values(fine)[:modes]
        change = np.abs(values(coarse)[:modes] / exact - 1)
        if change.max() <= _TARGET or functions > _MOST_FUNCTIONS:
            rounding = np.finfo(float).eps * (10 + exact / exact[0])
            return fine, change + rounding, functions
        coarse = fine
