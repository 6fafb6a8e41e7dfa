"""What every H2 synthesis starts from and ends with: checks, scaling, the Riccati optimum."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slewctl._types import Array
from slewctl.design.achieved import closed_cost
from slewctl.design.energy_coordinates import ScaledPlant, scaled
from slewctl.design.observer import observer_feedback, observer_reference
from slewctl.design.reference import Reference
from slewctl.design.result import Check, Controller, Guarantee, finished
from slewctl.design.riccati.lqg import optimal_cost
from slewctl.design.riccati.lqr_kalman import check_assumptions
from slewctl.numerics.h2_norm import h2_cost
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import Regulator, RiccatiSolution
from slewctl.plant import GeneralisedPlant

# A result whose recomputed cost lies further above the optimum is not called optimal.
GAP = 1e-6
ASSUMPTIONS = ("w is white noise of unit density, its components independent",)


@dataclass(frozen=True, eq=False)
class H2Setting:
    """A plant, scaled, and a twin of it in which results are recomputed.

    Attributes
    ----------
    plant : GeneralisedPlant
        As it was given.
    scaled : ScaledPlant
    twin : GeneralisedPlant
        The same plant in modal states: itself if it has them, else in energy states.
    twin_scaled : ScaledPlant
        Takes gains to the twin's states.
    """

    plant: GeneralisedPlant
    scaled: ScaledPlant
    twin: GeneralisedPlant
    twin_scaled: ScaledPlant

    def riccati(self) -> tuple[RiccatiSolution, RiccatiSolution]:
        """Return regulator and filter of the twin by Riccati equations.

        In its states they keep digits that raw coordinates lose; whether its controllers are
        the plant's, the cost recomputed from the plant as given decides.
        """
        p = self.twin
        regulator = Regulator.of(p.A, p.B2, p.C1, p.D12).solve()
        return regulator, Regulator.of(p.A.T, p.C2.T, p.B1.T, p.D21.T).solve()

    def twin_state_feedback(self, K: Array) -> Array:
        """Return a state feedback of the plant as one of the twin."""
        return K if self.twin is self.plant else K @ self.scaled.state

    def cost(self, system: LinearSystem) -> float:
        """Return the squared H2 norm with a controller; infinite if the loop is not stable."""
        return closed_cost(self.plant, system).value


def h2_setting(plant: GeneralisedPlant) -> H2Setting:
    """Return a plant with its scaling.

    Raises
    ------
    DesignError
        If a mode is not penalised, not seen or not reached, if the actuator has no penalty or
        a sensor no noise, or if white noise passes straight to z.
    AccuracyError
        If the modes of a plant in raw coordinates cannot be told apart.
    """
    check_assumptions(plant)
    energy = scaled(plant)
    twin, twin_scaled = (plant, energy) if energy.diagonal else energy.energy_plant(plant)
    return H2Setting(plant, energy, twin, twin_scaled)


def stable_cost(A: Array, B: Array, C: Array) -> float:
    """Return ‖C(sI − A)⁻¹B‖₂², infinite if A is not stable."""
    stable = np.linalg.eigvals(A).real.max() < 0
    return h2_cost(A, B, C).value if stable else np.inf


@dataclass(frozen=True, eq=False)
class Realised:
    """A controller of the twin.

    Attributes
    ----------
    system : LinearSystem
    reference : Reference or None
        How the reference angle enters, if it is known.
    note : str
        How it was made, in words.
    """

    system: LinearSystem
    reference: Reference | None
    note: str


def observer(setting: H2Setting, F: Array, L: Array) -> Realised:
    """Return the observer feedback u_s = −F x̂_s, x̂_s corrected by L."""
    K, Kf = setting.twin_scaled.state_feedback(F), setting.twin_scaled.observer_gain(L)
    return Realised(
        observer_feedback(setting.twin, K, Kf, "h2_lmi"),
        observer_reference(setting.twin, K, Kf),
        "u = −K(x̂ − x_ref), x̂ from an observer on the sensors, driven by u",
    )


def finished_h2(
    setting: H2Setting,
    made: Realised,
    gains: tuple[Array, Array],
    *,
    said: str,
    bound: float,
    sense: Literal["at least", "at most"],
    seconds: Mapping[str, float],
) -> Controller:
    """Return a controller with its gap to the Riccati optimum among the checks.

    Parameters
    ----------
    setting : H2Setting
    made : Realised
    gains : tuple of ndarray
        Scaled state feedback F and observer gain L.
    said : str
        What the solver said; it is reported and not believed.
    bound, sense : float, {"at least", "at most"}
        The inequalities' own bound on the cost, shown beside what is achieved.
    seconds : mapping of str to float
    """
    optimum = optimal_cost(setting.twin, *setting.riccati())
    cost = setting.cost(made.system)
    F, L = gains
    return finished(
        setting.plant,
        made.system,
        "h2-lmi",
        {
            "state_feedback": setting.scaled.state_feedback(F),
            "observer": setting.scaled.observer_gain(L),
        },
        checks=(Check(f"cost over the Riccati optimum ({said})", abs(cost / optimum - 1), GAP),),
        assumptions=(made.note, *ASSUMPTIONS),
        guarantees=(Guarantee("H2 cost by the inequalities", bound, cost, sense),),
        seconds=seconds,
        reference=made.reference,
    )
