"""The largest structured singular value over all frequencies, certified between them.

A scaling D that is good at one frequency bounds μ by σ_max(DMD⁻¹) at all others, and where
that bound lies below a level is decided by the eigenvalues of one Hamiltonian matrix.  The
intervals so certified are taken away, and the next scaling is made for what is left, until
nothing is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError
from slewctl.loop.robust.mu import Destabiliser, balanced_bound, lower_bound, upper_bound
from slewctl.numerics.bilinear import Equivalent, equivalent
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.hinf_norm import level_crossings
from slewctl.numerics.linear_system import LinearSystem

# The certified level above the largest upper bound found at one frequency, relative.
LEVEL = 2e-5
_ROUNDS = 200  # of certifying what is left, a safeguard
# Narrowings of a peak, each with so many points: nine make it 3⁹ times narrower.
_ZOOMS, _POINTS = 9, 7
_HILLS, _CLIMBED = 6, 2  # highest points looked at closely, and how many of these are climbed
# Edges of certified intervals are known to rounding only; what is left overlaps them.
_OVERLAP = 1e-9


@dataclass(frozen=True, eq=False)
class StructuredPeak:
    """sup μ(M(jω)) over all ω, enclosed.

    Attributes
    ----------
    upper : float
        No frequency has a larger μ.
    destabiliser : Destabiliser
        A diagonal that makes I − M diag(δ) singular at `omega`; its value bounds from below.
    omega : float
        In rad/s; infinite for the feedthrough of a continuous system.
    rounds : int
        How many scalings certified all frequencies.
    """

    upper: float
    destabiliser: Destabiliser
    omega: float
    rounds: int


class _Matrix:
    """M of frequency, with bounds of its μ.  The system must be stable."""

    def __init__(self, system: LinearSystem) -> None:
        self.response = FrequencyResponse(system)
        self.equivalent = equivalent(system)
        self.feedthrough = np.asarray(system.D).astype(complex)
        self.last = self.response.nyquist
        self.poles = _in_s(self.response.poles, self.response.sample_time)
        self.known = np.unique(
            np.concatenate([[0.0], self.response.landmarks, [self.last]])
            if system.nstates
            else np.array([0.0])
        )

    def __call__(self, omega: Array) -> ComplexArray:
        """Return M at each ω, shape (k, n, n)."""
        omega = np.asarray(omega, dtype=float)
        values = np.broadcast_to(self.feedthrough, (len(omega), *self.feedthrough.shape)).copy()
        finite = np.isfinite(omega)
        if finite.any():
            values[finite] = self.response(omega[finite]).reshape(-1, *self.feedthrough.shape)
        return values

    def quick(self, omega: Array) -> Array:
        """Return an upper bound of μ at each ω."""
        return balanced_bound(self(omega))

    def scaled(self, d: Array) -> Equivalent:
        """Return DMD⁻¹ on the imaginary axis."""
        M = self.equivalent
        return Equivalent(
            M.A, M.B / d, d[:, None] * M.C, d[:, None] * M.D / d, M.sample_time, M.turn
        )

    def exact(self, omega: Array) -> Array:
        """Return the smallest upper bound of μ at each ω."""
        values = self(omega)
        if values.shape[-1] <= 2:
            return balanced_bound(values)
        return np.array([upper_bound(value)[0] for value in values])

    def top(self, omega: float) -> tuple[float, float]:
        """Return the height and place of the top of the hill on which ω lies."""
        return self.zoomed(self.exact, self.zoomed(self.quick, omega)[1])

    def zoomed(self, height: Callable[[Array], Array], omega: float) -> tuple[float, float]:
        """Return the height and place of the top of a hill of `quick` or `exact`."""
        at = float(height(np.array([omega]))[0]), omega
        if not np.isfinite(omega) or not len(self.poles):
            return at
        # A resonance is as wide as its pole's real part; outside of it the hill ends.
        width = float(np.abs(self.poles - 1j * omega).min())
        width = min(width, 0.5 * omega) if omega else width
        for _ in range(_ZOOMS):
            points = at[1] + np.linspace(-width, width, _POINTS)
            points = points[(points >= 0) & (points <= self.last)]
            heights = height(points)
            k = int(np.argmax(heights))
            at = max(at, (float(heights[k]), float(points[k])))
            width *= 0.4
        return at


def _in_s(poles: ComplexArray, step: float) -> ComplexArray:
    """Return poles in the s plane; those at z = 0 belong to no frequency."""
    if not step:
        return poles
    return np.asarray(np.log(poles[poles != 0]) / step)


def structured_peak(system: LinearSystem) -> StructuredPeak:
    """Return the largest μ of M(jω) over all ω for a diagonal of complex scalars.

    Parameters
    ----------
    system : LinearSystem
        M, square and stable, continuous or sampled.

    Returns
    -------
    StructuredPeak
        For up to three scalars both bounds agree to a relative 1e-4; for more the upper
        bound may be conservative, and the two say by how much.

    Raises
    ------
    AccuracyError
        If not all frequencies can be certified.
    """
    M = _Matrix(system)
    seen = sorted({M.zoomed(M.quick, float(w)) for w in _highest(M, M.known, _HILLS)}, reverse=True)
    hills = sorted((M.zoomed(M.exact, w) for _, w in seen[:_CLIMBED]), reverse=True)
    best, where = hills[0]
    pending = [(0.0, M.last)] if system.nstates else []
    rounds = 0
    while pending:
        rounds += 1
        if rounds > _ROUNDS:
            raise AccuracyError(
                "the structured singular value could not be bounded at all frequencies",
                where="multiloop_margins",
                remedy="check the loop for modes that are hardly stable",
            )
        piece = pending.pop()
        omega = where if piece[0] <= where <= piece[1] and rounds == 1 else _highest_in(M, piece)
        value, d = upper_bound(M(np.array([omega]))[0])
        if value > best * (1 + LEVEL):
            best, where = max((value, omega), M.top(omega))
            pending.append(piece)  # the level has risen, so what is certified stays so
            continue
        pending += _left_over(M, d, best * (1 + LEVEL), piece, omega)
    below = _lower(M, [where, *(w for _, w in hills)])
    return StructuredPeak(best * (1 + LEVEL), below[0], below[1], rounds)


def _highest(M: _Matrix, omega: Array, count: int) -> Array:
    return np.asarray(omega[np.argsort(-M.quick(omega))[:count]])


def _highest_in(M: _Matrix, piece: tuple[float, float]) -> float:
    """Return a frequency of the piece at which μ is large."""
    low, high = piece
    inner = M.known[(M.known > low) & (M.known < high)]
    points = np.unique(np.concatenate([inner, _between(np.array([low, high]), M)]))
    return float(_highest(M, points, 1)[0])


def _between(edges: Array, M: _Matrix) -> Array:
    """Return one frequency inside each interval between increasing edges."""
    low, high = edges[:-1], edges[1:]
    positive = M.known[(M.known > 0) & np.isfinite(M.known)]
    typical = float(np.median(positive)) if len(positive) else 1.0
    with np.errstate(invalid="ignore", over="ignore"):
        inner = np.sqrt(low) * np.sqrt(high)
        inner = np.where(low == 0, np.minimum(high / 2, typical), inner)
        return np.asarray(np.where(np.isinf(high), np.maximum(2 * low, typical), inner))


def _left_over(
    M: _Matrix, d: Array, level: float, piece: tuple[float, float], omega: float
) -> list[tuple[float, float]]:
    """Return the parts of a piece in which σ_max(DMD⁻¹) is not below the level."""
    low, high = piece
    crossings = level_crossings(M.scaled(d), level)
    inner = crossings[(crossings > low) & (crossings < high)]
    edges = np.unique(np.concatenate([[low], inner, [high]]))
    middles = _between(edges, M)
    scaled = d[:, None] * M(middles) / d
    above = np.linalg.norm(scaled, 2, axis=(1, 2)) >= level
    left: list[tuple[float, float]] = []
    for a, b in zip(edges[:-1][above], edges[1:][above], strict=True):
        if (a, b) == piece and low < omega < high:  # only rounding can be the reason
            return [(low, omega), (omega, high)]
        a, b = max(low, a * (1 - _OVERLAP)), min(high, b * (1 + _OVERLAP))
        if left and a <= left[-1][1]:
            left[-1] = (left[-1][0], float(b))
        else:
            left.append((float(a), float(b)))
    return left


def _lower(M: _Matrix, omega: list[float]) -> tuple[Destabiliser, float]:
    """Return the strongest destabiliser found at one of the frequencies."""
    found = [(lower_bound(M(np.array([w]))[0]), w) for w in dict.fromkeys(omega)]
    return max(found, key=lambda pair: pair[0].value)
