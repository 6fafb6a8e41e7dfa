"""Simulated large slews: invariants, an independent integrator, and what must not change them."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from strategies import arms, deterministic

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Hub,
    InputError,
    Payload,
    Polynomial,
    assemble,
    state_space,
    truth,
)
from slewctl.loop.motion.gauss_collocation import gauss_nodes
from slewctl.loop.motion.large_slew import Swing, simulate_swing
from slewctl.model.nonlinear import LargeDeflectionError, NonlinearModel, large_slew
from slewctl.model.spin import SpinSofteningWarning

EPS = np.finfo(float).eps
FREE = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3, 0.1), Payload(0.2, 0.01))
DRAGGED = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3, 0.1, 0.02), Payload(0.2, 0.01), damping_ratio=0.01)


def equations(arm: Arm = FREE, n: int = 4, stiffening: bool = True) -> NonlinearModel:
    return large_slew(assemble(arm, ClampedFree(n)), stiffening)


def spinning(model: NonlinearModel, rate: float, bend: float = 0.02) -> np.ndarray:
    """A state that turns at `rate`, with the first function deflected by `bend`."""
    state = np.zeros(2 * (model.n + 1))
    state[1], state[model.n + 1] = bend, rate
    return state


def test_nodes_integrate_polynomials() -> None:
    nodes = gauss_nodes(12)
    for power in range(12):
        to = np.array([0.1, 0.6, 1.0])
        assert_allclose(
            nodes.integral_to(to) @ nodes.c**power, to ** (power + 1) / (power + 1), atol=200 * EPS
        )
    assert nodes.weights @ nodes.c**23 == pytest.approx(1 / 24, rel=100 * EPS)


@pytest.mark.slow
@given(arms(), st.floats(0.1, 4.0), st.booleans())
@deterministic(6)
def test_energy_and_momentum_are_kept_in_a_free_slew(
    arm: Arm, turns: float, stiffening: bool
) -> None:
    """`turns` is the spin in units of the critical one, which without stiffening it stays below."""
    model = large_slew(assemble(arm, Polynomial(3)), stiffening)
    reference = large_slew(model.linear, stiffening=False).critical_spin_rad_s
    rate = turns * reference if stiffening else min(turns, 0.7) * reference
    q = model.linear.mode_shapes[1:, 1]
    limit = np.sqrt(abs(q @ model.softening @ q) * model.compliance[0])
    state = np.concatenate([[0.0], 0.02 * q / limit, [rate], np.zeros(3)])
    t = np.linspace(0.0, 20 / reference, 21)
    free = simulate_swing(model, t, initial=state, rtol=1e-9)
    assert free.energy_error < 1e-8
    assert_allclose(free.energy, free.energy[0], rtol=1e-7)
    # A linear invariant of the integrated form: kept to rounding at the steps, and to the
    # rounding of the interpolation between them.
    momentum = model.angular_momentum(free.states)
    cancelled = np.abs(model.linear.mass[0]) @ np.abs(free.states[:, 4:]).max(axis=0)
    assert_allclose(momentum, momentum[0], rtol=0, atol=1e-12 * (cancelled + abs(momentum[0])))


def test_tighter_tolerance_keeps_the_energy_better() -> None:
    model = equations()
    t = np.linspace(0.0, 10.0, 101)
    errors = {
        rtol: simulate_swing(model, t, initial=spinning(model, 6.0, 0.05), rtol=rtol).energy_error
        for rtol in (1.0, 1e-2, 1e-4, 1e-6)
    }
    assert all(error <= rtol for rtol, error in errors.items())
    assert errors[1e-2] < 0.1 * errors[1.0]
    assert errors[1e-4] < 0.1 * errors[1e-2]
    assert errors[1e-6] < 1e-11


def by_runge_kutta(
    model: NonlinearModel, t: np.ndarray, torque: Callable[[float], float], state: np.ndarray
) -> np.ndarray:
    """The same motion from scipy's DOP853 on the physical equations."""
    found = solve_ivp(
        lambda time, y: model.derivative(y, torque(time)),
        (t[0], t[-1]), state, method="DOP853", t_eval=t, rtol=1e-11, atol=1e-13,
    )  # fmt: skip
    return found.y.T


