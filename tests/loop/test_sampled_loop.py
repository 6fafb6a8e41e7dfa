"""Sampled loops: poles, cost, return ratio and slews, each against an independent way to it."""

from __future__ import annotations

import warnings

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_examples import OBJECTIVE, TWO_SENSORS, uniform_arm
from numpy.typing import NDArray
from scipy.linalg import expm
from strategies import deterministic

import slewctl as sc
from slewctl import (
    ClampedFree,
    Controller,
    InputError,
    Loop,
    Slew,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    simulate_slew,
    state_space,
    truth,
)
from slewctl.compare import QUANTITIES, Case, evaluate, read
from slewctl.design import given as designed_elsewhere
from slewctl.loop import SampledLoop
from slewctl.loop.motion.slew_inputs import feedforward, rigid_readings

Array = NDArray[np.float64]


def design(T: float, delay: float = 0.0, **options: float) -> Controller:
    plant = generalised_plant(assemble(uniform_arm(), ClampedFree(3)), TWO_SENSORS)
    return lqg(plant, sample_time=T, delay=delay, **options)


def sampled_loop(T: float = 0.02, delay: float = 0.0, **options: float) -> SampledLoop:
    loop = close(truth(uniform_arm(), 10), TWO_SENSORS, design(T, delay, **options))
    assert isinstance(loop, SampledLoop)
    return loop


def unstable_loop() -> Loop:
    """A gentle design whose torque is inverted."""
    system = design(0.05).system
    wrong = control.StateSpace(
        system.A, system.B, -system.C, -system.D, 0.05,
        inputs=system.input_labels, outputs=["torque"],
    )  # fmt: skip
    return close(truth(uniform_arm(), 10), TWO_SENSORS, wrong, sign=1)


def walked(loop: SampledLoop, samples: int, start: Array) -> Array:
    """Return |x| of the arm at each sample, by steps of T/8 with the input that has arrived."""
    T, K, plant = loop.sample_time, loop.controller.system, loop.plant
    n = len(plant.A)
    fine = expm(np.block([[plant.A, plant.B2], [np.zeros((1, n + 1))]]) * T / 8)
    late = round(8 * loop.controller.delay / T)
    x, k, computed, sizes = start, np.zeros(K.nstates), [], []
    for i in range(8 * samples):
        if i % 8 == 0:
            y = plant.C2 @ x
            computed.append(float((K.C @ k + K.D @ y)[0]))
            k = K.A @ k + K.B @ y
            sizes.append(float(np.linalg.norm(x)))
        arrived = (i - late) // 8
        x = (fine @ np.append(x, computed[arrived] if arrived >= 0 else 0.0))[:n]
    return np.array(sizes)


@pytest.mark.parametrize("delay", [0.0, 0.0125, 0.02, 0.0475])
def test_simulation_decays_with_the_slowest_pole(delay: float) -> None:
    loop = sampled_loop(0.02, delay)
    assert loop.stable
    start = np.random.default_rng(0).standard_normal(len(loop.plant.A))
    sizes = walked(loop, 4000, start)
    slowest = loop.poles[np.argmax(loop.poles.real)]
    period = max(1, round(abs(2 * np.pi / (slowest.imag * 0.02)))) if slowest.imag else 1
    late, early = (sizes[i : i + period].max() for i in (3000, 2000))
    assert np.log(late / early) / 20 == pytest.approx(slowest.real, rel=0.02)


def test_unstable_loop_grows_and_has_nothing() -> None:
    loop = unstable_loop()
    assert isinstance(loop, SampledLoop)
    assert not loop.stable
    assert loop.unstable_hz
    assert loop.describe().startswith("UNSTABLE at")
    sizes = walked(loop, 600, np.ones(len(loop.plant.A)))
    # What grows fastest is soon all there is: e^(σt) at its own period.
    fastest = loop.poles[np.argmax(loop.poles.real)]
    period = max(1, round(abs(2 * np.pi / (fastest.imag * 0.05)))) if fastest.imag else 1
    early, late = (sizes[i : i + period].max() for i in (300, 599 - period))
    assert np.log(late / early) / ((299 - period) * 0.05) == pytest.approx(fastest.real, rel=0.02)
    assert fastest.real > 0.1
    for question in ("h2", "margins", "tracking"):
        with pytest.raises(UnstableLoopError):
            getattr(loop, question)
    with pytest.raises(UnstableLoopError):
        simulate_slew(loop, Slew(10.0, 1.0))


