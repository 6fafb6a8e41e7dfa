"""The closed loop from the reference angle to what the arm does."""

from __future__ import annotations

import control
import numpy as np

from slewctl._types import Array
from slewctl.design import Controller
from slewctl.design.reference import REFERENCE, rigid_readings, rigid_reference
from slewctl.design.result import with_reference
from slewctl.model import Model
from slewctl.plant import state_space
from slewctl.plant.statespace import Actuator

WATCHED = ("theta", "tip")


def tracking_controller(controller: Controller, model: Model) -> control.StateSpace:
    """Return a controller with ``theta_ref`` as its last input.

    Where the design does not say how the reference enters, each sensor's reading on the
    rigid arm at rest is subtracted: it depends on the arm's lengths alone.
    """
    reference = controller.reference
    if reference is None:
        reference = rigid_reference(controller.system, rigid_readings(model, controller.sensors))
    return with_reference(controller.system, reference)


def tracking_loop(
    path: control.StateSpace, controller: control.StateSpace, model: Model, actuator: Actuator
) -> control.StateSpace:
    """Return the closed loop from ``theta_ref`` to ``theta``, ``tip`` and the actuator.

    Parameters
    ----------
    path : control.StateSpace
        From the actuator to the sensors; its first states are those of the model.
    controller : control.StateSpace
        With ``theta_ref`` as its last input.
    model : Model
    actuator : {"torque", "voltage"}
    """
    watched = watched_rows(model, path.nstates, actuator)
    A, B, C = (np.asarray(getattr(path, name)) for name in "ABC")
    Ak, Ck = np.asarray(controller.A), np.asarray(controller.C)
    Bk, Br = np.asarray(controller.B[:, :-1]), np.asarray(controller.B[:, -1:])
    Dk, Dr = np.asarray(controller.D[:, :-1]), np.asarray(controller.D[:, -1:])
    return control.StateSpace(
        np.block([[A + B @ Dk @ C, B @ Ck], [Bk @ C, Ak]]),
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
    system = state_space(model, WATCHED, input=actuator, coordinates="modal")
    rows = np.zeros((len(WATCHED), states))
    rows[:, : system.nstates] = system.C
    return rows
