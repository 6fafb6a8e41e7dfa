"""The closed loop from the reference angle to what the arm does."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.design import Controller
from slewctl.design.reference import REFERENCE, rigid_readings, rigid_reference, with_reference
from slewctl.model import Model
from slewctl.numerics.interconnect import closed_matrix
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.statespace import Actuator, arm_equations

WATCHED = ("theta", "tip")


def tracking_controller(controller: Controller, model: Model) -> LinearSystem:
    """Return a controller with ``theta_ref`` as its last input.

    Where the design does not say how the reference enters, each sensor's reading on the
    rigid arm at rest is subtracted: it depends on the arm's lengths alone.
    """
    reference = controller.reference
    if reference is None:
        reference = rigid_reference(controller.linear, rigid_readings(model, controller.sensors))
    return with_reference(controller.linear, reference)


def tracking_loop(
    path: LinearSystem, controller: LinearSystem, model: Model, actuator: Actuator
) -> LinearSystem:
    """Return the closed loop from ``theta_ref`` to ``theta``, ``tip`` and the actuator.

    Parameters
    ----------
    path : LinearSystem
        From the actuator to the sensors; its first states are those of the model.
    controller : LinearSystem
        With ``theta_ref`` as its last input.
    model : Model
    actuator : {"torque", "voltage"}
    """
    watched = watched_rows(model, path.nstates, actuator)
    A, B, C = (np.asarray(getattr(path, name)) for name in "ABC")
    Ak, Ck = np.asarray(controller.A), np.asarray(controller.C)
    Bk, Br = np.asarray(controller.B[:, :-1]), np.asarray(controller.B[:, -1:])
    Dk, Dr = np.asarray(controller.D[:, :-1]), np.asarray(controller.D[:, -1:])
    return LinearSystem(
        closed_matrix(A, B, C, (Ak, Bk, Ck, Dk)),
        np.vstack([B @ Dr, Br]),
        np.block([[watched, np.zeros((len(watched), len(Ak)))], [Dk @ C, Ck]]),
        np.vstack([np.zeros((len(watched), 1)), Dr]),
        controller.dt,
        inputs=[REFERENCE],
        outputs=[*WATCHED, actuator],
        name="tracking",
    )


def watched_rows(model: Model, states: int, actuator: Actuator) -> Array:
    """Return the rows that read ``theta`` and ``tip`` off the first of so many states."""
    system = arm_equations(model, WATCHED, actuator)
    rows = np.zeros((len(WATCHED), states))
    rows[:, : system.nstates] = system.C
    return rows
