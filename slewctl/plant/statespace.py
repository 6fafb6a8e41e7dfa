"""The reduced-order model builder: from a `Model` to a named `control.StateSpace` (eq. 43–44)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, Motor
from slewctl.errors import InputError, check_choice, check_positive
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.dead_time import late
from slewctl.plant.readings import driven
from slewctl.plant.signals import ACTUATORS, TORQUE, VOLTAGE, check_signals, signal

if TYPE_CHECKING:
    import control

Coordinates = Literal["physical", "modal"]
Actuator = Literal["torque", "voltage"]
APPLIED = "applied"
"""What the actuator applies, its lags and dead time included: the last of the outputs."""


@dataclass(frozen=True, eq=False)
class _SecondOrder:
    """ẍ = −stiffness·x − damping·ẋ + force·u in coordinates x with [θ, q] = transform·x."""

    stiffness: Array
    damping: Array
    force: Array
    transform: Array
    names: tuple[str, ...]


def state_space(
    model: Model,
    outputs: Sequence[str] | str = ("theta", "theta_dot", "tip"),
    *,
    input: Actuator = "torque",
    coordinates: Coordinates = "physical",
    sample_time: float | None = None,
) -> control.StateSpace:
    """Return the state-space model of an arm from its actuator to named outputs.

    Of an arm with an `Actuator` the input is its command, and its lags are states beside the
    arm's, as is the Padé approximation of its dead time.  Outputs are the arm's own: what its
    `Sensor` objects make of them is in the generalised plant.

    Parameters
    ----------
    model : Model
    outputs : sequence of str, or str
        Any of ``theta`` (rad), ``theta_dot`` (rad/s), ``tip`` (m, along the arc),
        ``theta_motor`` (rad) and ``theta_motor_dot`` (rad/s), the rotor's behind an elastic
        joint, ``tip_dot`` (m/s), ``tip_acceleration`` (m/s²), ``tip_deflection`` (m) and
        ``root_moment`` (N·m), and sensors at a station: ``moment@50mm`` (N·m),
        ``deflection@50mm`` (m) and ``acceleration@50mm`` (m/s²); see `signal`.
    input : {"torque", "voltage"}
        Torque: the torque on the hub, or on the rotor behind an elastic joint, as of a motor
        under current control.  Voltage: that of the arm's motor, whose back-EMF is then
        friction there.
    coordinates : {"physical", "modal"}
        Physical: states θ, q_1 … q_n and their rates (with an elastic joint ``theta_motor``
        and ``twist`` in the place of θ); A and B are those of eq. 44, with
        damping.  Modal: x = Uη, so that A consists of diagonal blocks; this is the
        better conditioned one.
    sample_time : float, optional
        In seconds.  Given, the model is sampled exactly, with a zero-order hold on the
        input.

    Returns
    -------
    control.StateSpace
        2(n+1) states, two more with an elastic joint; input ``torque`` in N·m or ``voltage``
        in V.

    Raises
    ------
    InputError
        For an unknown output, input or coordinates, a station beyond the tip, a voltage
        without a motor, a sample time that is not positive, or one beside a dead time,
        which `sampled_plant` takes exactly.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> G = sc.state_space(model, ["theta", "tip"])
    >>> G.nstates, G.input_labels, G.output_labels
    (6, ['torque'], ['theta', 'tip'])
    """
    check_model(model, "state_space")
    check_signals(outputs, "outputs", model.arm.beam)
    equations = arm_equations(model, outputs, input, coordinates)
    delay = model.arm.drive.delay
    if sample_time is None:
        return late(equations, delay).to_control()
    step = check_positive(sample_time, "sample_time")
    if delay:
        raise InputError(
            "the actuator's dead time is not part of a sampled state space",
            where="sample_time",
            remedy="use slewctl.sampled_plant, which takes it exactly",
        )
    continuous = equations.to_control()
    return continuous.sample(step, method="zoh", name=f"{continuous.name}_sampled")


def arm_equations(
    model: Model,
    outputs: Sequence[str] | str,
    input: Actuator = "torque",
    coordinates: Coordinates = "modal",
) -> LinearSystem:
    """Return the arm's signals from the command of its actuator, without its dead time.

    `APPLIED` among the outputs is what the actuator applies, in its own unit.
    """
    return driven(bare_equations(model, outputs, input, coordinates), model.arm.drive.lags)


def bare_equations(
    model: Model,
    outputs: Sequence[str] | str,
    input: Actuator = "torque",
    coordinates: Coordinates = "modal",
) -> LinearSystem:
    """Return the same from what the actuator applies."""
    wanted = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    names = check_signals([name for name in wanted if name != APPLIED], "outputs", model.arm.beam)
    for name in dict(model.arm.sensors):
        signal(name, "arm.sensors", model.arm.beam)
    check_choice(input, ACTUATORS, "input")
    system = _second_order(model, coordinates, input)
    size = len(system.names)
    A = np.block([[np.zeros((size, size)), np.eye(size)], [-system.stiffness, -system.damping]])
    B = np.concatenate([np.zeros(size), system.force])[:, None]
    C = np.zeros((len(names), 2 * size))
    D = np.zeros((len(names), 1))
    for i, name in enumerate(names):
        C[i], D[i] = _output_row(model, system, name)
    if APPLIED in wanted:
        C, D = np.vstack([C, np.zeros(2 * size)]), np.vstack([D, np.ones((1, 1))])
        names = (*names, APPLIED)
    return LinearSystem(
        A,
        B,
        C,
        D,
        inputs=[input],
        outputs=list(names),
        states=[*system.names, *(f"{name}_dot" for name in system.names)],
        name=f"{model.basis.name}_{model.n}".replace(" ", "_").replace("-", "_"),
    )


def require_motor(arm: Arm, where: str) -> Motor:
    """Return the motor of `arm`; refuse an arm that has none."""
    if arm.motor is None:
        raise InputError(
            f"{arm.name} has no motor, so no voltage drives it",
            where=where,
            remedy="give the arm its motor, or use the torque",
        )
    return arm.motor


def drive(arm: Arm, actuator: str) -> tuple[float, float]:
    """Return the torque at rest per unit of the actuator, and its friction where it acts.

    Returns
    -------
    tuple of float
        (1, 0) for the torque; N·m/V and N·m·s/rad, the back-EMF's, for the voltage.
    """
    if actuator == TORQUE:
        return 1.0, 0.0
    motor = require_motor(arm, VOLTAGE)
    return motor.torque_per_volt, motor.back_emf_damping


def _second_order(model: Model, coordinates: Coordinates, actuator: str) -> _SecondOrder:
    check_choice(coordinates, ("physical", "modal"), "coordinates")
    U = model.mode_shapes
    gain, drag = drive(model.arm, actuator)
    force = gain * model.input
    damping = model.damping + drag * np.outer(model.input, model.input)
    if coordinates == "modal":
        names = ("rigid", *(f"mode{i}" for i in range(1, model.n + 1)))
        squared = np.concatenate([[0.0], model.omega**2])
        return _SecondOrder(np.diag(squared), U.T @ damping @ U, U.T @ force, U, names)
    # M⁻¹ = UUᵀ: the modes are known to full accuracy, so M need not be factorised again.
    names = model.coordinates
    return _SecondOrder(
        U @ (U.T @ model.stiffness),
        U @ (U.T @ damping),
        U @ (U.T @ force),
        np.eye(model.n + 1),
        names,
    )


def _output_row(model: Model, system: _SecondOrder, name: str) -> tuple[Array, float]:
    """Return the row of C and the entry of D that belong to output `name`."""
    output = signal(name, beam=model.arm.beam)
    row = output.row(model) @ system.transform
    nothing = np.zeros_like(row)
    if output.of == "displacement":
        return np.concatenate([row, nothing]), 0.0
    if output.of == "rate":
        return np.concatenate([nothing, row]), 0.0
    accelerations = -np.concatenate([row @ system.stiffness, row @ system.damping])
    return accelerations, float(row @ system.force)
