"""Properties along the beam (mass per length, bending stiffness) as functions of x.

A profile can be given as a number, as polynomial coefficients in x/L (lowest power
first), as a table of `Stations`, or, in Python, as a callable of x in metres.
`as_profile` turns each of them into a `Profile`, which says beside its values
where it has kinks or steps and whether it is a polynomial between them: that is
what the quadrature needs to know to be exact.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial as PowerSeries

from slewctl._types import Array
from slewctl.arm.magnitudes import check_size, check_size_or_zero
from slewctl.errors import InputError, check_each, check_number, shown

# Up to this many, moments of inertia of the profile are integrated exactly (`basis.inertia`).
_MOST_COEFFICIENTS = 62


@dataclass(frozen=True)
class Stations:
    """A property tabulated at stations along the beam, linear between them.

    Parameters
    ----------
    x : sequence of float
        Stations in metres from the clamp, not decreasing, from 0 to the beam's
        length.  A station given twice makes a step there.
    values : sequence of float
        The property at each station.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Stations([0.0, 0.5, 1.0], [40.0, 30.0, 10.0]).x
    (0.0, 0.5, 1.0)
    """

    x: tuple[float, ...]
    values: tuple[float, ...]

    def __init__(self, x: Sequence[float], values: Sequence[float]) -> None:
        object.__setattr__(self, "x", _numbers(x, "stations.x"))
        object.__setattr__(self, "values", _numbers(values, "stations.values"))
        if len(self.x) != len(self.values) or len(self.x) < 2:
            raise InputError(
                f"{len(self.x)} stations with {len(self.values)} values",
                where="stations",
                remedy="give at least two stations and one value for each",
            )
        here, after = np.array(self.x[:-1]), np.array(self.x[1:])
        wrong, repeated = after < here, after == here
        wrong[1:] |= repeated[1:] & repeated[:-1]
        wrong[[0, -1]] |= repeated[[0, -1]]
        if wrong.any():
            first = int(np.argmax(wrong))
            raise InputError(
                f"stations do not increase: {after[first]:g} m follows {here[first]:g} m",
                where=f"stations.x.{first + 1}",
                remedy="sort them; repeat an inner station once to make a step",
            )


def _numbers(values: object, name: str) -> tuple[float, ...]:
    """Return a sequence or array of numbers as a tuple of floats."""
    if not isinstance(values, Sequence | np.ndarray) or isinstance(values, str):
        raise InputError(
            f"{shown(values)} is not a list of numbers", where=name, remedy="give a list"
        )
    return check_each(values, name, check_number)


ProfileSpec = float | Sequence[float] | Stations | Callable[[Array], Array]


class Profile(ABC):
    """A positive property along the beam as a function of ``xi = x/L`` in [0, 1]."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner points where the profile has a kink or a step."""
        return ()

    @property
    def degree(self) -> int | None:
        """Degree of the polynomial between breakpoints; None when it isn't one."""
        return None

    @abstractmethod
    def __call__(self, xi: Array) -> Array:
        """Return the values at `xi`, an array of any shape."""

    @abstractmethod
    def minimum(self) -> float:
        """Return the smallest value over the beam."""

    @abstractmethod
    def bound(self) -> float:
        """Return a bound of the values over the beam."""


@dataclass(frozen=True)
class _Power(Profile):
    coefficients: tuple[float, ...]

    @property
    def degree(self) -> int:
        return len(self.coefficients) - 1

    def __call__(self, xi: Array) -> Array:
        return np.asarray(PowerSeries(self.coefficients)(xi), dtype=float)

    def minimum(self) -> float:
        # Leading coefficients near zero put a root beyond the largest number; it is not
        # on the beam.
        with np.errstate(all="ignore"):
            stationary = PowerSeries(self.coefficients).deriv().roots()
        inner = stationary[np.abs(stationary.imag) < 1e-9].real
        at = np.concatenate([[0.0, 1.0], inner[(inner > 0) & (inner < 1)]])
        return float(self(at).min())

    def bound(self) -> float:
        return float(np.sum(np.abs(self.coefficients)))


