"""The regulator's and the filter's problem of a plant, as the separation principle has them.

Whatever the controller, the state is x = x̂ + e with the Kalman filter's estimate x̂ and an
error e that is uncorrelated with it and that no control changes.  x̂ obeys

    x̂' = A x̂ + B₂ u + K_f ν,   ν white,

so the best control under any constraint on means of squares is found as if the state were
measured, with the innovations ν for disturbance.  The dual holds for the filter when the
regulator is optimal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design.energy_coordinates import ScaledPlant, scaled
from slewctl.design.lmi.state_feedback import Dynamics
from slewctl.design.riccati.lqr_kalman import check_assumptions
from slewctl.numerics.matrix_equations import Regulator
from slewctl.plant import GeneralisedPlant


@dataclass(frozen=True, eq=False)
class Half:
    """One of the two problems: dynamics, cost rows, and its Riccati optimum.

    Attributes
    ----------
    dynamics : Dynamics
        Without cross terms: a preliminary gain takes them out.
    C : ndarray
        Rows of the cost, which beside them is the control's variance.
    preliminary : ndarray, shape (m, n)
    optimal : ndarray, shape (m, n)
        The Riccati gain that comes on top of the preliminary one.
    X : ndarray, shape (n, n)
        The Riccati solution.
    """

    dynamics: Dynamics
    C: Array
    preliminary: Array
    optimal: Array
    X: Array

    @property
    def optimum(self) -> float:
        """The least cost tr NᵀXN."""
        N = self.dynamics.N
        return float(np.trace(N.T @ self.X @ N))


@dataclass(frozen=True, eq=False)
class Innovations:
    """Both halves of a plant in its scaled coordinates.

    Attributes
    ----------
    plant : GeneralisedPlant
    scaled : ScaledPlant
    regulator : Half
        Its noise is the innovations of the Kalman filter.
    observer : Half
        Transposed; its noise is what the optimal regulator makes of an error.
    """

    plant: GeneralisedPlant
    scaled: ScaledPlant
    regulator: Half
    observer: Half

    @property
    def unavoidable(self) -> float:
        """The part of the cost, in the plant's units, that the estimation error alone makes."""
        error = self.scaled.C1 @ self.observer.X @ self.scaled.C1.T
        return self.scaled.rate * float(np.trace(error))

    @property
    def unavoidable_dual(self) -> float:
        """The part of the cost that the optimal regulator leaves even if it sees the state."""
        cost = self.scaled.B1.T @ self.regulator.X @ self.scaled.B1
        return self.scaled.rate * float(np.trace(cost))

    @property
    def optimum(self) -> float:
        """J*, the least squared H2 norm of the plant."""
        return self.unavoidable + self.scaled.rate * self.regulator.optimum

    def state_feedback(self, F: Array) -> Array:
        """Return K in the plant's coordinates for a gain on top of the preliminary one."""
        return self.scaled.state_feedback(self.regulator.preliminary + F)

    def observer_gain(self, F: Array) -> Array:
        """Return K_f in the plant's coordinates for a gain of the transposed problem."""
        return self.scaled.observer_gain((self.observer.preliminary + F).T)


def innovations(plant: GeneralisedPlant) -> Innovations:
    """Return both halves of a plant.

    Raises
    ------
    DesignError
        If a mode is not penalised, not seen or not reached, or the torque is free.
    """
    check_assumptions(plant)
    s = scaled(plant)
    observer = _half(s.A.T, s.C2.T, s.B1.T, s.D21.T)
    gain = observer[2] + observer[3]
    regulator = _half(s.A, s.B2, s.C1, s.D12)
    # The noise of each half needs the other's gain.
    feedback = regulator[2] + regulator[3]
    return Innovations(
        plant,
        s,
        Half(Dynamics(regulator[0], s.B2, gain.T), *regulator[1:]),
        Half(Dynamics(observer[0], s.C2.T, feedback.T), *observer[1:]),
    )


def _half(A: Array, B: Array, C: Array, D: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return A and C without the cross term CᵀD, the gain that removes it, the optimal one, X.

    DᵀD = I.
    """
    kept = Regulator.of(A, B, C, D)
    found = kept.solve()
    return kept.A, kept.C, kept.gain, found.gain - kept.gain, found.X
