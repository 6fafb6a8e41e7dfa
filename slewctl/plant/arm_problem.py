"""The generalised plant of the disturbance-rejection problem on an arm.

                 ┌───────────────────┐
    w_torque ───►│                   ├───► z_<output>   = output / largest acceptable value
    w_<sensor> ─►│         P         ├───► z_<actuator> = actuator / largest acceptable value
                 │                   │
    <actuator> ─►│                   ├───► <sensor>     = measurement + noise
                 └───────────────────┘

The actuator is the ``torque`` on the hub or the ``voltage`` of the motor.  The
disturbances w are independent white noises of unit intensity, the torque's on the arm itself,
a sensor's behind its lags; the controller feeds the
sensors back to the actuator so that the H2 norm from w to z is small.  Its square is the
stationary mean of Σ z².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, shown
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.dead_time import late, loop_dead_time
from slewctl.plant.objective import Objective
from slewctl.plant.problem import GeneralisedPlant
from slewctl.plant.readings import driven, measured
from slewctl.plant.signals import TORQUE
from slewctl.plant.statespace import Actuator, Coordinates, arm_equations, bare_equations, drive


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
        With the lags of the arm's actuator and sensors among its states, and their dead time,
        which its system has as a Padé approximation.

    Raises
    ------
    InputError
        If a performance output or sensor responds to the torque without delay (such as
        ``tip_acceleration`` without a lag), for which the H2 cost is not finite; if sensors
        differ in their dead time; if a station is beyond
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
    plant = _disturbed(model, (*z_names, *sensors), objective, coordinates)
    nz, ny = len(z_names), len(sensors)
    _refuse_feedthrough(plant.output_labels[:nz], plant.D[:nz])
    plant = measured(plant, model.arm, sensors)
    _refuse_feedthrough(sensors, plant.D[nz:])
    states = plant.nstates
    B = np.hstack([plant.B[:, :1], np.zeros((states, ny)), plant.B[:, 1:]])
    C = np.insert(plant.C, nz, 0.0, axis=0)
    D = np.zeros((nz + 1 + ny, ny + 2))
    for i, name in enumerate(z_names):
        C[i] = _over(C[i], objective.limits[name], f"limits.{name}")
    D[nz, -1:] = _over(np.ones(1), objective.limits[actuator], f"limits.{actuator}")
    for i, name in enumerate(sensors):
        D[nz + 1 + i, 1 + i] = objective.noise[name]
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
    exact = GeneralisedPlant(system, sensors, model, objective)
    seconds = loop_dead_time(model.arm, sensors)
    if not seconds:
        return exact
    delayed = late(system, seconds)
    # The limit of the actuator is one of the command, which nothing delays.
    rows = np.hstack([system.C, np.zeros((len(system.C), delayed.nstates - states))])
    delayed = LinearSystem(
        delayed.A,
        delayed.B,
        rows,
        system.D,
        inputs=delayed.input_labels,
        outputs=delayed.output_labels,
        states=delayed.state_labels,
        name=delayed.name,
    )
    return replace(exact, system=delayed, undelayed=exact, dead_time=seconds)


def arm_signals(plant: GeneralisedPlant, outputs: Sequence[str]) -> LinearSystem:
    """Return the arm's own signals, and `APPLIED`, on the states of an arm's plant.

    Parameters
    ----------
    plant : GeneralisedPlant
        As `generalised_plant` made it, in modal coordinates.
    outputs : sequence of str
        `APPLIED` last, if it is wanted.

    Returns
    -------
    LinearSystem
        From the actuator's command.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> arm_signals(problem.plant("clamped-free", n=1), ["theta", "tip"]).C.shape
    (2, 4)
    """
    if plant.model is None:
        raise InputError(
            "the plant carries no model of an arm",
            where="plant",
            remedy="make it with slewctl.generalised_plant",
        )
    actuator: Actuator = "torque" if plant.actuator == TORQUE else "voltage"
    arm, exact = arm_equations(plant.model, outputs, actuator), plant.exact
    rows = np.zeros((arm.noutputs, exact.linear.nstates))
    rows[:, : arm.nstates] = arm.C
    own = LinearSystem(
        exact.A,
        exact.B2,
        rows,
        arm.D,
        inputs=[actuator],
        outputs=arm.output_labels,
        states=exact.linear.state_labels,
    )
    return late(own, plant.dead_time)


def _disturbed(
    model: Model, outputs: Sequence[str], objective: Objective, coordinates: Coordinates
) -> LinearSystem:
    """Return the arm from [disturbance torque, actuator's command] to some of its signals.

    The disturbance meets the arm itself, the command passes the actuator's lags.
    """
    actuator, names = objective.actuator, tuple(dict.fromkeys(outputs))
    bare = bare_equations(model, names, actuator, coordinates)
    plant = driven(bare, model.arm.drive.lags)
    rows = [names.index(name) for name in outputs]
    size = objective.noise[TORQUE] / drive(model.arm, actuator)[0]
    entering = np.zeros((plant.nstates, 1))
    entering[: bare.nstates] = size * bare.B
    return LinearSystem(
        plant.A,
        np.hstack([entering, plant.B]),
        plant.C[rows],
        np.hstack([size * bare.D, plant.D])[rows],
        inputs=["w_torque", actuator],
        outputs=list(outputs),
        states=plant.state_labels,
        name=plant.name,
    )


def _refuse_feedthrough(names: Sequence[str], D: Array) -> None:
    for name, row in zip(names, D, strict=True):
        if row.any():
            raise InputError(
                f"{name} responds to the torque without delay",
                where="objective",
                remedy="leave it out, or give its sensor a lag: white torque noise would make "
                "its variance infinite",
            )


def _over(row: Array, limit: float, where: str) -> Array:
    with np.errstate(over="ignore"):
        weighted = row / limit
    if not np.isfinite(weighted).all():
        raise InputError(
            f"{limit:g} is too small to divide by", where=where, remedy="give a larger limit"
        )
    return weighted
