"""Peaks of a frequency response, from eigenvalues instead of a grid.

‖G‖∞ is found by climbing level sets (Boyd and Balakrishnan, Systems & Control Letters 15,
1990; Bruinsma and Steinbuch, 14, 1990): a singular value of G(jω) equals γ exactly where jω
is an eigenvalue of a Hamiltonian matrix, so a level that no frequency reaches bounds the
peak from above.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError
from slewctl.numerics.bilinear import Equivalent, equivalent
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.linear_system import LinearSystem

# The peak is at most this much, relative, above the value that is returned.
PEAK_TOLERANCE = 1e-8
_ROUNDS = 30  # a safeguard: the convergence is quadratic
# Where the level is this close to a singular value of D the Hamiltonian matrix is not formed.
_SINGULAR = 1e-3
Sizes = Callable[[Array], Array]


@dataclass(frozen=True)
class Peak:
    """The largest singular value of G over all frequencies.

    Attributes
    ----------
    value : float
        σ(G) evaluated at `omega`: a lower bound, and within `PEAK_TOLERANCE` the norm.
    omega : float
        In rad/s; infinite where the peak is the direct feedthrough of a continuous system.
    """

    value: float
    omega: float


def peak_gain(system: LinearSystem) -> Peak:
    """Return ‖G‖∞ of a stable system, continuous or sampled, with any inputs and outputs.

    Parameters
    ----------
    system : LinearSystem
        The caller decides stability first: of an unstable system, without poles on the
        axis, this is the largest gain on the axis (the L∞ norm).

    Returns
    -------
    Peak

    Raises
    ------
    AccuracyError
        If the level sets do not close in on the peak.

    Examples
    --------
    >>> from slewctl.numerics.hinf_norm import peak_gain
    >>> from slewctl.numerics.linear_system import LinearSystem
    >>> peak = peak_gain(LinearSystem([[0.0, 1], [-1, -0.1]], [[0.0], [1]], [[1.0, 0]], [[0.0]]))
    >>> round(peak.value, 4)
    10.0125
    """
    response = FrequencyResponse(system)

    def sizes(omega: Array) -> Array:
        values = response(omega)
        return np.abs(values) if values.ndim == 1 else np.linalg.norm(values, 2, axis=(1, 2))

    if response.sample_time:
        last = Peak(float(sizes(np.array([response.nyquist]))[0]), response.nyquist)
    else:
        last = Peak(float(np.linalg.norm(np.asarray(system.D), 2)), np.inf)
    if not system.nstates:
        return last
    known = np.unique(np.concatenate([[0.0], response.landmarks]))
    return enclosed_peak(sizes, equivalent(system), known, sizes(known), last)


def enclosed_peak(sizes: Sizes, system: Equivalent, known: Array, found: Array, last: Peak) -> Peak:
    """Return the largest of `sizes`, bounded from above by the level sets of `system`.

    Parameters
    ----------
    sizes : callable
        The largest singular value of G at each ω in rad/s.
    system : Equivalent
        The same G as a state space, of which the eigenvalues are taken.
    known, found : ndarray
        Increasing frequencies in rad/s, among them those of the poles, and the sizes there.
    last : Peak
        Gain at infinite frequency, or at half the sampling frequency.

    Raises
    ------
    AccuracyError
        If the level sets do not close in on the peak.
    """
    best = climbed(sizes, known, found, last)
    for _ in range(_ROUNDS):
        if best.value == 0:
            return best
        level = best.value * (1 + PEAK_TOLERANCE)
        crossings = np.unique(level_crossings(system, level))
        between = np.sqrt(crossings[1:] * crossings[:-1])
        points = np.unique(np.concatenate([crossings, between]))
        found = sizes(points)
        higher = climbed(sizes, points, found, best)
        if higher.value <= level:
            return higher
        best = higher
    raise AccuracyError(
        "the peak of the frequency response could not be enclosed", where="peak_gain"
    )


def climbed(sizes: Sizes, points: Array, values: Array, best: Peak) -> Peak:
    """Return the top of the hill on which the largest of `values` lies, or `best` if higher."""
    if not len(points) or not np.max(values) > best.value:
        return best
    k = int(np.argmax(values))
    top, value = float(points[k]), float(values[k])
    left = points[k - 1] if k else top
    right = points[k + 1] if k + 1 < len(points) else top
    for _ in range(12):
        fine = np.linspace(left, right, 21)
        heights = sizes(fine)
        j = int(np.argmax(heights))
        gained = heights[j] - value
        if gained > 0:
            top, value = float(fine[j]), float(heights[j])
        left, right = fine[max(j - 1, 0)], fine[min(j + 1, 20)]
        if gained <= 1e-15 * value:
            break
    return Peak(value, top)


def level_crossings(system: Equivalent, level: float) -> Array:
    """Return frequencies in rad/s near which a singular value of G may equal `level`.

    The eigenvalues of the Hamiltonian matrix, or where a singular value of D is close to
    the level those of the even pencil of which it is the Schur complement.
    """
    A, B, C, D = system.A, system.B, system.C, system.D
    if not len(A):
        return np.zeros(0)
    gains = np.linalg.svd(D, compute_uv=False)
    if np.abs(gains - level).min(initial=np.inf) <= _SINGULAR * level:
        return system.near_axis(_pencil_eigenvalues(system, level))
    Dh = D.conj().T
    room = level**2 * np.eye(D.shape[1]) - Dh @ D
    inner, spread = np.linalg.solve(room, Dh @ C), np.linalg.solve(room, B.conj().T)
    drift = A + B @ inner
    hamiltonian = np.block(
        [
            [drift, level * B @ spread],
            [-C.conj().T @ (C + D @ inner) / level, -drift.conj().T],
        ]
    )
    return system.near_axis(np.linalg.eigvals(hamiltonian))


def _pencil_eigenvalues(system: Equivalent, level: float) -> ComplexArray:
    A, B, C, D = system.A, system.B, system.C, system.D / level
    b, c = B / np.sqrt(level), C / np.sqrt(level)
    Ch, n, m = c.conj().T, len(A), D.shape[1]
    size = max(float(np.linalg.norm(A, 2)), float(np.finfo(float).tiny))
    pencil = np.block(
        [
            [A / size, np.zeros((n, n)), b / np.sqrt(size)],
            [-Ch @ c / size, -A.conj().T / size, -Ch @ D / np.sqrt(size)],
            [
                D.conj().T @ c / np.sqrt(size),
                b.conj().T / np.sqrt(size),
                D.conj().T @ D - np.eye(m),
            ],
        ]
    )
    weight = np.diag(np.concatenate([np.ones(2 * n), np.zeros(m)]))
    return finite_eigenvalues(pencil, weight) * size


def finite_eigenvalues(pencil: Array | ComplexArray, weight: Array) -> ComplexArray:
    """Return the finite eigenvalues of pencil − λ·weight."""
    alpha, beta = eigvals(pencil, weight, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-13 * np.abs(alpha)
    return np.asarray(alpha[finite] / beta[finite])
