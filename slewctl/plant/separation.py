"""A linear system taken apart: its rigid-body part, and its flexible modes one by one.

The poles at the origin, and with friction the slow real pole −c/J beside it, are split off
as an invariant subspace of their own; what is left is diagonal, ẋ = λx + bu, y = Σ c x,
with one or two poles to a mode.  In these coordinates the Gramians of a lightly damped arm
are known in closed form, and each of their elements to a relative accuracy of about ε/ζ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import control
import numpy as np
from scipy.linalg import schur
from scipy.sparse.csgraph import connected_components

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.errors import AccuracyError, InputError, shown
from slewctl.linalg import balance

# A double pole at the origin is computed with an error of up to √ε‖A‖.
_AT_ORIGIN = 1e-7
# Eigenvectors of a worse condition would spoil more digits than a reduction needs.
_WORST_CONDITION = 1e9
_RESIDUAL = 1e-7


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a system: ẋ = Ax + Bu, contributing y = Cx.

    Attributes
    ----------
    A, B, C : ndarray, shapes (k, k), (k, m), (p, k)
    """

    A: Array
    B: Array
    C: Array


@dataclass(frozen=True, eq=False)
class Separated:
    """The rigid-body part of a system and its flexible modes, which add up to it.

    Attributes
    ----------
    rigid : Part
        Zero to two states; two are [[0, 1], [0, −d]], the angle and its rate.
    poles : ndarray of complex, shape (f,)
        Of the flexible part, in rad/s, mode after mode by increasing frequency; a complex
        pole is followed by its conjugate.
    B, C : ndarray of complex, shapes (f, m) and (p, f)
        ẋ_i = λ_i x_i + B_i u, y = Σ C_i x_i, scaled to ‖B_i‖ = ‖C_i‖.
    modes : tuple of tuple of int
        Indices of the poles of each mode.
    residual : float
        Largest relative difference of the parts' frequency response from the system's own,
        between the modes.
    """

    rigid: Part
    poles: ComplexArray
    B: ComplexArray
    C: ComplexArray
    modes: tuple[tuple[int, ...], ...]
    residual: float

    @property
    def frequencies(self) -> Array:
        """Undamped natural frequency of each mode in rad/s: √|λλ*|."""
        return np.array([np.sqrt(np.abs(self.poles[list(m)]).prod()) if len(m) == 2
                         else abs(self.poles[m[0]]) for m in self.modes])  # fmt: skip

    def chosen(self, modes: slice) -> Separated:
        """Return the same rigid part with some of the modes."""
        kept = self.modes[modes]
        index = [i for mode in kept for i in mode]
        return Separated(
            self.rigid,
            self.poles[index],
            self.B[index],
            self.C[:, index],
            _consecutive(kept),
            self.residual,
        )

    def real(self) -> Part:
        """Return the flexible part in real coordinates, blocks [[σ, ω], [−ω, σ]]."""
        U = self.unitary
        turned = U.conj().T
        return Part(
            np.real((U * self.poles) @ turned), np.real(U @ self.B), np.real(self.C @ turned)
        )

    @property
    def unitary(self) -> ComplexArray:
        """U with x_real = U x: each conjugate pair to its real and imaginary part."""
        U = np.eye(len(self.poles), dtype=complex)
        for i in np.flatnonzero(self.poles.imag > 0):
            U[i : i + 2, i : i + 2] = np.array([[1, 1], [1j, -1j]]) / np.sqrt(2)
        return U

    def response(self, s: complex) -> ComplexArray:
        """Return the flexible part's C(s − Λ)⁻¹B, shape (p, m)."""
        return np.asarray((self.C / (s - self.poles)) @ self.B)

    def gramians(self) -> tuple[Array, Array]:
        """Return the controllability and observability Gramians in the real coordinates.

        AP + PAᴴ + BBᴴ = 0 with A = diag(λ) has P_ij = −b_i b_jᴴ/(λ_i + λ̄_j), and likewise
        W_ij = −c_iᴴc_j/(λ̄_i + λ_j).
        """
        sums = self.poles[:, None] + self.poles[None, :].conj()
        P = -(self.B @ self.B.conj().T) / sums
        W = -(self.C.conj().T @ self.C) / sums.conj()
        U = self.unitary
        turned = U.conj().T
        return np.real(U @ P @ turned), np.real(U @ W @ turned)


def separate(system: control.StateSpace) -> Separated:
    """Return the rigid-body part and the flexible modes of a continuous system.

    Parameters
    ----------
    system : control.StateSpace
        Stable but for at most two poles at the origin and undamped modes.

    Returns
    -------
    Separated

    Raises
    ------
    InputError
        For another object, a sampled or an unstable system.
    AccuracyError
        If the eigenvectors are too ill-conditioned, as at critical damping.
    """
    if not isinstance(system, control.StateSpace) or not system.isctime():
        raise InputError(
            f"{shown(system)} is not a continuous-time StateSpace",
            where="reduction",
            remedy="give one made by state_space or generalised_plant",
        )
    A, B, C = (np.array(getattr(system, name), dtype=float) for name in "ABC")
    if not all(np.isfinite(matrix).all() for matrix in (A, B, C)):
        raise InputError("the system is not finite", where="reduction", remedy="check its matrices")
    scale = balance(A)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    size = float(np.linalg.norm(A, 2)) if len(A) else 0.0
    pieces = [_Piece.of(A, states, size) for states in _uncoupled(A, size)]
    _check_rigid(sum(piece.rigid.shape[1] for piece in pieces))
    return _confirmed(_assembled(B, C, pieces), A, B, C)


