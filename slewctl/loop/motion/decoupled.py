"""A state matrix taken apart into parts that do not act on each other.

Where the eigenvectors are well conditioned each eigenvalue stands alone.  Those that are
not, as of a double pole that has one eigenvector, stay together in a triangular block
(C. A. Bavely and G. W. Stewart, SIAM J. Numerical Analysis 16, 1979), so that nothing is
lost to large terms of opposite sign.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig, schur, solve_sylvester
from scipy.sparse.csgraph import connected_components

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.errors import AccuracyError
from slewctl.numerics.balance import balance

# Largest condition number of an eigenvalue that stands alone, and of a block.
_ALONE = 1e4
# The parts add up to the whole to this, in balanced coordinates.
_COMPLETE = 1e-8
# Eigenvalues are put together that are nearer to each other than this, relative to their
# own size, or than its square, relative to the largest.
_NEARNESS = (1e-8, 1e-6, 1e-4, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class Block:
    """A part of several eigenvalues: ẋ = T x.

    Attributes
    ----------
    T : ndarray, shape (k, k)
        Upper triangular.
    right, left : ndarray, shapes (n, k), (k, n)
        From the part to the states, and back.
    """

    T: ComplexArray
    right: ComplexArray
    left: ComplexArray

    @property
    def worst(self) -> float:
        """How much the part may exceed the states that it is of: its condition number."""
        return float(np.linalg.norm(self.left, 2))


@dataclass(frozen=True, eq=False)
class Decoupled:
    """The parts of a real matrix: x is the real part of their sum.

    Attributes
    ----------
    rates : ndarray, shape (K,)
        Eigenvalues that stand alone, one of each conjugate pair.
    right, left : ndarray, shapes (n, K), (K, n)
        From these parts to the states, and back.
    blocks : tuple of Block
        The others, both of each pair.
    """

    rates: ComplexArray
    right: ComplexArray
    left: ComplexArray
    blocks: tuple[Block, ...]


def decoupled(A: Array) -> Decoupled:
    """Take a real matrix apart.

    Parameters
    ----------
    A : ndarray, shape (n, n)

    Raises
    ------
    AccuracyError
        If its parts cannot be told apart to eight digits.
    """
    scale = balance(A)
    balanced = A / scale[:, None] * scale
    values, left, right = eig(balanced, left=True)  # type: ignore[misc]
    meeting = (left.conj() * right).sum(axis=0)
    alone = np.abs(meeting) > 1 / _ALONE
    left = (left.conj() / np.where(alone, meeting, 1)).T
    right = right * np.where(values.imag > 0, 2.0, 1.0)
    for free, blocks in _parted(balanced, values, alone):
        kept = free & (values.imag >= 0)
        whole = (right[:, kept] @ left[kept]).real + sum((b.right @ b.left).real for b in blocks)
        if np.abs(whole - np.eye(len(A))).max() < _COMPLETE:
            return Decoupled(
                values[kept],
                scale[:, None] * right[:, kept],
                left[kept] / scale,
                tuple(Block(b.T, scale[:, None] * b.right, b.left / scale) for b in blocks),
            )
    raise AccuracyError(
        "the modes of the loop cannot be told apart to working precision",
        where="slew",
        remedy="give the controller in better conditioned coordinates",
    )


def _parted(
    A: Array, values: ComplexArray, alone: BoolArray
) -> Iterator[tuple[BoolArray, tuple[Block, ...]]]:
    """Yield which eigenvalues stand alone and blocks of all others, the smallest blocks first."""
    from scipy.optimize import linear_sum_assignment  # slow to load: not before it is wanted

    if alone.all():
        yield alone, ()
        return
    again = np.diag(schur(A, output="complex")[0])
    # Those that can stand alone are well conditioned: each is found again.
    able = np.flatnonzero(alone)
    _, known = linear_sum_assignment(np.abs(values[able][:, None] - again))
    others = np.setdiff1d(np.arange(len(again)), known)
    for nearness in _NEARNESS:
        groups = [group for group in _linked(again, nearness) if np.isin(others, group).any()]
        if min(map(len, groups)) == 1:
            continue  # one of the others would be alone
        blocks = tuple(block for group in groups if (block := _block(A, again, group)))
        if len(blocks) < len(groups) or max(block.worst for block in blocks) > _ALONE:
            continue
        free = alone.copy()
        free[able[np.isin(known, np.concatenate(groups))]] = False
        yield free, blocks


def _linked(values: ComplexArray, nearness: float) -> list[IntArray]:
    """Return groups of eigenvalues that are linked by a chain of near ones."""
    sizes = np.abs(values)
    room = nearness * np.maximum(sizes[:, None], sizes) + nearness**2 * sizes.max()
    count, label = connected_components(np.abs(values[:, None] - values) <= room)
    return [np.flatnonzero(label == k) for k in range(count)]


def _block(A: Array, values: ComplexArray, group: IntArray) -> Block | None:
    """Return the block of a group of the eigenvalues of A; None if it is not found again."""

    member = np.isin(np.arange(len(values)), group)

    def chosen(z: complex) -> bool:
        return bool(member[np.argmin(np.abs(values - z))])

    T, U, k = schur(A, output="complex", sort=chosen)  # type: ignore[call-overload]
    if k != len(group):
        return None
    right, left = U[:, :k], U[:, :k].conj().T
    if k < len(A):
        apart = solve_sylvester(T[:k, :k], -T[k:, k:], T[:k, k:])
        left = left + apart @ U[:, k:].conj().T
    return Block(T[:k, :k], right, left)
