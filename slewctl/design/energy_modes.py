"""The modes of a plant in any coordinates: two energy states [ωη, η̇] for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.errors import AccuracyError
from slewctl.numerics.balance import balance, balance_realisation
from slewctl.numerics.modes import conjugate_pairs, invariant_basis, linked, near

Indices = NDArray[np.intp]

# Two real poles closer than this (relative) belong to one mode: a mode near critical damping,
# whose eigenvectors are nearly parallel.
_CLOSE = 0.05
# Poles this far below the next ones are the rigid body's.  Not `modes.rigid_body`: here only
# the unit of a state depends on it, in coordinates that may have lost more than half of the
# digits.  So the limit is generous; a slow mode mistaken for a rigid one is scaled differently
# and loses nothing else.
_RIGID = 1e-3
# What rounding leaves of a stiffness or friction that the rigid body has not, relative to the
# first mode's; and of inputs, outputs and damping that are zero, relative to the largest.  A
# zero that is not one would mislead whatever balances the matrix afterwards.
_NOISE = 1e-8
_FAINT = 1e-12


@dataclass(frozen=True, eq=False)
class Modes:
    """Energy states of a system ẋ = A x, with x = state @ (energy states).

    Attributes
    ----------
    A : ndarray, shape (n, n)
        State matrix of the energy states.
    state, inverse : ndarray, shape (n, n)
    omega : ndarray, shape (n,)
        Frequency in rad/s of each state's mode; the rate's for the rigid body.
    rate : float
        The lowest flexible frequency.
    residual : float
        ‖A_x·state − state·A‖ over ‖A_x‖‖state‖, in balanced coordinates.
    """

    A: Array
    state: Array
    inverse: Array
    omega: Array
    rate: float
    residual: float


@dataclass(frozen=True, eq=False)
class Signals:
    """What acts on a plant and what is seen of it, each in its own unit.

    Attributes
    ----------
    noise, control : ndarray, shape (n, ·)
        White noise of unit density, and other inputs.
    shown, noisy : ndarray, shape (·, n)
        Outputs, and those that are measured in units of their own noise's density.
    """

    noise: Array
    control: Array
    shown: Array
    noisy: Array

    def counted(self, rate: float) -> tuple[Array, Array]:
        """Return inputs and outputs with time counted in units of 1/rate.

        A density is per √time: beside what is none it would depend on the unit of time.
        """
        root = np.sqrt(rate)
        return np.hstack([root * self.noise, self.control]), np.vstack(
            [self.shown, self.noisy / root]
        )

    def scaled_by(self, scale: Array) -> Signals:
        """Return the same for states of another scale."""
        return Signals(
            self.noise / scale[:, None],
            self.control / scale[:, None],
            self.shown * scale,
            self.noisy * scale,
        )

    def free_rate(self, A: Array) -> float:
        """Return a rate for a rigid body alone: that of the loop which its weights ask for."""
        return float(np.sqrt(np.linalg.norm(self.shown @ A @ self.control, 2))) or 1.0


def modes_of(A: Array, signals: Signals) -> Modes:
    """Return the modes of a system.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    signals : Signals
    """
    half = len(A) // 2
    second_order = len(A) % 2 == 0 and np.array_equal(A[:half], np.eye(half, 2 * half, half))
    if second_order:
        found = _from_second_order(A, signals)
        if found is not None:
            return found
    return _from_subspaces(A, signals)


def _from_second_order(A: Array, signals: Signals) -> Modes | None:
    """Return the modes of ẍ = −Sx − Dẋ, or None where S is no stiffness."""
    half = len(A) // 2
    S = -A[half:, :half]
    if np.array_equal(S, np.diag(np.diag(S))):
        squared, U, inverse = np.diag(S).copy(), np.eye(half), np.eye(half)
    else:
        found = _eigenvectors(S)
        if found is None:
            return None
        squared, U = found
        inverse = _inverse(U)
    rigid = _rigid_rows(squared)
    if not np.all(squared[~rigid] > 0):
        return None
    flexible = np.sqrt(squared[~rigid])
    rate = float(flexible.min()) if len(flexible) else signals.free_rate(A)
    B, C = signals.counted(rate)
    omega = np.where(rigid, rate, np.sqrt(np.abs(squared)))
    stiffness = np.diag(np.where(rigid, 0.0, squared))
    exact = np.array_equal(U, np.eye(half))
    damping = -A[half:, half:] if exact else -inverse @ A[half:, half:] @ U
    damping = np.where(np.abs(damping) <= _FAINT * np.abs(damping).max(), 0.0, damping)
    lengths = _lengths(
        omega,
        _audible(inverse @ B[half:], axis=1),
        _audible(C[:, :half] @ U, axis=0),
        _audible(C[:, half:] @ U, axis=0),
    )
    U, inverse = U * lengths, inverse / lengths[:, None]
    damping = damping / lengths[:, None] * lengths
    state = block_diag(U / omega, U)
    back = block_diag(inverse * omega[:, None], inverse)
    energy = np.block([[np.zeros((half, half)), np.diag(omega)], [-stiffness / omega, -damping]])
    return Modes(energy, state, back, np.tile(omega, 2), rate, _residual(A, state, energy))


def _rigid_rows(squared: Array) -> BoolArray:
    """Return which of the modes is the rigid body's: at most one, see `_RIGID`."""
    rigid = np.zeros(len(squared), dtype=bool)
    slowest = int(np.argmin(np.abs(squared)))
    others = np.delete(np.abs(squared), slowest)
    limit = _RIGID**2 * others.min() if len(others) else 0.0
    rigid[slowest] = abs(squared[slowest]) <= limit
    return rigid


