"""The shortest shaper on a controller's clock, for all modes at once."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_positive, check_types
from slewctl.trajectory.fewest import fewest
from slewctl.trajectory.shapers import Mode, Shaper, check_order

# Impulses below this are none: the program's rounding.
_NONE = 1e-12
# What the shaper may leave of a mode at its design frequency.
_LEFT = 1e-8
# Doublings of the length before the program is given up.
_DOUBLINGS = 6


def sampled_shaper(modes: Sequence[Mode], sample_time: float, order: int = 1) -> Shaper:
    """Return the shortest shaper of positive impulses at multiples of the sample time.

    A linear program finds whether impulses on so many samples can leave no vibration; their
    number is bisected.  The zeros are exact on the clock, which those of a classical shaper
    moved to it are not.

    Parameters
    ----------
    modes : sequence of Mode
    sample_time : float
        In s.
    order : {1, 2}
        2 makes the residual's derivative with respect to each frequency vanish as well.

    Returns
    -------
    Shaper

    Raises
    ------
    InputError
        For no mode, another order, or less than two samples in half a period of a mode.
    AccuracyError
        If the residual, computed anew, is not what it should be.

    Examples
    --------
    >>> import slewctl as sc
    >>> found = sc.sampled_shaper([sc.Mode(12.0), sc.Mode(61.0)], sample_time=0.01)
    >>> found.duration < sc.shaper("zv", [sc.Mode(12.0), sc.Mode(61.0)]).duration
    True
    """
    modes = check_types(modes, Mode, "modes")
    check_order(order)
    check_positive(sample_time, "sample_time")
    slowest = min(mode.half_period for mode in modes) / 2
    if sample_time > slowest:
        raise InputError(
            f"{sample_time:g} s is too slow for a mode of {2 * slowest:.4g} s half a period",
            where="sample_time",
            remedy=f"take at most {0.999 * slowest:.4g} s",
        )
    # The convolution of shapers takes `order` half periods of each mode, and a little for the
    # grid: within twice that the program succeeds, or the number is doubled again.
    first = ceil(order * sum(mode.half_period for mode in modes) / sample_time) + 1
    found = fewest(lambda n: _impulses(n, modes, sample_time, order), first, _DOUBLINGS)
    if found is None:
        raise AccuracyError(
            f"no shaper of {first * 2 ** (_DOUBLINGS - 1)} samples was found",
            where="sampled_shaper",
            remedy="leave out a mode, or take another sample_time",
        )
    kept = np.flatnonzero(found > _NONE)
    shaper = Shaper(
        "sampled",
        tuple((kept * sample_time).tolist()),
        tuple((found[kept] / found[kept].sum()).tolist()),
    )
    left = max(float(shaper.residual(mode.frequency, mode.ratio)) for mode in modes)
    if left > _LEFT or kept[0] != 0:
        raise AccuracyError(f"the sampled shaper leaves {left:.2g}", where="sampled_shaper")
    return shaper


def _impulses(samples: int, modes: Sequence[Mode], sample_time: float, order: int) -> Array | None:
    """Return impulses at 0, …, `samples` times the sample time without residual, if there are."""
    from scipy.optimize import linprog  # slow to load: not before it is wanted

    back = sample_time * np.arange(-samples, 1.0)
    rows = [np.ones_like(back)]
    for mode in modes:
        wave = np.exp((mode.ratio * mode.frequency + 1j * mode.damped) * back)
        for power in range(order):
            row = (mode.frequency * back) ** power * wave
            rows += [row.real, row.imag]
    wanted = np.zeros(len(rows))
    wanted[0] = 1.0
    found = linprog(-back, A_eq=np.array(rows), b_eq=wanted, bounds=(0, None),
                    options={"primal_feasibility_tolerance": 1e-10})  # fmt: skip
    return None if found.x is None or found.status != 0 else np.asarray(found.x, dtype=float)
