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
from slewctl.linalg import balance
from slewctl.loop.frequency import FrequencyResponse

# Candidates this far from the imaginary axis, relative, are still looked at: a loose test
# costs evaluations, a tight one would lose close pairs of crossings.
_NEAR_AXIS = 2e-2
# A sign is trusted only this many times above the rounding error of its evaluation.
_TRUSTED = 10.0
_GRID = 400


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
    confirmed : bool
        Whether the closed loop was found stable just inside and unstable just outside
        of each finite gain margin.
    """

    gain_db: Crossing
    gain_reduction_db: Crossing
    phase_deg: Crossing
    delay_s: Crossing
    gain_crossings_hz: tuple[float, ...]
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
    """
    response = FrequencyResponse(loop)
    A, B, C = _balanced(loop)
    closed = np.linalg.eigvals(A - B @ C)
    proposals = [
        np.abs(response.poles),
        np.abs(response.poles.imag),
        np.abs(closed),
        np.abs(closed.imag),
    ]
    gain = _crossings(response, _log_gain, _unit_gain_candidates(A, B, C), proposals)
    phase = _crossings(response, _sine, _real_axis_candidates(A, B, C), proposals)
    up, down = _gain_margins(response, phase)
    turn, delay = _phase_margins(response, gain)
    return Margins(
        Crossing(_decibel(up[0]), up[1]),
        Crossing(-_decibel(down[0]), down[1]),
        turn,
        delay,
        tuple(float(w) / (2 * np.pi) for w in gain),
        _confirm(A, B, C, up[0], True) and _confirm(A, B, C, down[0], False),
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
    proposals: list[Array],
) -> Array:
    """Return the sign changes of `function` of L(jω) over ω > 0, enclosed and polished."""
    known = np.concatenate([candidates, *proposals])
    known = np.unique(known[known > 1e-9 * known.max()])
    grid = np.geomspace(known[0] / 100, known[-1] * 100, _GRID)
    points = np.unique(np.concatenate([known, grid]))
    points = np.unique(np.concatenate([points, np.sqrt(points[1:] * points[:-1])]))
    loop, rounding = response.with_rounding(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = function(loop)
        clear = np.isfinite(values) & (np.abs(values * loop) > _TRUSTED * rounding)
    points, values = points[clear], values[clear]
    change = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))

    def at(w: float) -> float:
        return float(function(response(np.array([w])))[0])

    return np.array([brentq(at, points[i], points[i + 1], xtol=1e-300, rtol=1e-14) for i in change])


def _gain_margins(
    response: FrequencyResponse, phase: Array
) -> tuple[tuple[float, float | None], tuple[float, float | None]]:
    """Return (factor, frequency in Hz) for raising and for lowering the gain."""
    up: tuple[float, float | None] = (np.inf, None)
    down: tuple[float, float | None] = (0.0, None)
    if len(phase):
        values = response(phase)
        # A sign change of Im L may also be a pole on the axis, where L is not real.
        real = np.abs(values.imag) < 1e-6 * np.abs(values)
        for w, value in zip(phase[real], values[real].real, strict=True):
            if value < 0:
                factor, hertz = float(-1 / value), float(w / (2 * np.pi))
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


def _decibel(factor: float) -> float:
    return float(20 * np.log10(factor)) if factor > 0 else -np.inf


def _confirm(A: Array, B: Array, C: Array, factor: float, rising: bool) -> bool:
    """Whether the loop is stable just inside the gain margin and unstable just outside."""
    if factor in (0.0, np.inf):
        return True
    step = 1e-4 if rising else -1e-4
    inside, outside = factor * (1 - step), factor * (1 + step)
    return bool(
        np.linalg.eigvals(A - inside * B @ C).real.max() < 0
        and np.linalg.eigvals(A - outside * B @ C).real.max() > 0
    )