def _inverse(matrix: Array) -> Array:
    return np.asarray(np.linalg.inv(matrix), dtype=float)


def _solve(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, right), dtype=float)


def _eigenvectors(S: Array) -> tuple[Array, Array] | None:
    """Return the eigenvalues and eigenvectors of a matrix, or None if they are not real."""
    scale = balance(S)
    values, vectors = np.linalg.eig(S / scale[:, None] * scale)
    real = np.isrealobj(values) or np.all(np.abs(values.imag) <= 1e-9 * np.abs(values).max())
    if not real:
        return None
    order = np.argsort(values.real)
    return values.real[order], scale[:, None] * vectors.real[:, order]


def _lengths(omega: Array, reached: Array, displacement: Array, rate: Array) -> Array:
    """Return the unit of each mode for which inputs and outputs see it alike.

    Modes of unit mass are reached by a torque as much as its angle shows them; other inputs
    and outputs come near that, and nothing here needs the mass matrix, which a plant in
    coordinates of its own does not have.
    """
    force = np.linalg.norm(reached, axis=1)
    shown = np.linalg.norm(displacement, axis=0)
    shown = np.where(shown > 0, shown, np.linalg.norm(rate, axis=0) * omega)
    return np.array([_length(f, s) for f, s in zip(force, shown, strict=True)])


def _from_subspaces(A: Array, signals: Signals) -> Modes:
    """Return the modes of a system in any coordinates from its invariant subspaces."""
    # What A couples one way only, as an angle with its rate, is scaled by what acts and is seen.
    scale = balance_realisation(A, *signals.counted(1.0))
    balanced, signals = A / scale[:, None] * scale, signals.scaled_by(scale)
    values, vectors = np.linalg.eig(balanced)
    groups = _groups(values)
    flexible = [_frequency(values[group]) for group, rigid in groups if not rigid]
    rate = min(flexible) if flexible else signals.free_rate(balanced)
    B, C = signals.counted(rate)
    if rate <= 1e-9 * np.abs(values).max(initial=0.0):
        raise AccuracyError(
            "the plant has more than one motion without stiffness, beside its fastest pole at "
            f"{np.abs(values).max():.3g} rad/s",
            where="scaled",
            remedy="leave out the states that nothing holds, but for one rigid body, and lags "
            "far faster than the arm",
        )
    bases = np.hstack([_invariant_basis(balanced, values, vectors, g) for g, _ in groups])
    blocks = _solve(bases, balanced @ bases)
    into, out = _solve(bases, B), C @ bases
    into, out = _audible(into, axis=1), _audible(out, axis=0)
    local, inner, omega, start = [], [], [], 0
    for group, rigid in groups:
        here = slice(start, start + len(group))
        pole = rate if rigid else _frequency(values[group])
        T, block = _energy_states(blocks[here, here], into[here], out[:, here], pole)
        local.append(T)
        inner.append(np.where(np.abs(block) <= _NOISE * rate, 0.0, block) if rigid else block)
        omega += [pole] * len(group)
        start += len(group)
    energy, state = block_diag(*inner), bases @ block_diag(*local)
    return Modes(
        energy,
        scale[:, None] * state,
        _inverse(state) / scale,
        np.array(omega),
        rate,
        _residual(balanced, state, energy),
    )


