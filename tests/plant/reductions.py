"""Arms and systems for the tests of reductions, and what is left of them."""

from __future__ import annotations

import control
import numpy as np

from slewctl import (
    Arm,
    Beam,
    GeneralisedPlant,
    Hub,
    Objective,
    generalised_plant,
    truth,
)
from slewctl.plant import Reduced

OBJECTIVE = Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 1e-2, "tip": 1e-2})


def arm_with(ratio: float = 0.005, friction: float = 0.0) -> Arm:
    return Arm(Beam(1.0, (1.0, -0.4), 1.0), Hub(0.1, 0.05, friction), damping_ratio=ratio)


def plant_of(arm: Arm, modes: int = 12) -> GeneralisedPlant:
    return generalised_plant(truth(arm, modes), OBJECTIVE)


def without(system: control.StateSpace, states: list[int]) -> control.StateSpace:
    """The system without some uncoupled states."""
    A = np.delete(np.delete(system.A, states, 0), states, 1)
    return control.StateSpace(
        A, np.delete(system.B, states, 0), np.delete(system.C, states, 1), system.D
    )


def flexible_error(system: control.StateSpace, reduced: Reduced, modes: int) -> control.StateSpace:
    """G − Gr without the rigid body, of an arm without friction in modal coordinates."""
    G, Gr = without(system, [0, modes + 1]), without(reduced.system, [0, 1])
    return control.StateSpace(
        np.block(
            [[G.A, np.zeros((G.nstates, Gr.nstates))], [np.zeros((Gr.nstates, G.nstates)), Gr.A]]
        ),
        np.vstack([G.B, Gr.B]),
        np.hstack([G.C, -Gr.C]),
        G.D - Gr.D,
    )


def response(system: control.StateSpace, omega: float) -> np.ndarray:
    A = np.asarray(system.A)
    return system.C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, system.B) + system.D


def companion(numerator: list[float], poles: list[complex]) -> control.StateSpace:
    """The transfer function in companion form: multiple poles have one eigenvector."""
    n = len(poles)
    A = np.eye(n, k=-1)
    A[0] = -np.poly(poles).real[1:]
    return control.StateSpace(A, np.eye(n, 1), [[0.0] * (n - len(numerator)) + numerator], 0)
