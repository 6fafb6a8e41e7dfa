"""Coordinates in which a matrix is diagonal but for small triangular blocks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.numerics.modes import AT_ORIGIN, linked, near
from slewctl.numerics.ordered_schur import nearest_of, ordered_complex_schur

# An eigenvalue of a worse condition shares a block with those near to it: half of the digits.
_WORST = 1e6
# How near, relative: wider only where that leaves eigenvectors nearly parallel.
_NEARNESS = (1e-3, 1e-2, 0.1, 0.5)
# z = −1 in δ = z − 1, and how near to it a pole is taken to be there: its own rounding.
AT_END, _ROUNDED = -2.0, 64 * float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of states that A couples with each other.

    Attributes
    ----------
    V, W, J : ndarray, shape (count, n, n)
    blocks : tuple of ndarray of int
    integral : int or None
        A state that integrates the others and moves none of them: its pole, the last one, is
        exactly at the origin.
    """

    V: ComplexArray
    W: ComplexArray
    J: ComplexArray
    blocks: tuple[IntArray, ...] = ()
    integral: int | None = None

    @property
    def kept(self) -> IntArray:
        """All states but that one."""
        states = np.arange(self.V.shape[-1])
        return states[states != self.integral]

    @property
    def others(self) -> Modes:
        """The modes without that state."""
        kept = self.kept
        V, W = self.V[:, kept, :-1], self.W[:, :-1, kept]
        return Modes(V, W, self.J[:, :-1, :-1], self.blocks)


def outside(n: int, groups: Iterable[IntArray]) -> BoolArray:
    """Return which of n indices are in none of some groups."""
    alone = np.ones(n, dtype=bool)
    for group in groups:
        alone[group] = False
    return alone


def modal_bases(A: Array) -> Iterator[tuple[IntArray, Modes]]:
    """Yield the modes of a stack of matrices: small ones with good eigenvectors at once."""
    n, good = A.shape[-1], np.zeros(len(A), dtype=bool)
    if n <= 2:
        values, V = _eigen(A)
        # Of unit vectors, the determinant is the sine of the angle between them.
        angle = np.abs(np.linalg.det(V)) if n == 2 else np.ones(len(A))
        good = angle * _WORST >= 1
    if good.any():
        J = values[good][:, :, None] * np.eye(n, dtype=complex)
        yield np.flatnonzero(good), Modes(V[good], np.asarray(np.linalg.inv(V[good])), J)
    for k in np.flatnonzero(~good).tolist():
        yield np.array([k]), _of_others(A[k]) or _blocked(A[k], *_eigen(A[k]))


def _eigen(A: Array) -> tuple[ComplexArray, ComplexArray]:
    """Return eigenvalues, those at z = −1 exactly there, and unit eigenvectors."""
    values, V = np.linalg.eig(A)
    values = values.astype(complex)
    values[np.abs(values - AT_END) <= _ROUNDED] = AT_END
    return values, V.astype(complex)


def _blocked(A: Array, values: ComplexArray, V: ComplexArray) -> Modes:
    """Return the modes of one matrix, those with nearly parallel eigenvectors in blocks."""
    # Poles below that of all but are at the origin together, as are those that rounding makes.
    reach = max(AT_ORIGIN * float(np.abs(values).max(initial=0.0)), _known(A))
    for nearness in _NEARNESS:
        groups = _groups(values, nearness, reach)
        alone = np.array([group[0] for group in groups if len(group) == 1], dtype=int)
        blocks = [np.array([[value]]) for value in values[alone]]
        bases = [V[:, alone]]
        try:
            for group in groups:
                if len(group) > 1:
                    basis, T = _block_basis(A, values, group, reach)
                    bases.append(basis)
                    blocks.append(T)
            part = _assembled(np.hstack(bases), blocks)
        except LinAlgError:
            continue
        if np.linalg.norm(part.W, axis=2).max() <= _WORST:
            return part
    T, Z, _ = ordered_complex_schur(A, lambda poles: poles.real < 0)
    return _assembled(Z, [T])


