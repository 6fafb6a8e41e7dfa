"""Methods on a clock: poles in z are exact, and what runs tends to the continuous design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from design_problems import design_plant, transfer
from general_plants import random_plant
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.compare import sampling_loss
from slewctl.design import METHODS, options
from slewctl.errors import InputError
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import sampled_plant

SENSORS = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
PLANT = design_plant(2, sc.Objective({"tip": 0.1, "torque": 1.0}, SENSORS))
# With one sensor an observer's poles leave no choice of its gain.
ANGLE = design_plant(2, sc.Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01}))
WISH = {"bandwidth_hz": 0.1, "damping_ratio": 0.7, "added_damping": 0.05}
CLOCK = ("sample_time", "delay", "discretise", "prewarp_hz")
# Of each method a design on the plant; positive position feedback needs another sensor.
DESIGNS: dict[str, Mapping[str, object]] = {
    "pole-placement": WISH,
    "pd-notch": {"bandwidth_hz": 0.1},
    "lead": {"crossover_hz": 0.1},
    "h2-lmi": {},
}


@settings(max_examples=15, deadline=None)
@given(
    st.floats(0.005, 0.04),
    st.sampled_from([0.0, 0.3, 1.0, 1.7, 3.0]),
    st.sampled_from([(), (1,), (1, 2)]),
)
def test_poles_of_the_hybrid_loop_are_those_wished_and_zeros(
    T: float, late: float, leave: tuple[int, ...]
) -> None:
    """The characteristic polynomial is that of e^(sT) for each s wished, and of zeros."""
    wish = {**WISH, "added_damping": 0.0 if len(leave) == 2 else 0.05, "leave": leave}
    wanted = np.exp(np.linalg.eigvals(PLANT.closed(sc.pole_placement(PLANT, **wish).linear).A) * T)
    K = sc.pole_placement(PLANT, **wish, sample_time=T, delay=late * T)
    assert K.certificate.verified
    loop = sampled_plant(PLANT, T, late * T).close(K.linear)
    z = 1.3 * np.exp(1j * np.linspace(0.0, np.pi, 6))
    found = np.linalg.det(z[:, None, None] * np.eye(len(loop.A)) - loop.A)
    at_rest = z ** (len(loop.A) - len(wanted))
    np.testing.assert_allclose(found, at_rest * np.prod(z[:, None] - wanted, axis=1), rtol=1e-9)


@pytest.mark.parametrize("method", DESIGNS)
def test_what_runs_tends_to_the_continuous_law_with_the_hold_s_half_sample(method: str) -> None:
    """K_T(e^jωT) behind its hold differs from K(jω) by terms of first order in T."""
    s = 2j * np.pi * np.array([0.02, 0.1, 0.5])
    law = METHODS[method](ANGLE, **DESIGNS[method])
    errors = []
    for T in (4e-3, 2e-3, 1e-3):
        K = METHODS[method](ANGLE, **DESIGNS[method], sample_time=T, delay=T / 2)
        assert (K.sample_time, K.delay) == (T, T / 2)
        hold = (1 - np.exp(-s * T)) / (s * T) * np.exp(-s * T / 2)
        run = transfer(K.system, np.exp(s * T)) * hold[:, None, None]
        errors.append(np.abs(run / transfer(law.system, s) - 1).max())
    ratios = [first / second for first, second in pairwise(errors)]
    assert errors[-1] < 0.02
    np.testing.assert_allclose(ratios, 2.0, rtol=0.1)
    if np.isfinite(law.h2_cost):  # of a loop that is stable
        assert abs(K.h2_cost / law.h2_cost - 1) < 0.1


@pytest.mark.parametrize("rule", [{"discretise": "zoh"}, {"prewarp_hz": 0.1}])
def test_the_loss_of_margin_is_that_of_the_engine(rule: dict[str, object]) -> None:
    problem = sc.Problem(PLANT.model.arm, {"tip": 0.1, "torque": 1.0}, SENSORS, truth_modes=4)
    K = sc.pd_notch(PLANT, bandwidth_hz=0.1, sample_time=0.01, delay=0.005, **rule)
    law = sc.pd_notch(PLANT, bandwidth_hz=0.1)
    on_model = [sc.margins(PLANT, law), sc.margins(PLANT, K)]
    before, after = (f"{m.modulus.value:.3g}" for m in on_model)
    assert f"{before} of the continuous law, {after} of what runs" in K.assumptions[-1]
    judged = problem.judge(K)
    loss = sampling_loss(judged)
    assert loss is not None
    for name, reading in loss.continuous.items():
        if name == "disk_margin":
            assert reading.value == pytest.approx(problem.judge(law).margins.disk.value, rel=1e-9)
    lost = [
        loss.sampled[n].value < loss.continuous[n].value for n in ("modulus_margin", "disk_margin")
    ]
    assert lost == [True, True]
    assert str(loss) in str(judged)


def test_the_path_of_the_reference_is_discretised_with_the_law() -> None:
    """At rest the trapezoidal rule keeps every gain: a step leaves no error."""
    law = sc.h2_lmi(PLANT)
    K = sc.h2_lmi(PLANT, sample_time=0.02)
    still = [np.array([0.0j]), np.array([1.0 + 0j])]
    one, other = (transfer(c.tracking, z) for c, z in zip((law, K), still, strict=True))
    np.testing.assert_allclose(one, other, rtol=1e-6)
    with pytest.raises(InputError, match="matched is for one input"):
        sc.h2_lmi(PLANT, sample_time=0.02, discretise="matched")


def test_every_method_takes_a_clock_and_says_what_it_takes() -> None:
    for method in set(METHODS) - {"given"}:
        taken = CLOCK if method not in ("lqg", "pole-placement") else CLOCK[:2]
        assert set(taken) < set(options(method)), method
        assert all(f"\n    {name} : " in (METHODS[method].__doc__ or "") for name in taken), method


REFUSED = [
    ({"delay": 0.01}, "delay: a continuous controller has no computational delay"),
    ({"discretise": "zoh"}, "discretise: nothing is discretised"),
    ({"prewarp_hz": 1.0}, "prewarp_hz: nothing is discretised"),
    ({"sample_time": 0.0}, "sample_time: 0 is not positive"),
    ({"sample_time": 0.1, "delay": 2.0}, "delay: 2 s is more than 10 sample times"),
    ({"sample_time": 0.1, "discretise": "euler"}, "discretise: unknown name 'euler'"),
    ({"sample_time": 0.1, "discretise": "zoh", "prewarp_hz": 1.0}, "zoh has nothing to prewarp"),
    ({"sample_time": 0.1, "prewarp_hz": 9.0}, "prewarp_hz: 9 Hz is not below half"),
]


@pytest.mark.parametrize(("clock", "told"), REFUSED)
def test_a_clock_that_cannot_be_is_refused_by_name(clock: dict[str, object], told: str) -> None:
    """Before anything is designed: the wish itself would be refused."""
    with pytest.raises(InputError) as refused:
        sc.pd_notch(PLANT, bandwidth_hz=-1.0, **clock)
    assert told in str(refused.value)


def leaking() -> sc.GeneralisedPlant:
    """Return a plant whose disturbances enter its sensors too."""
    own = PLANT.linear
    system = LinearSystem(
        own.A, own.B, own.C, own.D + 1.0, inputs=own.input_labels, outputs=own.output_labels
    )
    return replace(PLANT, system=system)


def test_a_sampled_plant_has_its_clock_already() -> None:
    with pytest.raises(InputError, match="the plant is sampled, every"):
        sc.lead(random_plant(3, sampled=True), crossover_hz=0.1, sample_time=0.1)
    with pytest.raises(InputError, match="the plant is sampled already"):
        sc.pole_placement(random_plant(3, sampled=True), bandwidth_hz=0.1, sample_time=0.1)
    with pytest.raises(InputError, match="white noise has no value at an instant"):
        sc.lead(leaking(), crossover_hz=0.1, sample_time=0.1)


def test_a_law_given_to_be_discretised_knows_the_continuous_one() -> None:
    pid = {"kp": 2.0, "kd": 0.5, "filter_hz": 9.0}
    K = sc.given(pid=pid, sample_time=0.05, discretise="tustin")
    assert K.continuous is not None
    points = np.array([0.3j, 5.0j])
    expected = transfer(sc.given(pid=pid).system, points)
    np.testing.assert_allclose(transfer(K.continuous.system, points), expected, rtol=1e-12)
