"""Where |L| = 1: eigenvalues propose, signs decide.

|L(jω)| = 1 at imaginary eigenvalues of a Hamiltonian matrix, which only propose frequencies,
and generously.  Between all proposals, their midpoints, the poles of the open and the closed
loop and a grid, the sign of log|L| is examined where it exceeds its rounding error; what
turns towards zero without reaching it is followed to its lowest point; every sign change is
enclosed and polished.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.loop.single.roots import polished
from slewctl.numerics.bilinear import Equivalent
from slewctl.numerics.hinf_norm import level_crossings

# A sign is trusted only this many times above the rounding error of its evaluation.
TRUSTED = 10.0
_GRID = 400
_TURNS = 8


@dataclass(frozen=True, eq=False)
class Samples:
    """L at increasing frequencies in rad/s, with the rounding error of each value."""

    omega: Array
    values: ComplexArray
    rounding: Array


@dataclass(frozen=True, eq=False)
class Crossings:
    """Sign changes: frequencies in rad/s, increasing, and +1 where the function rises."""

    omega: Array
    rising: Array


Function = Callable[[ComplexArray], Array]


def log_gain(values: ComplexArray) -> Array:
    """Return log|L|, between −1e3 and 1e3."""
    with np.errstate(divide="ignore"):
        return np.clip(np.log(np.abs(values)), -1e3, 1e3)


def sampled(loop: BrokenLoop, more: Array | None = None) -> Samples:
    """Return L at all proposed frequencies, the poles, a grid, and the midpoints of these.

    Parameters
    ----------
    more : ndarray, optional
        Proposals in rad/s beside those of |L| = 1.
    """
    system = loop.equivalent
    proposed = level_crossings(system, 1.0)
    if more is not None:
        proposed = np.concatenate([proposed, more])
    top = loop.known[-1] if len(loop.known) else 1.0
    # What lies far above all poles is an infinite eigenvalue, unless L ends in a constant.
    proposed = proposed[proposed < (1e8 if loop.D else 1e3) * top]
    known = np.unique(np.concatenate([proposed, loop.known, [top]]))
    known = known[known > 1e-9 * top]
    limit = loop.response.nyquist
    # Evenly in log(tan(ωT/2)), so that both ends of a sampled loop's band are resolved.
    grid = _unwarped(np.geomspace(known[0] / 100, known[-1] * 100, _GRID), system, top)
    points = np.unique(np.concatenate([known, grid]))
    points = np.unique(np.concatenate([points, np.sqrt(points[1:] * points[:-1])]))
    points = points[(points > 0) & (points < limit)]
    return Samples(points, *loop.response.with_rounding(points))


def _unwarped(grid: Array, system: Equivalent, top: float) -> Array:
    if not system.sample_time:
        return grid
    low = np.tan(min(grid[0] * system.sample_time / 2, 1.0))
    return 2 * np.arctan(np.geomspace(low, 1e6, _GRID)) / system.sample_time


def crossings(loop: BrokenLoop, samples: Samples, function: Function) -> Crossings:
    """Return the sign changes of `function` of L over 0 < ω, enclosed and polished."""
    values = function(samples.values)
    # At a pole on the axis both are infinite, and no sign is to be had.
    clear = np.isfinite(samples.rounding)
    size = np.abs(samples.values, where=clear, out=np.zeros(len(values)))
    clear &= np.abs(values) * size > TRUSTED * samples.rounding
    points, values = samples.omega[clear], values[clear]

    def at(omega: Array) -> Array:
        return function(loop.response(omega))

    points, values = _turned(at, points, values)
    change = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    return Crossings(
        polished(lambda v, _: at(v), points[change], points[change + 1])[0],
        np.sign(values[change + 1]),
    )


def _turned(at: Callable[[Array], Array], points: Array, values: Array) -> tuple[Array, Array]:
    """Add the lowest points of what turns towards zero between samples of one sign.

    Successive parabolas: a pair of roots hides only where the vertex is near zero or beyond.
    """
    for _ in range(_TURNS):
        size = np.abs(values)
        low = np.flatnonzero(
            (size[1:-1] < size[:-2])
            & (size[1:-1] < size[2:])
            & (values[1:-1] * values[:-2] > 0)
            & (values[1:-1] * values[2:] > 0)
        )
        x = points[low], points[low + 1], points[low + 2]
        y = size[low], size[low + 1], size[low + 2]
        left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
        bend = (right - left) / (x[2] - x[0])
        vertex = np.clip((x[0] + x[1]) / 2 - left / (2 * bend), x[0], x[2])
        height = y[1] + (vertex - x[1]) * (left + bend * (vertex - x[0]))
        new = np.setdiff1d(vertex[height < 0.5 * y[1]], points)
        if not len(new):
            break
        order = np.argsort(np.concatenate([points, new]), kind="stable")
        points = np.concatenate([points, new])[order]
        values = np.concatenate([values, at(new)])[order]
    return points, values
