"""Modulus and disk margins: how near L comes to −1, and in which measure.

The disk of perturbations is that of Seiler, Packard and Gahinet, "An Introduction to Disk
Margins", IEEE Control Systems Magazine 40(5), 2020: factors
f = (1 + (1 − σ)δ/2)/(1 − (1 + σ)δ/2) with |δ| < α.  The loop stands all of them exactly
while α < 1/‖S + (σ − 1)/2‖∞.  σ = 0 is the balanced disk, in S − T; σ = 1 is the disk of
S, whose α is the modulus margin min|1 + L|; σ = −1 that of T.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.crossings import Samples
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.bilinear import Equivalent
from slewctl.numerics.hinf_norm import Peak, enclosed_peak


def nearest(loop: BrokenLoop, samples: Samples, skew: float) -> Peak:
    """Return ‖S + (σ − 1)/2‖∞ and where it is reached; the disk margin is its inverse.

    Raises
    ------
    AccuracyError
        If the level sets do not close in on the peak.
    """
    shift = (skew - 1) / 2

    def sizes(omega: Array) -> Array:
        return _size(loop.response(omega), shift)

    ends = np.array([0.0])
    points = np.concatenate([ends, samples.omega])
    found = np.concatenate([sizes(ends), _size(samples.values, shift)])
    last = Peak(float(_size(np.array([loop.last]), shift)[0]), loop.response.nyquist)
    return enclosed_peak(sizes, _sensitivity(loop.equivalent, shift), points, found, last)


def _size(values: ComplexArray | Array, shift: float) -> Array:
    """Return |1/(1 + L) + shift|, which is |shift| at poles of L."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.abs(np.where(np.isfinite(values), 1 / (1 + values), 0) + shift)


def _sensitivity(loop: Equivalent, shift: float) -> Equivalent:
    """Return S + shift on the axis of `loop`."""
    gain = 1 / (1 + loop.D)
    return Equivalent(
        loop.A - loop.B @ gain @ loop.C,
        loop.B @ gain,
        -gain @ loop.C,
        gain + shift,
        loop.sample_time,
        loop.turn,
    )


def disk_gains(alpha: float, skew: float) -> tuple[float, float]:
    """Return the smallest and largest gain factor of a disk; the largest may be infinite."""
    low, high = 2 - alpha * (1 - skew), 2 - alpha * (1 + skew)
    if np.isinf(alpha):
        return 0.0, np.inf
    least = max(low / (2 + alpha * (1 + skew)), 0.0)
    # Within the tolerance of a peak this is the half plane.
    return least, (2 + alpha * (1 - skew)) / high if high > 1e-7 else np.inf


def disk_phase_deg(alpha: float, skew: float) -> float:
    """Return the largest turn, of either sign, up to which all turns lie in a disk, in degrees.

    The disk's edge meets the unit circle where cos φ = (4 − α²(1 + σ²))/(4 + α²(1 − σ²)).
    """
    if np.isinf(alpha):
        return 180.0
    above, below = 4 - alpha**2 * (1 + skew**2), 4 + alpha**2 * (1 - skew**2)
    return 180.0 if above <= -below or below <= 0 else float(np.degrees(np.arccos(above / below)))
