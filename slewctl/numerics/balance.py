"""State coordinates in which small and large numbers are of one size."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dgebal, zgebal

from slewctl._types import Array, ComplexArray, IntArray

# How often groups of states are scaled: each time inputs and outputs have other sizes.
_ROUNDS = 4


def balance(A: Array | ComplexArray) -> Array:
    """Return state scales s (powers of two) for which diag(1/s) A diag(s) is balanced."""
    complete = np.asarray_chkfinite(A)
    if not complete.size:
        return np.ones(0)
    # scipy.linalg.matrix_balance, which wraps this, takes longer than it on small matrices.
    gebal = zgebal if np.iscomplexobj(complete) else dgebal
    return np.asarray(gebal(complete, scale=1, permute=0)[3], dtype=float)


def balance_system(
    A: Array | ComplexArray, B: Array | ComplexArray, C: Array | ComplexArray
) -> Array:
    """Return state scales s (powers of two) for which [A B; C 0] is balanced.

    Where a loop is closed through B and C they matter as much as A: a companion form has its
    small and large numbers in C, and A − BC of an A balanced alone may be 1e9 times as large
    as any pole.

    Parameters
    ----------
    A, B, C : ndarray, shapes (n, n), (n, m), (p, n)
    """
    return _bordered(A, _norms(B), _norms(C.T))


def _bordered(A: Array | ComplexArray, reached: Array, shown: Array) -> Array:
    """Return the scales of a system with one input and one output of these sizes."""
    whole = np.zeros((len(A) + 1, len(A) + 1))
    whole[:-1, :-1] = np.abs(A)
    whole[:-1, -1], whole[-1, :-1] = reached, shown
    scale = balance(whole)
    return np.asarray(scale[:-1] / scale[-1])


def balance_realisation(A: Array, B: Array, C: Array) -> Array:
    """Return state scales s (powers of two) for which A, B and C are of comparable size.

    As `balance_system`, in units of inputs and outputs that make B and C as large as A: a
    state that A couples with no other is scaled by what reaches it and where it is seen.  So
    are states that A couples both ways with each other alone, as those of a mode, all of them
    by one factor: LAPACK scales one at a time, and each would unbalance its pair.  What one such
    group does to the next is then of the size of a row of A: were it as large as the largest,
    no slow mode behind a lag could be told from it.
    """
    if not len(A):
        return np.ones(0)
    scale = balance(A)
    a = A / scale[:, None] * scale
    reached, shown = _norms(B) / scale, _norms(C.T) * scale
    group = _coupled(a)
    groups = _Groups(group, a, reached, shown)
    for _ in range(_ROUNDS):
        through = _norm(reached) ** 0.5 * _norm(shown) ** 0.5
        if not through:
            return scale
        rows = _norms(a)
        typical = float(np.exp(np.mean(np.log(rows[rows > 0])))) if rows.any() else 1.0
        step = groups.scaled(typical / through)[group]
        if np.all(step == 1):
            break
        scale = scale * step
        a, reached, shown = a / step[:, None] * step, reached / step, shown * step
    unit = (np.linalg.norm(a) or 1.0) / through
    return scale * _bordered(a, unit * reached, unit * shown)


def _coupled(A: Array) -> IntArray:
    """Return for each state which group it is of: those that A couples both ways."""
    sizes = np.abs(A)
    reach = sizes > len(A) * np.finfo(float).eps * sizes.max()
    np.fill_diagonal(reach, True)
    while np.any(further := (reach.astype(np.float32) @ reach > 0) & ~reach):
        reach |= further
    return np.unique((reach & reach.T).argmax(axis=1), return_inverse=True)[1]


class _Groups:
    """Groups of states by the largest of what couples them, acts on them and is seen of them."""

    def __init__(self, group: IntArray, A: Array, reached: Array, shown: Array) -> None:
        order = np.argsort(group, kind="stable")
        first = np.searchsorted(group[order], np.arange(int(group.max()) + 1))
        rows = np.maximum.reduceat(np.abs(A)[np.ix_(order, order)], first, axis=0)
        self._between = np.maximum.reduceat(rows, first, axis=1)
        np.fill_diagonal(self._between, 0.0)
        self._into, self._out = (
            np.maximum.reduceat(sizes[order], first) for sizes in (reached, shown)
        )

    def scaled(self, unit: float) -> Array:
        """Scale each group as a whole, in that unit of inputs and outputs; return by how much."""
        if len(self._into) == 1:
            return np.ones(1)
        step = _bordered(self._between, unit * self._into, unit * self._out)
        self._between = self._between / step[:, None] * step
        self._into, self._out = self._into / step, self._out * step
        return step


def _norms(rows: Array | ComplexArray) -> Array:
    """Return the norms of rows, whose squares need not be numbers."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    unit = np.ldexp(1.0, np.frexp(largest)[1])  # no digit changes
    return np.asarray(np.linalg.norm(rows / unit[:, None], axis=1) * unit)


def _norm(vector: Array) -> float:
    largest = float(vector.max())
    return float(np.linalg.norm(vector / largest)) * largest if largest else 0.0
