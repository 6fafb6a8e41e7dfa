"""The least-squares problem behind `fit`: coordinates, residuals, derivatives and descent.

Positive factors have their logarithm as coordinate, the other properties their ratio to the
beam's own mass, inertia or length; these are bounded below by zero.  Nothing depends on units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from slewctl._types import Array, BoolArray
from slewctl.arm import Arm
from slewctl.basis import Polynomial
from slewctl.errors import AccuracyError
from slewctl.model.adjustable import Adjustable
from slewctl.model.converge import modes_in
from slewctl.model.ritz import Boundary

_STEP = 1e-4  # of the differences in coordinates whose typical size is one
_LEAST_START = 0.01  # a search that starts on the bound may stay there
_AT_ZERO = 1e-6  # of a coordinate whose typical size is one: it is on its bound
_OTHER_STARTS = (0.03, 0.3, 1.0)  # of the coordinates that begin near zero, a decade and a half
_GOOD = 3e-3  # root-mean-square residual that needs no other start
_MOST_STEPS = 200  # of one search, a safeguard
_GRADIENT = 1e-14  # rounding of the residuals
_LARGEST_LOG = 25.0  # factors between 1e-11 and 1e11
_UNDETERMINED = 1e-6  # relative singular value; the derivatives are good to about 1e-8


@dataclass(frozen=True, eq=False)
class Problem:
    """A least-squares problem: an arm, what may change, and what was measured.

    Attributes
    ----------
    arm : Arm
    free : tuple of Adjustable
    boundary : {"hub-locked", "free"}
    modes : tuple of int
        Mode numbers, from 1, increasing.
    measured_hz : ndarray, shape (m,)
    uncertainty : ndarray, shape (m,), or None
        Relative standard deviations of the measurements.
    functions : int
        Number of polynomial functions of the model.
    """

    arm: Arm
    free: tuple[Adjustable, ...]
    boundary: Boundary
    modes: tuple[int, ...]
    measured_hz: Array
    uncertainty: Array | None
    functions: int

    @property
    def weights(self) -> Array:
        """1/σ of each relative residual; ones when σ is not known."""
        return np.ones(len(self.modes)) if self.uncertainty is None else 1 / self.uncertainty

    @property
    def logarithmic(self) -> BoolArray:
        """Which coordinates are logarithms, shape (n,)."""
        return np.array([each.positive for each in self.free])

    @property
    def scales(self) -> Array:
        """Typical sizes of the free properties, shape (n,)."""
        return np.array([each.scale(self.arm) for each in self.free])

    def start(self) -> Array:
        """Return the arm's own coordinates, shape (n,)."""
        values = [each.read(self.arm) for each in self.free]
        return np.array(
            [
                np.log(value) if each.positive else value / scale
                for each, value, scale in zip(self.free, values, self.scales, strict=True)
            ]
        )

    def values(self, coordinates: Array) -> Array:
        """Return the properties in their units at `coordinates`, both of shape (n,)."""
        growth = np.exp(np.where(self.logarithmic, coordinates, 0.0))
        return np.where(self.logarithmic, growth, coordinates * self.scales)

    def slopes(self, coordinates: Array) -> Array:
        """Return d value / d coordinate, shape (n,)."""
        return np.where(self.logarithmic, self.values(coordinates), self.scales)

    def cost(self, coordinates: Array) -> float:
        """Return the weighted sum of squared residuals."""
        return float(np.sum((self.weights * self.residuals(coordinates)) ** 2))

    def arm_at(self, coordinates: Array) -> Arm:
        """Return the arm with its free properties at `coordinates`."""
        arm = self.arm
        for each, value in zip(self.free, self.values(coordinates), strict=True):
            arm = each.write(arm, float(value))
        return arm

    def residuals(self, coordinates: Array) -> Array:
        """Return f(p)/f − 1 of the measured modes, shape (m,)."""
        basis = Polynomial(self.functions, self.arm.breakpoints)
        found = modes_in(self.arm_at(coordinates), basis, max(self.modes), self.boundary)
        hz = found.omega[np.array(self.modes) - 1] / (2 * np.pi)
        return hz / self.measured_hz - 1

    def jacobian(self, coordinates: Array) -> Array:
        """Return the derivatives of the residuals, shape (m, n), by second-order differences."""
        columns = []
        for j, each in enumerate(self.free):
            step = np.zeros(len(self.free))
            step[j] = _STEP * (1.0 if each.positive else max(1.0, coordinates[j]))
            ahead = self.residuals(coordinates + step)
            if each.positive or coordinates[j] >= step[j]:
                change = ahead - self.residuals(coordinates - step)
            else:  # one-sided: the property cannot be negative
                here, further = self.residuals(coordinates), self.residuals(coordinates + 2 * step)
                change = 4 * ahead - 3 * here - further
            columns.append(change / (2 * step[j]))
        return np.column_stack(columns)

    def sizes(self, coordinates: Array) -> Array:
        """Return the sizes of a change to judge by, shape (n,), in coordinates.

        A property's own size, or its typical one if that is larger.
        """
        return np.where(self.logarithmic, 1.0, np.maximum(coordinates, 1.0))

    def sensitivity(self, coordinates: Array) -> Array:
        """Return the weighted derivatives by changes of that size, shape (m, n)."""
        return self.weights[:, None] * self.jacobian(coordinates) * self.sizes(coordinates)

    def null_space(self, coordinates: Array) -> Array:
        """Return orthonormal changes, shape (n, k), that leave the frequencies as they are."""
        _, singular, rows = np.linalg.svd(self.sensitivity(coordinates))
        return rows[singular <= _UNDETERMINED * max(singular[0], self.weights.max())].T


