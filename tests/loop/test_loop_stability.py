"""Stability is decided first; an unstable loop has neither margins nor a cost nor a slew."""

from __future__ import annotations

import re
from itertools import pairwise

import control
import numpy as np
import pytest
from loop_examples import (
    OBJECTIVE,
    TWO_SENSORS,
    loop_on,
    stable_loop,
    uniform_arm,
    unstable_loop,
)
from random_loops import random_arm, random_design
from scipy.integrate import quad

from slewctl import (
    AccuracyError,
    ClampedFree,
    Controller,
    DesignError,
    InputError,
    Loop,
    Objective,
    Slew,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    margins,
    simulate_slew,
    truth,
)


def closed_poles(loop: Loop) -> np.ndarray:
    """Closed-loop poles as python-control's `feedback` has them, positive sign."""
    G, K = loop.plant.control_path, loop.controller.system
    return np.asarray(control.feedback(G, K, sign=1).poles())


def distance(a: np.ndarray, b: np.ndarray) -> float:
    gap = np.abs(a[:, None] - b) / np.abs(a[:, None])
    return float(max(gap.min(axis=0).max(), gap.min(axis=1).max()))


@pytest.mark.slow
def test_stable_agrees_with_an_independent_closed_loop() -> None:
    rng = np.random.default_rng(8)
    decisions = []
    while len(decisions) < 60:
        arm = random_arm(rng)
        try:
            objective, controller = random_design(rng, arm)
        except (DesignError, AccuracyError):
            continue
        loop = close(truth(arm, int(rng.integers(5, 26))), objective, controller)
        growth = closed_poles(loop).real.max()
        # Within rounding of the axis, ε‖A‖, nothing can be decided; no drawn loop comes so close.
        assert abs(growth) > 1e-13 * np.abs(loop.poles).max()
        assert loop.stable == (growth < 0)
        decisions.append(loop.stable)
    assert 5 < sum(decisions) < 55  # both verdicts were put to the test


def test_poles_on_the_design_model_are_those_of_the_design() -> None:
    model = assemble(uniform_arm(), ClampedFree(3))
    plant = generalised_plant(model, OBJECTIVE)
    controller = lqg(plant)
    loop = close(model, OBJECTIVE, controller)
    K, Kf = controller.gains["state_feedback"], controller.gains["observer"]
    separate = np.concatenate(
        [np.linalg.eigvals(plant.A - plant.B2 @ K), np.linalg.eigvals(plant.A - Kf @ plant.C2)]
    )
    assert distance(loop.poles, separate) < 1e-8
    assert loop.stable
    assert np.all(np.diff(np.abs(loop.poles)) >= -1e-12 * np.abs(loop.poles[:-1]))
    assert loop.h2.value == pytest.approx(controller.h2_cost, rel=1e-10)


def test_return_ratio_closes_to_the_loop() -> None:
    loop = loop_on(uniform_arm(), TWO_SENSORS)
    L = loop.return_ratio
    assert distance(np.linalg.eigvals(L.A - L.B @ L.C), loop.poles) < 1e-8


