"""Small helpers for every design by matrix inequalities: run, check from the numbers, relax.

The solver's own word is never taken.  After it has stopped, every block is evaluated at the
values found and its least eigenvalue computed; how far the answer is from the optimum follows
from the multipliers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slewctl.design.lmi.clarabel import run_clarabel
from slewctl.design.result import Check

if TYPE_CHECKING:
    import cvxpy

# Every block is asked to be this positive definite where the unknowns are of size one: more
# than what the solver leaves unsolved, so that the recomputed block is positive.  The next is
# tried when the one before was not enough.
MARGINS = (1e-8, 1e-7, 1e-6)
_ITERATIONS = 60  # of the solver, a safeguard


@dataclass(frozen=True, eq=False)
class Block:
    """A symmetric matrix expression that is to be positive definite.

    Attributes
    ----------
    name : str
    matrix : cvxpy.Expression
    imposed : bool
        False: it follows from other blocks and is only checked afterwards.
    """

    name: str
    matrix: Any
    imposed: bool = True


def run(
    cost: Any, blocks: Sequence[Block], tolerance: float, margin: float
) -> tuple[str, cvxpy.Problem, list[tuple[Block, Any]]]:
    """Run the solver and return what it said, the problem, and the constraints by block."""
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    imposed = []
    for block in blocks:
        if block.imposed:
            inside = (block.matrix + block.matrix.T) / 2 - margin * np.eye(block.matrix.shape[0])
            imposed.append((block, inside >> 0))
    problem = cp.Problem(cp.Minimize(cost), [constraint for _, constraint in imposed])
    if not run_clarabel(problem, tolerance, _ITERATIONS):
        return "stopped without a solution", problem, imposed
    return str(problem.status), problem, imposed


def definiteness(blocks: Sequence[Block]) -> list[Check]:
    """Return a check for each block: its least eigenvalue, from the numbers, is positive."""
    checks = []
    for block in blocks:
        value = np.atleast_2d(block.matrix.value)
        eigenvalues = np.linalg.eigvalsh((value + value.T) / 2)
        size = max(float(np.abs(eigenvalues).max()), np.finfo(float).tiny)
        least = float(eigenvalues[0]) / size
        short = 0.0 if least > 0 else max(-least, np.finfo(float).eps)
        checks.append(Check(f"block {block.name!r} short of positive definite", short, 0.0))
    return checks


def gap(imposed: Sequence[tuple[Block, Any]], cost: float, margin: float, allowed: float) -> Check:
    """Return the check that the multipliers vanish where blocks do not: Σ tr ZF over the cost."""
    found = 0.0
    for block, constraint in imposed:
        value, dual = np.atleast_2d(block.matrix.value), constraint.dual_value
        inside = value - margin * np.eye(len(value))
        found += abs(float(np.sum(np.atleast_2d(dual) * inside))) if dual is not None else np.inf
    return Check("complementarity gap over the cost", found / abs(cost), allowed)


def largest(possible: Callable[[float], bool], good: float, bad: float, rounds: int = 5) -> float:
    """Return a value that is possible, near the last such one between `good` and `bad`.

    Parameters
    ----------
    possible : callable
        Says whether a value is; `good` is taken to be, `bad` not to be.
    good, bad : float
        If both are positive the search is by ratio, else by difference.
    rounds : int
    """
    for _ in range(rounds):
        middle = np.sqrt(good * bad) if good * bad > 0 else (good + bad) / 2
        good, bad = (middle, bad) if possible(float(middle)) else (good, middle)
    return float(good)
