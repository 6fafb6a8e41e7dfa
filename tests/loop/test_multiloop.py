"""Several loops: the multiloop disk margin against closed forms, invariances and its own claims."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_multiloops import brute_force_mu, flexible_plant, lqg_controller, stable_multiloops
from strategies import deterministic

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Hub,
    InputError,
    Loop,
    Objective,
    Payload,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.loop import classical_margins
from slewctl.loop.parts import state_space
from slewctl.loop.robust.multiloop import (
    MultiloopDisk,
    multiloop_disk_margin,
    multiloop_margins,
    perturbation_system,
)
from slewctl.loop.robust.return_ratios import (
    input_loop,
    input_output_loop,
    one_loop,
    output_loop,
    sensitivity,
)
from slewctl.numerics.given_system import static

BRACKET = 1e-4


def satellite(a: float) -> tuple[control.StateSpace, control.StateSpace]:
    """The spinning satellite, and its controller for negative feedback."""
    plant = control.ss([[0, a], [-a, 0]], np.eye(2), [[1, a], [-a, 1]], np.zeros((2, 2)))
    return plant, static(np.eye(2)).to_control()


def sampled(loop: control.StateSpace, fraction: float = 0.02) -> control.StateSpace | None:
    """The loop sampled often enough to stay stable, if it does."""
    step = fraction / np.abs(loop.poles()).max() ** 0.5
    discrete = loop.sample(step)
    poles = sensitivity(state_space(discrete, "loop")).poles()
    return discrete if np.abs(poles).max() < 1 - 1e-9 else None


def assert_sound(disk: MultiloopDisk) -> None:
    assert 0 < disk.guaranteed <= disk.reached
    assert disk.gap < BRACKET
    assert disk.on_axis < 1e-6
    assert disk.confirmed
    assert np.abs(disk.perturbation) == pytest.approx(disk.reached, rel=1e-9)


@pytest.mark.slow
def test_spinning_satellite() -> None:
    """Seiler, Packard and Gahinet 2020: perfect one at a time, 0.0998 together."""
    plant, controller = satellite(10.0)
    margins = multiloop_margins(input_loop(plant, controller))
    for single in margins.one_at_a_time:
        assert single.gain_db.value == single.gain_reduction_db.value == np.inf
        assert single.phase_deg.value == pytest.approx(90)
        assert single.modulus.value == pytest.approx(1)
        assert single.disk.value == pytest.approx(2)
    assert round(margins.disk.reached, 4) == 0.0998
    assert_sound(margins.disk)
    assert margins.disk.gains == pytest.approx((0.905, 1.105), abs=1e-3)
    both = multiloop_disk_margin(input_output_loop(plant, controller))
    assert_sound(both)
    assert both.reached < margins.disk.guaranteed


@pytest.mark.parametrize("a", [0.5, 3.0, 10.0, 100.0])
@pytest.mark.parametrize("skew", [-1.0, 1.0])
def test_satellite_in_closed_form(a: float, skew: float) -> None:
    """S and T are normal with the same gain in both channels, √(1 + a²) at its largest."""
    disk = multiloop_disk_margin(input_loop(*satellite(a)), skew)
    assert disk.guaranteed <= 1 / np.sqrt(1 + a**2) * (1 + 1e-9)
    assert disk.guaranteed == pytest.approx(1 / np.sqrt(1 + a**2), rel=BRACKET)
    assert_sound(disk)


@pytest.mark.slow
@pytest.mark.parametrize("loop", list(stable_multiloops(1, 6)))
def test_two_loops_against_a_grid_refined_at_every_pole(loop: control.StateSpace) -> None:
    found, truth = multiloop_disk_margin(loop), 1 / brute_force_mu(loop)
    assert_sound(found)
    assert found.guaranteed <= truth * (1 + 1e-7)
    assert truth * (1 - BRACKET) <= found.guaranteed
    discrete = sampled(loop)
    if discrete is not None:
        found, truth = multiloop_disk_margin(discrete), 1 / brute_force_mu(discrete)
        assert_sound(found)
        assert truth * (1 - BRACKET) <= found.guaranteed <= truth * (1 + 1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("skew", [0.0, 0.6])
def test_many_two_loops_against_a_refined_grid(skew: float) -> None:
    for loop in stable_multiloops(7, 3, modes=(2, 16)):
        found, truth = multiloop_disk_margin(loop, skew), 1 / brute_force_mu(loop, skew)
        assert found.gap < BRACKET
        assert found.on_axis < 1e-6
        assert truth * (1 - BRACKET) <= found.guaranteed <= truth * (1 + 1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("channels", [3, 4])
def test_three_and_four_loops_are_enclosed(channels: int) -> None:
    """Three scalars have an exact upper bound; for four the random examples happen to."""
    for loop in stable_multiloops(3, 2, channels, modes=(2, 6)):
        assert_sound(multiloop_disk_margin(loop))


@pytest.mark.slow
@pytest.mark.parametrize("loop", list(stable_multiloops(4, 4, modes=(2, 8))))
def test_invariances(loop: control.StateSpace) -> None:
    """Units of the channels, their order, and transposition change nothing."""
    margin = multiloop_disk_margin(loop).reached
    A, B, C, D = (np.asarray(getattr(loop, name)) for name in "ABCD")
    scale = np.array([1e3, 0.02])
    others = [
        control.ss(A, B / scale, scale[:, None] * C, scale[:, None] * D / scale),
        control.ss(A, B[:, ::-1], C[::-1], D[::-1, ::-1]),
        control.ss(A.T, C.T, B.T, D.T),
        control.ss(7 * A, 7 * B, C, D),
    ]
    for other in others:
        assert multiloop_disk_margin(other).reached == pytest.approx(margin, rel=BRACKET)


@pytest.mark.parametrize("loop", list(stable_multiloops(5, 4, modes=(2, 8))))
def test_a_channel_alone_bears_no_less_than_all_together(loop: control.StateSpace) -> None:
    margins = multiloop_margins(loop)
    for single in margins.one_at_a_time:
        assert single.disk.value >= margins.disk.guaranteed
    plain = 1 / np.linalg.norm(
        np.asarray(sensitivity(state_space(loop, "loop")).D) - 0.5 * np.eye(2), 2
    )
    assert margins.disk.guaranteed <= plain * (1 + 1e-9)


def test_a_single_channel_has_the_disk_margin_of_a_single_loop() -> None:
    for loop in stable_multiloops(6, 4, modes=(2, 10)):
        one = one_loop(state_space(loop, "loop"), 1)
        single, multi = classical_margins(one).disk, multiloop_disk_margin(one)
        assert multi.guaranteed <= single.value * (1 + 1e-9)
        assert multi.reached == pytest.approx(single.value, rel=BRACKET)


def test_uncoupled_channels_have_the_smaller_of_both_margins() -> None:
    first = control.tf2ss(control.tf([25], [1, 10, 10, 10]))
    second = control.tf2ss(control.tf([4], [1, 1.5, 1]))
    found = multiloop_disk_margin(control.append(first, second))
    expected = min(classical_margins(loop).disk.value for loop in (first, second))
    assert found.guaranteed <= expected * (1 + 1e-9)
    assert found.reached == pytest.approx(expected, rel=BRACKET)


@pytest.mark.parametrize("loop", list(stable_multiloops(8, 4, modes=(2, 8))))
def test_the_real_perturbation_puts_a_pair_of_poles_on_the_axis(loop: control.StateSpace) -> None:
    disk = multiloop_disk_margin(loop)
    assert disk.frequency_hz
    omega = 2 * np.pi * disk.frequency_hz
    factors = perturbation_system(disk)
    at = np.diag(factors(1j * omega))
    assert at == pytest.approx(np.array(disk.factors), rel=1e-9)
    deltas = (at - 1) / (1 + (at - 1) / 2)
    assert np.abs(deltas) == pytest.approx(disk.reached, rel=1e-9)
    poles = sensitivity(state_space(loop * factors, "loop")).poles()
    assert np.abs(poles - 1j * omega).min() < 1e-6 * omega
    assert np.abs(poles + 1j * omega).min() < 1e-6 * omega


def test_plant_and_controller_are_connected_with_the_sign_given() -> None:
    rng = np.random.default_rng(2)
    plant = flexible_plant(rng, 3, 2, 3)
    controller = lqg_controller(rng, plant)
    s = 0.3 + 1.1j
    G, K = plant(s), controller(s)
    for sign in (-1, 1):
        assert input_loop(plant, controller, sign=sign)(s) == pytest.approx(-sign * K @ G)
        assert output_loop(plant, controller, sign=sign)(s) == pytest.approx(-sign * G @ K)
        both = np.block([[np.zeros((2, 2)), -sign * K], [-G, np.zeros((3, 3))]])
        assert input_output_loop(plant, controller, sign=sign)(s) == pytest.approx(both)
    assert input_loop(plant, controller)(s) == pytest.approx(K @ G)
    poles = [
        np.sort_complex(sensitivity(state_space(opened(plant, controller, sign=1), "loop")).poles())
        for opened in (input_loop, output_loop, input_output_loop)
    ]
    assert poles[0] == pytest.approx(poles[1])
    assert poles[0] == pytest.approx(poles[2])


def flexible_arm_loop() -> Loop:
    """An arm with a rigid body and light damping, under LQG from two sensors."""
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.2), Payload(0.05), damping_ratio=1e-3)
    objective = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-2, "tip": 1e-2})
    design = assemble(arm, ClampedFree(2))
    return close(truth(arm, 8), objective, lqg(generalised_plant(design, objective)))


def test_an_arm_broken_at_its_sensors_and_everywhere() -> None:
    """At the torque the single loop's disk margin; at the sensors μ in closed form; all at
    once no more than at either place."""
    loop = flexible_arm_loop()
    path, controller = loop.plant.control_path, loop.controller
    at_torque = multiloop_disk_margin(input_loop(path, controller))
    assert at_torque.reached == pytest.approx(loop.margins.disk.value, rel=BRACKET)
    broken = output_loop(path, controller)
    at_sensors = multiloop_disk_margin(broken)
    assert at_sensors.reached == pytest.approx(1 / brute_force_mu(broken), rel=BRACKET)
    everywhere = multiloop_disk_margin(input_output_loop(path, controller))
    for disk in (at_torque, at_sensors, everywhere):
        assert_sound(disk)
        assert disk.mode
        assert everywhere.guaranteed <= disk.guaranteed * (1 + BRACKET)


def test_closing_the_other_channels() -> None:
    loop = next(stable_multiloops(9, 1, 3))
    loop = control.ss(loop.A, loop.B, loop.C, 0.2 * np.arange(9).reshape(3, 3) / 9)
    L, s = loop(0.2 + 0.9j), 0.2 + 0.9j
    for i in range(3):
        others = [j for j in range(3) if j != i]
        inner = np.linalg.solve(np.eye(2) + L[np.ix_(others, others)], L[others, i])
        assert one_loop(state_space(loop, "loop"), i).to_control()(s) == pytest.approx(
            L[i, i] - L[i, others] @ inner
        )


@given(st.floats(-0.9, 3.0), st.floats(-0.9, 3.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
@deterministic(30)
def test_static_loops(a: float, b: float, c: float, d: float) -> None:
    """μ of one constant matrix in closed form; the change makes I + LF singular."""
    L = np.array([[a, c], [d, b]])
    if abs(np.linalg.det(np.eye(2) + L)) < 1e-2:
        return
    found = multiloop_disk_margin(static(L))
    S = np.linalg.inv(np.eye(2) + L) - np.eye(2) / 2
    squares = S[0, 0] ** 2 + S[1, 1] ** 2 + 2 * abs(S[0, 1] * S[1, 0])
    both = abs(S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0])
    mu = np.sqrt((squares + np.sqrt(max(squares**2 - 4 * both**2, 0.0))) / 2)
    if mu < 1e-9:  # L = I, whose S − 1/2 vanishes
        assert found.guaranteed > 1e8
        return
    assert found.guaranteed <= 1 / mu * (1 + 1e-9)
    assert found.reached == pytest.approx(1 / mu, rel=BRACKET)
    assert found.on_axis < 1e-6


def test_a_transfer_function_is_a_loop_too() -> None:
    L = control.tf([2.0], [1, 1, 0.5])
    of_function, of_states = multiloop_disk_margin(L), multiloop_disk_margin(control.ss(L))
    assert of_function.reached == pytest.approx(of_states.reached, rel=1e-9)


def test_what_cannot_be_answered_is_refused() -> None:
    loop = next(stable_multiloops(1, 1))
    with pytest.raises(UnstableLoopError, match="unstable at"):
        multiloop_disk_margin(control.ss(np.eye(2), np.eye(2), np.eye(2), 0))
    with pytest.raises(InputError, match="square"):
        multiloop_margins(control.ss(loop.A, loop.B, np.asarray(loop.C)[:1], np.zeros((1, 2))))
    with pytest.raises(InputError, match="well posed"):
        multiloop_margins(control.ss(loop.A, loop.B, loop.C, -np.eye(2)))
    with pytest.raises(InputError, match=r"control\.StateSpace"):
        multiloop_margins("L")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="skew"):
        multiloop_margins(loop, np.nan)
    plant, controller = satellite(10.0)
    with pytest.raises(InputError, match="does not fit"):
        input_loop(plant, one_loop(state_space(loop, "loop"), 0))
    with pytest.raises(InputError, match="sample"):
        input_loop(plant, static(np.eye(2), 0.1))
    at_rest = multiloop_disk_margin(input_loop(plant, controller), -1.0)
    if not at_rest.frequency_hz:
        with pytest.raises(InputError, match="critical frequency"):
            perturbation_system(at_rest)


@pytest.mark.parametrize("skew", [0.0, 0.7, -0.5])
def test_a_margin_that_is_reached_at_rest_is_at_zero_and_has_no_system(skew: float) -> None:
    A = [[0, 1, 0, 0], [-0.119, -0.1115, 0, 0], [0, 0, 0, 1], [0, 0, -917.3, -0.123]]
    B = [[-0.89, 1.536], [-0.6815, -0.7015], [-1.218, 0.58], [0.178, -1.187]]
    F = [[-1.471, -0.866, -18.95, 0.3566], [1.105, 0.1163, 9.823, -0.226]]
    disk = multiloop_disk_margin(control.ss(A, B, F, 0), skew)
    assert disk.frequency_hz == 0.0  # it had been 1e-17 Hz
    assert disk.confirmed
    assert np.allclose(np.imag(disk.factors), 0, atol=1e-6)
    with pytest.raises(InputError, match="no real-rational perturbation"):
        perturbation_system(disk)


@pytest.mark.parametrize("step", [0, 0.1])
def test_static_loops_have_no_factor_that_is_no_number(step: float) -> None:
    """Of L = I, S − 1/2 is zero: no change destabilises; of L = 0 only an infinite gain does."""
    one, none = (
        multiloop_disk_margin(control.ss([], [], [], gain * np.eye(2), step)) for gain in (1, 0)
    )
    assert (one.guaranteed, one.reached, one.factors) == (np.inf, np.inf, ())
    assert none.reached == pytest.approx(2)
    assert not np.isnan(none.factors).any()
