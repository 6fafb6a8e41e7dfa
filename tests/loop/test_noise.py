"""Levels under noise: against the cost that they make up, and a simulated sampled loop."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from slewctl import (
    Arm,
    Beam,
    Hub,
    Motor,
    Objective,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.basis import ClampedFree
from slewctl.loop import Loop
from slewctl.loop.noise import noise_levels

MOTOR = Motor(resistance=2.0, torque_constant=0.1, back_emf_constant=0.2, gear_ratio=5)
ARM = Arm(Beam(1.0, 1.0, 1.0), hub=Hub(0.2, radius=0.05), motor=MOTOR, damping_ratio=0.01)
NOISE = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}


def loop_of(limits: dict[str, float], arm: Arm = ARM, **clock: float) -> Loop:
    objective = Objective(limits, NOISE)
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(2)), objective), **clock)
    return close(truth(arm, 6), objective, controller)


@pytest.mark.parametrize("clock", [{}, {"sample_time": 0.02, "delay": 0.013}])
@pytest.mark.parametrize("actuator", ["torque", "voltage"])
def test_levels_make_up_the_cost(actuator: str, clock: dict[str, float]) -> None:
    """J = (tip/limit)² + (actuator/limit)², however each is computed."""
    loop = loop_of({"tip": 0.03, actuator: 2.0}, **clock)
    found = noise_levels(loop)
    own = getattr(found, actuator)
    assert own is not None
    assert_allclose((found.tip / 0.03) ** 2 + (own / 2.0) ** 2, loop.h2.value, rtol=1e-9)


def test_torque_and_voltage_are_those_of_the_motor() -> None:
    """Var τ from the covariance of voltage and rate of a loop written out by hand."""
    loop = loop_of({"tip": 0.03, "voltage": 2.0})
    found = noise_levels(loop)
    closed = loop.system
    A, B = np.asarray(closed.A), np.asarray(closed.B)
    P = np.zeros_like(A)
    step = expm(A * 1e-3)
    # ∫ e^(At) BBᵀ e^(Aᵀt) dt by doubling, which no Lyapunov solver has a part in.
    van_loan = expm(np.block([[-A, B @ B.T], [np.zeros_like(A), A.T]]) * 1e-3)
    P = van_loan[len(A) :, len(A) :].T @ van_loan[: len(A), len(A) :]
    for _ in range(40):
        P, step = P + step @ P @ step.T, step @ step
    rate = np.concatenate([loop.plant.C2[1], np.zeros(len(A) - loop.plant.C2.shape[1])])
    volts = np.concatenate(
        [np.zeros(loop.plant.C2.shape[1]), np.asarray(loop.controller.system.C)[0]]
    )
    torque = MOTOR.torque_per_volt * (volts - MOTOR.volts_per_rate * rate)
    assert found.voltage is not None
    assert_allclose(found.voltage, math.sqrt(volts @ P @ volts), rtol=1e-8)
    assert_allclose(found.torque, math.sqrt(torque @ P @ torque), rtol=1e-8)


def test_a_fast_clock_is_the_continuous_loop() -> None:
    """Sampled ever faster, LQG and what the noise does approach the continuous design."""
    limits = {"tip": 0.03, "torque": 1.0}
    continuous = noise_levels(loop_of(limits))
    errors = []
    for T in (4e-3, 2e-3, 1e-3):
        sampled = noise_levels(loop_of(limits, sample_time=T))
        errors.append(abs(sampled.tip / continuous.tip - 1))
    assert errors[2] < errors[1] < errors[0] < 0.05


def test_an_arm_without_motor_has_no_voltage() -> None:
    assert (
        noise_levels(loop_of({"tip": 0.03, "torque": 1.0}, replace(ARM, motor=None))).voltage
        is None
    )


def test_white_noise_straight_to_the_actuator_has_no_finite_level() -> None:
    loop = loop_of({"tip": 0.03, "torque": 1.0})
    K = loop.controller.system
    direct = replace(loop.controller, system=type(K)(
        K.A, K.B, K.C, [[-1e-3, 0]], inputs=K.input_labels, outputs=K.output_labels
    ))  # fmt: skip
    found = noise_levels(replace(loop, controller=direct))
    assert found.torque == math.inf
    assert math.isfinite(found.tip)


def test_an_unstable_loop_is_never_at_rest() -> None:
    loop = loop_of({"tip": 0.03, "torque": 1.0})
    K = loop.controller.system
    wrong = replace(loop.controller, system=type(K)(
        K.A, K.B, -np.asarray(K.C), K.D, inputs=K.input_labels, outputs=K.output_labels
    ))  # fmt: skip
    with pytest.raises(UnstableLoopError):
        noise_levels(replace(loop, controller=wrong))
