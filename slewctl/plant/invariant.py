"""Invariant subspaces of a state matrix: the rigid body's, single modes, poles that coincide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from scipy.linalg import LinAlgError, block_diag, schur

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.errors import AccuracyError, InputError
from slewctl.numerics.modes import (
    AT_ORIGIN,
    at_origin,
    conjugate_pairs,
    inseparable,
    invariant_basis,
    linked,
    near,
    real_pairs,
    rigid_body,
)
from slewctl.numerics.ordered_schur import ordered_schur

# Poles this close to each other, relative, with eigenvectors at this angle or less are one
# mode.  A pole of multiplicity m and its eigenvectors are computed with an error of about
# ε^(1/m): the first value is for up to eight, the others where that leaves them parallel.
_CLUSTERED = (0.03, 0.1, 0.3)
# A transformation of a worse condition would spoil more digits than a reduction needs.
_WORST_CONDITION = 1e9
# With this one and better, wider clusters are not tried: what it costs goes with its square.
_GOOD_CONDITION = 1e3


@dataclass(frozen=True, eq=False)
class Piece:
    """The invariant subspaces of one set of coupled states, in the whole system's states."""

    rigid: Array  # columns of a basis of the rigid subspace
    rigid_left: Array
    rigid_block: Array
    flexible: ComplexArray  # A of the flexible states
    unitary: ComplexArray
    right: ComplexArray
    left: ComplexArray
    modes: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, A: Array, states: list[int], size: float) -> Piece:
        block = A[np.ix_(states, states)]
        poles, vectors = np.linalg.eig(block)
        poles, vectors = poles.astype(complex), vectors.astype(complex)
        slow = rigid_body(poles, size)
        Z, A_rigid = _rigid_subspace(block, np.abs(poles[slow]).max(initial=0.0), slow, size)
        T, order, modes, clusters = _split(block, poles, vectors, Z, np.flatnonzero(~slow))
        inverse = np.linalg.inv(T)
        k, single = Z.shape[1], Z.shape[1] + len(order)
        # The eigenvalues' errors are of the size of A; a Rayleigh quotient's are not.
        exact = np.einsum("ij,ji->i", inverse @ block, T)[k:single]
        exact = np.where(poles[order].imag == 0, exact.real, exact).astype(complex)
        upper = np.flatnonzero(exact.imag > 0)
        exact[upper + 1] = exact[upper].conj()
        blocks, turns = [np.diag(exact)], [_to_real(exact)]
        for start, cluster in zip(_starts(clusters, single), clusters, strict=True):
            here = slice(start, start + len(cluster))
            own, turn = schur((inverse[here] @ block @ T[:, here]).real, output="complex")
            T[:, here], inverse[here] = T[:, here] @ turn, turn.conj().T @ inverse[here]
            blocks.append(own)
            turns.append(turn)
        flexible = np.asarray(block_diag(*blocks), dtype=complex)
        _refuse_unstable(np.diagonal(flexible), size)
        whole = len(A)
        right = np.zeros((whole, len(states)), dtype=complex)
        left = np.zeros((len(states), whole), dtype=complex)
        right[states], left[:, states] = T, inverse
        return cls(
            right[:, :k].real,
            left[:k].real,
            A_rigid,
            flexible,
            np.asarray(block_diag(*turns), dtype=complex),
            right[:, k:],
            left[k:],
            consecutive([*modes, *clusters]),
        )


def _split(
    A: Array, poles: ComplexArray, vectors: ComplexArray, rigid: Array, chosen: IntArray
) -> tuple[ComplexArray, list[int], tuple[tuple[int, ...], ...], list[tuple[int, ...]]]:
    """Return a basis of all subspaces: the rigid body's, single modes, poles that coincide.

    Returns
    -------
    T : ndarray of complex, shape (n, n)
    order : list of int
        Poles of the single modes.
    modes, clusters : sequence of tuple of int
        Single modes, by their place in `order`; poles of each of the others.
    """
    best, least = None, _WORST_CONDITION
    for width in _CLUSTERED:
        clusters = _clusters(poles, vectors, chosen, width)
        order, modes = _paired(poles, sorted(set(chosen.tolist()).difference(*clusters)))
        bases = [invariant_basis(A, poles, cluster, "reduction") for cluster in clusters]
        T = np.hstack([rigid, vectors[:, order], *bases])
        condition = float(np.linalg.cond(T))
        if condition <= least:
            best, least = (T, order, modes, clusters), condition
        if condition <= _GOOD_CONDITION:
            break
    if best is not None:
        return best
    raise AccuracyError(
        "the modes of the system are too nearly parallel to be told apart",
        where="reduction",
        remedy="use modal coordinates",
    )