@pytest.mark.filterwarnings("ignore::slewctl.model.spin.SpinSofteningWarning")
@pytest.mark.parametrize("stiffening", [True, False])
def test_motion_is_that_of_another_integrator(stiffening: bool) -> None:
    model = equations(DRAGGED, 3, stiffening)
    t = np.linspace(0.5, 3.0, 26)
    state = np.array([0.1, 0.03, -0.01, 0.0, 2.0, 0.1, 0.0, 0.05])

    def torque(time: float) -> float:
        return 0.4 * np.sin(3 * time)

    swing = simulate_swing(model, t, torque, initial=state)
    expected = by_runge_kutta(model, t, torque, state)
    scale = np.abs(expected).max(axis=0)
    # The default tolerance 1e-7 a step and some thirty steps.
    assert np.all(np.abs(swing.states - expected) <= 1e-6 * scale)
    row = model.linear.displacement(np.array([1.0]))[0]
    assert_allclose(swing.tip, swing.states[:, :4] @ row, rtol=1e-12)
    assert_allclose(swing.tip_deflection, swing.tip - row[0] * swing.theta, atol=1e-14)
    assert_allclose(swing.energy, model.energy(swing.states), rtol=1e-14)
    assert_allclose(swing.torque, [torque(time) for time in t], rtol=1e-15)
    tight = simulate_swing(model, t, torque, initial=state, rtol=1e-11)
    assert np.all(np.abs(tight.states - expected) <= 1e-9 * scale)


def test_small_slew_is_the_linear_one() -> None:
    """A torque of 1e-5 N·m: the nonlinear terms are of relative order 1e-10."""
    model = equations(DRAGGED)
    t = np.linspace(0.0, 5.0, 401)
    torque = 1e-5 * np.sin(2 * t)
    swing = simulate_swing(model, t, torque, rtol=1e-11)
    plant = state_space(model.linear, ("theta", "tip_deflection"))
    theta, deflection = control.forced_response(plant, t, torque).outputs
    assert_allclose(swing.theta, theta, rtol=0, atol=1e-9 * np.abs(theta).max())
    assert_allclose(swing.tip_deflection, deflection, rtol=0, atol=1e-8 * np.abs(deflection).max())


@pytest.mark.slow
def test_torque_as_array_has_straight_lines_between_its_values() -> None:
    model = equations(DRAGGED)
    for t in (np.linspace(0.0, 4.0, 41), np.sort(np.random.default_rng(0).uniform(0, 4, 41))):
        torque = np.sin(3 * t)
        array = simulate_swing(model, t, torque, rtol=1e-10)
        function = simulate_swing(
            model, t, lambda time, t=t, torque=torque: np.interp(time, t, torque), rtol=1e-10
        )
        # Forty kinks, each found to 1e-10 of the largest rate, which is about one.
        assert_allclose(function.states, array.states, rtol=0, atol=1e-8)


def test_jumps_of_the_torque_are_found() -> None:
    """Bang-bang without drag: the momentum is the torque's integral, jump or not."""
    model = equations()
    t = np.linspace(0.0, 4.0, 81)
    bang = simulate_swing(model, t, lambda time: 0.3 if time < np.pi / 2 else -0.2)
    expected = np.where(t < np.pi / 2, 0.3 * t, 0.15 * np.pi - 0.2 * (t - np.pi / 2))
    # A jump within a step costs at most the tolerance of the step.
    assert_allclose(model.angular_momentum(bang.states), expected, rtol=0, atol=1e-6)
    assert bang.energy_error < 1e-6


def test_times_wanted_do_not_change_the_motion() -> None:
    model = equations(DRAGGED)
    ends = [
        simulate_swing(model, np.linspace(0.0, 3.0, count), np.cos, rtol=1e-10).states[-1]
        for count in (2, 7, 1001)
    ]
    for end in ends[1:]:
        assert_allclose(end, ends[0], rtol=1e-12)
    first = simulate_swing(model, np.linspace(0.0, 1.3, 5), np.cos, rtol=1e-10)
    then = simulate_swing(
        model, np.linspace(1.3, 3.0, 9), np.cos, initial=first.states[-1], rtol=1e-10
    )
    assert_allclose(then.states[-1], ends[0], rtol=0, atol=1e-8 * np.abs(ends[0]).max())


def test_turned_and_mirrored_slews_are_alike() -> None:
    model = equations(DRAGGED)
    t, state = np.linspace(0.0, 2.0, 21), spinning(equations(DRAGGED), 3.0)
    swing = simulate_swing(model, t, 0.3, initial=state)
    mirrored = simulate_swing(model, t, -0.3, initial=-state)
    assert_allclose(mirrored.states, -swing.states, rtol=0, atol=1e-13)
    state[0] += 5.0
    turned = simulate_swing(model, t, 0.3, initial=state)
    assert_allclose(turned.theta - 5.0, swing.theta, rtol=0, atol=1e-13 * 20)
    assert_allclose(turned.states[:, 1:], swing.states[:, 1:], rtol=0, atol=1e-12)


