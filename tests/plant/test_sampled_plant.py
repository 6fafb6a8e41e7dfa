"""The plant between hold and sampler: exact, for any delay, between the samples too."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hybrid_truth import STEPS, brute_force
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from strategies import arms, deterministic

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    GeneralisedPlant,
    Hub,
    InputError,
    KelvinVoigt,
    Objective,
    assemble,
    generalised_plant,
    lqg,
    state_space,
)
from slewctl.plant import continuous_equivalent, sampled_plant, split_delay
from slewctl.plant.hold import held

OBJECTIVE = Objective(
    {"tip": 0.1, "theta": 0.2, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "tip": 0.02}
)


def example(modes: int = 2) -> GeneralisedPlant:
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3, 0.1), damping_ratio=0.01)
    return generalised_plant(assemble(arm, ClampedFree(modes)), OBJECTIVE)


@given(st.floats(-12, 12), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
@deterministic(40)
def test_scalar_integrals_in_closed_form(power: float, b: float, h: float) -> None:
    """x' = −a x + b u + w, z = [x; u], over sixteen orders of ah."""
    a = 10.0 ** (power / 2)
    found = held(np.array([[-a]]), np.array([[b]]), np.eye(1), np.eye(2), h)
    s = a * h
    decayed = -np.expm1(-s)
    # 1 − e^(−s) and the like lose digits for small s, where the series takes over.
    small = s < 1e-2
    once = (1 - s / 2 + s**2 / 6 - s**3 / 24 + s**4 / 120) * h if small else decayed / a
    square = -np.expm1(-2 * s) / (2 * a)
    twice = h**2 * (1 / 2 - s / 3 + s**2 / 6 - s**3 / 15) if small else (h - square) / (2 * a)
    rtol = 1e-8 if small else 1e-10
    np.testing.assert_allclose(found.transition, [[np.exp(-s), b * once], [0, 1]], rtol=rtol)
    np.testing.assert_allclose(found.noise, [[square]], rtol=1e-12)
    np.testing.assert_allclose(found.cost[0, 0], square, rtol=1e-12)
    assert found.noise_cost == pytest.approx(twice, rel=rtol)


@given(arms(damping=True), st.floats(1e-3, 0.5))
@deterministic(10)
def test_sampling_without_delay_is_that_of_python_control(arm: Arm, T: float) -> None:
    model = assemble(arm, ClampedFree(2))
    theirs = state_space(model, ("theta", "tip"), coordinates="modal", sample_time=T)
    ours = sampled_plant(generalised_plant(model, OBJECTIVE), T)
    assert ours.waiting == 0
    for mine, other in ((ours.A, theirs.A), (ours.B, theirs.B)):
        np.testing.assert_allclose(mine, other, rtol=0, atol=1e-9 * np.abs(other).max())


