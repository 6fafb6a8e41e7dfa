"""The loop with an observer, closed around every arm of a range of payloads and stiffness."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from slewctl._types import Array
from slewctl.arm import vary
from slewctl.design.achieved import achieved
from slewctl.design.observer import observer_feedback
from slewctl.design.result import Check
from slewctl.design.riccati.lqr_kalman import optimal_filter
from slewctl.errors import InputError
from slewctl.model import assemble
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import TORQUE, GeneralisedPlant, generalised_plant

# Torque noise that the observer believes in, over the objective's: the more, the more the loop
# has the robustness of the state feedback (Doyle and Stein, IEEE Trans. Automatic Control 24,
# 1979).
_RECOVERIES = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)


def changed_plant(nominal: GeneralisedPlant, mass: float, factor: float) -> GeneralisedPlant:
    """Return the generalised plant of the changed arm, assembled in the same functions."""
    model, objective = nominal.model, nominal.objective
    if model is None or objective is None:  # the caller has refused it
        raise InputError("the plant does not know its arm", where="payload_lmi")
    arm = vary(model.arm, payload_mass=mass, stiffness_factor=factor)
    return generalised_plant(assemble(arm, model.basis), objective)


@dataclass(frozen=True)
class Worst:
    """The worst over the changed arms: real part of a pole with its rounding, and cost.

    Attributes
    ----------
    real, cost : float
    at : tuple of float
        Mass in kg and factor on the stiffness of the arm with that pole.
    """

    real: float
    cost: float
    at: tuple[float, float]

    def check(self, count: int) -> Check:
        """Return the check that every changed arm is stable, naming the worst one."""
        mass, factor = self.at
        return Check(
            f"real part of a pole with a payload of {mass:.4g} kg"
            + (f" and {factor:.4g} times the stiffness" if factor != 1 else "")
            + f", the worst of {count} changed arms",
            max(self.real, 0.0),
            0.0,
            "narrow payload_mass or stiffness, or lower decay_rate_min",
        )


def best_observer(
    nominal: GeneralisedPlant, K: Array, changed: Mapping[tuple[float, float], GeneralisedPlant]
) -> tuple[Array, float, Worst]:
    """Return the observer gain with the least worst cost, its recovery factor, and the worst."""
    best: tuple[Array, float, Worst] | None = None
    objective, model = nominal.objective, nominal.model
    if objective is None or model is None:  # the caller has refused it
        raise InputError("the plant does not know its arm", where="payload_lmi")
    for recovery in _RECOVERIES:
        noise = {**objective.noise, TORQUE: recovery * objective.noise[TORQUE]}
        noisier = generalised_plant(model, replace(objective, noise=noise))
        Kf = optimal_filter(noisier).gain.T
        worst = worst_of(observer_feedback(nominal, K, Kf, "payload_lmi"), changed)
        if best is None or (worst.cost, worst.real) < (best[2].cost, best[2].real):
            best = Kf, recovery, worst
        elif math.isfinite(best[2].cost):
            break
    if best is None:
        raise InputError("no observer was tried", where="payload_lmi")
    return best


def worst_of(
    system: LinearSystem, changed: Mapping[tuple[float, float], GeneralisedPlant]
) -> Worst:
    """Return the worst of a controller over plants; the cost is infinite if one is unstable."""
    found = {at: achieved(plant, system, 0.0)[1:] for at, plant in changed.items()}
    rightmost = max(found, key=lambda at: found[at][0])
    cost = max(cost.value for _, cost in found.values())
    return Worst(found[rightmost][0], cost, rightmost)
