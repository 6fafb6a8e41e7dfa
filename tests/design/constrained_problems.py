"""Arms, plants and changes of units for the designs under constraints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    GeneralisedPlant,
    Hub,
    Objective,
    assemble,
    generalised_plant,
)

OMEGA = 5.028  # rad/s, the uniform arm's first flexible frequency
OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.6}, {"torque": 0.07, "theta": 1.3e-3, "theta_dot": 0.022}
)


def arm(damping_ratio: float = 0.005) -> Arm:
    return Arm(Beam(1.0, 1.0, 1.0), Hub(0.3), damping_ratio=damping_ratio)


def plant(n: int = 2, objective: Objective = OBJECTIVE, of: Arm | None = None) -> GeneralisedPlant:
    return generalised_plant(assemble(of or arm(), ClampedFree(n)), objective)


def in_units(given: GeneralisedPlant, length: float, mass: float, time: float) -> GeneralisedPlant:
    """Return the plant of the same arm in other units: a metre is `length` of them."""
    model = given.model
    assert model is not None
    force = mass * length / time**2
    old, beam = model.arm, model.arm.beam
    turned = replace(
        old,
        beam=Beam(
            beam.length * length,
            beam.mass_per_length * mass / length,
            beam.bending_stiffness * force * length**2,
        ),
        hub=Hub(old.hub.inertia * mass * length**2),
    )
    unit = {"theta": 1.0, "theta_dot": 1 / time, "tip": length, "torque": force * length}
    objective = Objective(
        {name: value * unit[name] for name, value in OBJECTIVE.limits.items()},
        {name: value * unit[name] * np.sqrt(time) for name, value in OBJECTIVE.noise.items()},
    )
    return generalised_plant(assemble(turned, ClampedFree(model.n)), objective)
