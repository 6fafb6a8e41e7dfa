"""Where |L| = 1 and where L is real: eigenvalues propose, signs decide.

|L(jω)| = 1 at imaginary eigenvalues of a Hamiltonian matrix; L is real at zeros of
L(s) − L(−s), a pencil of twice the size, found a second time about real shifts over all
decades of the poles.  Both sets only propose frequencies, and generously.  Between all
proposals, their midpoints, the poles of the open and the closed loop and a grid, the sign of
log|L| or Im L/|L| is examined where it exceeds its rounding error; what turns towards zero
without reaching it is followed to its lowest point; every sign change is enclosed and
polished.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.loop.single.roots import polished
from slewctl.numerics.bilinear import Equivalent
from slewctl.numerics.hinf_norm import finite_eigenvalues, level_crossings

# A sign is trusted only this many times above the rounding error of its evaluation.
_TRUSTED = 10.0
_GRID = 400
_SHIFTS_A_DECADE = 0.5
_TURNS = 8


@dataclass(frozen=True, eq=False)
class Samples:
    """L at increasing frequencies in rad/s, with the rounding error of each value."""

    omega: Array
    values: ComplexArray
    rounding: Array


@dataclass(frozen=True, eq=False)
class Crossings:
    """Sign changes: frequencies in rad/s, increasing, and +1 where the function rises."""

    omega: Array
    rising: Array


Function = Callable[[ComplexArray], Array]


def log_gain(values: ComplexArray) -> Array:
    """Return log|L|, between −1e3 and 1e3."""
    with np.errstate(divide="ignore"):
        return np.clip(np.log(np.abs(values)), -1e3, 1e3)


def sine(values: ComplexArray) -> Array:
    """Return Im L/|L|, zero where L is zero or infinite."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.asarray(values.imag / np.abs(values)))


def sampled(loop: BrokenLoop, *, real: bool = True) -> Samples:
    """Return L at all proposed frequencies, the poles, a grid, and the midpoints of these.

    Parameters
    ----------
    real : bool
        Whether frequencies where L is real are wanted among them.
    """
    system = loop.equivalent
    proposed = level_crossings(system, 1.0)
    if real:
        proposed = np.concatenate([proposed, real_axis_candidates(loop)])
    top = loop.known[-1] if len(loop.known) else 1.0
    # What lies far above all poles is an infinite eigenvalue, unless L ends in a constant.
    proposed = proposed[proposed < (1e8 if loop.D else 1e3) * top]
    known = np.unique(np.concatenate([proposed, loop.known, [top]]))
    known = known[known > 1e-9 * top]
    limit = loop.response.nyquist
    # Evenly in log(tan(ωT/2)), so that both ends of a sampled loop's band are resolved.
    grid = _unwarped(np.geomspace(known[0] / 100, known[-1] * 100, _GRID), system, top)
    points = np.unique(np.concatenate([known, grid]))
    points = np.unique(np.concatenate([points, np.sqrt(points[1:] * points[:-1])]))
    points = points[(points > 0) & (points < limit)]
    return Samples(points, *loop.response.with_rounding(points))


def _unwarped(grid: Array, system: Equivalent, top: float) -> Array:
    if not system.sample_time:
        return grid
    low = np.tan(min(grid[0] * system.sample_time / 2, 1.0))
    return 2 * np.arctan(np.geomspace(low, 1e6, _GRID)) / system.sample_time


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


def crossings(loop: BrokenLoop, samples: Samples, function: Function) -> Crossings:
    """Return the sign changes of `function` of L over 0 < ω, enclosed and polished."""
    values = function(samples.values)
    # At a pole on the axis both are infinite, and no sign is to be had.
    clear = np.isfinite(samples.rounding)
    size = np.abs(samples.values, where=clear, out=np.zeros(len(values)))
    clear &= np.abs(values) * size > _TRUSTED * samples.rounding
    points, values = samples.omega[clear], values[clear]

    def at(omega: Array) -> Array:
        return function(loop.response(omega))

    points, values = _turned(at, points, values)
    change = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    return Crossings(polished(at, points[change], points[change + 1]), np.sign(values[change + 1]))


def _turned(at: Callable[[Array], Array], points: Array, values: Array) -> tuple[Array, Array]:
    """Add the lowest points of what turns towards zero between samples of one sign.

    Successive parabolas: a pair of roots hides only where the vertex is near zero or beyond.
    """
    for _ in range(_TURNS):
        size = np.abs(values)
        low = np.flatnonzero(
            (size[1:-1] < size[:-2])
            & (size[1:-1] < size[2:])
            & (values[1:-1] * values[:-2] > 0)
            & (values[1:-1] * values[2:] > 0)
        )
        x = points[low], points[low + 1], points[low + 2]
        y = size[low], size[low + 1], size[low + 2]
        left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
        bend = (right - left) / (x[2] - x[0])
        vertex = np.clip((x[0] + x[1]) / 2 - left / (2 * bend), x[0], x[2])
        height = y[1] + (vertex - x[1]) * (left + bend * (vertex - x[0]))
        new = np.setdiff1d(vertex[height < 0.5 * y[1]], points)
        if not len(new):
            break
        order = np.argsort(np.concatenate([points, new]), kind="stable")
        points = np.concatenate([points, new])[order]
        values = np.concatenate([values, at(new)])[order]
    return points, values


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
        & (np.abs(values) > _TRUSTED * rounding)
        & (np.abs(values.imag) < 1e-6 * np.abs(values))
        & (before * after > 0)
    )
    return Crossings(omega[kept], found.rising[kept])