def test_return_ratio_is_minus_controller_times_plant() -> None:
    loop = loop_on(uniform_arm(), TWO_SENSORS)
    product = loop.controller.system * loop.plant.control_path
    for omega in (0.3, 3.0, 30.0):
        expected = -complex(product(1j * omega))
        assert loop.response(np.array([omega]))[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("ask", ["margins", "h2"])
def test_unstable_loop_has_none(ask: str) -> None:
    loop = unstable_loop()
    assert not loop.stable
    with pytest.raises(UnstableLoopError, match=f"{loop.unstable_hz[0]:.4g} Hz"):
        getattr(loop, ask)


def test_unstable_loop_is_not_simulated() -> None:
    with pytest.raises(UnstableLoopError, match="a slew response"):
        simulate_slew(unstable_loop(), Slew(30.0, 2.0))


def test_frequencies_of_the_instability() -> None:
    loop = unstable_loop()
    poles = closed_poles(loop)
    growing = poles[(poles.real > 1e-9) & (poles.imag > 0)]
    growing = growing[np.argsort(-growing.real)]
    found = loop.unstable_hz[: len(growing)]
    np.testing.assert_allclose(found, np.abs(growing) / (2 * np.pi), rtol=1e-8)


def test_describe_names_the_smaller_of_rise_and_fall() -> None:
    """With integral action the gain may not fall without limit; the poles say how far."""
    plant = generalised_plant(assemble(uniform_arm(), ClampedFree(3)), TWO_SENSORS)
    loop = close(truth(uniform_arm(), 5), TWO_SENSORS, lqg(plant, integral_limit=0.1))
    m = loop.margins
    assert m.gain_reduction_db.value < m.gain_db.value
    assert f"gain margin {m.gain_reduction_db.value:.2f} dB" in loop.describe()
    assert f"gain margin {m.gain_reduction_db.value:.2f} dB" in loop._repr_html_()
    L = loop.return_ratio
    for more, stable in ((-1e-4, True), (1e-4, False)):
        factor = 10 ** (-(m.gain_reduction_db.value + more) / 20)
        assert (np.linalg.eigvals(L.A - factor * L.B @ L.C).real.max() < 0) == stable


def test_describe_names_the_verdict() -> None:
    assert re.match(
        r"stable: gain margin \S+ dB, phase margin \S+ deg, H2 cost", stable_loop().describe()
    )
    assert unstable_loop().describe().startswith("UNSTABLE at ")


@pytest.mark.parametrize("objective", [OBJECTIVE, TWO_SENSORS])
def test_h2_is_the_integral_over_frequency(objective: Objective) -> None:
    loop = loop_on(uniform_arm(damping_ratio=0.02), objective, modes=4)
    system = loop.system
    A, B, C = (np.asarray(getattr(system, name)) for name in "ABC")
    eye = np.eye(len(A))

    def squared(log: float) -> float:
        omega = np.exp(log)
        response = C @ np.linalg.solve(1j * omega * eye - A, B.astype(complex))
        return float(np.sum(np.abs(response) ** 2)) * omega

    peaks = np.log(np.abs(loop.poles[loop.poles.imag > 0]))
    edges = np.unique(np.concatenate([[-16.0, 18.0], peaks, peaks - 0.05, peaks + 0.05]))
    total = sum(
        quad(squared, a, b, epsabs=0, epsrel=1e-10, limit=200)[0] for a, b in pairwise(edges)
    )
    # Beyond e^18 rad/s the integrand falls like 1/ω²: 1e-7 of the corner is left out.
    assert loop.h2.value == pytest.approx(total / np.pi, rel=1e-6)


def test_no_reduced_design_beats_the_optimum_of_the_truth() -> None:
    optimum = lqg(generalised_plant(truth(uniform_arm(), 10), OBJECTIVE)).h2_cost
    for n in (1, 2, 3, 5):
        loop = loop_on(uniform_arm(), modes=10, n=n)
        assert loop.h2.value > optimum * (1 - 1e-9)
        assert loop.h2.discrepancy < 1e-9


def test_direct_feedthrough_of_noise_costs_infinitely() -> None:
    model = assemble(uniform_arm(), ClampedFree(2))
    design = lqg(generalised_plant(model, TWO_SENSORS))
    pd = control.StateSpace(
        [],
        [],
        [],
        [[-1.0, -1.0]],
        inputs=list(TWO_SENSORS.sensors),
        outputs=["torque"],
    )
    controller = Controller(pd, "pd", {}, np.inf, design.certificate)
    loop = close(model, TWO_SENSORS, controller)
    assert loop.stable  # collocated position and rate feedback
    assert loop.h2.value == np.inf


@pytest.mark.parametrize("measured", [("theta", "tip"), ("theta",), ("tip", "theta_dot")])
def test_mismatched_sensors_are_refused(measured: tuple[str, ...]) -> None:
    arm = uniform_arm()
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS))
    other = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, **dict.fromkeys(measured, 0.01)})
    with pytest.raises(InputError, match="the controller takes"):
        close(truth(arm, 5), other, controller)


def test_a_users_own_controller_is_judged_like_any_other() -> None:
    loop = stable_loop()
    again = close(loop.model, loop.objective, loop.controller.system, sign=1)
    assert again.margins == loop.margins
    assert again.h2 == loop.h2


def test_a_users_own_system_has_the_sign_of_control_feedback_everywhere() -> None:
    loop = stable_loop()
    K = -loop.controller.system
    again = close(loop.model, loop.objective, K)
    assert again.h2 == loop.h2
    assert margins(loop.plant, K) == margins(loop.plant, K, sign=-1)
    assert margins(loop.plant, K).modulus.value == again.margins.modulus.value
    assert not close(loop.model, loop.objective, K, sign=1).stable
    with pytest.raises(InputError, match=r"^sign: .*plus sign"):
        close(loop.model, loop.objective, loop.controller, sign=-1)
    with pytest.raises(InputError, match=r"^sign: 0 is no sign"):
        close(loop.model, loop.objective, K, sign=0)


def test_sensors_are_matched_by_name_whatever_their_order() -> None:
    arm, kept = uniform_arm(), {"tip": 0.1, "torque": 1.0}
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(2)), TWO_SENSORS))
    model = assemble(arm, ClampedFree(3))
    both = [
        close(model, Objective(kept, {"torque": 0.1, **dict.fromkeys(names, 0.01)}), controller)
        for names in (("theta", "theta_dot"), ("theta_dot", "theta"))
    ]
    phases = [loop.margins.phase_deg.value for loop in both]
    assert phases[0] == pytest.approx(phases[1], rel=1e-9)


@pytest.mark.parametrize("wrong", [None, 1.0, "K"])
def test_what_is_no_controller_is_refused(wrong: object) -> None:
    loop = stable_loop()
    with pytest.raises(InputError, match="is no controller"):
        close(loop.model, loop.objective, wrong)  # type: ignore[arg-type]
