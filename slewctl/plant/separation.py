"""A linear system taken apart: its rigid-body part, and its flexible modes one by one.

The poles at the origin, and with friction the slow real pole −c/J beside it, are split off
as an invariant subspace of their own; what is left is diagonal, ẋ = λx + bu, y = Σ c x,
with one or two poles to a mode.  In these coordinates the Gramians of a lightly damped arm
are known in closed form, and each of their elements to a relative accuracy of about ε/ζ.

Poles that coincide, as those of two equal lags or at critical damping, have no eigenvectors
of their own.  Those whose eigenvectors are nearly parallel are taken together as one mode: an
invariant subspace with a triangular block from a Schur form (Bavely and Stewart, SIAM J.
Numerical Analysis 16, 1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError, InputError
from slewctl.numerics.balance import balance
from slewctl.numerics.given_system import read_system
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.modes import linked
from slewctl.plant.invariant import Piece, check_rigid, consecutive

# Relative: ten times what half of the digits leave, √ε.
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
    A : ndarray of complex, shape (f, f)
        Of the flexible part, mode after mode by increasing frequency.  Its diagonal holds the
        poles in rad/s.  It is diagonal, a complex pole followed by its conjugate, but for
        poles that coincide: theirs is an upper triangular block.
    B, C : ndarray of complex, shapes (f, m) and (p, f)
        ẋ = A x + B u, y = C x, scaled to ‖B_i‖ = ‖C_i‖ in every block.
    unitary : ndarray of complex, shape (f, f)
        U with x_real = U x, block by block: each conjugate pair to its real and imaginary
        part.
    modes : tuple of tuple of int
        Indices of the poles of each mode.
    residual : float
        Largest relative difference of the parts' frequency response from the system's own,
        between the modes.
    """

    rigid: Part
    A: ComplexArray
    B: ComplexArray
    C: ComplexArray
    unitary: ComplexArray
    modes: tuple[tuple[int, ...], ...]
    residual: float

    @property
    def poles(self) -> ComplexArray:
        """Poles of the flexible part in rad/s, shape (f,)."""
        return np.diagonal(self.A)

    @property
    def frequencies(self) -> Array:
        """Undamped natural frequency of each mode in rad/s: the geometric mean of its |λ|."""
        sizes = np.abs(self.poles)
        return np.array([sizes[list(m)].prod() ** (1 / len(m)) for m in self.modes])

    def chosen(self, modes: slice) -> Separated:
        """Return the same rigid part with some of the modes."""
        kept = self.modes[modes]
        index = [i for mode in kept for i in mode]
        return Separated(
            self.rigid,
            self.A[np.ix_(index, index)],
            self.B[index],
            self.C[:, index],
            self.unitary[np.ix_(index, index)],
            consecutive(kept),
            self.residual,
        )

    def real(self) -> Part:
        """Return the flexible part in real coordinates, blocks [[σ, ω], [−ω, σ]] for pairs."""
        U = self.unitary
        turned = U.conj().T
        return Part(np.real(U @ self.A @ turned), np.real(U @ self.B), np.real(self.C @ turned))

    def response(self, s: complex) -> ComplexArray:
        """Return the flexible part's C(s − A)⁻¹B, shape (p, m)."""
        if not len(self.A):
            return np.zeros((len(self.C), self.B.shape[1]), dtype=complex)
        return np.asarray(self.C @ solve_triangular(s * np.eye(len(self.A)) - self.A, self.B))

    def gramians(self) -> tuple[Array, Array]:
        """Return the controllability and observability Gramians in the real coordinates.

        AP + PAᴴ + BBᴴ = 0 with A = diag(λ) has P_ij = −b_i b_jᴴ/(λ_i + λ̄_j), and likewise
        W_ij = −c_iᴴc_j/(λ̄_i + λ_j).  What a triangular block has beside its diagonal goes to
        the right side: being nilpotent, it is exhausted after as many turns as it has entries
        from corner to corner.
        """
        sums = self.poles[:, None] + self.poles[None, :].conj()
        beside = self.A - np.diag(self.poles)
        P, W = np.zeros_like(sums), np.zeros_like(sums)
        for _ in range(2 * max((len(mode) for mode in self.modes), default=1)):
            known = beside @ P
            P = -(self.B @ self.B.conj().T + known + known.conj().T) / sums
            known = W @ beside
            W = -(self.C.conj().T @ self.C + known + known.conj().T) / sums.conj()
        U = self.unitary
        turned = U.conj().T
        return np.real(U @ P @ turned), np.real(U @ W @ turned)


