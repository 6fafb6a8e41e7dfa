"""Least squares on a log itself, the noise read anew from what is left in every round."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.measured.elsewhere import elsewhere
from slewctl.measured.record_data import RecordData, Remainder
from slewctl.measured.record_descent import descend_record, record_slopes
from slewctl.measured.redrawn import redrawn
from slewctl.measured.rig_problem import RigProblem

# Rounds of fitting and reading the noise from what is left, at most; and the change, in
# standard deviations, that ends them.
_ROUNDS, _SETTLED = 8, 0.05
# Rounds in which the state may be anything, after the first, so that it hides what is not near.
_FREE = 1


@dataclass(frozen=True, eq=False)
class Solution:
    """Coordinates of least squares, with what says how well they are known.

    Attributes
    ----------
    coordinates : ndarray, shape (n,)
    jacobian : ndarray, shape (m, n)
        Of residuals in standard deviations.
    scatter : float
        What these deviations are multiplied with to be those seen.
    spare : int
        Residuals beyond the properties.
    noise : float
        Of a log: of an encoder's rounding.
    dry : tuple of float
        Of a log of the hub angle: dry friction in the actuator's unit, and its deviation.
    explained : float
        Of a log: how much of the output the input makes through the rig, at most 1; see
        `RecordData.explained`.
    redrawn : ndarray, shape (m, n), or None
        With dry friction: by how much each log that was drawn anew moves the coordinates.
    """

    coordinates: Array
    jacobian: Array
    scatter: float
    spare: int
    noise: float = np.nan
    dry: tuple[float, float] = (np.nan, np.nan)
    explained: float = np.nan
    redrawn: Array | None = None


def fit_record(
    problem: RigProblem, data: Callable[[], RecordData], starts: Sequence[Array]
) -> Solution:
    """Refine on the log itself, the noise read anew from what is left in every round.

    Parameters
    ----------
    problem : RigProblem
    data : callable
        Returns the log as it is before a fit.
    starts : sequence of ndarray
        The fit goes on from where the log is likeliest.

    Raises
    ------
    AccuracyError
        If no start leads to an arm.
    """
    ends: list[tuple[float, RecordData, Array, Remainder]] = []
    for start in starts:
        with suppress(SlewctlError):  # a descent may leave all arms
            mine = data()
            x, remainder = _approach(problem, mine, start)
            ends.append((_unlikely(problem, data(), x), mine, x, remainder))
    if not ends:
        raise AccuracyError(
            "no arm near the one given moves like the log",
            where="fit",
            remedy="free fewer properties, or start from an arm closer to the measured one",
        )
    _, mine, x, remainder = min(ends, key=lambda end: end[0])
    return _refined(problem, mine, x, remainder)


def _unlikely(problem: RigProblem, data: RecordData, x: Array) -> float:
    rig = problem.rig_at(x)
    if data.driven(data.state_part(rig)):
        data.rub(rig, None)
    return data.unlikely(rig)


def _approach(problem: RigProblem, data: RecordData, start: Array) -> tuple[Array, Remainder]:
    """Return a minimum of the log's least squares, about, and what is left there."""
    x, remainder = start, data.state_part(problem.rig_at(start))
    for round_ in range(_FREE + 1):
        if round_:
            remainder = _read(problem, data, x, remainder)
        x = descend_record(problem, data, x, fine=False)
        if not round_ and data.driven(data.state_part(problem.rig_at(x))):
            data.rub(problem.rig_at(start), None)
            x = descend_record(problem, data, start, fine=False)
        if round_ == _FREE:
            x = elsewhere(problem, data, x)
        remainder = data.state_part(problem.rig_at(x))
    return x, remainder


def _refined(problem: RigProblem, data: RecordData, x: Array, remainder: Remainder) -> Solution:
    for _ in range(_ROUNDS - _FREE - 1):
        remainder = _read(problem, data, x, remainder)
        data.expect(problem.rig_at(x))
        before, x = x, descend_record(problem, data, x, fine=True)
        remainder = data.state_part(problem.rig_at(x))
        moved = remainder.without(data.errors(problem.rig_at(before))) - remainder.vector
        if np.linalg.norm(moved) < _SETTLED * np.sqrt(len(x)):
            break
    jacobian = record_slopes(problem, data, remainder, x, two_sided=True)
    spare = max(len(remainder.vector) - remainder.taken - len(x), 1)
    scatter = float(np.sqrt(remainder.vector @ remainder.vector / spare))
    return Solution(
        x, jacobian, scatter, spare, data.times_rounding, data.dry_friction(remainder),
        data.explained(remainder), redrawn(problem, data, x, remainder),
    )  # fmt: skip


def _read(problem: RigProblem, data: RecordData, x: Array, remainder: Remainder) -> Remainder:
    """Read dry friction's sign and the noise anew; return what is left with that sign."""
    remainder = data.rub(problem.rig_at(x), remainder)
    data.weigh(remainder, record_slopes(problem, data, remainder, x))
    return remainder
