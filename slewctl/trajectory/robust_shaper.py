"""Shapers by linear programming that hold a residual over a band of frequencies.

Impulses on a grid of times, none negative, their sum one, the earliest centre of mass: a linear
program.  The residual of a frequency is a point that shall lie in a circle; wherever it lies
outside, the tangent that it crosses is added, and the program solved again (Kelley's cutting
planes), so that what has no solution has none with the circle either.  The shortest grid that
has one is found by bisection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError, InputError, check_number, check_positive, check_types
from slewctl.trajectory.fewest import fewest
from slewctl.trajectory.shapers import TOLERANCE, Mode, Shaper

# Frequencies at which a band is looked at, for each turn of the phase across it and at least.
_A_TURN, _LEAST = 300, 101
# Every so manieth of them is held from the beginning, in so many directions.
_FIRST, _SIDES = 20, 4
# Frequencies beside a highest one, where it may be higher.
_FINER = 9
# What the limit is lowered by for what lies between them, the overshoot that ends the search,
# both relative, and its rounds at most.
_BETWEEN, _ROOM, _CUTS = 2e-4, 1e-5, 60
# Smaller residuals are beyond what the linear programs are solved to.
_SMALLEST = 1e-6
# Impulses of less than this, in units of the tolerance, are none.
_NONE = 1e-8
# A shaper of so many times its first guess is not sought.
_DOUBLINGS = 6
# Samples in half the shortest period without a clock of its own.
_SAMPLES = 12


@dataclass(frozen=True)
class Band:
    """Frequencies between which a mode may lie.

    Parameters
    ----------
    low, high : float
        Natural frequencies in rad/s.
    ratio : float
        Damping ratio, 0 <= ratio < 1.

    Raises
    ------
    InputError
        For frequencies that are not positive, or in the wrong order.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Band(9.0, 11.0).centre
    10.0
    """

    low: float
    high: float
    ratio: float = 0.0

    def __post_init__(self) -> None:
        check_positive(self.low, "band.low")
        if check_positive(self.high, "band.high") < self.low:
            raise InputError(
                f"{self.high:g} is below {self.low:g}",
                where="band.high",
                remedy="give the lower frequency first",
            )
        if not 0 <= check_number(self.ratio, "band.ratio") < 1:
            raise InputError(
                f"{self.ratio:g} is not a damping ratio of a mode that vibrates",
                where="band.ratio",
                remedy="give 0 <= ratio < 1",
            )

    @classmethod
    def around(cls, frequency: float, deviation: float, ratio: float = 0.0) -> Band:
        """Return the band of a fitted frequency, two standard deviations either way.

        Parameters
        ----------
        frequency, deviation : float
            In rad/s, as 2π times a `Root.frequency_hz` of a fit and its deviation.
        ratio : float
            Damping ratio.
        """
        size = 2 * check_positive(deviation, "band.deviation")
        return cls(frequency - size, frequency + size, ratio)

    @property
    def centre(self) -> float:
        """The frequency in the middle, in rad/s."""
        return (self.low + self.high) / 2

    def frequencies(self, count: int) -> Array:
        """Return so many frequencies from end to end."""
        return np.linspace(self.low, self.high, count)


def bands_of(modes: Sequence[Mode], error: float) -> list[Band]:
    """Return the bands of modes whose frequencies may be off by so much, relative.

    Parameters
    ----------
    modes : sequence of Mode
    error : float

    Examples
    --------
    >>> from slewctl.trajectory.shapers import Mode
    >>> bands_of([Mode(10.0)], 0.5)[0].high
    15.0
    """
    return [Band((1 - error) * m.frequency, (1 + error) * m.frequency, m.ratio) for m in modes]


def robust_shaper(
    bands: Sequence[Band], *, tolerance: float = TOLERANCE, sample_time: float | None = None
) -> Shaper:
    """Return the shortest shaper on a grid of times that leaves little over bands of frequencies.

    Parameters
    ----------
    bands : sequence of Band
    tolerance : float
        Largest residual anywhere in them, at least 1e-6 and less than 1.
    sample_time : float, optional
        Of the grid in s, a controller's clock; by default a twelfth of half the shortest
        period.

    Returns
    -------
    Shaper
        No impulse is negative.

    Raises
    ------
    InputError
        For no band, an impossible tolerance, or a clock that is too slow for a band.
    AccuracyError
        If the residual, computed anew on a finer grid of frequencies, is larger than allowed.

    Examples
    --------
    >>> import slewctl as sc
    >>> robust = sc.robust_shaper([sc.Band(10.0, 14.0)], sample_time=0.01)
    >>> bool(robust.residual(12.5) <= 0.05), robust.duration < 0.53
    (True, True)
    """
    bands = check_types(bands, Band, "bands")
    if not _SMALLEST <= check_number(tolerance, "tolerance") < 1:
        raise InputError(
            f"{tolerance:g} is no residual that can be held",
            where="tolerance",
            remedy=f"give {_SMALLEST:g} <= tolerance < 1",
        )
    fastest = pi / max(band.high for band in bands)
    step = fastest / _SAMPLES if sample_time is None else check_positive(sample_time, "sample_time")
    if step > fastest / 2:
        raise InputError(
            f"{step:g} s is too slow for a mode of {1 / (2 * fastest):.4g} Hz",
            where="sample_time",
            remedy=f"take at most {0.999 * fastest / 2:.4g} s",
        )
    found = _shortest(bands, tolerance * (1 - _BETWEEN), step)
    left = max(
        float(found.residual(b.frequencies(4 * _count(b, found.duration)), b.ratio).max())
        for b in bands
    )
    if left > tolerance:
        raise AccuracyError(
            f"the residual is {left:.4g} between the frequencies of the program",
            where="robust_shaper",
            remedy="allow a little more, or give narrower bands",
        )
    return found


def _count(band: Band, duration: float) -> int:
    turns = (band.high - band.low) * duration / (2 * pi)
    return max(_LEAST, ceil(_A_TURN * turns)) if band.high > band.low else 1


def _shortest(bands: Sequence[Band], tolerance: float, step: float) -> Shaper:
    first = ceil(sum(pi / band.low for band in bands) / step) + 1
    found = fewest(lambda n: _impulses(n, bands, tolerance, step), first, _DOUBLINGS)
    if found is None:
        raise AccuracyError(
            f"no shaper of {first * 2 ** (_DOUBLINGS - 1) * step:.4g} s was found",
            where="robust_shaper",
            remedy="allow a larger tolerance, or give narrower bands",
        )
    kept = np.flatnonzero(found > _NONE * tolerance)
    amplitudes = found[kept] / found[kept].sum()
    times = step * (kept - kept[0])
    return Shaper("robust", tuple(times.tolist()), tuple(amplitudes.tolist()))


def _impulses(samples: int, bands: Sequence[Band], tolerance: float, step: float) -> Array | None:
    """Return impulses at 0, …, `samples` steps within the tolerance, if there are."""
    from scipy.optimize import linprog  # slow to load: not before it is wanted

    back = step * np.arange(-samples, 1.0)
    grids = [band.frequencies(_count(band, samples * step)) for band in bands]
    waves = [_waves(band, w, back) for band, w in zip(bands, grids, strict=True)]
    turns = np.exp(2j * pi * np.arange(_SIDES) / _SIDES)[:, None, None]
    rows = [
        (turns * wave[np.unique([*range(0, len(wave), _FIRST), len(wave) - 1])]).real
        for wave in waves
    ]
    limits = np.vstack([row.reshape(-1, len(back)) for row in rows])
    for _ in range(_CUTS):
        # In units of the tolerance, for the solver's own is absolute.
        found = linprog(
            step * np.arange(samples + 1.0), A_ub=limits / tolerance, b_ub=np.ones(len(limits)),
            A_eq=np.ones((1, len(back))), b_eq=np.ones(1), bounds=(0, None), method="highs",
        )  # fmt: skip
        if found.x is None or found.status != 0:
            return None
        tops = [_tops(*each, back, found.x) for each in zip(bands, grids, waves, strict=True)]
        cuts = [_cuts(*top, tolerance * (1 + _ROOM)) for top in tops]
        if not any(len(cut) for cut in cuts):
            return np.asarray(found.x, dtype=float)
        limits = np.vstack([limits, *cuts])
    return None


def _waves(band: Band, frequencies: Array, back: Array) -> ComplexArray:
    """Return what an impulse at each time leaves at the end, shape (frequencies, times)."""
    pole = (band.ratio + 1j * np.sqrt(1 - band.ratio**2)) * frequencies
    return np.asarray(np.exp(pole[:, None] * back))


def _tops(
    band: Band, grid: Array, waves: ComplexArray, back: Array, impulses: Array
) -> tuple[ComplexArray, ComplexArray]:
    """Return waves and residuals at the highest of each run of frequencies, between them too."""
    size = np.abs(waves @ impulses)
    higher = np.concatenate([[True], size[1:] > size[:-1]])
    higher &= np.concatenate([size[:-1] >= size[1:], [True]])
    apart = grid[1] - grid[0] if len(grid) > 1 else 0.0
    near = grid[higher, None] + apart * np.linspace(-1, 1, _FINER)
    fine = _waves(band, np.clip(near, band.low, band.high).ravel(), back)
    left = (fine @ impulses).reshape(near.shape)
    at = np.arange(len(near)) * _FINER + np.abs(left).argmax(axis=1)
    return fine[at], left.ravel()[at]


def _cuts(waves: ComplexArray, left: ComplexArray, limit: float) -> Array:
    """Return the tangents that residuals cross."""
    beyond = np.abs(left) > limit
    left = left[beyond]
    return np.asarray((np.conj(left / np.abs(left))[:, None] * waves[beyond]).real)
