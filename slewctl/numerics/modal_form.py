"""A system with one input in its modes, with an enclosure of what that leaves out.

x = V ξ takes ẋ = A x + b u to ξ̇ = (J + F) ξ + (ξ_b + …) u.  J is diagonal, with a small
triangular block where eigenvectors are nearly parallel: the two poles of a rigid body, equal
lags.  F, and the errors of V⁻¹b and of C V, are not zero in double precision.  They are
bounded entry by entry, so that values of (C, A, b) computed from the modes can be enclosed:

    |C (s − A)⁻¹ b − Y (s − J)⁻¹ ξ| ≤ |Y| R f · g R |ξ| / (1 − g R f) + …

with R = |(s − J)⁻¹| and |F| ≤ f gᵀ.  The bounds hold for the matrices as they were given, in
double precision.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from weakref import WeakKeyDictionary

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.numerics.balance import balance_realisation
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.long_sums import LongSum
from slewctl.numerics.modal_basis import Modes, modal_bases, outside
from slewctl.numerics.modal_bounds import Stack, bounded
from slewctl.numerics.modal_refined import best_modes
from slewctl.numerics.modes import linked


@dataclass(frozen=True, eq=False)
class Block:
    """A triangular block of J: the indices of its modes, and T + low."""

    index: IntArray
    T: ComplexArray
    low: ComplexArray

    @property
    def nilpotent(self) -> bool:
        """Whether all its poles are exactly zero."""
        return not np.diagonal(self.T).any()


@dataclass(frozen=True, eq=False)
class ModalForm:
    """y = Y (s − J)⁻¹ ξ u + D u, and bounds of what is missing.

    Attributes
    ----------
    poles : ndarray of complex, shape (n,)
        Diagonal of J, in s, or in δ = z − 1 of a sampled system.
    blocks : tuple of Block
        Triangular blocks; all other poles stand alone.
    entry : ndarray of complex, shape (n,)
        ξ.
    shape : ndarray of complex, shape (p, n)
        Y.
    D : ndarray, shape (p,)
    spread, weight : ndarray, shape (n,)
        f and g of |F| ≤ f gᵀ.
    entry_error, shape_error : ndarray, shapes (n,) and (p, n)
    poles_low, entry_low, shape_low : ndarray of complex
        What rounding took from `poles`, `entry` and `shape`, where long numbers are needed.
    component : ndarray of int, shape (n,)
        Which poles belong to states that A couples with each other; f gᵀ is zero between others.
    long : bool
        Whether they are, so that sums of modes cancel digits that double precision has not got.
    sample_time : float
    """

    poles: ComplexArray
    blocks: tuple[Block, ...]
    entry: ComplexArray
    shape: ComplexArray
    D: Array
    spread: Array
    weight: Array
    entry_error: Array
    shape_error: Array
    poles_low: ComplexArray
    entry_low: ComplexArray
    shape_low: ComplexArray
    component: IntArray
    long: bool
    sample_time: float

    @property
    def alone(self) -> BoolArray:
        """Which poles are in no block, shape (n,)."""
        return outside(len(self.poles), [block.index for block in self.blocks])

    @cached_property
    def unlinked(self) -> bool:
        """Whether poles at the origin are one chain by no more than rounding, if at all."""
        for block in self.blocks:
            if block.nilpotent and len(block.index) > 1:
                reach = np.linalg.norm(self.spread[block.index])
                reach *= np.linalg.norm(self.weight[block.index])
                # One is zero, however long the chain.
                if np.linalg.svd(block.T, compute_uv=False)[-2] <= _LINKED * reach:
                    return True
        return False


# Times what bounds the errors of J: links of real chains are 1e11 times as large, those that the
# rounding of given numbers makes a few times.
_LINKED = 1e3
# Systems of no more than so many states, to whose cube the cost of long numbers is proportional:
# those in companion form, which need them, are small.
LONGEST = 40
# What a truth yields is computed once for all controllers that meet it; and once for a controller
# whose copies are told apart by names alone.
_KNOWN: WeakKeyDictionary[LinearSystem, dict[bool, ModalForm]] = WeakKeyDictionary()
COPIES = 16


class _Content:
    """A system that equals all with the same numbers."""

    def __init__(self, system: LinearSystem) -> None:
        self.system = system
        numbers = (*system.matrices, np.array(system.sample_time))
        self.key = tuple((matrix.shape, matrix.tobytes()) for matrix in numbers)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Content) and self.key == other.key


def modal_form(system: LinearSystem, long: bool = False) -> ModalForm:
    """Return the modes of a system with one input; of the same numbers, the same again.

    Parameters
    ----------
    system : LinearSystem
        One input, any number of outputs, continuous or sampled.
    long : bool
        Whether to find them in long numbers where those know them better.
    """
    known = _KNOWN.setdefault(system, {})
    long = long and len(system.A) <= LONGEST
    if long not in known:
        known[long] = _modal_form(_Content(system), long)
    return known[long]


@lru_cache(COPIES)
def _modal_form(content: _Content, long: bool) -> ModalForm:
    system = content.system
    A, B, C, D = system.matrices
    scale = balance_realisation(A, B, C)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    n, sampled = len(A), bool(system.sample_time)
    lost: Array = np.zeros((n, n))
    if sampled:
        less = LongSum((n, n))
        less.add(A)
        less.add(-np.eye(n))
        A, lost = less.hi, less.lo
    p = len(C)
    found = ModalForm(
        poles=np.zeros(n, complex),
        blocks=(),
        entry=np.zeros(n, complex),
        shape=np.zeros((p, n), complex),
        D=D[:, 0],
        spread=np.zeros(n),
        weight=np.zeros(n),
        entry_error=np.zeros(n),
        shape_error=np.zeros((p, n)),
        poles_low=np.zeros(n, complex),
        entry_low=np.zeros(n, complex),
        shape_low=np.zeros((p, n), complex),
        component=np.zeros(n, dtype=int),
        long=False,
        sample_time=system.sample_time,
    )
    blocks: list[Block] = []
    longer = False
    for states in _uncoupled(A):  # shape (count, m): components of the same size together
        inside = states[:, :, None], states[:, None, :]
        stack = A[inside], lost[inside], B[states], np.swapaxes(C[:, states], 0, 1)
        bases = modal_bases(stack[0])
        for at, modes in _one_by_one(bases) if long else bases:
            index = states[at]
            one = Stack(*(matrix[at] for matrix in stack))
            part = best_modes(one, modes) if long else bounded(one, modes)
            J, Y = part.J, part.shape
            found.poles[index], found.poles_low[index] = _diagonals(J.hi), _diagonals(J.lo)
            found.entry[index], found.entry_low[index] = part.entry.hi, part.entry.lo
            found.shape[:, index], found.shape_low[:, index] = (
                np.swapaxes(Y.hi, 0, 1),
                np.swapaxes(Y.lo, 0, 1),
            )
            found.entry_error[index] = part.entry_error
            found.shape_error[:, index] = np.swapaxes(part.shape_error, 0, 1)
            found.spread[index], found.weight[index] = part.spread, part.weight
            count = int(found.component.max(initial=0)) + 1
            found.component[index] = count + np.arange(len(index))[:, None]
            longer |= part.long
            for group in part.blocks:
                own = np.ix_(group, group)
                blocks.append(Block(index[0][group], J.hi[0][own], J.lo[0][own]))
    return replace(found, blocks=tuple(blocks), component=found.component - 1, long=longer)


def _one_by_one(bases: Iterator[tuple[IntArray, Modes]]) -> Iterator[tuple[IntArray, Modes]]:
    """Yield the modes of stacks of matrices one matrix after the other."""
    for at, modes in bases:
        for place, k in enumerate(at.tolist()):
            own = slice(place, place + 1)
            yield np.array([k]), replace(modes, V=modes.V[own], W=modes.W[own], J=modes.J[own])


def _diagonals(stack: ComplexArray) -> ComplexArray:
    return np.diagonal(stack, axis1=-2, axis2=-1)


def _uncoupled(A: Array) -> Iterator[IntArray]:
    """Yield the sets of states that A couples with each other, those of one size together."""
    if not len(A):
        return
    sets = linked(A != 0)
    for size in sorted({len(states) for states in sets}):
        yield np.array([states for states in sets if len(states) == size])