def _confirmed(parts: Separated, A: Array, B: Array, C: Array) -> Separated:
    """Return the parts with their residual; refuse them where they do not add up."""
    frequencies = parts.frequencies
    between = np.sqrt(frequencies[1:] * frequencies[:-1])
    residual = 0.0
    for omega in [*between, *(2 * frequencies[-1:] if len(frequencies) else (1.0,))]:
        s = 1j * float(omega)
        own = C @ np.linalg.solve(s * np.eye(len(A)) - A, B.astype(complex))
        rigid = parts.rigid
        added = rigid.C @ np.linalg.solve(
            s * np.eye(len(rigid.A)) - rigid.A, rigid.B.astype(complex)
        )
        difference = np.linalg.norm(added + parts.response(s) - own)
        size = np.linalg.norm(own) + np.linalg.norm(added)
        residual = max(residual, float(difference / size) if size else 0.0)
    if not residual <= _RESIDUAL:
        raise AccuracyError(
            f"the modes do not add up to the system, by {residual:.1e}",
            where="reduction",
            remedy="use modal coordinates",
        )
    return replace(parts, residual=residual)


def _uncoupled(A: Array, size: float) -> list[list[int]]:
    """Return the sets of states that A couples with each other, beyond rounding.

    Each is then solved alone: what is exactly uncoupled, such as the modes of an arm
    without friction, keeps the full relative accuracy of each mode's own damping.
    """
    if not len(A):
        return []
    coupled = np.abs(A) > len(A) * np.finfo(float).eps * size
    count, labels = connected_components(coupled, directed=False)
    return [np.flatnonzero(labels == k).tolist() for k in range(count)]


@dataclass(frozen=True, eq=False)
class _Piece:
    """The invariant subspaces of one set of coupled states, in the whole system's states."""

    rigid: Array  # columns of a basis of the rigid subspace
    rigid_left: Array
    rigid_block: Array
    poles: ComplexArray
    right: ComplexArray
    left: ComplexArray
    modes: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, A: Array, states: list[int], size: float) -> _Piece:
        block = A[np.ix_(states, states)]
        poles, vectors = np.linalg.eig(block)
        poles, vectors = poles.astype(complex), vectors.astype(complex)
        slow = _rigid(poles, size)
        Z, A_rigid = _rigid_subspace(block, np.abs(poles[slow]).max(initial=0.0), slow, size)
        order, modes = _paired(poles, np.flatnonzero(~slow).tolist())
        T = np.hstack([Z, vectors[:, order]])
        if np.linalg.cond(T) > _WORST_CONDITION:
            raise AccuracyError(
                "two poles nearly coincide with one eigenvector, as at critical damping",
                where="reduction",
                remedy="change the damping slightly",
            )
        inverse = np.linalg.inv(T)
        # The eigenvalues' errors are of the size of A; a Rayleigh quotient's are not.
        exact = np.einsum("ij,jk,ki->i", inverse, block, T)[Z.shape[1] :]
        exact = np.where(poles[order].imag == 0, exact.real, exact).astype(complex)
        upper = np.flatnonzero(exact.imag > 0)
        exact[upper + 1] = exact[upper].conj()
        _refuse_unstable(exact, size)
        k, whole = Z.shape[1], len(A)
        right = np.zeros((whole, len(states)), dtype=complex)
        left = np.zeros((len(states), whole), dtype=complex)
        right[states], left[:, states] = T, inverse
        return cls(right[:, :k].real, left[:k].real, A_rigid, exact, right[:, k:], left[k:], modes)


def _rigid(poles: ComplexArray, size: float) -> BoolArray:
    """Return which poles belong to the rigid body: at the origin, and the one beside it."""
    rigid = np.abs(poles) <= _AT_ORIGIN * size
    if rigid.sum() == 1:
        rest = np.where(rigid | (poles.imag != 0), np.inf, np.abs(poles))
        if rest.size and np.isfinite(rest.min()):
            rigid = rigid.copy()
            rigid[int(np.argmin(rest))] = True
    return np.asarray(rigid)


