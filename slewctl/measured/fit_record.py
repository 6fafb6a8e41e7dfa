"""Least squares on a log itself, the noise read anew from what is left in every round."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.measured.elsewhere import elsewhere
from slewctl.measured.record_data import RecordData
from slewctl.measured.record_descent import descend_record, record_slopes
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
    """

    coordinates: Array
    jacobian: Array
    scatter: float
    spare: int
    noise: float = np.nan
    dry: tuple[float, float] = (np.nan, np.nan)


def fit_record(problem: RigProblem, data: RecordData, start: Array) -> Solution:
    """Refine on the log itself, the noise read anew from what is left in every round."""
    x, remainder = start, data.state_part(problem.rig_at(start))
    for round_ in range(_ROUNDS):
        if round_:
            remainder = data.rub(problem.rig_at(x), remainder)
            data.weigh(remainder, record_slopes(problem, data, remainder, x))
        if round_ > _FREE:
            data.expect(problem.rig_at(x))
        before, x = x, descend_record(problem, data, x, fine=round_ > _FREE)
        if round_ == _FREE:
            x = elsewhere(problem, data, x)
        remainder = data.state_part(problem.rig_at(x))
        moved = remainder.without(data.errors(problem.rig_at(before))) - remainder.vector
        if round_ > _FREE and np.linalg.norm(moved) < _SETTLED * np.sqrt(len(x)):
            break
    jacobian = record_slopes(problem, data, remainder, x, two_sided=True)
    spare = max(len(remainder.vector) - remainder.taken - len(x), 1)
    scatter = float(np.sqrt(remainder.vector @ remainder.vector / spare))
    return Solution(x, jacobian, scatter, spare, data.times_rounding, data.dry_friction(remainder))
