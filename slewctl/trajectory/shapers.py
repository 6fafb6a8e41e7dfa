"""Input shapers: a few impulses that a command is convolved with, and what a mode keeps of them.

The residual vibration of impulses A_k at t_k (ΣA_k = 1, the last at t_n) in a mode of natural
frequency ω and ratio ζ is, as a part of what one impulse at t_n would leave,

    e^{-ζω t_n} |Σ A_k e^{(ζω + iω√(1-ζ²)) t_k}|        (Singer and Seering 1990)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import exp, pi, sqrt

import numpy as np

from slewctl._show import Tabular
from slewctl._types import Array
from slewctl.errors import (
    InputError,
    check_choice,
    check_number,
    check_positive,
    check_types,
    shown,
)
from slewctl.trajectory.profiles import Profile

# Impulses closer than this part of the shaper's duration are one.
_TOGETHER = 1e-12
# The residual that EI shapers allow at most, as in Singhose's papers.
TOLERANCE = 0.05


@dataclass(frozen=True)
class Mode:
    """A mode that a command shall not excite.

    Parameters
    ----------
    frequency : float
        Natural (undamped) frequency in rad/s.
    ratio : float
        Damping ratio, 0 <= ratio < 1.
    """

    frequency: float
    ratio: float = 0.0

    def __post_init__(self) -> None:
        check_positive(self.frequency, "mode.frequency")
        if not 0 <= check_number(self.ratio, "mode.ratio") < 1:
            raise InputError(
                f"{self.ratio:g} is not a damping ratio of a mode that vibrates",
                where="mode.ratio",
                remedy="give 0 <= ratio < 1",
            )

    @property
    def damped(self) -> float:
        """Damped frequency ω√(1-ζ²) in rad/s."""
        return self.frequency * sqrt((1 - self.ratio) * (1 + self.ratio))

    @property
    def half_period(self) -> float:
        """Half the damped period in s."""
        return pi / self.damped

    @property
    def fade(self) -> float:
        """What is left of an amplitude after half a damped period."""
        return exp(-self.ratio * self.frequency * self.half_period)


@dataclass(frozen=True)
class Shaper:
    """Impulses that a command is convolved with; they sum to one.

    Parameters
    ----------
    name : str
    times : tuple of float
        In s, increasing, the first 0.
    amplitudes : tuple of float
    """

    name: str
    times: tuple[float, ...]
    amplitudes: tuple[float, ...]

    @property
    def duration(self) -> float:
        """What the shaper adds to the time of a command, in s."""
        return self.times[-1]

    def residual(self, frequency: float | Array, ratio: float = 0.0) -> Array:
        """Return the residual vibration in modes of natural frequencies in rad/s.

        Parameters
        ----------
        frequency : float or ndarray
        ratio : float
            Damping ratio of them all.

        Returns
        -------
        ndarray
            Of the shape of `frequency`; 1 is that of the unshaped impulse.
        """
        w = np.asarray(frequency, dtype=float)[..., np.newaxis]
        pole = ratio * w + 1j * w * sqrt(1 - ratio**2)
        # Counted from the last impulse, nothing grows.
        return np.abs(np.exp(pole * (np.array(self.times) - self.duration)) @ self.amplitudes)

    def command(self, profile: Profile, t: Array) -> tuple[Array, Array, Array]:
        """Return angle, rate and acceleration of the shaped profile at times t."""
        moved = [np.asarray(profile.at(np.asarray(t, dtype=float) - at)) for at in self.times]
        angle, rate, acceleration = np.tensordot(np.array(self.amplitudes), np.array(moved), 1)
        return angle, rate, acceleration

    def require_within(self, duration: float) -> None:
        """Refuse a slew that has no time for the shaper.

        Parameters
        ----------
        duration : float
            Time in s that the slew may take, shaper and all.

        Raises
        ------
        InputError
            If the shaper is as long; it says how long the slew must be.
        """
        if self.duration >= check_positive(duration, "duration"):
            raise InputError(
                f"the {self.name} shaper takes {self.duration:.4g} s, the slew {duration:g} s",
                where="duration",
                remedy=f"give more than {self.duration:.6g} s, or a shorter shaper",
            )

    def convolved(self, other: Shaper) -> Shaper:
        """Return one shaper after the other: it has the zeros of both."""
        times = np.add.outer(self.times, other.times).ravel()
        amplitudes = np.multiply.outer(self.amplitudes, other.amplitudes).ravel()
        order = np.argsort(times)
        return _merged(f"{self.name} * {other.name}", times[order], amplitudes[order])


@dataclass(frozen=True)
class ShaperRow:
    """A shaper in a few numbers: duration in s, worst residual nominally and over the error."""

    name: str
    duration: float
    residual: float
    residual_off: float
    impulses: int


@dataclass(frozen=True)
class ShaperTable(Tabular):
    """Shapers side by side.

    Attributes
    ----------
    entries : tuple of ShaperRow
    error : float
        Relative error of all frequencies, either way, behind `residual_off`.
    """

    entries: tuple[ShaperRow, ...]
    error: float

    def rows(self) -> list[dict[str, object]]:
        """Return one row a shaper."""
        off = f"residual at ±{100 * self.error:g} %"
        return [
            {"shaper": e.name, "duration (s)": e.duration, "impulses": e.impulses,
             "residual": e.residual, off: e.residual_off}
            for e in self.entries
        ]  # fmt: skip


def _merged(name: str, times: Array, amplitudes: Array) -> Shaper:
    starts = np.flatnonzero(np.diff(times, prepend=-np.inf) > _TOGETHER * times[-1])
    summed = np.add.reduceat(amplitudes, starts)
    return Shaper(name, tuple(times[starts].tolist()), tuple(summed.tolist()))


def _two_hump(v: float) -> list[float]:
    x = (v**2 * (sqrt(1 - v**2) + 1)) ** (1 / 3)
    outer = (3 * x**2 + 2 * x + 3 * v**2) / (16 * x)
    return [outer, 0.5 - outer, 0.5 - outer, outer]


def _three_hump(v: float) -> list[float]:
    outer, inner = (1 + 3 * v + 2 * sqrt(2 * v * (v + 1))) / 16, (1 - v) / 4
    return [outer, inner, 1 - 2 * (outer + inner), inner, outer]


# Amplitudes for an undamped mode, half a period apart, by the residual that is allowed.
_HALF_PERIODS: dict[str, Callable[[float], list[float]]] = {
    "zv": lambda v: [0.5, 0.5],
    "zvd": lambda v: [0.25, 0.5, 0.25],
    "ei": lambda v: [(1 + v) / 4, (1 - v) / 2, (1 + v) / 4],
    "ei2": _two_hump,
    "ei3": _three_hump,
}
# Those with a residual at the design frequency, or beside it, that is chosen.
_TOLERANT = {"ei", "ei2", "ei3"}
SHAPERS = ("zv", "mzv", "zvd", "ei", "ei2", "ei3")


def shaper(kind: str, modes: Mode | Sequence[Mode], tolerance: float = TOLERANCE) -> Shaper:
    """Return a classical shaper, of several modes the convolution of one for each.

    Parameters
    ----------
    kind : {"zv", "mzv", "zvd", "ei", "ei2", "ei3"}
        Zero vibration; with three impulses three eighths of a period apart; with zero slope;
        extra-insensitive with one, two and three humps.
    modes : Mode or sequence of Mode
    tolerance : float
        The residual that the EI shapers allow, between 0 and 1.

    Returns
    -------
    Shaper

    Raises
    ------
    InputError
        For another kind, no mode, a tolerance that the damping alone already meets, or one
        where none means anything.

    Notes
    -----
    For a damped mode the impulse after k half periods is fade^k times its undamped amplitude,
    normalised to the sum one.  Zeros stay zeros, and the tolerance that the amplitudes are made
    for is raised until the residual is the one asked for: EI and three-hump EI then have it
    exactly at the design frequency.  (Singer and Seering 1990; Singhose, Seering, Singer 1994.)

    Examples
    --------
    >>> from slewctl.trajectory.shapers import Mode, shaper
    >>> shaper("zvd", Mode(6.283185307179586)).times
    (0.0, 0.5, 1.0)
    """
    check_choice(kind, SHAPERS, "shaper")
    several = [modes] if isinstance(modes, Mode) else check_types(modes, Mode, "modes")
    if tolerance != TOLERANCE and not kind.startswith("ei"):
        raise InputError(
            f"{kind} allows no residual", where="tolerance", remedy="leave it out, or take ei"
        )
    if not 0 < check_number(tolerance, "tolerance") < 1:
        raise InputError(
            f"{tolerance:g} is no residual", where="tolerance", remedy="give 0 < tolerance < 1"
        )
    found = reduce(Shaper.convolved, [_single(kind, mode, tolerance) for mode in several])
    return Shaper(kind, found.times, found.amplitudes)


def compare_shapers(
    shapers: Sequence[Shaper], modes: Sequence[Mode], error: float = 0.1
) -> ShaperTable:
    """Return durations and worst residuals of shapers side by side.

    Parameters
    ----------
    shapers : sequence of Shaper
    modes : sequence of Mode
        The residual told is that of the worst of them.
    error : float
        Relative error of all frequencies at once, either way.

    Returns
    -------
    ShaperTable

    Raises
    ------
    InputError
        For an error that is not between 0 and 1, no shaper or no mode.

    Examples
    --------
    >>> import slewctl as sc
    >>> modes = [sc.Mode(12.0, 0.01)]
    >>> table = sc.compare_shapers([sc.shaper("zv", modes), sc.shaper("zvd", modes)], modes)
    >>> [f"{row.name} {row.residual_off:.3f}" for row in table.entries]
    ['zv 0.154', 'zvd 0.024']
    """
    check_error(error, "error")
    modes, entries = check_types(modes, Mode, "modes"), []
    for one in check_types(shapers, Shaper, "shapers"):
        left = np.array([
            one.residual(mode.frequency * np.array([1, 1 - error, 1 + error]), mode.ratio)
            for mode in modes
        ]).max(axis=0)  # fmt: skip
        entries.append(
            ShaperRow(one.name, one.duration, left[0], float(left[1:].max()), len(one.times))
        )
    return ShaperTable(tuple(entries), error)


def check_order(order: object) -> None:
    """Refuse an order that is neither 1 nor 2."""
    if type(order) is not int or order not in (1, 2):
        raise InputError(f"{shown(order)} is no order", where="order", remedy="give 1 or 2")


def check_error(error: object, where: str) -> float:
    """Return a relative error of frequencies; refuse one that is not between 0 and 1.

    Parameters
    ----------
    error : object
    where : str
        For the message.
    """
    if not 0 < check_number(error, where) < 1:
        raise InputError(
            f"{error:g} is no error of a frequency", where=where, remedy="give 0 < error < 1"
        )
    return float(error)  # type: ignore[arg-type]


def _single(kind: str, mode: Mode, tolerance: float) -> Shaper:
    if kind == "mzv":
        fade = mode.fade ** (3 / 4)
        amplitudes = np.array([1 - sqrt(0.5), (sqrt(2) - 1) * fade, (1 - sqrt(0.5)) * fade**2])
        times = 0.75 * mode.half_period * np.arange(3.0)
        return _merged(kind, times, amplitudes / amplitudes.sum())
    if kind in _TOLERANT:
        tolerance = _raised(kind, mode, tolerance)
    amplitudes = _faded(kind, mode, tolerance)
    times = mode.half_period * np.arange(float(len(amplitudes)))
    return _merged(kind, times, amplitudes / amplitudes.sum())


def _faded(kind: str, mode: Mode, tolerance: float) -> Array:
    undamped = np.array(_HALF_PERIODS[kind](tolerance))
    return undamped * mode.fade ** np.arange(len(undamped))


def _raised(kind: str, mode: Mode, wanted: float) -> float:
    """Return the tolerance of the undamped amplitudes that leaves `wanted` after fading."""
    from scipy.optimize import brentq  # slow to load: not before it is wanted

    def beyond(tolerance: float) -> float:
        faded = _faded(kind, mode, tolerance)
        return float(tolerance * mode.fade ** (len(faded) - 1) / faded.sum()) - wanted

    if mode.ratio == 0:
        return wanted
    if beyond(1.0) <= 0:
        raise InputError(
            f"a damping ratio of {mode.ratio:g} leaves less than {wanted:g} by itself",
            where="tolerance",
            remedy=f"give less than {beyond(1.0) + wanted:.3g}, or shape no such mode",
        )
    return float(brentq(beyond, wanted, 1.0, xtol=1e-15, rtol=1e-14))