def _starts(groups: Sequence[Sequence[int]], first: int) -> list[int]:
    """Return where each of consecutive groups begins."""
    return [*accumulate((len(group) for group in groups[:-1]), initial=first)] if groups else []


def _to_real(poles: ComplexArray) -> ComplexArray:
    """Return U with x_real = U x for single poles: a pair to its real and imaginary part."""
    U = np.eye(len(poles), dtype=complex)
    for i in np.flatnonzero(poles.imag > 0):
        U[i : i + 2, i : i + 2] = np.array([[1, 1], [1j, -1j]]) / np.sqrt(2)
    return U


def _clusters(
    poles: ComplexArray, vectors: ComplexArray, chosen: IntArray, width: float
) -> list[tuple[int, ...]]:
    """Return the sets of poles, conjugates included, that are close with parallel eigenvectors."""
    own, shapes = poles[chosen], vectors[:, chosen]
    cosines = np.abs(shapes.conj().T @ shapes)
    joined = near(own, width) & (1 - cosines**2 <= width**2)
    # The conjugate of a cluster is one as well; both are one mode, with real coordinates.
    upper = chosen[own.imag > 0]
    pairs = np.searchsorted(chosen, upper)
    crowded = joined.sum(axis=0) > 1
    joined[pairs, pairs + 1] |= crowded[pairs]
    groups = [group for group in linked(joined) if crowded[group].any()]
    return [tuple(chosen[group].tolist()) for group in groups]


def _rigid_subspace(A: Array, largest: float, rigid: BoolArray, size: float) -> tuple[Array, Array]:
    """Return a basis of the rigid body's subspace, and A on it as [[0, 1], [0, −d]]."""
    count = int(rigid.sum())
    if not count:
        return np.zeros((len(A), 0)), np.zeros((0, 0))
    limit = largest * (1 + 1e-6) + np.finfo(float).eps * size

    # An ordered Schur form: the eigenvectors of a pole near the origin and of one at it are
    # almost parallel, the plane that they span is well defined all the same.
    def slow(poles: ComplexArray) -> BoolArray:
        return at_origin(poles, size) | (poles.imag == 0) & (np.abs(poles) <= limit)

    try:
        T, Z, found = ordered_schur(A, slow)
    except LinAlgError as error:
        raise inseparable("reduction") from error
    if found != count:
        raise inseparable("reduction")
    Z, block = Z[:, :count], T[:count, :count]
    if count == 1:
        return Z, np.zeros((1, 1))
    if count > 2:
        check_rigid(count)
    rate = -float(np.trace(block))
    rate = 0.0 if abs(rate) <= len(A) * np.finfo(float).eps * size else rate
    angle = np.linalg.svd(block)[2][-1]
    angle *= np.sign(angle[np.argmax(np.abs(angle))])
    # A w = v − d w: the matrix A + d has rank one, so its pseudoinverse is its transpose.
    shifted = block + rate * np.eye(2)
    if np.linalg.norm(shifted) <= AT_ORIGIN * size:
        check_rigid(3)
    w = shifted.T @ angle / np.linalg.norm(shifted) ** 2
    return Z @ np.column_stack([angle, w]), np.array([[0.0, 1.0], [0.0, 0.0 - rate]])


def check_rigid(count: int) -> None:
    if count > 2:
        raise InputError(
            "more poles at the origin, or next to it beside the fastest pole, than the one "
            "rotation of a rigid body has",
            where="reduction",
            remedy="leave integrators other than the arm's own, and lags millions of times as fast "
            "as its modes, out of the system",
        )


def _refuse_unstable(poles: ComplexArray, size: float) -> None:
    growing = poles[poles.real > 1e-12 * size]
    if growing.size:
        raise InputError(
            f"a pole at {growing.real.max():.3g} rad/s is unstable",
            where="reduction",
            remedy="reduce the open-loop arm, or a stable system",
        )


def _paired(poles: ComplexArray, kept: list[int]) -> tuple[list[int], tuple[tuple[int, ...], ...]]:
    """Return an order of the poles in which those of one mode follow each other, and the modes.

    Real poles are taken as those of overdamped modes.
    """
    overdamped, lone = real_pairs(poles, kept, overdamped=True)
    groups = [*conjugate_pairs(poles, kept), *overdamped, *((i,) for i in lone)]
    order = [i for group in groups for i in group]
    return order, consecutive(groups)


def consecutive(groups: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
    """Return groups of the same lengths that count on from zero."""
    ends = [0, *accumulate(len(group) for group in groups)]
    return tuple(tuple(range(first, last)) for first, last in pairwise(ends))