def solve(problem: Problem) -> Array:
    """Return the coordinates of least weighted squares, shape (n,).

    Where the measurements do not determine everything, as many properties as needed stay as
    they are.  Properties that end at zero are put there exactly: an interior method only
    comes close.

    Raises
    ------
    AccuracyError
        If the search does not converge.
    """
    own = problem.start()
    start = np.where(problem.logarithmic, own, np.maximum(own, _LEAST_START))
    moving = _determined(problem, start)
    start = np.where(moving, start, own)
    found = _best(problem, start, moving)
    if found is None:
        raise AccuracyError(
            f"no least squares after {_MOST_STEPS} steps",
            where="fit",
            remedy="free fewer properties, or start from an arm closer to the measured one",
        )
    at_zero = moving & ~problem.logarithmic & (found <= _AT_ZERO)
    if not at_zero.any():
        return found
    held = _descend(problem, np.where(at_zero, 0.0, found), moving & ~at_zero)
    allowed = problem.cost(found) * (1 + 1e-9) + np.finfo(float).eps ** 2
    return found if held is None or problem.cost(held) > allowed else held


def _determined(problem: Problem, start: Array) -> BoolArray:
    """Return which properties may move so that the rest of them are determined, shape (n,).

    Held are those with the largest parts in the null space; of equals the last named.
    """
    null_space = problem.null_space(start)
    moving = np.ones(len(start), dtype=bool)
    preference = 1 + 1e-3 * np.arange(len(start))
    order = qr(null_space.T * preference, mode="r", pivoting=True)[1]
    moving[order[: null_space.shape[1]]] = False
    return moving


def _best(problem: Problem, start: Array, moving: BoolArray) -> Array | None:
    """Return the minimum reached from `start` or, if it is poor, the best from other starts.

    Masses and inertias far from the true ones have minima of their own, most of them with a
    property at zero.
    """
    found = _descend(problem, start, moving)
    good = found is not None and np.sqrt(np.mean(problem.residuals(found) ** 2)) < _GOOD
    spread = moving & ~problem.logarithmic
    if good or not spread.any():
        return found
    starts = [np.where(spread, level, start) for level in _OTHER_STARTS]
    minima = [found, *(_descend(problem, other, moving) for other in starts)]
    reached = [minimum for minimum in minima if minimum is not None]
    return min(reached, key=problem.cost) if reached else None


def _descend(problem: Problem, start: Array, moving: BoolArray) -> Array | None:
    """Minimise from `start` over the coordinates that move; None when it does not settle."""
    from scipy.optimize import least_squares  # slow to load: not before it is wanted

    if not moving.any():
        return start
    weights = problem.weights / problem.weights.max()
    lower = np.where(problem.logarithmic, -_LARGEST_LOG, 0.0)
    upper = np.where(problem.logarithmic, _LARGEST_LOG, np.inf)

    def full(part: Array) -> Array:
        everything = start.copy()
        everything[moving] = part
        return everything

    def residuals(part: Array) -> Array:
        return weights * problem.residuals(full(part))

    def jacobian(part: Array) -> Array:
        return weights[:, None] * problem.jacobian(full(part))[:, moving]

    result = least_squares(
        residuals,
        start[moving],
        jac=jacobian,
        bounds=(lower[moving], upper[moving]),
        ftol=1e-15,
        xtol=1e-10,
        gtol=_GRADIENT,
        max_nfev=_MOST_STEPS,
    )
    return full(result.x) if result.success else None