def _groups(values: ComplexArray) -> list[tuple[Indices, bool]]:
    """Return indices of the poles of each mode, slowest first, and whether it is rigid."""
    order = np.argsort(np.abs(values), kind="stable")
    groups: list[tuple[Indices, bool]] = []
    rigid, order = _rigid_group(values, order)
    if len(rigid):
        groups.append((rigid, True))
    real = order[values[order].imag == 0]
    close = [real[group] for group in linked(near(values[real], _CLOSE))]
    pairs = [np.array(pair) for pair in conjugate_pairs(values, order)]
    found = sorted([*close, *pairs], key=lambda group: _frequency(values[group]))
    return [*groups, *((group, False) for group in found)]


def _rigid_group(values: ComplexArray, order: Indices) -> tuple[Indices, Indices]:
    """Return the poles of the rigid body, and the others."""
    next_slowest = np.abs(values[order[2]]) if len(order) > 2 else np.inf
    if len(order) >= 2 and np.abs(values[order[1]]) <= _RIGID * next_slowest:
        return order[:2], order[2:]
    slowest = order[:1]
    if len(order) >= 2 and np.abs(values[order[0]]) <= _RIGID * np.abs(values[order[1]]):
        # With friction at the hub the second pole of the rigid body is the slowest real one.
        real = [k for k in range(1, len(order)) if values[order[k]].imag == 0]
        if real:
            return order[[0, real[0]]], np.delete(order, [0, real[0]])
        return slowest, order[1:]
    return order[:0], order


def _frequency(values: ComplexArray) -> float:
    """Return the geometric mean of the poles' magnitudes: the undamped frequency of a pair."""
    return float(np.exp(np.mean(np.log(np.maximum(np.abs(values), np.finfo(float).tiny)))))


def _invariant_basis(
    A: Array, values: ComplexArray, vectors: ComplexArray, group: Indices
) -> Array:
    """Return an orthonormal basis of the invariant subspace of some poles."""
    poles = values[group]
    alone = len(group) == 1 or (len(group) == 2 and abs(poles[0].imag) > _CLOSE * abs(poles[0]))
    if alone:
        v = vectors[:, group[0]]
        columns = v.real[:, None] if len(group) == 1 else np.column_stack([v.real, v.imag])
        return np.linalg.qr(columns)[0]
    # Poles that rounding may have moved: their eigenvectors are not to be trusted one by one.
    return invariant_basis(A, values, group, "scaled")


def _audible(matrix: Array, axis: int) -> Array:
    """Return inputs or outputs without the rows or columns that rounding alone has made."""
    size = np.linalg.norm(matrix, axis=axis, keepdims=True)
    return np.where(size <= _FAINT * size.max(initial=0.0), 0.0, matrix)


def _energy_states(block: Array, into: Array, out: Array, omega: float) -> tuple[Array, Array]:
    """Return a basis [e₁, e₂] with block e₂ = ω e₁ − c e₂ and inputs on e₂, and its block.

    Then x = e₁ ωη + e₂ η̇ with η̈ + c η̇ + ω²η = force, whatever the coordinates were.  A
    group that is not a pair, or that no input reaches, keeps its orthonormal basis.
    """
    T, energy = np.eye(len(block)), block
    strongest, sizes, _ = np.linalg.svd(into, full_matrices=False)
    if len(block) == 2 and sizes[0] > 0:
        rate, trace = strongest[:, 0], float(np.trace(block))
        pair = np.column_stack([(block @ rate - trace * rate) / omega, rate])
        if np.linalg.cond(pair) < 1e6:
            # By Cayley and Hamilton, exactly.
            stiffness = float(np.linalg.det(block))
            T, energy = pair, np.array([[0.0, omega], [-stiffness / omega, trace]])
    reached, seen = _solve(T, into), out @ T
    # A mode seen by its displacement; a single state, by what it is.
    shown = float(np.linalg.norm(seen[:, 0])) or float(np.linalg.norm(seen))
    force = float(np.linalg.norm(reached))
    return T * _length(force, shown * (omega if len(block) == 2 else 1.0)), energy


def _length(force: float, shown: float) -> float:
    """Return the unit for which inputs and outputs see a mode alike (see `_lengths`)."""
    return float(np.sqrt(force / shown)) if force > 0 and shown > 0 else 1.0


def _residual(A: Array, state: Array, energy: Array) -> float:
    """Return ‖A − state·energy·state⁻¹‖/‖A‖ in coordinates in which A is balanced."""
    scale = balance(A)
    T = state / scale[:, None]
    balanced = A / scale[:, None] * scale
    back = _solve(T.T, (T @ energy).T).T
    size = float(np.linalg.norm(balanced, 2)) or 1.0
    return float(np.linalg.norm(back - balanced, 2)) / size
