"""State feedback of an observer's estimate, as a controller with named signals."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference, at_rest
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant


def observer_feedback(plant: GeneralisedPlant, K: Array, Kf: Array, name: str) -> LinearSystem:
    """Return u = −K x̂ with the observer x̂' = A x̂ + B₂ u + K_f (y − C₂ x̂ − D₂₂ u).

    Parameters
    ----------
    plant : GeneralisedPlant
    K, Kf : ndarray, shapes (1, n) and (n, sensors)
    name : str
    """
    return LinearSystem(
        plant.A - Kf @ plant.C2 - (plant.B2 - Kf @ plant.D22) @ K,
        Kf,
        -K,
        np.zeros((1, len(plant.sensors))),
        inputs=list(plant.sensors),
        outputs=[plant.actuator],
        states=[f"{state}_estimate" for state in plant.linear.state_labels],
        name=name,
    )


def observer_reference(plant: GeneralisedPlant, K: Array, Kf: Array) -> Reference | None:
    """Return how the reference angle enters `observer_feedback`: by commanding the state.

    u = −K(x̂ − N_x θ_ref) + N_u θ_ref, and the observer is driven by this u.  None if the
    plant does not say where its angle is (see `at_rest`).
    """
    rest = at_rest(plant)
    if rest is None:
        return None
    entry = K @ rest[0] + rest[1]
    return Reference((plant.B2 - Kf @ plant.D22) @ entry, entry)
