"""What signs of dry friction that are taken wrong add to the intervals of a fit.

They come from the log itself, so that its noise moves them, and they the properties: least
squares know nothing of that.  Logs of the fitted rig with other noise, whose signs are read in
the same way, tell how far (a parametric bootstrap: B. Efron and R. J. Tibshirani, An Introduction
to the Bootstrap, 1993, chapter 6).
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from slewctl._types import Array
from slewctl.errors import SlewctlError
from slewctl.measured.record_data import RecordData, Remainder
from slewctl.measured.record_descent import record_slopes
from slewctl.measured.rig_problem import RigProblem

# Logs that are drawn, and how often the signs of each are read.
_DRAWN, _READ = 8, 2
# The largest step of a coordinate, whose typical size is one.
_LARGEST = 0.5
# Relative singular value of what the log does not show.
_SMALL = 1e-10


def redrawn(problem: RigProblem, data: RecordData, x: Array, remainder: Remainder) -> Array | None:
    """Return by how much each of a few logs drawn anew moves the coordinates, shape (m, n).

    Parameters
    ----------
    problem : RigProblem
    data : RecordData
        With the noise as a fit has read it.
    x : ndarray, shape (n,)
        Where the fit ended.
    remainder : Remainder
        What it leaves.

    Returns
    -------
    ndarray or None
        None without dry friction.
    """
    dry, _ = data.dry_friction(remainder)
    if not dry > 0:
        return None
    moves = []
    with suppress(SlewctlError):  # readings too exact for a filter
        for other in data.drawn_anew(problem.rig_at(x), dry, np.random.default_rng(0), _DRAWN):
            with suppress(SlewctlError):  # a step may leave all arms
                moves.append(_fitted(problem, other, x) - x)
    return np.array(moves) if moves else None


def _fitted(problem: RigProblem, data: RecordData, x: Array) -> Array:
    """Return where a log leads from the rig that it was drawn of."""
    remainder = data.state_part(problem.rig_at(x))
    for _ in range(_READ):
        remainder = data.rub(problem.rig_at(x), remainder)
        slopes = record_slopes(problem, data, remainder, x)
        step = np.linalg.lstsq(slopes, -remainder.vector, rcond=_SMALL)[0]
        x = np.clip(x + np.clip(step, -_LARGEST, _LARGEST), *problem.bounds)
        remainder = data.state_part(problem.rig_at(x))
    return x


def widened(covariance: Array, moves: Array) -> Array:
    """Return a covariance whose deviations are no less than what was moved in the mean square.

    Parameters
    ----------
    covariance : ndarray, shape (n, n)
    moves : ndarray, shape (m, n)
    """
    deviation = np.sqrt(np.diag(covariance))
    moved = np.sqrt(np.mean(moves**2, axis=0))
    growth = np.maximum(1.0, np.divide(moved, deviation, out=np.ones(len(moved)),
                                       where=deviation > 0))  # fmt: skip
    return np.asarray(covariance * np.outer(growth, growth))
