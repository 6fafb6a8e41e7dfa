"""The least squares behind a fit to a response or a log: coordinates, starts and descent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array, BoolArray
from slewctl.errors import SlewctlError
from slewctl.measured.rig_parameters import DELAY, GAIN, Parameter, Rig, starting_coordinate

# Of the differences, in coordinates whose typical size is one.
_STEP = 1e-5
# Factors between 1e-6 and 1e6 of what it starts with, of the gain, whose unit may be anything,
# more; so near to a bound is on it.
_LARGEST_LOG, _LARGEST_GAIN, _AT_BOUND = 14.0, 70.0, 1e-4
_DECADE = float(np.log(10))
# Starts are spread over so much to either side, as a logarithm; dead times by halves of a tick to
# so many, and up to so many more widely.
_SPREAD = 1.1
_FEW_TICKS, _MOST_TICKS = 8.0, 80.0
_STARTS = 24  # for each property that moves poles and zeros
_MOST_STARTS = 96
_KEPT = 3  # of them, the best, are descended from
_STEPS = 40  # of one descent
_LARGE = 3.0  # standard deviations: beyond, a residual counts linearly
_AT_ZERO = 1e-6  # of a coordinate: it is on its bound


@dataclass(frozen=True, eq=False)
class RigProblem:
    """A rig, what may change of it, and what it should give.

    Attributes
    ----------
    rig : Rig
    free : list of Parameter
    """

    rig: Rig
    free: list[Parameter]

    @property
    def logarithmic(self) -> BoolArray:
        """Which coordinates are logarithms, shape (n,)."""
        return np.array([each.positive for each in self.free])

    def start(self) -> Array:
        """Return the rig's own coordinates, shape (n,)."""
        return np.array([starting_coordinate(each, np.log) for each in self.free])

    def values(self, coordinates: Array) -> Array:
        """Return the properties in their units, shape (n,)."""
        scales = np.array([each.scale for each in self.free])
        growth = np.exp(np.where(self.logarithmic, coordinates, 0.0))
        return np.where(self.logarithmic, growth, coordinates * scales)

    def slopes(self, coordinates: Array) -> Array:
        """Return d value / d coordinate, shape (n,)."""
        scales = np.array([each.scale for each in self.free])
        return np.where(self.logarithmic, self.values(coordinates), scales)

    def rig_at(self, coordinates: Array) -> Rig:
        """Return the rig with its free properties at `coordinates`."""
        rig = self.rig
        for each, value in zip(self.free, self.values(coordinates), strict=True):
            rig = each.write(rig, float(value))
        return rig

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest coordinates."""
        log, own = self.logarithmic, self.start()
        far = np.array([_LARGEST_GAIN if e.name == GAIN else _LARGEST_LOG for e in self.free])
        most = np.array([each.most for each in self.free])
        scales = np.array([each.scale for each in self.free])
        with np.errstate(divide="ignore"):
            upper = np.where(log, np.minimum(own + far, np.log(most)), most / scales)
        return np.where(log, own - far, 0.0), upper

    def at_bounds(self, coordinates: Array) -> BoolArray:
        """Return which properties are held at the least or the largest that they can be."""
        lower, upper = self.bounds
        least = np.where(self.logarithmic, coordinates < lower + _AT_BOUND, coordinates == 0)
        return np.asarray(least | (coordinates > upper - _AT_BOUND))

    def no_later_than(self, delay: float) -> RigProblem:
        """Return the problem with a dead time of at most so many s."""
        free = [replace(each, most=delay) if each.name == DELAY else each for each in self.free]
        return replace(self, free=free)

    def differences(
        self, of: Callable[[Rig], Array], coordinates: Array, here: Array | None = None
    ) -> Array:
        """Return the derivatives of a function of the rig by the coordinates, shape (m, n).

        With its value `here` they are one-sided, at half the cost.
        """
        columns = []
        for j, each in enumerate(self.free):
            step = np.zeros(len(coordinates))
            step[j] = _STEP * (1.0 if each.positive else max(1.0, coordinates[j]))
            ahead = of(self.rig_at(coordinates + step))
            both = here is None and (each.positive or coordinates[j] >= step[j])
            back = step if both else 0 * step
            behind = of(self.rig_at(coordinates - back)) if here is None else here
            columns.append((ahead - behind) / (step[j] + back[j]))
        return np.column_stack(columns)

    def descend(
        self,
        residual: Callable[[Array], Array],
        jacobian: Callable[[Array], Array],
        start: Array,
        *,
        robust: bool,
        held: bool = True,
        steps: int = _STEPS,
        tolerance: float = 1e-10,
    ) -> Array:
        """Return the coordinates of least squares from a start.


        Parameters
        ----------
        residual, jacobian : callable
            Of the coordinates; in standard deviations.
        start : ndarray, shape (n,)
        robust : bool
            Whether large residuals count linearly.
        held : bool
            Whether what the measurement does not show stays near where it was: a decade away
            from it counts like one standard deviation.
        steps : int
        tolerance : float
            Relative fall of the sum of squares that ends it.
        """
        from scipy.optimize import least_squares  # slow to load: not before it is wanted

        lower, upper = self.bounds
        inside = np.clip(start, lower + 1e-9, upper - 1e-9)
        pull = np.where(self.logarithmic, held / _DECADE, 0.0)
        own = self.start()

        def whole(x: Array) -> Array:
            return np.concatenate([residual(x), pull * (x - own)])

        def slopes(x: Array) -> Array:
            return np.vstack([jacobian(x), np.diag(pull)])

        found = least_squares(
            whole,
            inside,
            jac=slopes,
            bounds=(lower, upper),
            loss="soft_l1" if robust else "linear",
            f_scale=_LARGE,
            x_scale="jac",
            ftol=tolerance,
            xtol=1e-8,
            gtol=1e-10,
            max_nfev=steps,
        )
        x = np.asarray(found.x)
        return np.where(~self.logarithmic & (x < _AT_ZERO), 0.0, x)

    def starts(self, cost: Callable[[Rig], float], settle: Callable[[Array], Array]) -> list[Array]:
        """Return the most promising starts of a spread over what moves poles and zeros.

        Parameters
        ----------
        cost : callable
            Of a rig: how far its magnitudes are off.
        settle : callable
            Of coordinates: the same with gain and dead time that fit the measurement.
        """
        own = self.start()
        shape = np.flatnonzero([each.shape for each in self.free])
        tried = [own]
        if len(shape):
            from scipy.stats import qmc  # slow to load: not before it is wanted

            count = min(_STARTS * len(shape), _MOST_STARTS)
            spread = qmc.Halton(len(shape), scramble=True, rng=0).random(count)
            for point in 2 * spread - 1:
                moved = own.copy()
                for j, turn in zip(shape, _SPREAD * point, strict=True):
                    factor = np.exp(turn) if self.free[j].start else np.exp(2.5 * turn) * 10
                    moved[j] = own[j] + turn if self.free[j].positive else own[j] * factor
                tried.append(moved)
        costs = [_tried(cost, self.rig_at, point) for point in tried]
        order = np.argsort(costs, kind="stable")[:_KEPT]
        best = [tried[k] for k in order]
        if not any(point is own for point in best):
            best.append(own)
        return [settle(point) for point in best]

    def with_phase(self, coordinates: Array, misfit: Callable[[Rig], float]) -> Array:
        """Return the coordinates with the dead time that fits best, of a few."""
        names = [each.name for each in self.free]
        if DELAY not in names:
            return coordinates
        j = names.index(DELAY)
        trials = []
        few = np.arange(0.1, _FEW_TICKS, 0.5)
        for ticks in (*few, *np.geomspace(_FEW_TICKS, _MOST_TICKS, len(few))):
            moved = coordinates.copy()
            moved[j] = ticks
            trials.append((misfit(self.rig_at(moved)), moved))
        return min(trials, key=lambda pair: pair[0])[1]

    def with_gain(self, coordinates: Array, log_gain: float) -> Array:
        """Return the coordinates with the gain moved by a factor, if it is free."""
        moved = coordinates.copy()
        for j, each in enumerate(self.free):
            if each.name == GAIN:
                moved[j] += log_gain
        return moved


def _tried(
    cost: Callable[[Rig], float], rig_at: Callable[[Array], Rig], coordinates: Array
) -> float:
    """Return a cost; infinite for a rig that cannot be."""
    try:
        return cost(rig_at(coordinates))
    except SlewctlError:
        return np.inf
