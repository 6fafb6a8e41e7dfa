"""Arms, objectives and plants for the design tests."""

from __future__ import annotations

import control
import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    GeneralisedPlant,
    Hub,
    Model,
    Objective,
    Payload,
    assemble,
    generalised_plant,
)

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

OBJECTIVE = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
TWO_SENSORS = Objective(
    {"tip": 0.1, "theta": 0.2, "torque": 2.0}, {"torque": 0.1, "theta": 0.01, "tip": 0.02}
)
OBJECTIVES = (OBJECTIVE, TWO_SENSORS)


def uniform_arm(damping_ratio: float = 0.005, hub: float = 0.3) -> Arm:
    return Arm(Beam(1.0, 1.0, 1.0), Hub(hub), damping_ratio=damping_ratio)


def design_model(modes: int = 3, damping_ratio: float = 0.005) -> Model:
    return assemble(uniform_arm(damping_ratio), ClampedFree(modes))


def design_plant(modes: int = 3, objective: Objective = OBJECTIVE) -> GeneralisedPlant:
    return generalised_plant(design_model(modes), objective)


def transformed(plant: GeneralisedPlant, T: Array) -> GeneralisedPlant:
    """Return the same plant with states T x."""
    return plant.transformed(T)


def transfer(system: control.StateSpace, points: ComplexArray) -> ComplexArray:
    """Return G(s) at points anywhere in the plane, (points, outputs, inputs), by direct solves."""
    eye = np.eye(system.nstates)
    solved = np.linalg.solve(points[:, None, None] * eye - system.A, system.B.astype(complex))
    return np.asarray(system.C @ solved + system.D)


def sorted_poles(A: Array) -> ComplexArray:
    """Return eigenvalues in an order that rounding does not change: by |p|, then Im p."""
    values = np.linalg.eigvals(A)
    return values[np.lexsort([values.imag, np.round(np.log(np.abs(values)), 5)])]


def pole_distance(a: ComplexArray, b: ComplexArray) -> float:
    """Return the largest relative distance from a pole of one set to the nearest of the other."""
    gap = np.abs(a[:, None] - b) / np.maximum(np.abs(a[:, None]), np.abs(b))
    return float(max(gap.min(axis=0).max(), gap.min(axis=1).max()))


@st.composite
def arms(draw: st.DrawFn) -> Arm:
    """Draw an arm with a linear taper, a hub, perhaps a radius, a payload and friction."""
    taper = draw(st.floats(-0.7, 0.5))
    return Arm(
        Beam(1.0, (1.0, taper), (1.0, taper)),
        Hub(
            draw(st.floats(0.02, 3.0)),
            draw(st.sampled_from([0.0, 0.2])),
            draw(st.sampled_from([0.0, 0.05])),
        ),
        Payload(draw(st.sampled_from([0.0, 0.5])), draw(st.sampled_from([0.0, 0.01]))),
        damping_ratio=draw(st.floats(0.0, 0.02)),
    )
