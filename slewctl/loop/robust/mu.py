"""The structured singular value of a matrix for a diagonal of complex scalars, from both sides.

μ(M) = 1 / min{max|δ_i| : det(I − M diag(δ)) = 0}.  From above by scaling, the smallest
σ_max(DMD⁻¹) over positive diagonal D, which is exact for up to three scalars; from below by
turning phases, the largest spectral radius ρ(MU) over unitary diagonal U, which attains μ at
its global maximum (J. C. Doyle, Analysis of feedback systems with structured uncertainties,
IEE Proc. D 129, 1982).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray

# Off-diagonal entries count at least this much of M, so that a triangular M has scales.
# A direction of no more than this is none: dividing by it would overflow.
_NOTHING = 1e-300
_FLOOR = 1e-12  # relative to M
_BALANCING = 30  # sweeps, each over all channels: where they start is all they decide
_CUTS = 3000  # of the search for scales, a safeguard
_ENOUGH = 1e-8  # relative: the gap at which scales are the best
_STARTS, _POLISHED = 512, 6  # random changes of phase, and how many of the best are polished


@dataclass(frozen=True, eq=False)
class Destabiliser:
    """A diagonal that makes I − M diag(δ) singular, all |δ_i| equal.

    Attributes
    ----------
    value : float
        1/|δ_i|, a lower bound of μ.
    delta : ndarray of complex, shape (n,)
    """

    value: float
    delta: ComplexArray


def balanced_scales(M: ComplexArray) -> Array:
    """Return scales d, shape (k, n), that balance rows and columns of each matrix.

    diag(d) M diag(1/d) has the smallest Frobenius norm (E. E. Osborne, J. ACM 7, 1960).
    With two scalars that is the smallest largest singular value as well, since the product
    of the two is fixed.

    Parameters
    ----------
    M : ndarray of complex, shape (k, n, n)
    """
    squared = np.abs(M) ** 2
    n = M.shape[-1]
    floor = (_FLOOR**2 * squared.sum(axis=(1, 2)) + np.finfo(float).tiny)[:, None, None]
    squared = (squared + floor) * (1 - np.eye(n))
    log = np.zeros(M.shape[:2])
    for _ in range(1 if n == 2 else _BALANCING):
        for i in range(n):
            weight = np.exp(2 * (log[:, i, None] - log))
            row, column = squared[:, i, :] * weight, squared[:, :, i] / weight
            log[:, i] -= 0.25 * (np.log(row.sum(axis=1)) - np.log(column.sum(axis=1)))
    return np.asarray(np.exp(log - log[:, -1:]))


def balanced_bound(M: ComplexArray) -> Array:
    """Return an upper bound of μ of each matrix, shape (k,): quick, the smallest for n = 2."""
    if M.shape[-1] == 1:
        return np.abs(M[:, 0, 0])
    d = balanced_scales(M)
    return np.asarray(np.linalg.norm(d[:, :, None] * M / d[:, None, :], 2, axis=(1, 2)))


def upper_bound(M: ComplexArray) -> tuple[float, Array]:
    """Return the smallest σ_max(DMD⁻¹), and the diagonal of D.

    log σ_max(e^x M e^−x) is convex in x, so cutting planes through the centres of shrinking
    ellipsoids find its minimum even where two singular values meet and it has a kink.

    Parameters
    ----------
    M : ndarray of complex, shape (n, n)
    """
    n = len(M)
    d = balanced_scales(M[None])[0] if n > 1 else np.ones(1)
    if n <= 2 or not np.any(M):
        return _sigma(M, d)[0], d
    x, best = minimised(
        lambda x: _sigma(M, np.append(np.exp(x), 1.0)), np.log(d[:-1]), 2.0, _ENOUGH
    )
    return best, np.append(np.exp(x), 1.0)


def minimised(
    function: Callable[[Array], tuple[float, Array]], start: Array, radius: float, enough: float
) -> tuple[Array, float]:
    """Return where a positive function whose logarithm is convex is smallest, and its value.

    Parameters
    ----------
    function : callable
        From x to the value and a slope of its logarithm.
    start : ndarray, shape (n,)
    radius : float
        Distance from the start within which the minimum is sought.
    enough : float
        Relative accuracy of the minimum.
    """
    x, P = start, radius**2 * np.eye(len(start))
    best, best_x = np.inf, x
    for _ in range(_CUTS):
        value, slope = function(x)
        if value < best:
            best, best_x = value, x
        reach = float(np.sqrt(slope @ P @ slope))
        if reach < enough:
            break
        # A cut through the centre, and deeper where the centre is no better than the best.
        x, P = _smaller_ellipsoid(x, P, slope / reach, min(np.log(value / best) / reach, 0.99))
    return best_x, best


def _sigma(M: ComplexArray, d: Array) -> tuple[float, Array]:
    """Return σ_max(DMD⁻¹) and the slope of its logarithm along log d, the last one fixed."""
    U, sigma, Vh = np.linalg.svd(d[:, None] * M / d)
    return float(sigma[0]), (np.abs(U[:, 0]) ** 2 - np.abs(Vh[0]) ** 2)[:-1]


def _smaller_ellipsoid(x: Array, P: Array, slope: Array, depth: float) -> tuple[Array, Array]:
    """Return the smallest ellipsoid around the part of (x, P) that a cut leaves."""
    n = len(x)
    step = P @ slope
    x = x - (1 + n * depth) / (n + 1) * step
    if n == 1:
        return x, P * ((1 - depth) / 2) ** 2
    turn = 2 * (1 + n * depth) / ((n + 1) * (1 + depth))
    P = n**2 / (n**2 - 1) * (1 - depth**2) * (P - turn * np.outer(step, step))
    return x, (P + P.T) / 2


def lower_bound(M: ComplexArray, seed: int = 0) -> Destabiliser:
    """Return the largest ρ(MU) found over phases, with the diagonal that it gives.

    Parameters
    ----------
    M : ndarray of complex, shape (n, n)
    seed : int
        Of the random phases from which the search climbs.
    """
    n = len(M)
    if not np.any(M):
        return Destabiliser(0.0, np.full(n, np.inf, dtype=complex))
    starts = np.zeros((1, n))
    if n > 1:
        turns = np.random.default_rng(seed).uniform(-np.pi, np.pi, (_STARTS, n - 1))
        turns = np.vstack([np.zeros(n - 1), _aligned(M), turns])
        starts = np.hstack([turns, np.zeros((len(turns), 1))])
    radius = np.abs(np.linalg.eigvals(M * np.exp(1j * starts)[:, None, :])).max(axis=1)
    best = starts[np.argsort(-radius)[:_POLISHED]]
    if n > 1:
        best = np.array([_climbed(M, turns) for turns in best])
    found = [np.linalg.eigvals(M * np.exp(1j * turns)) for turns in best]
    chosen = int(np.argmax([np.abs(values).max() for values in found]))
    top = found[chosen][np.argmax(np.abs(found[chosen]))]
    return Destabiliser(float(abs(top)), np.exp(1j * best[chosen]) / top)


def _aligned(M: ComplexArray) -> Array:
    """Return the phases that turn the optimally scaled M's output onto its input."""
    _, d = upper_bound(M)
    U, _, Vh = np.linalg.svd(d[:, None] * M / d)
    turns = np.angle(Vh[0].conj() / np.where(np.abs(U[:, 0]) > _NOTHING, U[:, 0], 1.0))
    return np.asarray(turns[:-1] - turns[-1])


def _climbed(M: ComplexArray, start: Array) -> Array:
    """Return phases at which ρ(MU) has a local maximum, the last one fixed."""
    from scipy.optimize import minimize  # slow to load: not before it is wanted

    def descent(turns: Array) -> tuple[float, Array]:
        MU = M * np.exp(1j * np.append(turns, 0.0))
        values, right = np.linalg.eig(MU)
        k = int(np.argmax(np.abs(values)))
        if values[k] == 0:
            return 0.0, np.zeros(len(turns))
        try:
            left = np.linalg.inv(right)[k]
        except np.linalg.LinAlgError:  # a defective eigenvalue has no slope
            return -float(np.log(np.abs(values[k]))), np.zeros(len(turns))
        return -float(np.log(np.abs(values[k]))), np.imag(left * right[:, k])[:-1]

    found = minimize(descent, start[:-1], jac=True, method="BFGS", options={"gtol": 1e-10})
    return np.append(found.x if found.fun <= descent(start[:-1])[0] else start[:-1], 0.0)
