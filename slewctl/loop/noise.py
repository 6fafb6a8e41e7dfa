"""What noise and disturbance do to a closed loop at rest: root-mean-square levels."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.loop.closed import Loop
from slewctl.loop.sampled import SampledLoop
from slewctl.numerics.balance import balance
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import solve_lyapunov
from slewctl.plant import GeneralisedPlant, arm_signals, sampled_plant
from slewctl.plant.places import knows
from slewctl.plant.signals import TORQUE
from slewctl.plant.statespace import APPLIED

# A variance is negative where it is by more than this of what it is the sum of.
_NEGATIVE = 1e-9
_TIP, _TORQUE, _VOLTAGE = "z_tip", "z_torque", "z_voltage"


@dataclass(frozen=True)
class NoiseLevels:
    """Stationary root-mean-square values under the objective's disturbance and sensor noise.

    Attributes
    ----------
    tip : float or None
        Of the tip along the arc, in m; None for an arm whose modal data tell of no tip.
    torque : float
        Of the actuator, in N·m; infinite where white sensor noise passes straight to it.
    voltage : float or None
        Of the motor, in V; None for an arm without one.
    """

    tip: float | None
    torque: float
    voltage: float | None


def noise_levels(loop: Loop) -> NoiseLevels:
    """Return the levels of a loop, of a sampled one as means over all times.

    Parameters
    ----------
    loop : Loop

    Raises
    ------
    UnstableLoopError
        An unstable loop is never at rest.
    """
    loop.require_stable("levels under noise")
    watched = _watched(loop)
    if isinstance(loop, SampledLoop):
        values = _sampled(loop, watched)
    else:
        values = _continuous(loop, watched)
    return NoiseLevels(values.get(_TIP), values[_TORQUE], values.get(_VOLTAGE))


def _watched(loop: Loop) -> GeneralisedPlant:
    """Return the loop's plant with tip, torque and voltage in the place of its performance."""
    plant, motor = loop.plant, loop.model.arm.motor
    actuator = loop.objective.actuator
    seen = ("tip",) if knows(loop.model.arm.beam, "tip") else ()
    arm = arm_signals(plant, (*seen, "theta_motor_dot", APPLIED))
    (*tip, rate, applied), through = arm.C, float(arm.D[-1, 0])
    outputs: dict[str, tuple[Array, float]] = {}
    if tip:
        outputs[_TIP] = (tip[0], 0.0)
    if actuator == TORQUE or motor is None:
        outputs[_TORQUE] = (applied, through)
        if motor is not None:
            volts = motor.voltage(applied, rate)
            outputs[_VOLTAGE] = (volts, through / motor.torque_per_volt)
    else:
        outputs[_TORQUE] = (motor.torque(applied, rate), motor.torque_per_volt * through)
        outputs[_VOLTAGE] = (applied, through)
    system, kept = plant.linear, len(outputs)
    C = np.vstack([[row for row, _ in outputs.values()], plant.C2])
    D = np.zeros((len(C), system.ninputs))
    D[:kept, -1] = [through for _, through in outputs.values()]
    D[kept:] = system.D[plant.performance :]
    return replace(
        plant,
        system=LinearSystem(
            system.A,
            system.B,
            C,
            D,
            inputs=system.input_labels,
            outputs=[*outputs, *plant.sensors],
            states=system.state_labels,
            name=f"{system.name}_watched",
        ),
    )


def _continuous(loop: Loop, watched: GeneralisedPlant) -> dict[str, float]:
    closed = watched.close(loop.controller.linear)
    A, B, C, D = (np.asarray(getattr(closed, name)) for name in "ABCD")
    scale = balance(A)
    As, Bs, Cs = A / scale[:, None] * scale, B / scale[:, None], C * scale
    covariance = solve_lyapunov(As, -Bs @ Bs.T)
    variances = np.einsum("ij,jk,ik->i", Cs, covariance, Cs)
    sizes = np.einsum("ij,jk,ik->i", *map(np.abs, (Cs, covariance, Cs)))
    if np.any(variances < -_NEGATIVE * sizes):
        raise AccuracyError(
            "a variance comes out negative: a mode hardly decays beside rounding",
            where="noise",
            remedy="give modes some damping",
        )
    variances = np.where(D.any(axis=1), math.inf, np.maximum(variances, 0.0))
    return dict(zip(closed.output_labels, np.sqrt(variances).tolist(), strict=True))


def _sampled(loop: SampledLoop, watched: GeneralisedPlant) -> dict[str, float]:
    """Return the levels one by one: each is the cost of a plant that has only that output."""
    system, found = watched.linear, {}
    for k, name in enumerate(system.output_labels[: watched.performance]):
        kept = [k, *range(watched.performance, system.noutputs)]
        alone = LinearSystem(
            system.A, system.B, np.asarray(system.C)[kept], np.asarray(system.D)[kept],
            inputs=system.input_labels, outputs=[system.output_labels[i] for i in kept],
            states=system.state_labels, name=system.name,
        )  # fmt: skip
        one = replace(watched, system=alone)
        sampled = sampled_plant(one, loop.sample_time, loop.late)
        closed = sampled.close(loop.controller.linear, loop.rounding)
        found[name] = math.sqrt(max(closed.h2.value, 0.0))
    return found
