"""Another minimum of a log's least squares, where a fit took a light mode for a heavy one.

A mode that the log hardly shows, its pole close to a zero, leaves its frequency open: the fit may
put it where it is not, and its damping up until nothing of it is seen.  The rest of the log then
fits as well along a valley, in which the property known least changes and the others with it.
That valley is walked with the damping that the fit began with; where the log becomes likelier
there, the fit goes on.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from slewctl._types import Array, IntArray
from slewctl.errors import SlewctlError
from slewctl.measured.record_data import RecordData
from slewctl.measured.record_descent import descend_record, record_slopes
from slewctl.measured.rig_parameters import DAMPING, GAIN
from slewctl.measured.rig_problem import RigProblem

# A damping so many times what the fit began with, and its logarithm this unknown, is doubted.
_GREW, _UNKNOWN = float(np.log(5.0)), 0.2
# Steps of the property known least, as a logarithm, to either side, and the others' largest.
_STEP, _STEPS, _LARGEST = 0.05, 20, 0.3
# By how much twice the logarithm of the likelihood is to rise.
_LIKELIER = 10.0
_SMALL = 1e-8  # relative singular value


def elsewhere(problem: RigProblem, data: RecordData, here: Array) -> Array:
    """Return coordinates of a minimum where the log is likelier, or those that are given.

    Parameters
    ----------
    problem : RigProblem
    data : RecordData
    here : ndarray, shape (n,)
        A minimum.
    """
    slopes = record_slopes(problem, data, data.state_part(problem.rig_at(here)), here)
    covariance = _covariance(slopes)
    light = _light(problem, here, covariance)
    if light is None:
        return here
    lead = _known_least(problem, covariance)
    rest = np.flatnonzero((light == here) & (np.arange(len(here)) != lead))
    best, least = here, data.unlikely(problem.rig_at(here)) - _LIKELIER
    for step in (-_STEP, _STEP):
        start = _low(_walk(problem, data, light, lead, rest, step))
        if start is None:
            continue
        with suppress(SlewctlError):  # a descent may leave all arms
            end = descend_record(problem, data, start, fine=False)
            if (unlikely := data.unlikely(problem.rig_at(end))) < least:
                best, least = end, unlikely
    return best


def _walk(
    problem: RigProblem, data: RecordData, start: Array, lead: int, rest: IntArray, step: float
) -> list[tuple[float, Array]]:
    """Return how unlikely the log is along the valley, and the coordinates there."""
    lower, upper = problem.bounds
    x, found = start.copy(), []
    with suppress(SlewctlError):
        for _ in range(_STEPS):
            x[lead] += step * (1.0 if problem.logarithmic[lead] else max(start[lead], 1.0))
            remainder = data.state_part(problem.rig_at(x))
            slopes = record_slopes(problem, data, remainder, x)[:, rest]
            turn = np.linalg.lstsq(slopes, -remainder.vector, rcond=_SMALL)[0]
            x[rest] += np.clip(turn, -_LARGEST, _LARGEST)
            x = np.clip(x, lower, upper)
            found.append((data.unlikely(problem.rig_at(x)), x.copy()))
    return found


def _low(walked: list[tuple[float, Array]]) -> Array | None:
    """Return the lowest place that is lower than those beside it; None where there is none."""
    height = np.array([each for each, _ in walked])
    lows = [k for k in range(1, len(height) - 1) if height[k] < min(height[k - 1], height[k + 1])]
    return walked[min(lows, key=lambda k: height[k])][1] if lows else None


def _covariance(jacobian: Array) -> Array:
    size = np.linalg.norm(jacobian, axis=0)
    size[size == 0] = 1.0
    inverse = np.linalg.pinv(jacobian / size, rcond=_SMALL) / size[:, None]
    return np.asarray(inverse @ inverse.T)


def _light(problem: RigProblem, here: Array, covariance: Array) -> Array | None:
    """Return the coordinates with doubted dampings as they began; None where none is doubted."""
    damps = np.array([each.name.startswith(DAMPING) for each in problem.free])
    start = problem.start()
    unknown = np.sqrt(np.diag(covariance)) > _UNKNOWN
    doubted = damps & unknown & (here - start > _GREW)
    return np.where(doubted, start, here) if doubted.any() else None


def _known_least(problem: RigProblem, covariance: Array) -> int:
    """Return which of the properties that move poles, zeros and size is known least."""
    kept = [j for j, each in enumerate(problem.free) if each.shape or each.name == GAIN]
    return kept[int(np.argmax(np.diag(covariance)[kept]))]
