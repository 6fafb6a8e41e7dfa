"""A state matrix taken apart into parts that do not act on each other.

Where the eigenvectors are well conditioned each eigenvalue stands alone.  Those that are
not, as of a double pole that has one eigenvector, stay together in a triangular block
(C. A. Bavely and G. W. Stewart, SIAM J. Numerical Analysis 16, 1979), so that nothing is
lost to large terms of opposite sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.linalg import schur, solve_sylvester

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.errors import AccuracyError
from slewctl.loop.motion.eigenpairs import Pairs, scale_of_the_slow
from slewctl.numerics.modes import Eigensystem, linked, near
from slewctl.numerics.ordered_schur import nearest_of, ordered_complex_schur
from slewctl.numerics.pairing import paired

# Largest condition numbers of an eigenvalue that stands alone: if too much is lost with one
# of them the next is tried.
_ALONE = (1e4, 1e2, 1e1)
# Largest condition number of a block.
_WORST = 1e4
# So much of the motion may be lost in rounding, in balanced coordinates.
_LOST = 1e-6
# Eigenvalues are put together that are nearer to each other than this, relative to their
# own size, or than its square, relative to the largest.
_NEARNESS = (1e-8, 1e-6, 1e-4, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0)


# The matrix of a part, and the way from it to the states.
Part = tuple[ComplexArray, ComplexArray]
# From eigenvalues to times.
Lasting = Callable[[ComplexArray], Array]


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


def decoupled(A: Array, lasting: Lasting | None = None) -> Decoupled:
    """Take a real matrix apart.

    The way from the states to the parts is the inverse of the way back: left eigenvectors
    that are found for themselves do not match where eigenvalues are near to each other, even
    if these are as well conditioned as those of a normal matrix.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    lasting : callable, optional
        From eigenvalues to how long their parts matter; by default 1/|real part|.

    Raises
    ------
    AccuracyError
        If rounding hides more than 1e-6 of the motion of the parts.
    """
    whole, last = Eigensystem.of(A), lasting or _damped
    balanced, scale, pairs = whole.balanced, whole.scale, Pairs.of(whole)
    found = _alone(balanced, scale, pairs, last) or _alone_beside_the_fast(
        balanced, scale, pairs, last
    )
    if found:
        return found
    for limit in _ALONE:
        # Larger blocks only when no more can be taken out of those that stand alone.
        tried = None if limit == _ALONE[-1] else 1
        parted = _parted(balanced, pairs.values, pairs.condition < limit)
        for free, blocks in islice(parted, tried):
            if found := _apart(balanced, scale, pairs, free, blocks, last):
                return found
    raise AccuracyError(
        "the modes of the loop cannot be told apart to working precision",
        where="slew",
        remedy="give modes some damping, or the controller in better conditioned coordinates",
    )


def _alone(A: Array, scale: Array, pairs: Pairs, lasting: Lasting) -> Decoupled | None:
    """Return the parts of a balanced matrix if every eigenvalue stands alone."""
    every = pairs.condition < _ALONE[0]
    return _apart(A, scale, pairs, every, [], lasting) if every.all() else None


def _alone_beside_the_fast(
    A: Array, scale: Array, pairs: Pairs, lasting: Lasting
) -> Decoupled | None:
    """Return the same in scales and with eigenpairs that a far faster part does not spoil.

    A lag of 1e-6 s beside modes of seconds makes all that is slow ill-conditioned in the
    scales that balance its row and column, and eigenvalue solvers err by what is rounding to
    the largest entry.
    """
    own = scale_of_the_slow(A, pairs.values)
    if own is None:
        return None
    A = A / own[:, None] * own
    try:
        pairs = pairs.scaled(own).refined(A)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return _alone(A, scale * own, pairs, lasting)


def _apart(
    A: Array,
    scale: Array,
    pairs: Pairs,
    free: BoolArray,
    blocks: list[Part],
    lasting: Lasting,
) -> Decoupled | None:
    """Return the parts of a balanced matrix, None if too much of the motion is not theirs."""
    parts = [(np.diag(pairs.values[free]), pairs.right[:, free]), *blocks]
    there = np.linalg.inv(np.hstack([columns for _, columns in parts])).astype(complex)
    return _scaled(parts, there, scale) if _lost(A, parts, there, lasting) < _LOST else None


def _damped(values: ComplexArray) -> Array:
    """Return how long the parts of eigenvalues last."""
    return np.asarray(1 / np.maximum(np.abs(values.real), np.finfo(float).tiny))


def _lost(A: Array, parts: list[Part], there: ComplexArray, lasting: Lasting) -> float:
    """Estimate the part of the motion that is not that of the parts.

    What A does beyond the parts acts for as long as the shorter-lived of two of them lasts,
    or until they are out of step.
    """
    values = np.concatenate([np.diag(T) for T, _ in parts])
    beyond = np.abs(there @ np.hstack([A @ columns - columns @ T for T, columns in parts]))
    lasts, apart = lasting(values), np.abs(values[:, None] - values)
    acting = np.minimum(np.minimum(lasts[:, None], lasts), 2 / np.maximum(apart, 1e-300))
    return float((beyond * acting * np.linalg.norm(there, axis=1)).max())


def _scaled(parts: list[Part], there: ComplexArray, scale: Array) -> Decoupled:
    """Return the parts in the coordinates before balancing."""
    (alone, columns), *blocks = parts
    ends = np.cumsum([len(T) for T, _ in parts])
    back, *ways = np.split(there / scale, ends[:-1])
    rates = np.diag(alone)
    kept = rates.imag >= 0
    twice = np.where(rates[kept].imag > 0, 2.0, 1.0)
    return Decoupled(
        rates[kept],
        scale[:, None] * columns[:, kept] * twice,
        back[kept],
        tuple(
            Block(T, scale[:, None] * right, left)
            for (T, right), left in zip(blocks, ways, strict=True)
        ),
    )


def _parted(
    A: Array, values: ComplexArray, alone: BoolArray
) -> Iterator[tuple[BoolArray, list[Part]]]:
    """Yield which eigenvalues stand alone and blocks of all others, the smallest blocks first."""
    if alone.all():
        yield alone, []
        return
    again = np.diag(schur(A, output="complex")[0])
    # Those that can stand alone are well conditioned: each is found again.
    able = np.flatnonzero(alone)
    _, known = paired(np.abs(values[able][:, None] - again))
    others = np.setdiff1d(np.arange(len(again)), known)
    for nearness in _NEARNESS:
        joined = near(again, nearness, floor=nearness**2 * float(np.abs(again).max()))
        groups = [group for group in linked(joined) if np.isin(others, group).any()]
        if min(map(len, groups)) == 1:
            continue  # one of the others would be alone
        blocks = [block for group in groups if (block := _block(A, again, group))]
        if len(blocks) < len(groups):
            continue
        free = alone.copy()
        free[able[np.isin(known, np.concatenate(groups))]] = False
        if np.isin(values[free].conj(), values[free]).all():  # both of a pair, or none
            yield free, blocks


def _block(A: Array, values: ComplexArray, group: IntArray) -> Part | None:
    """Return the block of a group of the eigenvalues of A; None if it is not well conditioned."""
    T, U, k = ordered_complex_schur(A, nearest_of(values, group))
    if k != len(group):
        return None
    if k < len(A):
        apart = solve_sylvester(T[:k, :k], -T[k:, k:], T[:k, k:])
        if np.hypot(1, np.linalg.norm(apart, 2)) > _WORST:
            return None
    return T[:k, :k], U[:, :k]
