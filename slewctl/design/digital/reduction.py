"""A controller of fewer states that does in its loop what the larger one did.

Balanced truncation with the Gramians of the closed loop, of which the controller's own blocks
are taken (Enns' weights on both sides, those of the loop: Wortelboer, Frequency-weighted
Balanced Reduction of Closed-loop Mechanical Servo-systems, Delft 1994): a state counts by how
far the noise moves it and by what of it reaches the weighted outputs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from slewctl._types import Array, BoolArray
from slewctl.design.achieved import achieved
from slewctl.design.digital.sections import Sections, in_sections
from slewctl.design.reference import Reference
from slewctl.errors import DesignError, InputError, check_count
from slewctl.numerics.discrete_equations import solve_discrete_lyapunov
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import solve_lyapunov
from slewctl.numerics.modes import AT_ORIGIN
from slewctl.plant import GeneralisedPlant, sampled_plant


@dataclass(frozen=True, eq=False)
class ClosedGramians:
    """How far noise moves each state of a controller, and what of it costs.

    Attributes
    ----------
    moved, costly : ndarray, shape (n, n)
        The controller's blocks of the closed loop's Gramians.
    """

    moved: Array
    costly: Array


def closed_gramians(plant: GeneralisedPlant, system: LinearSystem, delay: float) -> ClosedGramians:
    """Return the Gramians of a stable closed loop at the controller's states.

    Parameters
    ----------
    plant : GeneralisedPlant
    system : LinearSystem
        The controller.
    delay : float
        Of a sampled one, in s.
    """
    if system.sample_time and not plant.sample_time:
        closed = sampled_plant(plant, system.sample_time, delay).close(system)
        P, Q = closed.covariance, closed.cost_to_go
    else:
        loop = plant.closed(system)
        solve = solve_discrete_lyapunov if system.sample_time else _continuous
        P, Q = solve(loop.A, loop.B @ loop.B.T), solve(loop.A.T, loop.C.T @ loop.C)
    own = slice(len(P) - system.nstates, None)
    return ClosedGramians(P[own, own], Q[own, own])


def _continuous(A: Array, Q: Array) -> Array:
    return solve_lyapunov(A, -Q)


def reduced_by_loop(
    plant: GeneralisedPlant,
    system: LinearSystem,
    order: int,
    delay: float,
    reference: Reference | None,
) -> tuple[LinearSystem, Reference | None]:
    """Return a controller of `order` states and how the reference enters it.

    Integrators are kept as they are.

    Parameters
    ----------
    plant : GeneralisedPlant
        The controller is stable on it.
    system : LinearSystem
    order : int
    delay : float
        Of a sampled controller, in s.
    reference : Reference or None

    Raises
    ------
    InputError
        For an order that is none, or a loop that is not stable to begin with.
    DesignError
        For an order at which the loop is not stable, with the least one at which it is.
    """
    n = system.nstates
    if check_count(order, "order", 0) >= n:
        raise InputError(
            f"order {order} of a controller of {n} states",
            where="order",
            remedy=f"give less than {n}" if n else "it has no states to leave out",
        )
    if not achieved(plant, system, delay)[1] < 0:
        raise InputError(
            "the controller does not stabilise the plant to begin with",
            where="plant",
            remedy="reduce it on a plant on which its loop is stable",
        )
    cut = _Cut(system, closed_gramians(plant, system, delay), in_sections(system))

    def holds(kept: int) -> bool:
        return kept >= cut.integrators and achieved(plant, cut.to(kept, None)[0], delay)[1] < 0

    if not holds(order):
        least = next(k for k in range(order + 1, n + 1) if k == n or holds(k))
        what = f"give at least {least}" if least < n else "keep it: no smaller order is stable"
        raise DesignError(
            f"a controller of {order} states does not keep its loop stable",
            where="order",
            remedy=what,
        )
    return cut.to(order, reference)


@dataclass(frozen=True, eq=False)
class _Cut:
    """A controller whose states are about to be left out."""

    system: LinearSystem
    gramians: ClosedGramians
    sections: Sections

    @property
    def _held(self) -> BoolArray:
        """Which states of the sections are integrators."""
        A = self.sections.system.A
        rest = np.diagonal(A) - (1.0 if self.system.sample_time else 0.0)
        size = 1.0 if self.system.sample_time else np.linalg.norm(A)
        alone = np.repeat(self.sections.sizes, self.sections.sizes) == 1
        return np.asarray(alone & (np.abs(rest) <= AT_ORIGIN * size))

    @property
    def integrators(self) -> int:
        """How many states are kept in any case."""
        return int(self._held.sum())

    def to(self, order: int, reference: Reference | None) -> tuple[LinearSystem, Reference | None]:
        """Return the controller with so many states."""
        held, basis = self._held, self.sections.basis
        inverse = np.linalg.inv(basis) if len(basis) else basis
        rest, own = basis[:, ~held], inverse[~held]
        P = own @ self.gramians.moved @ own.T
        Q = rest.T @ self.gramians.costly @ rest
        right, left = _balancing(P, Q, order - self.integrators)
        T = np.hstack([basis[:, held], rest @ right])
        L = np.vstack([inverse[held], left @ own])
        A, B, C, D = self.system.matrices
        made = LinearSystem(
            L @ A @ T, L @ B, C @ T, D, self.system.dt, inputs=self.system.input_labels,
            outputs=self.system.output_labels, name=self.system.name,
        )  # fmt: skip
        if reference is None:
            return made, None
        return made, Reference(L @ reference.B, reference.D)


def _balancing(P: Array, Q: Array, order: int) -> tuple[Array, Array]:
    """Return the bases of the states that count most, from and to the others."""
    R, S = _root(P), _root(Q)
    U, sizes, Vt = np.linalg.svd(S.T @ R)
    sizes, U, V = sizes[:order], U[:, :order], Vt[:order].T
    # A state that does not count at all is left as it is by a factor that is not infinite.
    root = np.sqrt(np.maximum(sizes, np.finfo(float).tiny))
    return R @ V / root, (S @ U / root).T


def _root(X: Array) -> Array:
    """Return a square root R of a Gramian, R Rᵀ = X."""
    values, vectors = eigh((X + X.T) / 2)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