def _of_others(A: Array) -> Modes | None:
    """Return the modes from those of all states but one that integrates them, if there is one.

    The angle of an arm whose slow friction alone holds it turns so.  As two of many
    eigenvectors, that of the friction and that of the angle are nearly parallel.
    """
    integrals = np.flatnonzero(~A.any(axis=0))
    if len(integrals) != 1 or len(A) == 1:
        return None
    state = int(integrals[0])
    kept = np.delete(np.arange(len(A)), state)
    inner = A[np.ix_(kept, kept)]
    values, V = _eigen(inner)
    if np.abs(values).min() <= _known(A):
        return None
    others = _blocked(inner, values, V)
    # What eigenvalues show beside the origin may be there, as a block has it.
    return integrated(A, others, state) if np.diagonal(others.J[0]).all() else None


def integrated(A: Array, others: Modes, state: int) -> Modes:
    """Return modes with a state beside them that integrates the others.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        Its column of the state is zero.
    others : Modes
        Of one matrix, without a pole at the origin.
    state : int
    """
    n = len(A)
    kept = np.delete(np.arange(n), state)
    V, W, J = (np.zeros((n, n), complex) for _ in range(3))
    seen = A[state, kept] @ others.V[0]
    row = np.linalg.solve(others.J[0].T, seen)
    V[kept, :-1], W[:-1, kept], J[:-1, :-1] = others.V[0], others.W[0], others.J[0]
    V[state], W[-1, kept] = np.append(row, 1), -(row @ others.W[0])
    W[-1, state] = 1
    return Modes(V[None], W[None], J[None], others.blocks, state)


def _known(A: Array) -> float:
    """Return what is zero but for rounding, as an eigenvalue.

    Ten times what an eigenvalue by itself may be off: of several at the origin the last carries
    the errors of the null vectors before it.  What is taken for zero is bounded as all that
    modes leave out.
    """
    return 10 * len(A) * float(np.finfo(float).eps * np.linalg.norm(A))


def _assembled(V: ComplexArray, blocks: list[ComplexArray]) -> Modes:
    J = np.zeros_like(V)
    index, start = [], 0
    for T in blocks:
        stop = start + len(T)
        J[start:stop, start:stop] = T
        if len(T) > 1:
            index.append(np.arange(start, stop))
        start = stop
    W = np.asarray(np.linalg.inv(V), dtype=complex)
    return Modes(V[None], W[None], J[None], tuple(index))


def _groups(poles: ComplexArray, nearness: float, reach: float) -> list[IntArray]:
    """Return the poles in groups linked by a chain of near ones, those at the origin together."""
    slow = np.abs(poles) <= reach
    return linked(near(poles, nearness) | np.outer(slow, slow))


def _block_basis(
    A: Array, values: ComplexArray, group: IntArray, reach: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return a basis of the invariant subspace of a group, orthonormal, and A on it."""
    T, Z, k = ordered_complex_schur(A, nearest_of(values, group))
    if k != len(group):
        raise LinAlgError("eigenvalues too close to be told apart")
    if np.abs(values[group]).max() > reach:
        return Z[:, :k], T[:k, :k]
    return _nilpotent(Z[:, :k], T[:k, :k], _known(A))


def _nilpotent(Z: ComplexArray, M: ComplexArray, known: float) -> tuple[ComplexArray, ComplexArray]:
    """Return a basis in which a block at the origin is triangular, poles below `known` zero.

    A Schur form would have ±√ε on its diagonal for the zeros of a rigid body; null vectors,
    one after the other, leave a residual of ε.
    """
    k = len(M)
    for j in range(k - 1):
        v = np.linalg.svd(M[j:, j:])[2][-1].conj()
        turn = np.eye(k, dtype=complex)
        turn[j:, j:] = np.linalg.qr(np.column_stack([v, np.eye(k - j)]))[0]
        Z, M = Z @ turn, turn.conj().T @ M @ turn
    T = np.triu(M)
    own = np.diagonal(T).copy()
    own[np.abs(own) <= known] = 0.0
    np.fill_diagonal(T, own)
    return Z, T