def test_modes_above_half_the_sampling_frequency_keep_their_frequency_and_damping() -> None:
    """The controller, sampled at 20 Hz, hardly moves them."""
    loop = sampled_loop(0.05)
    high = loop.model.omega[loop.model.omega > 2 * loop.nyquist_rad_s]
    assert len(high) >= 5
    for omega in high:
        pole = loop.poles[np.argmin(np.abs(loop.poles - 1j * omega))]
        assert pole.imag == pytest.approx(omega, rel=1e-2)
        assert -pole.real / abs(pole) == pytest.approx(0.005, rel=0.3)
    conjugate = np.abs(loop.poles[:, None] - loop.poles.conj())
    oscillating = np.abs(loop.poles.imag) > 1e-9
    assert np.all(conjugate.min(axis=1)[oscillating] < 1e-6 * np.abs(loop.poles[oscillating]))


def test_oscillation_at_half_the_sampling_frequency_is_reported_there() -> None:
    """Far too much rate feedback for a slow clock: u = −k θ̇ flips the sign at every sample."""
    system = control.StateSpace(
        [], [], [], [[1.0, 40.0]], 0.1, inputs=["theta", "theta_dot"], outputs=["torque"]
    )
    loop = close(assemble(uniform_arm(stiffness=1e4), ClampedFree(1)), TWO_SENSORS, system)
    assert not loop.stable
    assert loop.unstable_hz[0] >= 5.0 * (1 - 1e-9)


def test_poles_and_cost_tend_to_those_of_the_continuous_loop() -> None:
    continuous = close(
        truth(uniform_arm(), 10), TWO_SENSORS,
        lqg(generalised_plant(assemble(uniform_arm(), ClampedFree(3)), TWO_SENSORS)),
    )  # fmt: skip
    gaps, costs = [], []
    for T in (4e-3, 2e-3, 1e-3):
        loop = sampled_loop(T)
        slow = continuous.poles[np.abs(continuous.poles) < 30]
        gap = np.abs(loop.poles[:, None] - slow).min(axis=0) / np.abs(slow)
        gaps.append(gap.max())
        costs.append(loop.h2.value / continuous.h2.value - 1)
        assert loop.h2.discrepancy < 1e-9
    assert gaps[2] < 1e-2
    # Of first order at least.
    assert gaps[1] < 0.6 * gaps[0]
    assert gaps[2] < 0.6 * gaps[1]
    assert abs(costs[2]) < 1e-4


@given(st.floats(5e-3, 0.1), st.floats(0.0, 3.0))
@deterministic(10)
def test_return_ratio_closes_to_the_loops_poles(T: float, samples: float) -> None:
    loop = sampled_loop(T, samples * T)
    L = loop.return_ratio
    assert L.dt == T
    closed = np.linalg.eigvals(L.A - L.B @ L.C)
    both = np.abs(closed[:, None] - loop.closed.poles)
    # Poles of the delay line, all near zero, are known to the root of the rounding.
    assert np.all((both.min(axis=0) < 1e-7) | (np.abs(loop.closed.poles) < 1e-2))


def test_response_is_that_of_the_return_ratio_on_the_unit_circle() -> None:
    loop = sampled_loop(0.02, 0.013)
    omega = np.array([0.1, 3.0, 40.0, loop.nyquist_rad_s])
    L = loop.return_ratio
    expected = [
        (L.C @ np.linalg.solve(np.exp(1j * w * 0.02) * np.eye(L.nstates) - L.A, L.B))[0, 0]
        for w in omega
    ]
    np.testing.assert_allclose(loop.response(omega), expected, rtol=1e-8)
    assert np.pi / 0.02 == pytest.approx(loop.nyquist_rad_s)


