"""An arm with an elastic joint through design, judgement, reduction and the gate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import slewctl as sc
from slewctl.compare import first_modes
from slewctl.files import read_design
from slewctl.gate import check_designs
from slewctl.loop.noise import noise_levels

ARM = sc.Arm(
    sc.arms.paper_beam().beam,
    sc.Hub(0.1, friction=0.01),
    sc.Payload(0.1, 0.001),
    damping_ratio=0.01,
    motor=sc.Motor(2.0, 0.05, 0.05, gear_ratio=10.0, rotor_inertia=1e-4, voltage_limit=30.0),
    joint=sc.Joint(60.0, 0.02, rotor_inertia=0.1, rotor_friction=0.02),
)
NOISE = {"torque": 0.1, "theta_motor": 0.01, "theta_motor_dot": 0.1, "root_moment": 0.1}


def problem(arm: sc.Arm = ARM, actuator: str = "torque") -> sc.Problem:
    return sc.Problem(arm, {"tip": 0.03, actuator: 1.0}, NOISE)


@pytest.mark.parametrize("actuator", ["torque", "voltage"])
def test_designs_hold_on_the_truth(actuator: str) -> None:
    asked = problem(actuator=actuator)
    plant = asked.plant("hub-matched", 2)
    assert len(plant.A) == 2 * (1 + 1 + 2)
    judged = asked.judge(sc.lqg(plant))
    assert judged.stable
    assert 0 <= judged.loss < 0.01
    assert asked.judge(sc.lqg(plant, sample_time=0.02, delay=0.005)).stable
    servo = asked.judge(sc.pd_notch(plant, bandwidth_hz=0.3))
    assert servo.stable


def test_a_rotor_servo_is_stable_for_any_gain() -> None:
    """A collocated rate and angle: passive, whatever the arm; from the hub it is not."""
    for gain in (0.1, 10.0, 1e3):
        system = sc.given(
            D=[[gain, gain]], inputs=["theta_motor", "theta_motor_dot"], feedback="negative"
        )
        assert sc.close(problem().truth, problem().objective, system).stable
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    asked = sc.Problem(ARM, {"tip": 0.03, "torque": 1.0}, noise)
    hub = sc.given(D=[[1e3, 1e3]], inputs=["theta", "theta_dot"], feedback="negative")
    assert not sc.close(asked.truth, asked.objective, hub).stable


def test_voltage_and_noise_are_those_of_the_rotor() -> None:
    """The same loop by torque and by the voltage that makes it, back-EMF and all."""
    asked = problem(actuator="voltage")
    loop = asked.judge(sc.lqg(asked.plant("hub-matched", 2))).loop
    motor = ARM.motor
    assert motor is not None
    slew = sc.simulate_slew(loop, sc.Slew(30.0, 2.0), points=9)
    # The rotor's rate from V and τ, and its mean over the whole turn: the angle turned.
    rate = (slew.actuator - slew.torque / motor.torque_per_volt) / motor.volts_per_rate
    assert rate[0] == pytest.approx(0, abs=1e-9)
    assert abs(rate).max() > 0.1
    levels = noise_levels(loop)
    assert levels.voltage == pytest.approx(np.sqrt(_variance(asked, loop)), rel=1e-6)


def _variance(asked: sc.Problem, loop: sc.Loop) -> float:
    """Return the variance of the voltage from the closed loop's own z_voltage."""
    closed = loop.linear
    from scipy.linalg import solve_continuous_lyapunov

    P = solve_continuous_lyapunov(closed.A, -closed.B @ closed.B.T)
    row = closed.C[list(closed.output_labels).index("z_voltage")]
    return float(row @ P @ row) * asked.limits["voltage"] ** 2


def test_reductions_keep_the_joint() -> None:
    full = problem().plant("polynomial", 8)
    few = sc.balanced_truncation(full, 4)
    judged = problem().judge(sc.lqg(few.plant))
    assert judged.stable
    assert judged.loss < 0.05
    cut = first_modes(problem().truth, 6)
    assert np.allclose(cut.turning, problem().truth.turning[:7])


def test_arm_and_gate_by_file(tmp_path: Path) -> None:
    asked = {"gain_margin_db": 3.0}
    text = problem().to_toml("pd-notch", bandwidth_hz=0.3, basis="hub-matched", requirements=asked)
    varied = "\n[variations.soft]\njoint_stiffness_factor = 0.9\n\n[variations.stiff]\n"
    path = tmp_path / "joint.toml"
    path.write_text(text + varied + "joint_stiffness = 120.0\n")
    design = read_design(path)
    assert design.case.arm == replace(ARM, name=design.case.arm.name)
    assert [v.arm.joint.stiffness for v in design.variations] == pytest.approx([54.0, 120.0])
    (result,) = check_designs([path])
    assert result.status == "passed"
