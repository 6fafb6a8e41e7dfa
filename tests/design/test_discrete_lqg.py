"""Sampled LQG: optimal for the hybrid loop, and the continuous optimum when sampled fast."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import OBJECTIVE, TWO_SENSORS, Array, arms, design_plant, transfer, uniform_arm
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import (
    AccuracyError,
    Arm,
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    InputError,
    Objective,
    assemble,
    generalised_plant,
    lqg,
)
from slewctl import arms as catalogue
from slewctl.basis import bases_of
from slewctl.plant import sampled_plant


def cost_of(plant: GeneralisedPlant, T: float, delay: float, matrices: list[Array]) -> float:
    """Return the hybrid cost of a controller given by its matrices; infinite when unstable."""
    system = control.StateSpace(*matrices, T, inputs=list(plant.sensors), outputs=["torque"])
    closed = sampled_plant(plant, T, delay).close(system)
    return closed.h2.value if closed.stable else np.inf


def matrices(system: control.StateSpace) -> list[Array]:
    return [np.asarray(m) for m in (system.A, system.B, system.C, system.D)]


@given(
    arms(),
    st.floats(0.005, 0.2),
    st.sampled_from([0.0, 0.4, 1.0, 2.7]),
    st.sampled_from([None, 0.3, 10.0]),
)
@deterministic(15)
def test_achieved_cost_is_the_optimum_of_the_riccati_equations(
    arm: Arm, T: float, samples: float, limit: float | None
) -> None:
    plant = generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS)
    controller = lqg(plant, sample_time=T, delay=samples * T, integral_limit=limit)
    assert controller.certificate.verified, str(controller.certificate)
    assert controller.sample_time == T
    assert controller.delay == pytest.approx(samples * T)
    assert controller.poles.real.max() < 0


@pytest.mark.parametrize("samples", [0.0, 0.4, 2.0])
@pytest.mark.parametrize("objective", [OBJECTIVE, TWO_SENSORS])
def test_no_perturbed_controller_is_better(samples: float, objective: Objective) -> None:
    plant, T = design_plant(2, objective), 0.05
    best = lqg(plant, sample_time=T, delay=samples * T)
    rng = np.random.default_rng(0)
    for size in (1e-4, 1e-3, 1e-2):
        for _ in range(3):
            moved = [m * (1 + size * rng.standard_normal(m.shape)) for m in matrices(best.system)]
            assert cost_of(plant, T, samples * T, moved) >= best.h2_cost * (1 - 1e-12)


@pytest.mark.parametrize("samples", [0.0, 0.4, 2.0])
def test_cost_is_stationary_at_the_optimum(samples: float) -> None:
    """The excess is of second order in every direction: the gradient vanishes."""
    plant, T = design_plant(2), 0.05
    best = lqg(plant, sample_time=T, delay=samples * T)
    A, B, C, D = matrices(best.system)
    rng = np.random.default_rng(1)
    dB, dC, dD = (m * rng.standard_normal(m.shape) for m in (B, C, D))

    def excess(step: float) -> float:
        moved = [A, B + step * dB, C + step * dC, D + step * dD]
        return cost_of(plant, T, samples * T, moved) / best.h2_cost - 1

    assert excess(1e-4) > 0
    assert excess(2e-4) / excess(1e-4) == pytest.approx(4, rel=2e-2)
    assert excess(-1e-4) / excess(1e-4) == pytest.approx(1, rel=4e-2)


@pytest.mark.parametrize("limit", [None, 0.5])
def test_fast_sampling_tends_to_the_continuous_optimum(limit: float | None) -> None:
    """Without delay like T²; with a delay of one sample like T."""
    plant = design_plant(2, TWO_SENSORS)
    optimum = lqg(plant, integral_limit=limit).h2_cost

    def excess(T: float, samples: float) -> float:
        design = lqg(plant, sample_time=T, delay=samples * T, integral_limit=limit)
        return design.h2_cost / optimum - 1

    assert excess(0.02, 0) / excess(0.01, 0) == pytest.approx(4, rel=0.05)
    assert excess(0.004, 1) / excess(0.002, 1) == pytest.approx(2, rel=0.05)
    assert 0 < excess(0.002, 0) < 1e-4


def test_every_further_delay_costs() -> None:
    plant, T = design_plant(2), 0.05
    costs = [lqg(plant, sample_time=T, delay=d * T).h2_cost for d in np.linspace(0, 3, 7)]
    assert np.all(np.diff(costs) > 0)
    assert costs[0] > lqg(plant).h2_cost


def test_gains_are_those_of_python_control() -> None:
    plant, T = design_plant(3, TWO_SENSORS), 0.05
    controller, sampled = lqg(plant, sample_time=T), sampled_plant(plant, T)
    n = len(plant.A)
    Q, R, N = sampled.cost[:n, :n], sampled.cost[n:, n:], sampled.cost[:n, n:]
    gain, _, _ = control.dlqr(sampled.A, sampled.B, Q, R, N, method="scipy")
    np.testing.assert_allclose(
        controller.gains["state_feedback"], gain, rtol=1e-7, atol=1e-9 * np.abs(gain).max()
    )
    # python-control's filter gain is that of the prediction: Φ times ours.
    predicted, _, _ = control.dlqe(
        sampled.A, np.eye(n), sampled.C, sampled.noise, sampled.sensor_noise, method="scipy"
    )
    ours = sampled.A @ controller.gains["observer"]
    np.testing.assert_allclose(ours, predicted, rtol=1e-6, atol=1e-9 * np.abs(ours).max())


def test_optimum_does_not_depend_on_coordinates() -> None:
    plant, T = design_plant(2), 0.05
    rng = np.random.default_rng(3)
    turned = plant.transformed(
        np.linalg.qr(rng.standard_normal((6, 6)))[0] * rng.uniform(0.1, 10, 6)
    )
    for options in ({}, {"delay": 0.03}, {"delay": 0.1, "integral_limit": 0.3}):
        one, other = (lqg(p, sample_time=T, **options) for p in (plant, turned))
        assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-8)
        points = np.exp(1j * T * np.array([0.3, 3.0, 30.0]))
        np.testing.assert_allclose(
            transfer(other.tracking, points), transfer(one.tracking, points), rtol=1e-6
        )


@pytest.mark.parametrize("name", catalogue.names())
def test_every_catalogue_arm_is_designed_and_verified(name: str) -> None:
    arm = catalogue.get(name)
    plant = generalised_plant(assemble(arm, bases_of(arm)[0], 3), OBJECTIVE)
    T = 1.0 / float(plant.model.omega[-1])
    controller = lqg(plant, sample_time=T, delay=0.5 * T)
    assert controller.certificate.verified, str(controller.certificate)


def test_mode_on_half_the_sampling_frequency_is_lost() -> None:
    """An undamped mode at ω = π/T: only one of its two states is reached by a held input."""
    arm = replace(uniform_arm(0.0), damping_ratio=0.0)
    plant = generalised_plant(assemble(arm, ClampedFree(1)), OBJECTIVE)
    T = np.pi / float(plant.model.omega[0])
    with pytest.raises(AccuracyError, match="half the sampling rate"):
        lqg(plant, sample_time=T)
    assert lqg(plant, sample_time=0.9 * T).certificate.verified


def test_clock_is_stated() -> None:
    controller = lqg(design_plant(1), sample_time=0.02, delay=0.005, integral_limit=1.0)
    words = " ".join(controller.assumptions)
    for said in ("0.02 s", "t_k + 0.005 s", "n²/T", "−K x̂", "σ"):
        assert said in words
    assert set(controller.seconds) == {"sample", "solve", "build"}
    assert all(seconds >= 0 for seconds in controller.seconds.values())
    assert "every 0.02 s" in repr(controller)
    assert controller.system.dt == 0.02


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sample_time": 0.0}, "sample_time: 0 is not positive"),
        ({"sample_time": "fast"}, "sample_time: 'fast' is not a finite number"),
        ({"sample_time": 0.1, "delay": -1.0}, "delay: -1 is negative"),
        ({"sample_time": 0.1, "delay": 2.0}, "delay: 2 s is more than 10 sample times"),
        (
            {"delay": 0.1},
            "delay: a continuous controller has no computational delay; give sample_time",
        ),
        ({"integral_limit": 0.0}, "integral_limit: 0 is not positive"),
        ({"integral_limit": True}, "integral_limit: True is not a finite number"),
    ],
)
def test_impossible_options_are_refused(options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        lqg(design_plant(1), **options)


def test_unpenalised_rotation_is_refused_in_the_users_words() -> None:
    objective = Objective({"tip_deflection": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    for options in ({"sample_time": 0.1}, {"integral_limit": 1.0}):
        with pytest.raises(DesignError, match="rigid-body rotation is not penalised"):
            lqg(design_plant(1, objective), **options)