def test_poles_give_decay_and_damping() -> None:
    loop = sampled_loop(0.02, 0.01)
    assert np.isfinite(loop.poles).all()
    decay = -loop.poles.real.max()
    assert decay == pytest.approx(-np.log(np.abs(loop.closed.poles).max()) / 0.02, rel=1e-9)
    ratios = -loop.poles.real / np.abs(loop.poles)
    assert 0 < ratios.min() <= ratios.max() <= 1


def slow_walk(loop: SampledLoop, slew: Slew, fine: int) -> tuple[Array, Array]:
    """Return times and tip of a slew by python-control's own simulation, sample by sample."""
    T, K, delay = loop.sample_time, loop.controller.system, loop.controller.delay
    late = round(fine * delay / T)
    model = state_space(loop.model, ("tip",), coordinates="modal")
    plant = model.sample(T / fine)
    x, k, computed, tips, acting = np.zeros(plant.nstates), np.zeros(K.nstates), [], [], 0.0
    for i in range(round(fine * slew.end / T)):
        if i % fine == 0:
            now = np.array([i * T / fine])
            y = loop.plant.C2 @ x - np.array(
                rigid_readings(loop, *(float(r[0]) for r in slew.reference(now)))
            )
            ends = slew.reference(np.array([0.0, T]) + now + delay)
            added = feedforward(loop, *(float(np.diff(ends[j])[0]) / T for j in (0, 1)))
            computed.append(float((K.C @ k + K.D @ y)[0]) + added)
            k = K.A @ k + K.B @ y
        arrived = (i - late) // fine
        acting = computed[arrived] if arrived >= 0 else 0.0
        tips.append(float((plant.C @ x)[0]))
        x = plant.A @ x + plant.B[:, 0] * acting
    return np.arange(len(tips)) * T / fine, np.array(tips)


@pytest.mark.parametrize(("T", "delay"), [(0.05, 0.0), (0.05, 0.0125), (0.02, 0.055)])
def test_slew_is_that_of_a_walk_through_every_step(T: float, delay: float) -> None:
    loop, slew = sampled_loop(T, delay), Slew(40.0, 2.0)
    response = simulate_slew(loop, slew, points=401)
    t, tip = slow_walk(loop, slew, 8)
    common = np.abs(response.t[:, None] - t) < 1e-9
    i, j = np.nonzero(common)
    assert len(i) > 50
    np.testing.assert_allclose(response.tip[i], tip[j], atol=1e-9)


def test_slew_ends_at_the_angle_and_starts_at_rest() -> None:
    for options in ({}, {"integral_limit": 0.5}):
        loop = sampled_loop(0.02, 0.013, **options)
        end = 2.0 + 30 / -float(loop.poles.real.max())
        response = simulate_slew(loop, Slew(40.0, 2.0, end), points=801)
        assert response.tip[0] == response.theta[0] == 0.0
        final = np.radians(40.0)
        assert response.theta[-1] == pytest.approx(final, rel=1e-6)
        assert response.tip[-1] == pytest.approx(1.1 * final, rel=1e-6)
        assert abs(response.torque[-1]) < 1e-6


def test_fast_sampled_slew_is_the_continuous_one() -> None:
    arm, slew = uniform_arm(), Slew(40.0, 2.0)
    plant = generalised_plant(assemble(arm, ClampedFree(3)), TWO_SENSORS)
    model = truth(arm, 5)
    continuous = simulate_slew(close(model, TWO_SENSORS, lqg(plant)), slew)
    errors = []
    for T in (0.02, 0.01, 0.005):
        loop = close(model, TWO_SENSORS, lqg(plant, sample_time=T))
        response = simulate_slew(loop, slew)
        tip = np.interp(response.t, continuous.t, continuous.tip)
        errors.append(np.abs(response.tip - tip).max())
    assert errors[0] < 0.01
    assert errors[2] < 0.6 * errors[1] < 0.4 * errors[0]


def test_torque_is_held_between_the_samples() -> None:
    T = 0.05
    loop = sampled_loop(T, 0.02)
    response = simulate_slew(loop, Slew(40.0, 2.0), points=1001)
    cell = np.floor((response.t - 0.02) / T + 1e-9)
    for k in range(5, 30):
        held = response.torque[cell == k]
        assert len(held) > 1
        assert np.ptp(held) == 0


