"""Modes that outputs do not see, told whatever the units and the time scales are."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.balance import balance
from slewctl.numerics.modes import eigensystem

# What a mode must add to the rank of its test matrix, whose rows and columns are of size one.
_SEEN = 1e-11
# Rounds of scaling, after which rows and columns are of size one to a few per cent.
_EQUILIBRATIONS = 12
# A pole this near to the axis, or to the unit circle, over its size lies on it.
_ON_THE_EDGE = 1e-9


def pole_rounding(A: Array) -> tuple[ComplexArray, Array]:
    """Return the eigenvalues of A, and how far rounding may have moved each.

    Of the same matrix, which several checks ask about, the same again.  To first order, and
    entry by entry: |y|ᵀ|A||x| / |yᴴx| with the eigenvectors of the balanced matrix.  A slow
    pole beside a fast one keeps its own accuracy.
    """
    A = np.ascontiguousarray(A, dtype=float)
    return _rounded(A.tobytes(), len(A))


@lru_cache(maxsize=8)
def _rounded(entries: bytes, n: int) -> tuple[ComplexArray, Array]:
    found = eigensystem(np.frombuffer(entries).reshape(n, n))
    # A double pole moves by the root of what rounds it.
    size = np.abs(found.left).T * (np.abs(found.balanced) @ np.abs(found.right))
    moved = np.sum(size, axis=0) / np.abs(found.meeting)
    moved *= 4 * n * np.finfo(float).eps
    for array in (found.poles, moved):
        array.flags.writeable = False
    return found.poles, moved


def poles_and_growth(A: Array, sample_time: float) -> tuple[ComplexArray, float]:
    """Return the poles, and how far one of them may be beyond the edge of stability.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    sample_time : float
        Zero for continuous time, where the edge is the axis; else it is the unit circle.

    Returns
    -------
    tuple of ndarray and float
        The second is negative if every pole is stable by more than rounding; −inf without poles.
    """
    poles, rounding = pole_rounding(A)
    size = np.abs(poles) if sample_time else poles.real
    growth = float(np.max(size + rounding, initial=-np.inf))
    return poles, growth - 1 if sample_time else growth


def unobservable_modes(
    A: Array, C: Array, *, sampled: bool = False, only_on_the_edge: bool = False
) -> ComplexArray:
    """Return the eigenvalues of A, not stable, that C does not see (Popov–Belevitch–Hautus).

    Rows and columns of the test matrix [A − λ; C] are brought to size one first, which
    changes no rank: neither the units of states, nor those of outputs, nor time scales
    far apart decide.

    Parameters
    ----------
    A, C : ndarray, shapes (n, n), (p, n)
    sampled : bool
        Stable is then within the unit circle.
    only_on_the_edge : bool
        Leave out what is unstable by more than rounding: only a mode on the edge of
        stability leaves a Riccati equation without a stabilising solution.

    Returns
    -------
    ndarray of complex
        With non-negative imaginary part.  Empty when (A, C) is detectable.
    """
    return _unseen(A, C, pole_rounding(A), sampled, only_on_the_edge)


def unreachable_modes(
    A: Array, B: Array, *, sampled: bool = False, only_on_the_edge: bool = False
) -> ComplexArray:
    """Return the eigenvalues of A, not stable, that B does not reach; see `unobservable_modes`.

    Parameters
    ----------
    A, B : ndarray, shapes (n, n), (n, m)
    sampled, only_on_the_edge : bool
    """
    return _unseen(A.T, B.T, pole_rounding(A), sampled, only_on_the_edge)


def _unseen(
    A: Array,
    C: Array,
    known: tuple[ComplexArray, Array],
    sampled: bool,
    only_on_the_edge: bool,
) -> ComplexArray:
    scale = balance(A)
    As, Cs = A / scale[:, None] * scale, C * scale
    values, rounding = known
    rest = 1.0 if sampled else 0.0  # the pole of what stays where it is
    growth = np.abs(values) - 1 if sampled else values.real
    edge = np.maximum(_ON_THE_EDGE * np.abs(values - rest), rounding)
    suspect = (growth >= -edge) & (values.imag >= 0)
    if only_on_the_edge:
        suspect &= growth <= edge
    hidden = []
    seen: dict[tuple[complex, float], bool] = {}
    for value, error in zip(values[suspect].tolist(), edge[suspect].tolist(), strict=True):
        # Of two poles at rest rounding makes a pair beside them.
        exact = [rest] if abs(value - rest) <= 10 * error else []
        for candidate in (*exact, value):
            tried = (complex(candidate), error)
            if tried not in seen:
                seen[tried] = _sees(As, Cs, candidate, error)
            if not seen[tried]:
                hidden.append(candidate)
                break
    return np.array(hidden, dtype=complex)


def _sees(A: Array, C: Array, value: complex, error: float) -> bool:
    """Return whether [A − λ; C] has full column rank; λ is known to `error`."""
    shifted = A - value * np.eye(len(A))
    # What is left of a diagonal entry by cancellation is no entry.
    diagonal = np.diag(shifted)
    np.fill_diagonal(shifted, np.where(np.abs(diagonal) <= error, 0.0, diagonal))
    # Nor is an entry of C that rounding alone may have made.
    noise = len(A) * np.finfo(float).eps * np.abs(C).max(axis=1, keepdims=True, initial=0.0)
    matrix = np.vstack([shifted, np.where(np.abs(C) <= noise, 0.0, C)])
    # Rows first: their units are free, while a column holds equations and outputs alike.
    matrix = matrix / _size(matrix, axis=1)
    for _ in range(_EQUILIBRATIONS):
        for axis in (0, 1):
            matrix = matrix / np.sqrt(_size(matrix, axis))
    return bool(np.linalg.svd(matrix, compute_uv=False)[-1] >= _SEEN)


def _size(matrix: Array | ComplexArray, axis: int) -> Array:
    size = np.abs(matrix).max(axis=axis, keepdims=True)
    return np.where(size > 0, size, 1.0)
