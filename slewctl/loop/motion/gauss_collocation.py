"""Gauss collocation for ẏ = A y + g(t) + f(y): A implicit, the mild remainder f by iteration.

The s-stage Gauss method is the implicit Runge–Kutta method of order 2s that takes the
integral over the step at Gauss points.  It is stable for every step on an undamped mode,
so that high modes that hardly move do not dictate the step, and it keeps linear invariants
such as the angular momentum to rounding.  The linear part is inverted once a step size;
what remains is mild, and a few sweeps over all stages together settle it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from slewctl._types import Array
from slewctl.errors import AccuracyError

# Twelve stages resolve some eight radians of an oscillation in a step; more stages take
# fewer steps but larger matrices, and cost as much.
_STAGES = 12
_SWEEPS = 25  # of the iteration in a step; one that needs more is halved
_NEAR = 1e-7  # of a step: a jump closer to its end is not worth finding
_SETTLED = 1e-3  # of the tolerance
_MOST_STEPS = 1_000_000  # minutes of work, a safeguard
# A step this small a part of the whole hides nothing, not even a jump.
_LEAST_STEP = 2.0**-42


@dataclass(frozen=True, eq=False)
class Nodes:
    """Gauss points on a step of length one and what integrates a polynomial through them.

    Attributes
    ----------
    c, weights : ndarray, shape (s,)
    integral : ndarray, shape (s, s)
        Row i integrates from 0 to c_i.
    legendre : ndarray, shape (s, s)
        Values at the points to coefficients of shifted Legendre polynomials.
    at_ends : ndarray, shape (2, s)
        Rows that extrapolate to 0 and 1.
    """

    c: Array
    weights: Array
    integral: Array
    legendre: Array
    at_ends: Array

    def integral_to(self, c: Array) -> Array:
        """Return the rows, shape (len(c), s), that integrate from 0 to each of `c`."""
        count = len(self.c)
        P = legendre.legvander(2 * np.asarray(c) - 1, count)
        rows = np.empty((len(P), count))
        rows[:, 0] = (P[:, 0] + P[:, 1]) / 2
        k = np.arange(1, count)
        rows[:, 1:] = (P[:, 2:] - P[:, : count - 1]) / (2 * (2 * k + 1))
        return np.asarray(rows @ self.legendre)


@lru_cache(maxsize=8)
def gauss_nodes(stages: int) -> Nodes:
    """Return the `Nodes` of the method with so many stages."""
    x, w = legendre.leggauss(stages)
    c, weights = (x + 1) / 2, w / 2
    k = np.arange(stages)
    to_legendre = (2 * k[:, None] + 1) * (legendre.legvander(x, stages - 1) * weights[:, None]).T
    at_ends = legendre.legvander(np.array([-1.0, 1.0]), stages - 1) @ to_legendre
    bare = Nodes(c, weights, np.zeros((stages, stages)), to_legendre, at_ends)
    return replace(bare, integral=bare.integral_to(c))


@dataclass(frozen=True, eq=False)
class Propagator:
    """The linear part of a step of size h, solved: Y = start·y + forced·f at all stages."""

    start: Array
    forced: Array


def propagator(A: Array, h: float, nodes: Nodes) -> Propagator:
    """Return the `Propagator` of ẏ = A y + f for steps of size h.

    Its matrices have the shapes (s·m, m) and (s·m, s·m), with the stage the slow index.
    """
    size, stages = len(A), len(nodes.c)
    implicit = np.eye(stages * size) - np.kron(h * nodes.integral, A)
    right = np.hstack(
        [np.kron(np.ones((stages, 1)), np.eye(size)), np.kron(h * nodes.integral, np.eye(size))]
    )
    solved = np.linalg.solve(implicit, right)
    return Propagator(solved[:, :size], solved[:, size:])


@dataclass(frozen=True, eq=False)
class Step:
    """A step from `start` to `start` + `h`.

    Attributes
    ----------
    start, h : float
    begin, end : ndarray, shape (m,)
    times : ndarray, shape (s,)
        Of the stages.
    stages, slopes : ndarray, shape (s, m)
        y and ẏ at the stages.
    error : float
        Estimated error anywhere in the step, in the units of y.
    """

    start: float
    h: float
    begin: Array
    end: Array
    times: Array
    stages: Array
    slopes: Array
    error: float

    def at(self, t: Array) -> Array:
        """Return y at times within the step, shape (len(t), m)."""
        rows = gauss_nodes(len(self.times)).integral_to((t - self.start) / self.h)
        return np.asarray(self.begin + self.h * (rows @ self.slopes))


class GaussCollocation:
    """Steps of ẏ = A y + g(t) + f(y), as long as the tolerance allows.

    Parameters
    ----------
    A : ndarray, shape (m, m)
    forcing : callable
        g at all stages: from times (s,) to (s, m).
    remainder : callable
        f at all stages: from y (s, m) to (s, m), or to None where f is not defined.
    counted : ndarray of float, shape (m,)
        One for the components whose error counts, zero for the others.
    rtol : float
        Error allowed in a step, relative to the largest y so far.
    floor : float
        Size of y that is taken for granted when it starts from zero.
    """

    def __init__(
        self,
        A: Array,
        forcing: Callable[[Array], Array],
        remainder: Callable[[Array], Array | None],
        counted: Array,
        rtol: float,
        floor: float,
    ) -> None:
        self._A, self._forcing, self._remainder, self._counted = A, forcing, remainder, counted
        self._rtol, self._size = rtol, max(floor, float(np.finfo(float).tiny))
        self._nodes = gauss_nodes(_STAGES)
        self._propagators: dict[float, Propagator] = {}

    def steps(self, y: Array, roots: list[tuple[float, float]], h: float) -> Iterator[Step]:
        """Yield the steps over intervals (start, length) that follow one another.

        Parameters
        ----------
        y : ndarray, shape (m,)
        roots : list of (float, float)
            No step reaches over their ends, where f may have a kink.
        h : float
            Length of the first step, about.

        Raises
        ------
        AccuracyError
            If even the smallest step does not settle, or there are too many steps.
        """
        least = _LEAST_STEP * sum(length for _, length in roots)
        taken = 0
        for start, length in roots:
            level = max(0, int(np.ceil(np.log2(length / h))))
            if 2**level > _MOST_STEPS:
                raise _unsettled(start, h)
            pending = [(i, level) for i in range(2**level - 1, -1, -1)]
            while pending:
                i, level = pending.pop()
                h = length / 2**level
                step = self._attempt(y, start + i * h, h)
                allowed = self._rtol * self._size
                if step is None or (step.error > allowed and h > least):
                    if h <= least or taken + len(pending) > _MOST_STEPS:
                        raise _unsettled(start + i * h, h)
                    pending += [(2 * i + 1, level + 1), (2 * i, level + 1)]
                    continue
                taken += 1
                y = step.end
                yield step
                if step.error < allowed * 2.0 ** -(_STAGES + 2):
                    _merge(pending)
                    h *= 2

    def _attempt(self, y: Array, start: float, h: float) -> Step | None:
        """Return a step, or None if the sweeps do not settle."""
        nodes = self._nodes
        if h not in self._propagators:
            self._propagators[h] = propagator(self._A, h, nodes)
        times = start + h * nodes.c
        g = self._forcing(times)
        solved = self._sweep(self._propagators[h], y, g)
        if solved is None:
            return None
        Y, f = solved
        self._size = max(self._size, float(np.linalg.norm(Y * self._counted, axis=1).max()))
        slopes = Y @ self._A.T + g + f
        end = y + h * (nodes.weights @ slopes)
        error = self._error(Step(start, h, y, end, times, Y, slopes, 0.0), g)
        return Step(start, h, y, end, times, Y, slopes, error)

    def _error(self, step: Step, g: Array) -> float:
        """Return an estimate of the largest error in a step.

        What the polynomial through the stages leaves out is about as large as its last
        terms; but an oscillation too fast for the step is wrong by no more than its
        amplitude.  No stage sees a jump of g close to an end of the step, so that g is
        looked at there.
        """
        coefficients, h = self._nodes.legendre, step.h
        last = h * np.abs(coefficients[-2:] @ step.slopes).max(axis=0)
        missed = np.minimum(last, np.ptp(step.stages, axis=0))
        ends = self._forcing(step.start + h * np.array([_NEAR, 1 - _NEAR]))
        jump = np.abs(ends - self._nodes.at_ends @ g).max(axis=0)
        unseen = h * self._nodes.c[0] * jump
        return float(np.linalg.norm((missed + unseen) * self._counted))

    def _sweep(self, linear: Propagator, y: Array, g: Array) -> tuple[Array, Array] | None:
        """Return y and f at the stages; None if f is not defined or does not settle."""
        base = linear.start @ y + linear.forced @ g.ravel()
        Y = base.reshape(g.shape)
        for _ in range(_SWEEPS):
            f = self._remainder(Y)
            if f is None:
                return None
            before, Y = Y, (base + linear.forced @ f.ravel()).reshape(g.shape)
            size = float((np.abs(Y) @ self._counted).max())
            if not np.isfinite(size):
                return None
            change = float((np.abs(Y - before) @ self._counted).max())
            # The next sweep changes about as much less again: it need not be made.
            if change <= _SETTLED * self._rtol * max(size, self._size):
                return Y, f
        return None


def _merge(pending: list[tuple[int, int]]) -> None:
    """Join the next two steps if they are halves of one."""
    if len(pending) > 1 and pending[-1][1] == pending[-2][1] and pending[-1][0] % 2 == 0:
        i, level = pending.pop()
        pending[-1] = (i // 2, level - 1)


def _unsettled(t: float, h: float) -> AccuracyError:
    return AccuracyError(
        f"steps of {h:.1e} s at t = {t:.6g} s do not reach the tolerance, or are too many",
        where="simulation",
        remedy="look for a diverging motion, allow a larger rtol, or simulate a shorter time",
    )
