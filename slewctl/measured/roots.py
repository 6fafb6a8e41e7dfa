"""Poles and zeros of a fitted rig, and the same read from the measured response alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals

from slewctl._types import Array, ComplexArray
from slewctl.measured.response import Response
from slewctl.measured.rig_model import Channel, Modes, equations
from slewctl.measured.rig_parameters import Rig

# Infinite zeros of the pencil, over the largest pole.
_INFINITE = 1e4
# A local look: as many points on each side, and no further than this share of the frequency.
_POINTS = 5
_NEAR = 0.15
_FEWEST = 5
_ITERATIONS = 20
_LEAST_COHERENCE = 0.5


@dataclass(frozen=True)
class Root:
    """A resonance, or a dip, of a fitted rig beside the measured one.

    Attributes
    ----------
    kind : {"pole", "zero"}
        The zeros of the hub angle are the arm's with its hub held; no feedback moves them.
    frequency_hz, frequency_deviation_hz : float
        Of the fitted rig, with its standard deviation.
    damping_ratio, damping_deviation : float
    measured_hz, measured_damping : float
        From the points of the response around it alone, by a rational function of second order;
        NaN where they show none.
    """

    kind: str
    frequency_hz: float
    frequency_deviation_hz: float
    damping_ratio: float
    damping_deviation: float
    measured_hz: float
    measured_damping: float


def poles_and_zeros(rig: Rig, channel: Channel, modes: Modes) -> tuple[ComplexArray, ComplexArray]:
    """Return the oscillating poles and zeros of a rig in rad/s, upper half, by frequency."""
    system = equations(rig.arm, channel.actuator, channel.sensor, modes)
    poles = np.linalg.eigvals(system.A)
    size = len(system.A)
    scale = float(np.abs(poles).max())
    left = np.block([[system.A / scale, system.B], [system.C, system.D]])
    right = np.zeros_like(left)
    right[:size, :size] = np.eye(size)
    pairs = eigvals(left, right, homogeneous_eigvals=True)
    alpha, beta = pairs[0], pairs[1]
    finite = np.abs(beta) * _INFINITE > np.abs(alpha)
    return _upper(poles.astype(complex)), _upper(scale * alpha[finite] / beta[finite])


def _upper(roots: ComplexArray) -> ComplexArray:
    found = roots[roots.imag > 1e-6 * np.abs(roots)]
    found = found[np.abs(found.imag) > 0.05 * np.abs(found)]
    return found[np.argsort(np.abs(found))]


def figures(roots: ComplexArray) -> Array:
    """Return |s|/2π in Hz and the damping ratio of each root, one after the other."""
    return np.concatenate([np.abs(roots) / (2 * np.pi), -roots.real / np.abs(roots)])


def seen(response: Response, frequency_hz: float, kind: str) -> tuple[float, float]:
    """Return frequency in Hz and damping ratio of a root from the points around it, or NaN.

    By Sanathanan and Koerner's iteration of linear least squares (IEEE Trans. Automatic
    Control 8 (1963) 56–58) for a ratio of two polynomials of second degree.
    """
    nothing = (np.nan, np.nan)
    hz = response.frequencies_hz
    coherence = np.asarray(response.coherence)
    good = ~(coherence < _LEAST_COHERENCE) & (np.abs(hz / frequency_hz - 1) < _NEAR)
    near = np.flatnonzero(good)
    near = near[np.argsort(np.abs(hz[near] - frequency_hz))][: 2 * _POINTS + 1]
    if len(near) < _FEWEST:
        return nothing
    x = 1j * (hz[near] / frequency_hz)  # s over the expected frequency
    values = response.values[near] / np.abs(response.values[near]).max()
    if kind == "zero":
        values = 1 / values
        values = values / np.abs(values).max()
    weight: Array = np.ones(len(x))
    denominator = np.array([1.0, 0.0])
    for _ in range(_ITERATIONS):
        # b₀ + b₁x + b₂x² − G(a₁x + a₀) = G x²
        terms = [np.ones_like(x), x, x**2, -values * x, -values]
        matrix = _stacked(np.column_stack(terms).astype(complex) * weight[:, None])
        solution = np.linalg.pinv(matrix) @ _stacked(np.asarray(values * x**2 * weight))
        denominator = solution[3:]
        weight = 1 / np.abs(x**2 + denominator[0] * x + denominator[1])
    damping, square = denominator
    if square <= 0 or not np.sqrt(square) * frequency_hz < hz[near].max():
        return nothing
    own = float(np.sqrt(square))
    if own * frequency_hz < hz[near].min() or not 0 < damping < 0.5 * own:
        return nothing
    return own * frequency_hz, float(damping / (2 * own))


def _stacked(values: ComplexArray | Array) -> Array:
    return np.concatenate([values.real, values.imag])