@pytest.mark.parametrize("steps", [0, 5, 8, 13, 16, 29])
def test_delayed_input_acts_when_it_arrives(steps: int) -> None:
    """The same inputs in steps of T/8, each held from its own arrival on."""
    plant, T = example(), 0.2
    sampled = sampled_plant(plant, T, steps * T / 8)
    assert sampled.waiting == -(-steps // 8)
    n = len(plant.A)
    u = np.random.default_rng(1).standard_normal(12)
    whole = np.block([[plant.A, plant.B2], [np.zeros((1, n + 1))]])
    fine = expm(whole * T / 8)
    x, state = np.zeros(n), np.zeros(n + sampled.waiting)
    for k in range(12 * 8):
        if k % 8 == 0:
            np.testing.assert_allclose(state[:n], x, rtol=0, atol=1e-12 * max(1, np.abs(x).max()))
            state = sampled.A @ state + sampled.B[:, 0] * u[k // 8]
        acting = (k - steps) // 8
        x = (fine @ np.append(x, u[acting] if acting >= 0 else 0.0))[:n]


@pytest.mark.parametrize(("T", "steps"), [(0.02, 150), (0.5, 0), (0.5, 23), (0.5, 64)])
def test_hybrid_cost_is_that_of_a_walk_through_every_step(T: float, steps: int) -> None:
    plant = example()
    controller = lqg(plant, sample_time=T, delay=steps * T / STEPS)
    expected, radius = brute_force(plant, controller.system, T, steps)
    closed = sampled_plant(plant, T, steps * T / STEPS).close(controller.system)
    assert closed.h2.value == pytest.approx(expected, rel=1e-9)
    assert controller.h2_cost == pytest.approx(expected, rel=1e-9)
    assert closed.h2.discrepancy < 1e-10
    assert np.abs(closed.poles).max() == pytest.approx(radius, rel=1e-9)


def test_cost_between_the_samples_counts() -> None:
    """At the instants alone a slow sampler looks better than it is."""
    plant, T = example(), 1.0
    closed = sampled_plant(plant, T).close(lqg(plant, sample_time=T).system)
    at_instants = plant.C1[:-1] @ closed.covariance[: len(plant.A), : len(plant.A)]
    assert float(np.trace(at_instants @ plant.C1[:-1].T)) < 0.9 * closed.h2.value


@pytest.mark.parametrize("whole", [1, 2])
def test_cost_is_continuous_across_whole_delays(whole: int) -> None:
    plant, T = example(), 0.1
    costs = [
        lqg(plant, sample_time=T, delay=d * T).h2_cost for d in (whole - 1e-6, whole, whole + 1e-6)
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-5)
    assert costs[2] == pytest.approx(costs[1], rel=1e-5)
    assert costs[0] < costs[1] < costs[2]


def test_stiff_modes_neither_overflow_nor_go_wrong() -> None:
    """Strong Kelvin–Voigt damping: ζω h is beyond 1000 for the highest mode."""
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3), damping=KelvinVoigt(0.02))
    plant = generalised_plant(assemble(arm, ClampedFree(6)), OBJECTIVE)
    T = 0.5
    assert np.abs(np.linalg.eigvals(plant.A)).max() * T > 700
    found = sampled_plant(plant, T)
    n = len(plant.A)
    gramian = np.zeros((n, n))
    # The rigid body is not damped: the covariance satisfies A W + W Aᵀ + BBᵀ = ΦBBᵀΦᵀ.
    phi = found.A
    source = phi @ plant.B1
    left = plant.A @ found.noise + found.noise @ plant.A.T + plant.B1 @ plant.B1.T
    gramian = left - source @ source.T
    assert np.abs(gramian).max() < 1e-9 * np.abs(plant.A @ found.noise).max()
    assert lqg(plant, sample_time=T).certificate.verified


def test_delay_is_split_into_samples_and_a_rest() -> None:
    assert split_delay(0.01, 0.03) == (3, 0.0)
    assert split_delay(0.1, 0.3) == (3, 0.0)
    whole, rest = split_delay(0.01, 0.025)
    assert (whole, rest) == (2, pytest.approx(0.005, rel=1e-12))
    assert split_delay(0.01, 0.0) == (0, 0.0)


@given(st.floats(-50, -0.01), st.floats(-300, 300))
@deterministic(30)
def test_equivalent_pole_of_a_sampled_pole(real: float, imag: float) -> None:
    T = 0.01
    s = complex(real, imag)
    np.testing.assert_allclose(continuous_equivalent(np.exp(np.array([s * T])), T), [s], rtol=1e-9)


def test_deadbeat_pole_has_no_equivalent() -> None:
    poles = continuous_equivalent(np.array([0.0, 0.5, -0.5], dtype=complex), 1.0)
    np.testing.assert_allclose(poles, [np.log(0.5), np.log(0.5) + 1j * np.pi])


@pytest.mark.parametrize(
    ("T", "delay", "message"),
    [
        (0.0, 0.0, "sample_time: 0 is not positive"),
        (0.1, -0.1, "delay: -0.1 is negative"),
        (0.1, 1.2, "delay: 1.2 s is more than 10 sample times of 0.1 s"),
        (float("nan"), 0.0, "sample_time: nan is not a finite number"),
    ],
)
def test_impossible_times_are_refused(T: float, delay: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        sampled_plant(example(), T, delay)


def test_noise_that_is_also_measured_is_refused() -> None:
    plant = example()
    D = np.array(plant.system.D)
    D[plant.performance, 0] = 0.1
    system = control.StateSpace(
        plant.A, plant.system.B, plant.system.C, D,
        inputs=plant.system.input_labels, outputs=plant.system.output_labels,
    )  # fmt: skip
    with pytest.raises(InputError, match="enters a sensor too"):
        sampled_plant(GeneralisedPlant(system, plant.sensors), 0.1)


def test_controllers_on_another_clock_are_refused() -> None:
    plant = example()
    with pytest.raises(InputError, match=r"is not a 0\.1 s sampled StateSpace"):
        sampled_plant(plant, 0.1).close(lqg(plant, sample_time=0.2).system)
    with pytest.raises(InputError, match=r"is not a 0\.1 s sampled StateSpace"):
        sampled_plant(plant, 0.1).close(lqg(plant).system)
    with pytest.raises(InputError, match="is not a continuous-time StateSpace"):
        plant.close(lqg(plant, sample_time=0.2).system)
