"""Peaks of a frequency response, from eigenvalues instead of a grid.

‖G‖∞ is found by climbing level sets (Boyd and Balakrishnan, Systems & Control Letters 15,
1990; Bruinsma and Steinbuch, 14, 1990): |G(jω)| = γ exactly where jω is an eigenvalue of a
Hamiltonian matrix, so a level that no frequency reaches bounds the peak from above.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
from scipy.optimize import minimize_scalar

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.linalg import balance
from slewctl.loop.frequency import FrequencyResponse

# The peak is at most this much, relative, above the value that is returned.
PEAK_TOLERANCE = 1e-8
_ROUNDS = 30


@dataclass(frozen=True)
class Peak:
    """The largest |G(jω)|.

    Attributes
    ----------
    value : float
        |G| evaluated at `omega`: a lower bound, and within `PEAK_TOLERANCE` the norm.
    omega : float
        In rad/s; infinite where the peak is the direct feedthrough.
    """

    value: float
    omega: float


def peak_gain(system: control.StateSpace) -> Peak:
    """Return ‖G‖∞ of a stable system with one input and one output.

    Parameters
    ----------
    system : control.StateSpace
        Continuous; the caller decides stability first.

    Raises
    ------
    AccuracyError
        If the level sets do not close in on the peak.
    """
    response = FrequencyResponse(system)
    known = np.concatenate([[0.0], np.abs(response.poles), np.abs(response.poles.imag)])
    best = Peak(abs(float(system.D[0, 0])), np.inf)
    best = _best_of(response, known, best)
    for _ in range(_ROUNDS):
        if np.isfinite(best.omega):
            best = _climbed(response, best)
        level = best.value * (1 + PEAK_TOLERANCE)
        crossings = _level_crossings(system, level)
        between = np.sqrt(crossings[1:] * crossings[:-1])
        higher = _best_of(response, np.concatenate([crossings, between]), best)
        if higher.value <= level:
            return higher
        best = higher
    raise AccuracyError(
        "the peak of the frequency response could not be enclosed", where="peak_gain"
    )


def _best_of(response: FrequencyResponse, omega: Array, best: Peak) -> Peak:
    sizes = np.abs(response(omega)) if len(omega) else np.zeros(0)
    if len(sizes) and sizes.max() > best.value:
        k = int(np.argmax(sizes))
        return Peak(float(sizes[k]), float(omega[k]))
    return best


def _climbed(response: FrequencyResponse, start: Peak) -> Peak:
    """Return the top of the hill on which `start` lies."""
    # A resonance is as wide as its pole's real part; outside of it the hill ends.
    width = max(np.abs(response.poles - 1j * start.omega).min() / max(start.omega, 1e-300), 1e-12)
    found = minimize_scalar(
        lambda step: -abs(response(np.array([start.omega * (1 + step)]))[0]),
        bounds=(-min(width, 0.5), width),
        method="bounded",
        options={"xatol": 1e-9 * width},
    )
    return _best_of(response, np.array([start.omega * (1 + float(found.x))]), start)


def _level_crossings(system: control.StateSpace, level: float) -> Array:
    """Return frequencies near which |G| may equal `level`, increasing."""
    scale = balance(np.asarray(system.A))
    A = np.asarray(system.A) / scale[:, None] * scale
    B, C = np.asarray(system.B) / scale[:, None], np.asarray(system.C) * scale
    ratio = np.sqrt(np.linalg.norm(C) / np.linalg.norm(B)) if B.any() and C.any() else 1.0
    b, c, d = B * ratio, C / ratio, float(system.D[0, 0])
    room = level**2 - d**2
    if room <= 0:
        return np.zeros(0)
    closed = A + b @ c * (d / room)
    hamiltonian = np.block(
        [[closed, b @ b.T * (level / room)], [-c.T @ c * (level / room), -closed.T]]
    )
    values = np.linalg.eigvals(hamiltonian)
    # A loose test costs evaluations; a tight one would lose a flat peak.
    near = values[(np.abs(values.real) <= 2e-2 * np.abs(values)) & (values.imag > 0)]
    return np.sort(near.imag)