def test_very_fast_clock_gives_about_as_many_points_as_asked() -> None:
    response = simulate_slew(sampled_loop(1e-3), Slew(40.0, 1.0), points=101)
    assert 90 <= len(response.t) <= 130
    assert response.t[-1] == pytest.approx(3.0, abs=0.05)


def test_own_sampled_controller_with_a_delay() -> None:
    """A delay that eats the phase margin of a PD controller makes the loop unstable."""
    pd = control.StateSpace(
        [], [], [], [[-20.0, -8.0]], 0.02, inputs=["theta", "theta_dot"], outputs=["torque"]
    )
    model = assemble(uniform_arm(damping_ratio=0.05), ClampedFree(1))
    prompt = close(model, TWO_SENSORS, pd, sign=1)
    assert prompt.stable
    assert prompt.h2.discrepancy < 1e-9
    # A delay of k samples is z⁻ᵏ in the return ratio, exactly as the delay margin has it.
    bears = prompt.margins.delay_s.value
    assert 0.02 < bears < 0.18
    for k in range(10):
        late = close(
            model, TWO_SENSORS, designed_elsewhere(pd, feedback="positive", delay=0.02 * k)
        )
        assert late.stable == (0.02 * k < bears), k


def test_clock_that_is_not_known_is_refused() -> None:
    unknown = control.StateSpace([], [], [], [[-1.0]], True, inputs=["theta"], outputs=["torque"])
    with pytest.raises(InputError, match="sample time is not known"):
        close(assemble(uniform_arm(), ClampedFree(1)), OBJECTIVE, unknown)
    continuous = control.StateSpace([], [], [], [[-1.0]], inputs=["theta"], outputs=["torque"])
    with pytest.raises(InputError, match="no computational delay"):
        designed_elsewhere(continuous, feedback="positive", delay=0.1)


def test_case_with_a_sampled_design_is_evaluated() -> None:
    case = Case(
        "sampled", uniform_arm(), TWO_SENSORS, n=2, truth_modes=10, orders=(2,),
        options={"sample_time": 0.02, "delay": 0.005, "integral_limit": 1.0},
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        evaluation = evaluate(case)
    assert evaluation.verified
    assert evaluation.stable
    values = {name: read(evaluation.judgement, name).value for name in QUANTITIES}
    loop = close(truth(case.arm, 10), TWO_SENSORS, evaluation.controller)
    assert values["damping_ratio_min"] == pytest.approx((-loop.poles.real / abs(loop.poles)).min())
    assert values["decay_rate_min"] == pytest.approx(-loop.poles.real.max())
    problem = generalised_plant(truth(case.arm, 10), TWO_SENSORS)
    best = lqg(problem, sample_time=0.02, delay=0.005)
    assert values["h2_loss"] == pytest.approx(loop.h2.value / best.h2_cost - 1, rel=1e-6)
    response = simulate_slew(loop, case.slew)
    travel = np.radians(case.slew.angle_deg) * (case.arm.hub.radius + case.arm.beam.length)
    outside = response.t[np.abs(response.tip - travel) > 0.02 * abs(travel)]
    assert values["settling_time"] == pytest.approx(outside[-1], abs=0.05)


@pytest.mark.parametrize("unit", [1e-4, 1e-6, 1e-8])
def test_margins_do_not_depend_on_the_unit_of_torque(unit: float) -> None:
    """An arm without friction: its poles at z = 1 had been found to the unit's size only."""

    def found(N: float) -> sc.Margins:
        arm = sc.Arm(sc.Beam(1.0, N, 1.2 * N), sc.Hub(6.4 * N), damping_ratio=0.01)
        noise = {"torque": 0.1 * N, "theta": 0.004}
        problem = sc.Problem(arm, {"tip": 0.012, "torque": N}, noise)
        law = sc.lqg(problem.plant("arm-matched", 2), sample_time=0.01, delay=0.003)
        return problem.judge(law).loop.margins

    one, other = found(1.0), found(unit)
    assert one.confirmed
    assert other.confirmed
    for name in ("gain_db", "phase_deg", "delay_s", "disk"):
        assert getattr(other, name).value == pytest.approx(getattr(one, name).value, rel=1e-7)
