"""Peaks of S and T and the bandwidth of a stable loop: a second opinion beside the intervals.

Nothing is read from a grid: peaks are enclosed by level sets, and the frequencies at which
|S| passes a level are eigenvalues of a Hamiltonian matrix (`slewctl.numerics.hinf_norm`).
"""

from __future__ import annotations

import math

import numpy as np

from slewctl._types import Array
from slewctl.numerics.bilinear import equivalent
from slewctl.numerics.frequency_response import FrequencyResponse, sample_time
from slewctl.numerics.hinf_norm import Peak, level_crossings, peak_gain
from slewctl.numerics.linear_system import LinearSystem

# Where |S| is below this, feedback halves what a disturbance does, in power.
BANDWIDTH_LEVEL = 1 / math.sqrt(2)


def sensitivity(L: LinearSystem) -> LinearSystem:
    """Return S = 1/(1 + L) of a single loop.

    Parameters
    ----------
    L : LinearSystem
        Return ratio, 1 + L(∞) not zero; continuous or sampled.
    """
    A, B, C, D = (np.asarray(getattr(L, name)) for name in "ABCD")
    gain = 1 / (1 + D)
    return LinearSystem(A - B @ gain @ C, B @ gain, -gain @ C, gain, sample_time(L))


def sensitivity_peak(L: LinearSystem) -> Peak:
    """Return Ms = ‖S‖∞ of a stable loop and where it is reached: 1/Ms is min|1 + L|."""
    return peak_gain(sensitivity(L))


def complementary_sensitivity_peak(L: LinearSystem) -> Peak:
    """Return Mt = ‖T‖∞, T = L/(1 + L), of a stable loop and where it is reached."""
    S = sensitivity(L)
    return peak_gain(LinearSystem(S.A, S.B, -S.C, 1 - np.asarray(S.D), sample_time(L)))


def bandwidth(L: LinearSystem) -> float:
    """Return the frequency in rad/s at which |S| first rises through 1/√2.

    Below it feedback acts (S. Skogestad and I. Postlethwaite, "Multivariable Feedback
    Control", 2nd ed., section 2.4.5).  Zero where |S| is larger from the first frequency on,
    infinite where it never rises so far.

    Parameters
    ----------
    L : LinearSystem
        Return ratio of a stable loop, continuous or sampled.
    """
    from scipy.optimize import brentq  # slow to load: not before it is wanted

    S = sensitivity(L)
    response = FrequencyResponse(S)

    def excess(omega: Array | float) -> Array:
        found = np.abs(response(np.atleast_1d(np.asarray(omega, dtype=float))))
        return np.asarray(found - BANDWIDTH_LEVEL)

    if excess(0.0)[0] >= 0:
        return 0.0
    candidates = np.unique(level_crossings(equivalent(S), BANDWIDTH_LEVEL))
    candidates = candidates[candidates > 0]
    if not len(candidates):
        return math.inf
    # Every crossing is near a candidate, so that |S| passes the level at most there between
    # two middles.
    last = response.nyquist if math.isfinite(response.nyquist) else 2 * candidates[-1]
    middles = np.sqrt(candidates[1:] * candidates[:-1])
    points = np.unique(np.concatenate([candidates[:1] / 2, middles, candidates, [last]]))
    values = excess(points)
    rising = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    if not len(rising):
        return math.inf
    low, high = float(points[rising[0]]), float(points[rising[0] + 1])
    ends = float(excess(low)[0]), float(excess(high)[0])
    if ends[0] >= 0 or ends[1] <= 0:  # an eigenvalue that is the crossing, to rounding
        return low if ends[0] >= 0 else high
    return float(brentq(lambda omega: float(excess(omega)[0]), low, high))
