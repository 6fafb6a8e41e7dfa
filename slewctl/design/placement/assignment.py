"""Gains that put the poles of A − B F where they are wanted, and how sensitive those then are.

Modes that are left alone are taken out first: their invariant subspace gets no gain, so
their poles stay to rounding.  For what remains:

* One input, uncoupled modes (no friction): the gain of mode m follows from the remainder of
  ∏ q_j / ∏_{j≠m} p_j modulo p_m, where p are the modes' own quadratics and q the wanted ones.
  This is Ackermann's formula applied to each mode by itself, in 2 × 2 matrices: every factor
  is a difference that the data give to full accuracy, and wanted poles may be repeated.
  The pole of a lag is a mode of one state, in 1 × 1 matrices.
* One input, modes coupled by friction: the poles are moved one by one along the diagonal of
  a Schur form (A. Varga, IEEE Trans. Automatic Control 26, 1981, pp. 517–519).
* Several inputs leave a choice: the gain of best conditioned eigenvectors, either that of
  Tits and Yang (as scipy.signal.place_poles finds it) or that of the best single
  combination of the inputs, which also takes poles repeated more often.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, eig, schur

from slewctl._types import Array, ComplexArray
from slewctl.design.placement.pole_pairs import LonePole, OpenLoop, PolePair, Roots
from slewctl.errors import AccuracyError
from slewctl.numerics.ordered_schur import nearest_of, ordered_schur
from slewctl.numerics.pairing import paired

# Poles that an input moves by less than this fraction of its reach are out of it.
_OUT_OF_REACH = 1e-11
# Poles are where they are wanted when a relative change of the matrix this small explains it.
MISPLACED = 1e-13
# Directions among which the best combination of inputs is sought; the same on every run.
_TRIALS = 64


@dataclass(frozen=True, eq=False)
class PoleSensitivity:
    """How far the eigenvalues of a matrix move when the matrix changes.

    Attributes
    ----------
    poles : ndarray of complex
    condition : ndarray
        Of each pole: a change E of the matrix moves it by at most condition·‖E‖ to first
        order; 1 is the best possible, infinite where eigenvectors coincide.
    eigenvectors : float
        Condition number κ(V) of the unit eigenvectors: no pole moves by more than
        κ(V)·‖E‖ whatever E is (Bauer and Fike).
    """

    poles: ComplexArray
    condition: Array
    eigenvectors: float


def pole_sensitivity(A: Array) -> PoleSensitivity:
    """Return the condition numbers of the eigenvalues of a matrix.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        They depend on the coordinates; those in which states have comparable energies are
        the fair ones for a flexible arm.

    Returns
    -------
    PoleSensitivity

    Examples
    --------
    >>> import numpy as np
    >>> import slewctl as sc
    >>> sc.pole_sensitivity(np.array([[-1.0, 100.0], [0.0, -2.0]])).condition.round(1).tolist()
    [100.0, 100.0]
    """
    # In these coordinates, not in balanced ones.  The stubs of scipy promise two results.
    values, left, right = eig(A, left=True, right=True)  # type: ignore[misc]
    with np.errstate(divide="ignore"):
        condition = 1 / np.abs(np.sum(left.conj() * right, axis=0))
    return PoleSensitivity(
        np.asarray(values, dtype=complex), condition, float(np.linalg.cond(right))
    )


@dataclass(frozen=True)
class Misplacement:
    """How far the eigenvalues of a matrix are from wanted ones.

    Attributes
    ----------
    change : float
        The largest distance of a pole over its own condition number and the matrix' norm:
        the relative change of the matrix that explains the distance.
    distance : float
        The largest distance of a pole over its magnitude.
    """

    change: float
    distance: float


def misplacement(A: Array, wanted: Sequence[complex] | ComplexArray) -> Misplacement:
    """Return how far the eigenvalues of A, recomputed, are from wanted ones.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    wanted : sequence of complex
        n of them.
    """
    found, poles = pole_sensitivity(A), np.asarray(wanted)
    distance = np.abs(found.poles[:, None] - poles)
    rows, columns = paired(distance)
    distances = distance[rows, columns]
    size = np.linalg.norm(A, 2) or 1.0
    slowest = np.finfo(float).eps * size  # a pole at the origin has no relative distance
    return Misplacement(
        float((distances / found.condition[rows]).max() / size),
        float((distances / np.maximum(np.abs(poles[columns]), slowest)).max()),
    )


def out_of_reach(loop: OpenLoop, B: Array, modes: Sequence[int]) -> int | None:
    """Return the first of `modes` that no input reaches (Popov–Belevitch–Hautus), or None."""
    A, b, _ = _part(loop, B, modes)
    size = np.linalg.norm(A, 2) or 1.0
    reach = np.linalg.norm(B, 2) or 1.0
    for mode in modes:
        for pole in loop.pairs[mode].poles:
            pencil = np.hstack([(A - pole * np.eye(len(A))) / size, b / reach])
            if np.linalg.svd(pencil, compute_uv=False)[-1] < _OUT_OF_REACH:
                return mode
    return None


def assign(loop: OpenLoop, B: Array, wanted: Mapping[int, Roots]) -> Array:
    """Return F for which A − B F has the wanted poles, and its others where they were.

    Parameters
    ----------
    loop : OpenLoop
        The matrix A, shape (n, n), and its modes.
    B : ndarray, shape (n, m)
        Columns in comparable units.
    wanted : mapping of int to PolePair or LonePole
        The modes to move, each reached by an input; which pair goes with which mode is of no
        consequence.

    Returns
    -------
    ndarray, shape (m, n)

    Raises
    ------
    AccuracyError
        If the modes to move and those to leave cannot be told apart.
    """
    if not wanted:
        return np.zeros((B.shape[1], len(loop.A)))
    modes = sorted(wanted)
    A, b, basis = _part(loop, B, modes)
    pairs = [wanted[mode] for mode in modes]
    roots = np.array([pole for pair in pairs for pole in pair.poles])
    if B.shape[1] > 1:
        gain = _robust_gain(A, b, roots)
    elif loop.states is not None:
        gain = _gain_by_modes(A, b[:, 0], [loop.pairs[mode] for mode in modes], pairs)[None]
    else:
        gain = gain_by_deflation(A, b[:, 0], roots)[None]
    return gain @ basis.T


def _part(loop: OpenLoop, B: Array, modes: Sequence[int]) -> tuple[Array, Array, Array]:
    """Return A and B of some modes, and the left invariant subspace that has them.

    With A₁ = WᵀA W and WᵀA = A₁Wᵀ, a gain G Wᵀ moves the poles of A₁ alone.
    """
    n = len(loop.A)
    if loop.states is not None:
        index = np.array([state for mode in modes for state in loop.states[mode]], dtype=int)
        return loop.A[np.ix_(index, index)], B[index], np.eye(n)[:, index]
    if len(modes) == len(loop.pairs):
        return loop.A, B, np.eye(n)
    chosen = np.array([mode in modes for mode, pair in enumerate(loop.pairs) for _ in pair.poles])
    roots = np.array([pole for pair in loop.pairs for pole in pair.poles])
    try:
        T, W, count = ordered_schur(loop.A.T, nearest_of(roots, np.flatnonzero(chosen)))
    except LinAlgError as error:
        raise _inseparable() from error
    if count != chosen.sum():
        raise _inseparable()
    W = W[:, :count]
    return T[:count, :count].T, W.T @ B, W


def _inseparable() -> AccuracyError:
    return AccuracyError(
        "the modes to move and those to leave alone are too close to be told apart",
        where="leave",
        remedy="move both, or leave both alone",
    )


def _gain_by_modes(A: Array, b: Array, own: Sequence[Roots], wanted: Sequence[Roots]) -> Array:
    """Return the gain of uncoupled modes, a block each, from remainders modulo each mode."""
    gain, start = np.zeros(len(A)), 0
    for m, mine in enumerate(own):
        here = slice(start, start + len(mine.poles))
        block, force = A[here, here], b[here]
        remainder = _remainder(wanted[m], mine, block)
        for j, other in enumerate(own):
            if j != m:
                below = _remainder(other, mine, block)
                remainder = remainder @ _remainder(wanted[j], mine, block) @ np.linalg.inv(below)
        reach = np.column_stack([force, block @ force])[:, : len(block)]
        gain[here] = np.linalg.solve(reach.T, np.eye(len(block))[-1]) @ remainder
        start = here.stop
    return gain


def _remainder(roots: Roots, mine: Roots, block: Array) -> Array:
    """Return the polynomial with these roots of the block of the mode `mine`."""
    eye = np.eye(len(block))
    if isinstance(roots, LonePole):
        return np.asarray(block - roots.pole * eye)
    if isinstance(mine, PolePair):  # less the block's own polynomial, which is zero there
        damping, stiffness = roots.damping - mine.damping, roots.stiffness - mine.stiffness
        return np.asarray(damping * block + stiffness * eye)
    return np.asarray(block @ block + roots.damping * block + roots.stiffness * eye)


def gain_by_deflation(A: Array, b: Array, wanted: ComplexArray) -> Array:
    """Return the gain f for which A − b fᵀ has the wanted poles, by Varga's Schur method.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    b : ndarray, shape (n,)
        Reaching every mode of A.
    wanted : ndarray of complex, shape (n,)
        Closed under conjugation.

    Returns
    -------
    ndarray, shape (n,)
    """
    T, Z = schur(A.astype(complex), output="complex")
    force, remaining = Z.conj().T @ b.astype(complex), list(wanted)
    gain = np.zeros(len(A), dtype=complex)
    for done in range(len(A)):
        own = T[-1, -1]
        pole = remaining.pop(int(np.argmin([abs(own - p) for p in remaining])))
        step = (own - pole) / force[-1]
        T[:, -1] -= step * force
        gain += step * Z[:, -1].conj()
        for i in range(len(A) - 2, done - 1, -1):
            _swap(T, Z, force, i)
    return gain.real


def _swap(T: ComplexArray, Z: ComplexArray, b: ComplexArray, i: int) -> None:
    """Exchange the diagonal entries i and i + 1 of a Schur form, in place."""
    x = np.array([T[i, i + 1], T[i + 1, i + 1] - T[i, i]])
    size = np.linalg.norm(x)
    if size == 0:
        return  # equal, and not coupled
    x /= size
    turn = np.array([[x[0], -x[1].conj()], [x[1], x[0].conj()]])
    here = slice(i, i + 2)
    T[:, here] = T[:, here] @ turn
    T[here] = turn.conj().T @ T[here]
    T[i + 1, i] = 0.0
    Z[:, here] = Z[:, here] @ turn
    b[here] = turn.conj().T @ b[here]


def _robust_gain(A: Array, B: Array, roots: ComplexArray) -> Array:
    """Return the gain of best conditioned eigenvectors among those that can be computed."""
    from scipy.signal import place_poles  # slow to load: not before it is wanted

    # What is sought begins with the inputs in turn: the order in which they are named is none.
    order = np.argsort(np.linalg.norm(B, axis=0), kind="stable")
    back, B = np.argsort(order), B[:, order]
    mixed = _best_mixture(A, B)
    with np.errstate(all="ignore"):
        # Modes of one frequency are out of reach of any one combination: no number then.
        candidates = [mixed[:, None] * gain_by_deflation(A, B @ mixed, roots)]
    try:
        with warnings.catch_warnings():
            # "Convergence was not reached": what was reached is measured below.
            warnings.simplefilter("ignore", UserWarning)
            candidates.append(place_poles(A, B, roots, method="YT").gain_matrix)
    except ValueError:
        pass  # a pole repeated more often than there are independent inputs
    usable = [gain for gain in candidates if np.isfinite(gain).all()]
    if not usable:
        raise AccuracyError(
            "no gain for these poles could be computed",
            where="poles",
            remedy="do not repeat a pole more often than there are sensors",
        )
    return min(usable, key=lambda gain: _badness(A - B @ gain, roots))[back]


def _badness(closed: Array, roots: ComplexArray) -> tuple[bool, float]:
    """Return whether poles were missed, and the condition of the eigenvectors."""
    return misplacement(closed, roots).change > MISPLACED, pole_sensitivity(closed).eigenvectors


def _best_mixture(A: Array, B: Array) -> Array:
    """Return the unit combination of inputs by which the worst reached mode is reached best."""
    reach = B.T @ np.linalg.eig(A.T)[1]
    reach = reach / np.maximum(np.linalg.norm(reach, axis=0), np.finfo(float).tiny)
    directions = np.random.default_rng(0).standard_normal((_TRIALS, B.shape[1]))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    trials = np.vstack([np.eye(B.shape[1]), directions])
    return trials[int(np.argmax(np.abs(trials @ reach).min(axis=1)))]
