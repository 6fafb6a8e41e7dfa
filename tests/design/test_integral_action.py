"""LQG with integral action: no steady error under a constant torque, and still an optimum."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import TWO_SENSORS, arms, design_plant, uniform_arm
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import (
    Arm,
    ClampedFree,
    DesignError,
    Hub,
    InputError,
    Objective,
    SlewctlError,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.design.riccati.integral_action import slowest_motion
from slewctl.numerics.h2_norm import h2_cost

WITHOUT_ANGLE = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "tip": 0.01})


@given(arms(), st.floats(0.01, 100.0))
@deterministic(8)
def test_constant_torque_leaves_no_error_of_the_angle(arm: Arm, limit: float) -> None:
    """On the truth, not on the model that it was designed on."""
    plant = generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS)
    controller = lqg(plant, integral_limit=limit)
    assert controller.certificate.verified, str(controller.certificate)
    loop = close(assemble(arm, ClampedFree(4)), TWO_SENSORS, controller)
    if not loop.stable:
        return
    steady = loop.system.dcgain()
    angle = list(loop.system.output_labels).index("z_theta")
    plain = plant.close(lqg(plant).system).dcgain()[angle, 0]
    assert abs(steady[angle, 0]) < 1e-8 * abs(plain)


def test_without_the_integral_there_is_an_error() -> None:
    plant = design_plant(2, TWO_SENSORS)
    angle = list(plant.system.output_labels).index("z_theta")
    assert abs(plant.close(lqg(plant).system).dcgain()[angle, 0]) > 1e-3


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.04])
def test_sampled_loop_leaves_no_error_either(delay: float) -> None:
    arm = uniform_arm()
    plant = generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS)
    model = truth(arm, 10)
    errors = []
    for limit in (None, 0.5):
        controller = lqg(plant, sample_time=0.02, delay=delay, integral_limit=limit)
        loop = close(model, TWO_SENSORS, controller)
        assert loop.stable
        errors.append(abs(loop.system["theta", "torque_added"].dcgain()))
    assert errors[0] > 1e-3
    assert errors[1] < 1e-9 * errors[0]


def test_weak_integral_is_none() -> None:
    plant = design_plant(2)
    plain, weak = lqg(plant), lqg(plant, integral_limit=1e6)
    assert weak.h2_cost == pytest.approx(plain.h2_cost, rel=1e-5)
    np.testing.assert_allclose(
        weak.gains["state_feedback"], plain.gains["state_feedback"], rtol=1e-4,
        atol=1e-4 * np.abs(plain.gains["state_feedback"]).max(),
    )  # fmt: skip
    assert abs(weak.gains["integral"][0, 0]) < 1e-5


def test_tighter_integral_costs_more_of_the_rest() -> None:
    plant = design_plant(2)
    costs = [lqg(plant, integral_limit=limit).h2_cost for limit in (10.0, 1.0, 0.1)]
    assert lqg(plant).h2_cost < costs[0] < costs[1] < costs[2]


@pytest.mark.parametrize("seed", range(4))
def test_no_perturbed_controller_is_better(seed: int) -> None:
    """In the cost with the integral, which is what is minimised."""
    plant, limit = design_plant(2, TWO_SENSORS), 0.3
    found = lqg(plant, integral_limit=limit)
    best = found.system
    rng = np.random.default_rng(seed)

    def cost(size: float) -> float:
        A, B, C = (
            np.asarray(m) * (1 + size * rng.standard_normal(np.shape(m)))
            for m in (best.A, best.B, best.C)
        )
        A[-1], B[-1] = best.A[-1], best.B[-1]  # the integral stays one
        moved = control.StateSpace(A, B, C, 0, inputs=list(plant.sensors), outputs=["torque"])
        closed = plant.close(moved)
        if np.linalg.eigvals(closed.A).real.max() >= 0:
            return np.inf
        integral = np.zeros((1, closed.nstates))
        integral[0, -1] = found.state_scale[-1] / limit
        return h2_cost(closed.A, closed.B, np.vstack([closed.C, integral])).value

    optimum = cost(0.0)
    for size in (1e-4, 1e-3, 1e-2):
        assert cost(size) >= optimum * (1 - 1e-12)


def test_integral_is_named_and_timed() -> None:
    controller = lqg(design_plant(1), integral_limit=0.5)
    assert controller.system.state_labels[-1] == "theta_integral"
    assert "0.5 rad·s" in " ".join(controller.assumptions)
    assert set(controller.seconds) == {"solve", "build"}


@pytest.mark.parametrize("clock", [{}, {"sample_time": 0.05}])
def test_integral_wants_the_angle_measured(clock: dict) -> None:
    plant = design_plant(1, WITHOUT_ANGLE)
    with pytest.raises(InputError, match="integral_limit: the hub angle is not measured"):
        lqg(plant, integral_limit=1.0, **clock)


def test_friction_and_back_emf_make_no_difference() -> None:
    arm = replace(uniform_arm(), hub=Hub(0.3, 0.1, 0.2))
    plant = generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS)
    closed = plant.close(lqg(plant, integral_limit=0.5).system)
    angle = list(closed.output_labels).index("z_theta")
    assert abs(closed.dcgain()[angle, 0]) < 1e-12


@pytest.mark.parametrize("given", [{}, {"sample_time": 0.01}])
def test_an_integral_says_how_slow_it_is(given: dict[str, float]) -> None:
    """With a huge limit its pole is −1/(limit·…): the statement says what to expect of it."""
    plant = design_plant(1, TWO_SENSORS)
    slow = {
        limit: float(lqg(plant, integral_limit=limit, **given).assumptions[-1].split()[-2])
        for limit in (1e3, 1e4)
    }
    assert slow[1e4] == pytest.approx(10 * slow[1e3], rel=2e-2)


def test_an_integral_that_does_nothing_is_refused() -> None:
    plant = design_plant(1, TWO_SENSORS)
    for limit in (1e10, 1e12, 1e14):
        with pytest.raises(SlewctlError) as caught:
            lqg(plant, integral_limit=limit, sample_time=0.01)
        assert caught.value.where.startswith("integral_limit")
    A, B = np.array([[-1.0, 0], [1, 0]]), np.array([[1.0], [0]])
    with pytest.raises(DesignError, match="does nothing to working precision"):
        slowest_motion(A, B, np.array([[1.0, 0.0]]))
