"""Rest-to-rest turns: angle, rate and acceleration at any time, with exact derivatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import product
from math import expm1, hypot, log1p, sqrt

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, check_nonnegative, check_number, check_positive

# Angle, rate and acceleration of the minimum-jerk turn by powers of t/duration.
MINIMUM_JERK = ((0, 0, 0, 10, -15, 6), (0, 0, 30, -60, 30, 0), (0, 60, -180, 120, 0, 0))
# Below this the difference x + expm1(-x) loses digits, and its series has none to lose.
_SERIES = 0.05
# A time that is told in six digits, and shall suffice.
_ROUNDED_UP = 1 + 1e-5


class Profile(ABC):
    """A turn from rest to rest; before it the angle is 0, after it the whole angle."""

    angle: float

    @property
    @abstractmethod
    def duration(self) -> float:
        """Time of the turn in s."""

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times in s at which the acceleration, or its slope, may jump."""
        return (0.0, self.duration)

    @abstractmethod
    def _inside(self, t: Array) -> tuple[Array, Array, Array]:
        """Return angle, rate and acceleration at times between 0 and the duration."""

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return angle (rad), rate (rad/s) and acceleration (rad/s²) at times t in s.

        Where the acceleration jumps, it is that of one of the two sides.
        """
        t = np.asarray(t, dtype=float)
        inside = (t >= 0) & (t <= self.duration)
        angle, rate, acceleration = self._inside(np.clip(t, 0.0, self.duration))
        return angle, np.where(inside, rate, 0.0), np.where(inside, acceleration, 0.0)


@dataclass(frozen=True)
class _Timed(Profile):
    angle: float
    duration_s: float

    def __post_init__(self) -> None:
        _check_angle(self.angle)
        check_positive(self.duration_s, "duration_s")

    @property
    def duration(self) -> float:
        """Time of the turn in s."""
        return self.duration_s

    @property
    @abstractmethod
    def peak_acceleration(self) -> float:
        """Largest |acceleration| in rad/s²."""

    def require_torque(self, inertia: float, limit: float) -> None:
        """Refuse a turn that a rigid arm without friction cannot make.

        Parameters
        ----------
        inertia : float
            Of the whole arm about its axis, in kg·m².
        limit : float
            Largest torque in N·m.

        Raises
        ------
        InputError
            If the turn needs more; it says how long the turn must take.
        """
        needed = check_positive(inertia, "inertia") * self.peak_acceleration
        if needed > check_positive(limit, "limit"):
            least = self.duration_s * sqrt(needed / limit) * _ROUNDED_UP
            raise InputError(
                f"{self.duration_s:g} s needs {needed:.4g} N·m, the limit is {limit:g}",
                where="duration_s",
                remedy=f"take at least {least:.6g} s",
            )


@dataclass(frozen=True)
class MinimumJerk(_Timed):
    """A turn along the quintic polynomial of least integrated squared jerk.

    Parameters
    ----------
    angle : float
        Angle turned in rad, not zero.
    duration_s : float
    """

    @property
    def peak_acceleration(self) -> float:
        """Largest |acceleration| in rad/s²."""
        return 10 / sqrt(3) * abs(self.angle) / self.duration_s**2

    def _inside(self, t: Array) -> tuple[Array, Array, Array]:
        return minimum_jerk(t, self.angle, self.duration_s)


@dataclass(frozen=True)
class Versine(_Timed):
    """A turn whose rate is a versine, 1 - cos(2πt/T).

    Parameters
    ----------
    angle : float
        Angle turned in rad, not zero.
    duration_s : float
    """

    @property
    def peak_acceleration(self) -> float:
        """Largest |acceleration| in rad/s²."""
        return 2 * np.pi * abs(self.angle) / self.duration_s**2

    def _inside(self, t: Array) -> tuple[Array, Array, Array]:
        w, rate = 2 * np.pi / self.duration_s, self.angle / self.duration_s
        x = w * t
        return rate * (t - np.sin(x) / w), rate * (1 - np.cos(x)), rate * w * np.sin(x)


@dataclass(frozen=True)
class SCurve(Profile):
    """The fastest turn within limits of rate, acceleration and jerk; a trapezoid without the last.

    The rate is a box filtered by two moving averages, of which the second is as long as the
    jerk lasts; a limit that the turn is too short to reach is not reached.

    Parameters
    ----------
    angle : float
        Angle turned in rad, not zero.
    max_rate, max_acceleration : float
        rad/s and rad/s².
    max_jerk : float, optional
        rad/s³; without it the rate is a trapezoid.
    """

    angle: float
    max_rate: float
    max_acceleration: float
    max_jerk: float | None = None

    def __post_init__(self) -> None:
        _check_angle(self.angle)
        check_positive(self.max_rate, "max_rate")
        check_positive(self.max_acceleration, "max_acceleration")
        if self.max_jerk is not None:
            check_positive(self.max_jerk, "max_jerk")

    @property
    def widths(self) -> tuple[float, float, float]:
        """Widths in s of the three boxes whose convolution is the rate; 0 for none."""
        size, v, a, j = abs(self.angle), self.max_rate, self.max_acceleration, self.max_jerk
        jerking = 0.0 if j is None else a / j
        second = v / a
        if j is not None and second < jerking:
            second = jerking = sqrt(v / j)
        if size / v >= second + jerking:
            return size / v, second, jerking
        # The rate's limit is not reached: nothing lies between speeding up and slowing down.
        jerking = 0.0 if j is None else a / j
        second = size / a / (jerking / 2 + hypot(jerking / 2, sqrt(size / a)))
        if j is not None and second < jerking:
            second = jerking = (size / 2 / j) ** (1 / 3)
        return second + jerking, second, jerking

    @property
    def duration(self) -> float:
        """Time of the turn in s."""
        return sum(self.widths)

    @property
    def kinks(self) -> tuple[float, ...]:
        """Where one of the boxes begins or ends."""
        chosen = product((0, 1), repeat=len(self.widths))
        return tuple(sorted({float(np.dot(c, self.widths)) for c in chosen}))

    def _inside(self, t: Array) -> tuple[Array, Array, Array]:
        end = self.duration
        late = t > end / 2  # the second half is the first one backwards: nothing cancels
        t = np.where(late, end - t, t)
        angle, rate, acceleration = self._risen(t)
        # At the full rate, once it is reached, nothing is left to cancel either.
        first, rising = self.widths[0], sum(self.widths[1:])
        cruising, full = (t >= rising) & (t <= first), self.angle / first
        angle = np.where(cruising, full * (t - rising / 2), angle)
        rate = np.where(cruising, full, rate)
        acceleration = np.where(cruising, 0.0, acceleration)
        return (
            np.where(late, self.angle - angle, angle),
            rate,
            np.where(late, -acceleration, acceleration),
        )

    def _risen(self, t: Array) -> tuple[Array, Array, Array]:
        widths = [width for width in self.widths if width > 0]
        order, size = len(widths), self.angle / float(np.prod(widths))
        found = [np.zeros(t.shape) for _ in range(3)]
        for chosen in product((0, 1), repeat=order):
            since = t - float(np.dot(chosen, widths))
            after = (since >= 0) * size * (-1) ** sum(chosen)
            for derivative, total in enumerate(found):
                power = order - derivative
                total += after * since**power / np.prod(np.arange(1, power + 1))
        return found[0], found[1], found[2]


@dataclass(frozen=True)
class RigidTimeOptimal(Profile):
    """The fastest turn of a rigid arm under a torque limit: full torque, then full braking.

    J θ̈ + c θ̇ = ±limit.  With z = c²·angle/(limit·J) and s = √(1 - e^{-z}) the arm is braked for
    (J/c) ln(1 + s) and driven for -(J/c) ln(1 - s), which is (J/c) z longer.

    Parameters
    ----------
    angle : float
        Angle turned in rad, not zero.
    torque_limit : float
        N·m.
    inertia : float
        Of the whole arm about its axis, in kg·m².
    friction : float
        Viscous friction c in N·m·s.
    """

    angle: float
    torque_limit: float
    inertia: float
    friction: float = 0.0

    def __post_init__(self) -> None:
        _check_angle(self.angle)
        check_positive(self.torque_limit, "torque_limit")
        check_positive(self.inertia, "inertia")
        check_nonnegative(self.friction, "friction")

    @property
    def phases(self) -> tuple[float, float]:
        """Times in s of driving and of braking."""
        z = self.friction**2 * abs(self.angle) / self.torque_limit / self.inertia
        half = sqrt(abs(self.angle) / self.torque_limit) * sqrt(self.inertia)
        s = sqrt(-expm1(-z))
        # (J/c) ln(1 + s) as factors near 1: where z underflows it has no digits left.
        braking = half * sqrt(-expm1(-z) / z) * (log1p(s) / s) if z > 0 else half
        return self.friction * abs(self.angle) / self.torque_limit + braking, braking

    @property
    def duration(self) -> float:
        """Time of the turn in s."""
        return sum(self.phases)

    @property
    def kinks(self) -> tuple[float, ...]:
        """Start, switch and end."""
        return (0.0, self.phases[0], self.duration)

    def _inside(self, t: Array) -> tuple[Array, Array, Array]:
        driven = self.phases[0]
        early, late = np.minimum(t, driven), np.maximum(t - driven, 0.0)
        sign = np.sign(self.angle) * self.torque_limit / self.inertia
        decay = np.exp(-self.friction / self.inertia * late)
        one, two = self._steps(early)
        back_one, back_two = self._steps(late)
        # The rate at the switch coasts on against the friction, and the braking is added.
        rate = sign * (one * decay - back_one)
        angle = sign * (two + one * back_one - back_two)
        torque = np.where(t <= driven, sign, -sign)
        return angle, rate, torque - self.friction / self.inertia * rate

    def _steps(self, t: Array) -> tuple[Array, Array]:
        """Return rate and angle after unit drive for t: t φ₁(-x) and t² φ₂(-x), x = ct/J."""
        x = self.friction / self.inertia * t
        safe = np.where(x > _SERIES, x, 1.0)
        one = np.where(x > _SERIES, -np.expm1(-safe) / safe, _series(x, 1))
        two = np.where(x > _SERIES, (safe + np.expm1(-safe)) / safe**2, _series(x, 2))
        return t * one, t**2 * two


def minimum_jerk(t: Array, angle: float, duration: float) -> tuple[Array, Array, Array]:
    """Return angle, rate and acceleration of a minimum-jerk turn at times t, held outside it."""
    s = np.clip(t / duration, 0.0, 1.0)
    return (
        angle * s**3 * (10 - 15 * s + 6 * s**2),
        angle / duration * 30 * s**2 * (1 - s) ** 2,
        angle / duration / duration * 60 * s * (1 - s) * (1 - 2 * s),
    )


def _series(x: Array, first: int) -> Array:
    """Return Σ (-x)^k / (k + first)!, to rounding for x up to `_SERIES`."""
    total, term = np.zeros(x.shape), np.full(x.shape, 1.0 / first)
    for k in range(9):
        total = total + term
        term = -term * x / (k + first + 1)
    return total


def _check_angle(angle: float) -> None:
    if check_number(angle, "angle") == 0:
        raise InputError("no turn", where="angle", remedy="give an angle")