@dataclass(frozen=True)
class _Tabulated(Profile):
    stations: Stations
    length: float

    @property
    def degree(self) -> int:
        return 1

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return tuple(sorted({x / self.length for x in self.stations.x[1:-1]}))

    def __call__(self, xi: Array) -> Array:
        return np.interp(xi * self.length, self.stations.x, self.stations.values)

    def minimum(self) -> float:
        return min(self.stations.values)

    def bound(self) -> float:
        return max(self.stations.values)


@dataclass(frozen=True)
class _Sampled(Profile):
    function: Callable[[Array], Array]
    length: float
    name: str

    def __call__(self, xi: Array) -> Array:
        x = np.asarray(xi * self.length, dtype=float)
        found = np.asarray(self.function(x))
        if found.dtype.kind not in "fiu" or found.shape not in ((), x.shape):
            raise InputError(
                f"the function returns {shown(found)} for {x.size} points",
                where=self.name,
                remedy="return one real number for each x",
            )
        values = np.broadcast_to(found.astype(float), x.shape)
        if not np.all(values > 0) or not np.all(np.isfinite(values)):
            bad = x[~((values > 0) & np.isfinite(values))][0]
            raise InputError(
                f"the function is not positive and finite at x = {bad:.6g} m",
                where=self.name,
                remedy=f"make it so for 0 <= x <= {self.length:g} m",
            )
        return values

    def minimum(self) -> float:
        return float(self(np.linspace(0.0, 1.0, 1001)).min())

    def bound(self) -> float:
        return float(self(np.linspace(0.0, 1.0, 1001)).max())


def as_profile(spec: ProfileSpec, length: float, name: str) -> Profile:
    """Return the `Profile` that `spec` describes on a beam of the given length.

    Parameters
    ----------
    spec : float, sequence of float, Stations or callable
        A constant; polynomial coefficients in x/L, lowest power first; a table;
        or a function of x in metres that takes and returns an array.
    length : float
        Length of the beam in metres.
    name : str
        What the profile is, for error messages.

    Raises
    ------
    InputError
        If it is not positive everywhere, or a table does not cover the beam.
    """
    profile = _convert(spec, length, name)
    lowest = profile.minimum()
    if not lowest > 0:
        at = f".values.{spec.values.index(lowest)}" if isinstance(spec, Stations) else ""
        raise InputError(
            f"falls to {lowest:g} on the beam",
            where=f"{name}{at}",
            remedy="make it positive everywhere",
        )
    check_size(lowest, name)
    check_size(profile.bound(), name)
    return profile


def _convert(spec: ProfileSpec, length: float, name: str) -> Profile:
    if isinstance(spec, Stations):
        tolerance = 1e-12 * length
        if abs(spec.x[0]) > tolerance or abs(spec.x[-1] - length) > tolerance:
            raise InputError(
                f"stations run from {spec.x[0]:g} to {spec.x[-1]:g} m but the beam from 0 to "
                f"{length:g} m",
                where=name,
                remedy="make the first station 0 and the last the beam's length",
            )
        return _Tabulated(spec, length)
    if callable(spec):
        return _Sampled(spec, length, name)
    if isinstance(spec, Sequence) and not isinstance(spec, str):
        if len(spec) == 0:
            raise InputError("no coefficients", where=name, remedy="give at least one")
        if len(spec) > _MOST_COEFFICIENTS:
            raise InputError(
                f"{len(spec)} coefficients, where {_MOST_COEFFICIENTS} are the most",
                where=name,
                remedy="give a table of stations: so many powers of x/L are not told apart",
            )
        return _Power(check_each(_numbers(spec, name), name, _coefficient))
    return _Power((_coefficient(spec, name),))


def _coefficient(value: object, name: str) -> float:
    """Return a coefficient, which may be negative, within the sizes of an arm."""
    number = check_number(value, name)
    check_size_or_zero(abs(number), name)
    return number
