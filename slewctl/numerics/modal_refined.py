"""Modes in long numbers, where double precision knows a system too little."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from scipy.linalg import LinAlgError, solve_sylvester

from slewctl._types import Array, ComplexArray, IntArray
from slewctl.numerics.long_complex import LONG_ROUNDING, LongComplex, LongComplexSum
from slewctl.numerics.modal_basis import AT_END, Modes, outside
from slewctl.numerics.modal_bounds import (
    ROUNDING,
    BoundedModes,
    Corrected,
    Stack,
    bounded,
    rank_one,
)

# Each step squares the error, or makes it smaller by what double precision knows of V⁻¹.
_STEPS = 8
# A pole nearer than this to the origin, or to z = −1, relative to the fastest, is there: it is
# its own rounding.
_ZERO = 1e-24


def best_modes(stack: Stack, modes: Modes) -> BoundedModes:
    """Return the modes of one matrix with their bounds, in long numbers where those are smaller."""
    found = bounded(stack, modes)
    others = (_refined(stack, start) for start in _starts(stack.A[0], modes))
    return min([found, *(other for other in others if other)], key=lambda modes: modes.worst)


def _starts(A: Array, modes: Modes) -> Iterator[Modes]:
    """Yield the modes, and, of those with blocks, eigenvectors however nearly parallel.

    Of a matrix with entries of many sizes those of the order in which they fall are exact.
    """
    yield modes
    if not modes.blocks:
        return
    for order in (slice(None), slice(None, None, -1)):
        values, V = np.linalg.eig(A[order, order])
        with suppress(LinAlgError):
            start = V[order].astype(complex)
            W = np.linalg.inv(start)
            yield Modes(start[None], W[None], np.diag(values).astype(complex)[None])


def _refined(stack: Stack, modes: Modes) -> BoundedModes | None:
    """Return modes after steps of Newton's method with residuals in long numbers.

    Eigenvectors of a companion form amplify a residual of ε by the square of their condition:
    what is left here is ε² (after Ogita and Aishima, Japan J. Industrial and Applied
    Mathematics 35, 2018, for the symmetric case).
    """
    A, lost, B, C = stack.A[0], stack.lost[0], stack.B[0], stack.C[0]
    try:
        V, J = _newton(A, lost, modes)
        W = np.linalg.inv(V.hi)
    except (LinAlgError, ValueError):
        return None
    R, bound = _residual(A, lost, V, J)
    correct = Corrected(V.hi[None], W[None], V.lo[None])
    size = np.abs(W)[None]
    f, g = rank_one(correct(size @ (np.abs(R) + bound)[None]))
    x = LongComplex(W @ B)
    for _ in range(_STEPS):
        x = x.plus(W @ _rest(B, V, x)[0])
    rest, inexact = _rest(B, V, x)
    off = correct(size @ (np.abs(rest) + inexact)[None])[0]
    Y, off_shape = _seen(C, V)
    return BoundedModes(
        J[None], modes.blocks, x[None, :, 0], off[None, :, 0], Y[None], off_shape[None], f, g, True
    )


def _newton(A: Array, lost: Array, modes: Modes) -> tuple[LongComplex, LongComplex]:
    """Return V and J with A V = V J to the last digit of long numbers, or as near as it gets."""
    V, J, W = LongComplex(modes.V[0]), LongComplex(modes.J[0]), modes.W[0]
    before = np.inf
    for _ in range(_STEPS):
        F = W @ _residual(A, lost, V, J)[0]
        step, change = _step(J.hi, F, modes.blocks)
        J, V = J.plus(change), V.plus(V.hi @ step)
        size = float((np.abs(modes.V[0]) @ np.abs(F)).max())
        if not size < 0.5 * before:
            break
        before = size
    size = float(np.abs(np.diagonal(J.hi)).max())
    for place in (0.0, AT_END):
        there = (np.abs(J.minus(np.full_like(J.hi, place)).value) <= _ZERO * size) & np.eye(
            len(A), dtype=bool
        )
        J = LongComplex(np.where(there, place, J.hi), np.where(there, 0, J.lo))
    return V, J


def _step(
    J: ComplexArray, F: ComplexArray, blocks: tuple[IntArray, ...]
) -> tuple[ComplexArray, ComplexArray]:
    """Return X and dJ with J X − X J + F = dJ, dJ of the form of J."""
    n = len(J)
    alone = outside(n, blocks)
    values = np.diagonal(J)
    apart = values[None, :] - values[:, None]
    free = np.outer(alone, alone) & (apart != 0)
    X = np.divide(F, apart, out=np.zeros_like(F), where=free)
    change = np.where(np.eye(n, dtype=bool) & alone, F, 0)
    before = np.zeros(n, dtype=bool)
    for index in blocks:
        # Of two blocks, the later one sees to both of their corners.
        rest = np.flatnonzero(alone | before)
        inside = J[np.ix_(index, index)]
        if len(rest):
            outer = J[np.ix_(rest, rest)]
            X[np.ix_(rest, index)] = solve_sylvester(outer, -inside, -F[np.ix_(rest, index)])
            X[np.ix_(index, rest)] = solve_sylvester(inside, -outer, -F[np.ix_(index, rest)])
        own = np.ix_(index, index)
        X[own], change[own] = _inside(inside, F[own])
        before[index] = True
    return X, change


def _inside(T: ComplexArray, F: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return X and an upper triangular dT with T X − X T + F = dT, the smallest ones.

    A block at the origin keeps its zeros.
    """
    k = len(T)
    eye = np.eye(k)
    upper = np.triu(np.ones((k, k), dtype=bool), 0 if np.diagonal(T).any() else 1)
    commute = np.kron(T, eye) - np.kron(eye, T.T)  # of entries row by row
    scale = max(float(np.abs(T).max()), np.finfo(float).tiny)
    system = np.hstack([commute / scale, -np.eye(k * k)[:, upper.ravel()]])
    found = np.linalg.lstsq(system, -F.ravel() / scale, rcond=None)[0]
    change = np.zeros((k, k), complex)
    change[upper] = scale * found[k * k :]
    return np.asarray(found[: k * k].reshape(k, k)), change