def test_units_do_not_matter() -> None:
    """Millimetres: lengths and deflections ·10³, inertia and torque ·10⁶."""
    milli = Arm(Beam(1e3, 1e-3, 1e9), Hub(0.3e6, 100.0, 0.02e6), Payload(0.2, 1e4), 0.01)
    t = np.linspace(0.0, 2.0, 11)
    a = simulate_swing(equations(DRAGGED), t, lambda time: 0.3 * np.cos(time))
    b = simulate_swing(equations(milli), t, lambda time: 0.3e6 * np.cos(time))
    assert_allclose(b.theta, a.theta, rtol=1e-9)
    assert_allclose(
        b.tip_deflection, 1e3 * a.tip_deflection, rtol=0, atol=1e-6 * np.abs(b.tip_deflection).max()
    )


def test_stiffening_keeps_a_fast_slew_bounded() -> None:
    """Spun up to 1.2 times the critical rate; free, the deflection of κ = 0 grows without end."""
    t = np.linspace(0.0, 12.0, 121)
    swings: dict[bool, Swing] = {}
    softer = equations(stiffening=False)
    state = spinning(softer, 1.2 * softer.critical_spin_rad_s, 1e-4)
    with pytest.warns(SpinSofteningWarning, match="stiffening=True"):
        swings[False] = simulate_swing(softer, t, initial=state)
    with warnings.catch_warnings():
        warnings.simplefilter("error", SpinSofteningWarning)
        swings[True] = simulate_swing(equations(), t, initial=state)
    start = abs(swings[True].tip_deflection[0])
    assert np.abs(swings[True].tip_deflection).max() < 2 * start
    assert np.abs(swings[False].tip_deflection).max() > 100 * start


@pytest.mark.slow
def test_stiff_truth_takes_few_steps() -> None:
    """Twenty modes up to 600 Hz, hardly excited, must not dictate the step.

    An explicit method would need h < 3/ω_20 or so: 5600 steps in five seconds.
    """
    model = large_slew(truth(FREE))
    swing = simulate_swing(model, np.linspace(0.0, 5.0, 51), lambda time: 0.2 * np.sin(time))
    assert swing.steps < 5.0 * model.linear.omega[-1] / 3 / 5
    assert swing.energy_error < 1e-7


def test_too_large_a_deflection_says_so() -> None:
    bare = large_slew(assemble(Arm(Beam(1.0, 1.0, 1.0)), ClampedFree(5)))
    with pytest.raises(LargeDeflectionError, match="tip deflection"):
        simulate_swing(bare, np.linspace(0.0, 3.0, 31), 0.5)
    far = spinning(bare, 0.0, 1.0)
    with pytest.raises(LargeDeflectionError, match="tip deflection"):
        simulate_swing(bare, np.linspace(0.0, 3.0, 31), initial=far)


T = np.linspace(0.0, 1.0, 11)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"equations": "arm"}, "is not a nonlinear model; give one, as from large_slew"),
        ({"torque": np.full(11, np.nan)}, "torque: value 0 is not finite; give finite"),
        ({"torque": lambda t: np.nan if t > 0.5 else 0.0}, "torque is not finite at t = 0.5"),
        ({"torque": np.zeros(7)}, "7 values of the torque for 11 times; give one value"),
        ({"torque": "full"}, "torque: 'full' is not numeric; give numbers"),
        ({"t": T[::-1]}, "t: the times do not increase; give increasing"),
        ({"t": [0.0, 1.0, 1.0]}, "t: the times do not increase"),
        ({"t": [0.0]}, "fewer than two times"),
        ({"t": [0.0, np.inf]}, "t: value 1 is not finite"),
        ({"initial": np.zeros(7)}, r"initial: .* shape \(7,\) for 6 states; give θ, q1"),
        ({"initial": [0, 0, 0, np.nan, 0, 0]}, "initial: value 3 is not finite"),
        ({"rtol": 0.0}, "rtol: 0 is not positive"),
    ],
)
def test_simulate_swing_refuses_nonsense(change: dict, message: str) -> None:
    arguments = {"equations": equations(FREE, 2), "t": T, **change}
    with pytest.raises(InputError, match=message):
        simulate_swing(**arguments)
