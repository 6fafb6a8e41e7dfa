"""Classical margins of a stable loop, with crossings from eigenvalues instead of a grid.

With light damping a resonance is narrower than any frequency grid.  The frequencies where
|L| = 1 are therefore imaginary-axis eigenvalues of a Hamiltonian matrix, and those where
L is real are zeros of L(s) − L(−s).  Both sets only propose frequencies: between all
proposals, their midpoints and the poles the sign of log|L| or Im L is examined, every
sign change is enclosed and polished, and the loop is evaluated there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import control
import numpy as np
from scipy.linalg import eigvals
from scipy.optimize import brentq

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError
from slewctl.linalg import balance
from slewctl.loop.frequency import FrequencyResponse
from slewctl.loop.peaks import peak_gain

# Candidates this far from the imaginary axis, relative, are still looked at: a loose test
# costs evaluations, a tight one would lose close pairs of crossings.
_NEAR_AXIS = 2e-2
# A sign is trusted only this many times above the rounding error of its evaluation.
_TRUSTED = 10.0
_GRID = 400
# The margins are confirmed this far inside and outside, and over this factor if infinite.
_STEP = 1e-4
_WIDE = 50.0


@dataclass(frozen=True)
class Crossing:
    """A margin and the frequency at which it is reached.

    Attributes
    ----------
    value : float
        Infinite where the loop has no such crossing.
    frequency_hz : float or None
    """

    value: float
    frequency_hz: float | None


@dataclass(frozen=True)
class Margins:
    """Classical margins of a stable loop under negative feedback.

    Attributes
    ----------
    gain_db : Crossing
        How much the loop gain may rise.
    gain_reduction_db : Crossing
        How much it may fall, as a positive number; infinite when down to zero.
    phase_deg : Crossing
        Smallest phase change, of either sign, that reaches the stability limit.
    delay_s : Crossing
        Smallest added delay that reaches it.
    gain_crossings_hz : tuple of float
        All frequencies where |L| = 1.
    modulus : Crossing
        min |1 + L|: distance of the Nyquist curve from −1.
    disk : Crossing
        α of the symmetric disk margin: gain may change by any factor between
        (2 − α)/(2 + α) and its inverse, and phase by 2 arctan(α/2), also together (Seiler,
        Packard and Gahinet, IEEE Control Systems Magazine 40(5), 2020).
    confirmed : bool
        Whether the closed loop was found stable at gains and phases throughout the margins
        and unstable just outside of each finite one.
    """

    gain_db: Crossing
    gain_reduction_db: Crossing
    phase_deg: Crossing
    delay_s: Crossing
    gain_crossings_hz: tuple[float, ...]
    modulus: Crossing
    disk: Crossing
    confirmed: bool


def classical_margins(loop: control.StateSpace) -> Margins:
    """Return the classical margins of a loop that is stable when closed.

    Parameters
    ----------
    loop : control.StateSpace
        Return ratio L, one input and output, D = 0, closed as 1 + L = 0.  The caller decides
        stability first: an unstable loop has no margin.

    Returns
    -------
    Margins

    Raises
    ------
    InputError
        If the loop is static, not strictly proper, or has several inputs or outputs.
    """
    if loop.ninputs != 1 or loop.noutputs != 1 or np.any(np.asarray(loop.D)) or loop.nstates == 0:
        raise InputError(
            "the loop is static, has direct feedthrough, or several inputs",
            where="classical_margins",
            remedy="give one strictly proper loop",
        )
    response = FrequencyResponse(loop)
    A, B, C = _balanced(loop)
    poles = np.concatenate([response.poles, np.linalg.eigvals(A - B @ C)])
    known = np.unique(np.concatenate([np.abs(poles), np.abs(poles.imag)]))
    gain = _crossings(response, _log_gain, _unit_gain_candidates(A, B, C), known)
    real = _crossings(response, _sine, _real_axis_candidates(A, B, C), known)
    up, down = _gain_margins(response, _truly_real(response, real))
    turn, delay = _phase_margins(response, gain)
    return Margins(
        Crossing(_decibel(up[0]), up[1]),
        Crossing(-_decibel(down[0]), down[1]),
        turn,
        delay,
        tuple(float(w) / (2 * np.pi) for w in gain),
        _distance(A, B, C, 0.0),
        _distance(A, B, C, 0.5),
        _confirmed(A, B, C, up[0], down[0], np.radians(turn.value)),
    )


def _balanced(loop: control.StateSpace) -> tuple[Array, Array, Array]:
    scale = balance(np.asarray(loop.A))
    return (
        np.asarray(loop.A) / scale[:, None] * scale,
        np.asarray(loop.B) / scale[:, None],
        np.asarray(loop.C) * scale,
    )


def _unit_gain_candidates(A: Array, B: Array, C: Array) -> Array:
    """|L(jω)| = 1 exactly where jω is an eigenvalue of this Hamiltonian matrix."""
    # B and C enter with equal size, which balances the matrix.
    ratio = np.sqrt(np.linalg.norm(C) / np.linalg.norm(B))
    b, c = B * ratio, C / ratio
    return _near_axis(np.linalg.eigvals(np.block([[A, b @ b.T], [-c.T @ c, -A.T]])))


def _real_axis_candidates(A: Array, B: Array, C: Array) -> Array:
    """Im L(jω) = 0 at the zeros of L(s) − L(−s), a pencil of twice the size."""
    n = len(A)
    nothing = np.zeros((n, n))
    ratio = np.sqrt(np.linalg.norm(C) / np.linalg.norm(B))
    b, c = B * ratio, C / ratio
    size = max(np.linalg.norm(A, 2), 1.0)
    pencil = np.block([[A, nothing, b], [nothing, -A, b], [c, c, np.zeros((1, 1))]])
    weight = np.diag(np.concatenate([np.ones(2 * n), [0.0]]))
    alpha, beta = eigvals(pencil / size, weight, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-13 * np.abs(alpha)
    return _near_axis(size * alpha[finite] / beta[finite])


def _near_axis(values: ComplexArray) -> Array:
    near = values[np.abs(values.real) <= _NEAR_AXIS * np.abs(values)]
    return np.abs(near.imag)


def _log_gain(values: ComplexArray) -> Array:
    return np.log(np.abs(values))


def _sine(values: ComplexArray) -> Array:
    return np.asarray(values.imag / np.abs(values))


def _crossings(
    response: FrequencyResponse,
    function: Callable[[ComplexArray], Array],
    candidates: Array,
    poles: Array,
) -> Array:
    """Return the sign changes of `function` of L(jω) over ω > 0, enclosed and polished.

    Parameters
    ----------
    candidates : ndarray
        Proposed frequencies; what lies far above all poles is an infinite eigenvalue.
    poles : ndarray
        Magnitudes and imaginary parts of open- and closed-loop poles.
    """
    top = poles[-1]
    known = np.concatenate([candidates[candidates < 1e3 * top], poles])
    known = np.unique(known[known > 1e-9 * top])
    grid = np.geomspace(known[0] / 100, known[-1] * 100, _GRID)
    points = np.unique(np.concatenate([known, grid]))
    points = np.unique(np.concatenate([points, np.sqrt(points[1:] * points[:-1])]))
    loop, rounding = response.with_rounding(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = function(loop)
        clear = np.isfinite(values) & (np.abs(values * loop) > _TRUSTED * rounding)
    points, values = points[clear], values[clear]
    change = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    return np.array([_polished(response, function, points[i], points[i + 1]) for i in change])


def _polished(
    response: FrequencyResponse,
    function: Callable[[ComplexArray], Array],
    left: float,
    right: float,
) -> float:
    """Return the root of `function` of L(jω) between two frequencies of opposite sign."""

    def at(w: float) -> float:
        return float(function(response(np.array([w])))[0])

    ends = at(left), at(right)
    if np.sign(ends[0]) == np.sign(ends[1]):
        # One frequency alone rounds otherwise than among many: an end is the root itself.
        return left if abs(ends[0]) < abs(ends[1]) else right
    return float(brentq(at, left, right, xtol=1e-300, rtol=1e-14))


def _truly_real(response: FrequencyResponse, crossings: Array) -> Array:
    """Return the crossings where L is real and not merely turning through a pole or zero.

    An undamped pole or zero on the axis flips the sign of Im L, and that of Re L with it.
    The constant gain L(0) is real as well.
    """
    if len(crossings):
        values, rounding = response.with_rounding(crossings)
        sides = [response(crossings * (1 + step)).real for step in (-1e-8, 1e-8)]
        crossings = crossings[(np.abs(values) > _TRUSTED * rounding) & (sides[0] * sides[1] > 0)]
    return np.concatenate([[0.0], crossings])


def _gain_margins(
    response: FrequencyResponse, crossings: Array
) -> tuple[tuple[float, float | None], tuple[float, float | None]]:
    """Return (factor, frequency in Hz) for raising and for lowering the gain."""
    up: tuple[float, float | None] = (np.inf, None)
    down: tuple[float, float | None] = (0.0, None)
    values = response(crossings)
    for w, value in zip(crossings, values, strict=True):
        if np.isfinite(value) and value.real < 0 and abs(value.imag) < 1e-6 * abs(value):
            factor, hertz = float(-1 / value.real), float(w / (2 * np.pi))
            if 1 <= factor < up[0]:
                up = (factor, hertz)
            if down[0] < factor < 1:
                down = (factor, hertz)
    return up, down


def _phase_margins(response: FrequencyResponse, gain: Array) -> tuple[Crossing, Crossing]:
    if not len(gain):
        return Crossing(np.inf, None), Crossing(np.inf, None)
    from_limit = np.angle(-response(gain))
    turn = np.abs(from_limit)
    delay = np.mod(from_limit, 2 * np.pi) / gain
    k, j = int(np.argmin(turn)), int(np.argmin(delay))
    return (
        Crossing(float(np.degrees(turn[k])), float(gain[k] / (2 * np.pi))),
        Crossing(float(delay[j]), float(gain[j] / (2 * np.pi))),
    )


def _distance(A: Array, B: Array, C: Array, shift: float) -> Crossing:
    """Return 1/‖S − shift‖∞ with the sensitivity S = 1/(1 + L)."""
    peak = peak_gain(control.StateSpace(A - B @ C, B, -C, [[1.0 - shift]]))
    hertz = peak.omega / (2 * np.pi) if np.isfinite(peak.omega) else None
    return Crossing(1 / peak.value, hertz)


def _decibel(factor: float) -> float:
    return float(20 * np.log10(factor)) if factor > 0 else -np.inf


def _confirmed(A: Array, B: Array, C: Array, up: float, down: float, turn: float) -> bool:
    """Whether the closed loop is stable throughout the margins and unstable just outside.

    The loop is closed with gains from just inside the reduction to just inside the rise,
    and with phases up to the margin in either sense; where a margin is infinite a wide
    range stands for it.
    """
    low = down * (1 + _STEP) if down > 0 else 1 / _WIDE
    high = up * (1 - _STEP) if np.isfinite(up) else _WIDE
    largest = min(turn, np.pi)
    inside = np.concatenate(
        [
            np.geomspace(low, high, 16),
            np.exp(1j * np.linspace(-1, 1, 8) * largest * (1 - _STEP)),
        ]
    )
    outside = [
        *([up * (1 + _STEP)] if np.isfinite(up) else []),
        *([down * (1 - _STEP)] if down > 0 else []),
    ]
    turned = [np.exp(sense * 1j * turn * (1 + _STEP)) for sense in (-1, 1) if turn < np.pi]
    return (
        all(_stable(A - factor * B @ C) for factor in inside)
        and not any(_stable(A - factor * B @ C) for factor in outside)
        and not (turned and all(_stable(A - factor * B @ C) for factor in turned))
    )


def _stable(A: ComplexArray | Array) -> bool:
    return bool(np.linalg.eigvals(A).real.max() < 0)