def _residual(A: Array, lost: Array, V: LongComplex, J: LongComplex) -> tuple[ComplexArray, Array]:
    """Return (A + lost) V − V J and a bound of what is missing in it."""
    n = len(A)
    total = LongComplexSum((n, n))
    total.add_matrix_product(A.astype(complex), V.hi)
    diagonal = np.diagonal(J.hi)
    total.add_product(V.hi, np.broadcast_to(-diagonal, (n, n)))
    beside = J.hi - np.diag(diagonal)
    for i, j in np.argwhere(beside != 0).tolist():
        column = np.zeros((n, n), complex)
        column[:, j] = -V.hi[:, i]
        total.add_product(column, np.full((n, n), beside[i, j]))
    found = total.value + (A @ V.lo + lost @ V.hi - V.lo @ J.hi - V.hi @ J.lo)
    size, low = np.abs(V.hi), np.abs(V.lo)
    minor = np.abs(A) @ low + np.abs(lost) @ size + low @ np.abs(J.hi) + size @ np.abs(J.lo)
    bound = total.error + ROUNDING * np.abs(found) + (n + 2) * ROUNDING * minor
    return found, bound + np.abs(lost) @ low + low @ np.abs(J.lo)


def _rest(b: Array, V: LongComplex, x: LongComplex) -> tuple[ComplexArray, Array]:
    """Return b − V x and a bound of what is missing in it."""
    total = LongComplexSum(b.shape)
    total.add_product(b.astype(complex), np.ones(b.shape, complex))
    total.add_matrix_product(V.hi, -x.hi)
    found = total.value - V.lo @ x.hi - V.hi @ x.lo
    minor = np.abs(V.lo) @ np.abs(x.hi) + np.abs(V.hi) @ np.abs(x.lo)
    bound = (len(b) + 2) * ROUNDING * minor + np.abs(V.lo) @ np.abs(x.lo)
    return found, bound + total.error + ROUNDING * np.abs(found)


def _seen(C: Array, V: LongComplex) -> tuple[LongComplex, Array]:
    """Return C V and a bound of what is missing in it."""
    total = LongComplexSum(C.shape)
    total.add_matrix_product(C.astype(complex), V.hi)
    total.add_small(np.asarray(C @ V.lo, dtype=complex))
    bound = (C.shape[1] + 2) * ROUNDING * (np.abs(C) @ np.abs(V.lo))
    found = total.long
    return found, bound + total.error + LONG_ROUNDING * np.abs(found.hi)
