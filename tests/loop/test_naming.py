"""A frequency is named after what L is made of there, the same on every truth and any clock."""

from __future__ import annotations

import control
import numpy as np
import pytest
from loop_examples import OBJECTIVE, TWO_SENSORS, loop_on, uniform_arm

from slewctl import (
    Arm,
    ClampedFree,
    Controller,
    Hub,
    Loop,
    Objective,
    arms,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.loop.margin_functions import margins
from slewctl.loop.single.margin_results import Crossing
from slewctl.numerics.given_system import static
from slewctl.plant import SIGNALS

NAMES = ("gain_db", "gain_reduction_db", "phase_deg", "delay_s", "modulus", "disk")
S = control.tf("s")


def crossings(loop: Loop) -> list[Crossing]:
    found = [getattr(loop.margins, name) for name in NAMES]
    return [crossing for crossing in found if crossing.frequency_hz is not None]


def label(loop: Loop, k: int) -> str:
    return f"mode {k} ({loop.model.frequencies_hz[k - 1]:.4g} Hz)" if k else "rigid body"


@pytest.mark.parametrize("objective", [OBJECTIVE, TWO_SENSORS])
@pytest.mark.parametrize("n", [1, 3])
def test_the_largest_share_by_modal_sums(objective: Objective, n: int) -> None:
    """L as a sum over modes in closed form, the controller by a direct solve."""
    loop = loop_on(uniform_arm(), objective, n=n)
    model, K = loop.model, loop.controller.system
    omega = np.concatenate([[0.0], model.omega])
    rows = np.array([SIGNALS[name].row(model) @ model.mode_shapes for name in K.input_labels])
    rates = np.array([name.endswith("_dot") for name in K.input_labels])
    for crossing in crossings(loop):
        s = 2j * np.pi * crossing.frequency_hz
        modal = model.mode_shapes[0] / (s**2 + 2 * model.arm.damping_ratio * omega * s + omega**2)
        back = K.C @ np.linalg.solve(s * np.eye(K.nstates) - K.A, K.B.astype(complex))
        shares = np.abs((back * s**rates) @ (rows * modal))[0]
        assert crossing.mode == label(loop, int(np.argmax(shares)))


def lightly_damped(sample_time: float, modes: int) -> Loop:
    """An arm whose high modes fold down onto every frequency that the samples show."""
    arm = Arm(arms.paper_beam().beam, Hub(0.05), damping_ratio=0.005)
    objective = Objective(
        {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    )
    plant = generalised_plant(assemble(arm, ClampedFree(2)), objective)
    return close(truth(arm, modes), objective, lqg(plant, sample_time=sample_time, delay=0.003))


@pytest.mark.parametrize("sample_time", [0.01, 0.02])
def test_the_same_name_on_every_truth(sample_time: float) -> None:
    named = []
    for modes in (5, 10, 20, 40):
        loop = lightly_damped(sample_time, modes)
        assert loop.stable
        named.append([crossing.mode.partition(" (")[0] for crossing in crossings(loop)])
    assert named[1:] == named[:-1]


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.01, 0.025])
def test_parts_of_a_sampled_plant_add_up(delay: float) -> None:
    """Modes and the rigid body through hold and delay are the sampled plant, to rounding."""
    loop = lightly_damped(0.01, 4)
    controller = loop.controller
    later = Controller(controller.system, "given", {}, 0.0, controller.certificate, delay=delay)
    sampled = close(loop.model, loop.objective, later)
    modes, T = sampled.modes, 0.01
    J = 1 / (loop.model.mode_shapes[0, 0] ** 2)
    for hertz in (0.4, 3.0, 17.0, 44.0):
        z = np.exp(2j * np.pi * hertz * T)
        K = controller.system(z)[0]
        whole, late = divmod(delay, T)
        # The rigid body turns by the moments of the held, delayed torque.
        fresh = T - late
        theta = (fresh**2 / 2 + (T**2 / 2 - fresh**2 / 2) / z) + (fresh + late / z) * T / (z - 1)
        rigid = np.array([theta, fresh + late / z]) / (J * (z - 1) * z**whole)
        total = -K @ rigid + modes.parts(np.array([2 * np.pi * hertz])).sum()
        L = sampled.response(np.array([2 * np.pi * hertz]))[0]
        assert total == pytest.approx(L, rel=1e-6)


def test_a_mode_above_half_the_sampling_frequency_is_named_if_it_is_what_l_is_made_of() -> None:
    fast = 20.0 / (S**2 + 0.05 * S + 100.0)
    K = control.tf([0.05], [1.0], 0.5)
    assert margins(1 / (S + 1) + fast, K).disk.mode == "mode 1 (1.592 Hz, seen at 0.4085 Hz)"
    # Without gain it is still nearest to what the samples show, and has no share.
    silent = margins(1 / (S + 1) + 1e-9 * fast, control.tf([3.0], [1.0], 0.5))
    assert all(getattr(silent, name).mode == "" for name in NAMES)


def test_static_and_lag_loops_have_no_modes() -> None:
    assert margins(25 / (S + 1) ** 2).phase_deg.mode == ""
    assert margins(static(-0.5)).gain_db.mode == ""
