"""Disk margins: which gains and turns lie in a disk about one.

The disk of perturbations is that of Seiler, Packard and Gahinet, "An Introduction to Disk
Margins", IEEE Control Systems Magazine 40(5), 2020: factors
f = (1 + (1 − σ)δ/2)/(1 − (1 + σ)δ/2) with |δ| < α.  The loop stands all of them exactly
while α < 1/‖S + (σ − 1)/2‖∞.  σ = 0 is the balanced disk, in S − T; σ = 1 is the disk of
S, whose α is the modulus margin min|1 + L|; σ = −1 that of T.
"""

from __future__ import annotations

import numpy as np


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