def separate(system: object) -> Separated:
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
        If the modes cannot be told apart to working precision.
    """
    A, B, C = continuous(system).matrices[:3]
    scale = balance(A)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    size = float(np.linalg.norm(A, 2)) if len(A) else 0.0
    pieces = [Piece.of(A, states, size) for states in _uncoupled(A, size)]
    check_rigid(sum(piece.rigid.shape[1] for piece in pieces))
    return _confirmed(_assembled(B, C, pieces), A, B, C)


def continuous(system: object) -> LinearSystem:
    """Return a continuous-time state space of finite numbers; refuse anything else."""
    light = read_system(system, "reduction")
    if light.sample_time:
        raise InputError(
            f"it is sampled, every {light.sample_time:g} s",
            where="reduction",
            remedy="give a continuous system, and sample what comes of it",
        )
    return light


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
    return [states.tolist() for states in linked(coupled)]


def _assembled(B: Array, C: Array, pieces: Sequence[Piece]) -> Separated:
    rigid = np.hstack([piece.rigid for piece in pieces]) if pieces else np.zeros((0, 0))
    rigid_left = np.vstack([piece.rigid_left for piece in pieces]) if pieces else rigid
    rigid_block = np.zeros((rigid.shape[1],) * 2)
    start = 0
    for piece in pieces:
        k = len(piece.rigid_block)
        rigid_block[start : start + k, start : start + k] = piece.rigid_block
        start += k
    flexible, unitary = (
        np.asarray(block_diag(*(getattr(piece, name) for piece in pieces)), dtype=complex)
        if pieces
        else np.zeros((0, 0), complex)
        for name in ("flexible", "unitary")
    )
    T = np.hstack([piece.right for piece in pieces]) if pieces else np.zeros((0, 0), complex)
    left = np.vstack([piece.left for piece in pieces]) if pieces else T
    modes: list[tuple[int, ...]] = []
    start = 0
    for piece in pieces:
        modes += [tuple(start + i for i in mode) for mode in piece.modes]
        start += len(piece.flexible)
    whole = Separated(
        Part(rigid_block, rigid_left @ B, C @ rigid),
        flexible,
        *_scaled(flexible, left @ B, C @ T, modes),
        unitary,
        tuple(modes),
        0.0,
    )
    return _by_frequency(whole)


def _scaled(
    A: ComplexArray, B: ComplexArray, C: ComplexArray, modes: Sequence[tuple[int, ...]]
) -> tuple[ComplexArray, ComplexArray]:
    """Return B and C with ‖B_i‖ = ‖C_i‖ in each block, conjugate for conjugate poles."""
    B, C = B.copy(), C.copy()
    for mode in modes:
        states = list(mode)
        own = A[np.ix_(states, states)]
        diagonal = np.count_nonzero(own - np.diag(np.diagonal(own))) == 0
        if diagonal and own[0, 0].imag > 0:
            first, second = states
            B[second], C[:, second] = B[first].conj(), C[:, first].conj()
        elif diagonal:
            B[states], C[:, states] = B[states].real, C[:, states].real
        # One factor for all that is coupled: it commutes with the block.
        for block in [[state] for state in states] if diagonal else [states]:
            b, c = np.linalg.norm(B[block]), np.linalg.norm(C[:, block])
            ratio = np.sqrt(c / b) if b > 0 and c > 0 else 1.0
            B[block] *= ratio
            C[:, block] /= ratio
    return B, C


def _by_frequency(system: Separated) -> Separated:
    order = np.argsort(system.frequencies, kind="stable")
    sorted_modes = tuple(system.modes[k] for k in order)
    return replace(system, modes=sorted_modes).chosen(slice(None))
