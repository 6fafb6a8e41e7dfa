"""Where L is real, from a pencil of twice its size and about real shifts.

L is real at zeros of L(s) − L(−s), found a second time about real shifts over all decades of
the poles; modulus and disk margins are H∞ norms.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.crossings import TRUSTED, Crossings, Samples, sampled
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.bilinear import Equivalent
from slewctl.numerics.hinf_norm import Peak, enclosed_peak, finite_eigenvalues

_SHIFTS_A_DECADE = 0.5


def all_sampled(loop: BrokenLoop) -> Samples:
    """Return L at frequencies proposed for |L| = 1 and for real L, and between them."""
    return sampled(loop, real_axis_candidates(loop))


def sine(values: ComplexArray) -> Array:
    """Return Im L/|L|, zero where L is zero or infinite."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.asarray(values.imag / np.abs(values)))


def real_axis_candidates(loop: BrokenLoop) -> Array:
    """Return frequencies in rad/s near which L may be real.

    L(s) − L~(s) has the zeros of (diag(A, −Aᴴ), [B; Cᴴ], [C, Bᴴ], D − D̄).
    """
    system = loop.equivalent
    A, B, C, D = system.A, system.B, system.C, system.D
    n = len(A)
    if not n:
        return np.zeros(0)
    size = max(float(np.linalg.norm(A, 2)), float(np.finfo(float).tiny))
    nothing = np.zeros((n, n))
    pencil = np.block(
        [
            [A, nothing, B],
            [nothing, -A.conj().T, C.conj().T],
            [C, B.conj().T, D - D.conj()],
        ]
    )
    weight = np.diag(np.concatenate([np.ones(2 * n), [0.0]]))
    found = [system.near_axis(size * finite_eigenvalues(pencil / size, weight))]
    if np.isrealobj(A):
        found += [system.near_axis(z) for z in _about_shifts(A.real, B.real, C.real)]
    return np.concatenate(found)


def _about_shifts(A: Array, B: Array, C: Array) -> list[ComplexArray]:
    """Return zeros of C(s² − A²)⁻¹B from half-size problems about shifts over all decades.

    With X = (A² − σ²)⁻¹ they are s² = σ² + 1/ν, ν an eigenvalue of X − XB(CXB)⁻¹CX: each
    shift keeps the digits of the zeros near its own size.
    """
    sizes = np.abs(np.linalg.eigvals(A))
    sizes = sizes[sizes > 1e-9 * sizes.max(initial=0.0)]
    if not len(sizes):
        return []
    decades = np.log10(sizes.max() / sizes.min())
    shifts = np.geomspace(sizes.min(), sizes.max(), 1 + int(np.ceil(decades * _SHIFTS_A_DECADE)))
    eye = np.eye(len(A))
    zeros = []
    for shift in shifts:
        # Irrational against anything a pole is likely to be.
        sigma = 0.917 * shift
        try:
            X = np.linalg.inv((A - sigma * eye) @ (A + sigma * eye))
        except np.linalg.LinAlgError:
            continue  # the shift met a pole: its neighbours and the pencil remain
        row, column = C @ X, X @ B
        through = float((C @ column)[0, 0])
        if through == 0 or not np.isfinite(through):
            continue
        nu = np.linalg.eigvals(X - column @ row / through).astype(complex)
        nu = nu[np.abs(nu) > 1e-13 * np.abs(nu).max(initial=0.0)]
        zeros.append(np.sqrt(sigma**2 + 1 / nu))
    return zeros


def truly_real(loop: BrokenLoop, found: Crossings) -> Crossings:
    """Return the crossings where L is real and not merely turning through a pole or zero.

    An undamped pole or zero on the axis flips the sign of Im L, and that of Re L with it.
    """
    omega = found.omega
    if not len(omega):
        return found
    values, rounding = loop.response.with_rounding(omega)
    before, after = (loop.response(omega * (1 + step)).real for step in (-1e-8, 1e-8))
    kept = (
        np.isfinite(values)
        & (np.abs(values) > TRUSTED * rounding)
        & (np.abs(values.imag) < 1e-6 * np.abs(values))
        & (before * after > 0)
    )
    return Crossings(omega[kept], found.rising[kept])


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