def _rigid_subspace(A: Array, largest: float, rigid: BoolArray, size: float) -> tuple[Array, Array]:
    """Return a basis of the rigid body's subspace, and A on it as [[0, 1], [0, −d]]."""
    count = int(rigid.sum())
    if not count:
        return np.zeros((len(A), 0)), np.zeros((0, 0))
    limit = largest * (1 + 1e-6) + np.finfo(float).eps * size
    # An ordered Schur form: the eigenvectors of a pole near the origin and of one at it are
    # almost parallel, the plane that they span is well defined all the same.

    def slow(real: float, imaginary: float) -> bool:
        magnitude = np.hypot(real, imaginary)
        at_origin = magnitude <= _AT_ORIGIN * size
        return bool(at_origin or (imaginary == 0 and magnitude <= limit))

    T, Z, found = schur(A, output="real", sort=slow)
    if found != count:
        raise AccuracyError(
            "the rigid-body poles could not be told from the flexible ones",
            where="reduction",
            remedy="use modal coordinates",
        )
    Z, block = Z[:, :count], T[:count, :count]
    if count == 1:
        return Z, np.zeros((1, 1))
    if count > 2:
        _check_rigid(count)
    rate = -float(np.trace(block))
    rate = 0.0 if abs(rate) <= len(A) * np.finfo(float).eps * size else rate
    angle = np.linalg.svd(block)[2][-1]
    angle *= np.sign(angle[np.argmax(np.abs(angle))])
    # A w = v − d w: the matrix A + d has rank one, so its pseudoinverse is its transpose.
    shifted = block + rate * np.eye(2)
    if np.linalg.norm(shifted) <= _AT_ORIGIN * size:
        _check_rigid(3)
    w = shifted.T @ angle / np.linalg.norm(shifted) ** 2
    return Z @ np.column_stack([angle, w]), np.array([[0.0, 1.0], [0.0, 0.0 - rate]])


def _check_rigid(count: int) -> None:
    if count > 2:
        raise InputError(
            "more poles at the origin than the one rotation of a rigid body has",
            where="reduction",
            remedy="leave integrators other than the arm's own out of the system",
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

    Complex poles pair with their conjugates.  The real poles of overdamped modes pair from
    the middle outwards: Kelvin–Voigt damping sends one of each to −1/η, the other far left.
    """
    pairs = [(i, i + 1) for i in kept if poles[i].imag > 0]
    real = sorted((i for i in kept if poles[i].imag == 0), key=lambda i: -abs(poles[i]))
    half, odd = divmod(len(real), 2)
    groups: list[tuple[int, ...]] = [*pairs]
    groups += [(real[half - 1 - i], real[half + i]) for i in range(half)]
    if odd:
        groups.append((real[-1],))
    order = [i for group in groups for i in group]
    return order, _consecutive(groups)


def _consecutive(groups: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
    """Return groups of the same lengths that count on from zero."""
    ends = [0, *accumulate(len(group) for group in groups)]
    return tuple(tuple(range(first, last)) for first, last in pairwise(ends))


def _assembled(B: Array, C: Array, pieces: Sequence[_Piece]) -> Separated:
    rigid = np.hstack([piece.rigid for piece in pieces]) if pieces else np.zeros((0, 0))
    rigid_left = np.vstack([piece.rigid_left for piece in pieces]) if pieces else rigid
    rigid_block = np.zeros((rigid.shape[1],) * 2)
    start = 0
    for piece in pieces:
        k = len(piece.rigid_block)
        rigid_block[start : start + k, start : start + k] = piece.rigid_block
        start += k
    poles = np.concatenate([piece.poles for piece in pieces]) if pieces else np.zeros(0, complex)
    T = np.hstack([piece.right for piece in pieces]) if pieces else np.zeros((0, 0), complex)
    left = np.vstack([piece.left for piece in pieces]) if pieces else T
    modes: list[tuple[int, ...]] = []
    start = 0
    for piece in pieces:
        modes += [tuple(start + i for i in mode) for mode in piece.modes]
        start += len(piece.poles)
    parts = _scaled(poles, left @ B, C @ T)
    whole = Separated(
        Part(rigid_block, rigid_left @ B, C @ rigid),
        poles,
        *parts,
        tuple(modes),
        0.0,
    )
    return _by_frequency(whole)


def _scaled(
    poles: ComplexArray, B: ComplexArray, C: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return B and C with ‖B_i‖ = ‖C_i‖ and with conjugate entries for conjugate poles."""
    upper = np.flatnonzero(poles.imag > 0)
    B, C = B.copy(), C.copy()
    B[upper + 1], C[:, upper + 1] = B[upper].conj(), C[:, upper].conj()
    real = poles.imag == 0
    B[real], C[:, real] = B[real].real, C[:, real].real
    b, c = np.linalg.norm(B, axis=1), np.linalg.norm(C, axis=0)
    ratio = np.ones(len(b))
    both = (b > 0) & (c > 0)
    ratio[both] = np.sqrt(c[both] / b[both])
    return B * ratio[:, None], C / ratio


def _by_frequency(system: Separated) -> Separated:
    order = np.argsort(system.frequencies, kind="stable")
    sorted_modes = tuple(system.modes[k] for k in order)
    whole = Separated(system.rigid, system.poles, system.B, system.C, sorted_modes, system.residual)
    return whole.chosen(slice(None))
