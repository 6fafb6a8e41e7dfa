"""The generalised plant of the disturbance-rejection problem on an arm.

                 ┌───────────────────┐
    w_torque ───►│                   ├───► z_<output>   = output / largest acceptable value
    w_<sensor> ─►│         P         ├───► z_<actuator> = actuator / largest acceptable value
                 │                   │
    <actuator> ─►│                   ├───► <sensor>     = measurement + noise
                 └───────────────────┘

The actuator is the ``torque`` on the hub or the ``voltage`` of the motor.  The
disturbances w are independent white noises of unit intensity; the controller feeds the
sensors back to the actuator so that the H2 norm from w to z is small.  Its square is the
stationary mean of Σ z².
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, shown
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.objective import Objective
from slewctl.plant.problem import GeneralisedPlant
from slewctl.plant.signals import TORQUE
from slewctl.plant.statespace import Coordinates, arm_equations, drive


def generalised_plant(
    model: Model, objective: Objective, *, coordinates: Coordinates = "modal"
) -> GeneralisedPlant:
    """Return the generalised plant of `objective` on `model`.

    Parameters
    ----------
    model : Model
    objective : Objective
    coordinates : {"modal", "physical"}
        Of the states, see `state_space`.  The modal ones are much the better conditioned;
        every design method takes both.

    Returns
    -------
    GeneralisedPlant

    Raises
    ------
    InputError
        If a performance output or sensor responds to the torque without delay (such as
        ``tip_acceleration``), for which the H2 cost is not finite; if a station is beyond
        the tip, or the objective limits the voltage of an arm without a motor.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = sc.generalised_plant(model, objective)
    >>> plant.A.shape, plant.C1.shape, plant.C2.shape
    ((6, 6), (2, 6), (1, 6))
    """
    check_model(model, "generalised_plant")
    if not isinstance(objective, Objective):
        raise InputError(
            f"{shown(objective)} is not an Objective",
            where="generalised_plant",
            remedy="give a slewctl.Objective",
        )
    z_names, sensors, actuator = objective.performance, objective.sensors, objective.actuator
    outputs = _union(z_names, sensors)
    plant = arm_equations(model, outputs, actuator, coordinates)
    torque_per_unit = drive(model.arm, actuator)[0]
    for name, feedthrough in zip(plant.output_labels, plant.D[:, 0], strict=True):
        if feedthrough != 0:
            raise InputError(
                f"{name} responds to the torque without delay",
                where="objective",
                remedy="leave it out: white torque noise would make its variance infinite",
            )
    rows = {name: plant.C[i] for i, name in enumerate(plant.output_labels)}
    nz, ny = len(z_names) + 1, len(sensors)
    states = plant.nstates
    disturbance = objective.noise[TORQUE] * (plant.B / torque_per_unit)
    B = np.hstack([disturbance, np.zeros((states, ny)), plant.B])
    C = np.zeros((nz + ny, states))
    D = np.zeros((nz + ny, ny + 2))
    for i, name in enumerate(z_names):
        C[i] = _over(rows[name], objective.limits[name], f"limits.{name}")
    D[nz - 1, -1:] = _over(np.ones(1), objective.limits[actuator], f"limits.{actuator}")
    for i, name in enumerate(sensors):
        C[nz + i] = rows[name]
        D[nz + i, 1 + i] = objective.noise[name]
    system = LinearSystem(
        plant.A,
        B,
        C,
        D,
        inputs=["w_torque", *(f"w_{name}" for name in sensors), actuator],
        outputs=[*(f"z_{name}" for name in z_names), f"z_{actuator}", *sensors],
        states=list(plant.state_labels),
        name=f"{plant.name}_generalised",
    )
    return GeneralisedPlant(system, sensors, model, objective)


def _over(row: Array, limit: float, where: str) -> Array:
    with np.errstate(over="ignore"):
        weighted = row / limit
    if not np.isfinite(weighted).all():
        raise InputError(
            f"{limit:g} is too small to divide by", where=where, remedy="give a larger limit"
        )
    return weighted


def _union(first: Sequence[str], second: Sequence[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys([*first, *second]))
