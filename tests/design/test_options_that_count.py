"""An option that is accepted changes the controller or what is promised of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from design_problems import design_plant, transfer
from general_plants import random_plant
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.design import METHODS, options
from slewctl.errors import InputError

# One plant on which every method has a design: it measures angle, rate and bending.
PLANT = design_plant(
    2,
    sc.Objective(
        {"tip": 0.1, "torque": 1.0},
        {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1, "root_moment": 0.1},
    ),
)
POINTS = np.array([0.3j, 1.0 + 2.0j, 5.0j, 30.0j])
PAIRS = [[-0.5, 0.5], [-0.5, -0.5], [-0.4, 5.0], [-0.4, -5.0], [-0.9, 15.0], [-0.9, -15.0]]
CLOCK: dict[str, list[object]] = {
    "sample_time": [0.05],
    "delay": [0.01, 0.07],
    "discretise": ["zoh", "matched"],
    "prewarp_hz": [1.0],
}
POOLS: dict[str, dict[str, list[object]]] = {
    "lqg": {"integral_limit": [0.5, 3.0], "sample_time": [0.05], "delay": [0.01, 0.07]},
    "pole-placement": {
        "bandwidth_hz": [0.05, 0.1],
        "damping_ratio": [0.5, 1.2],
        "added_damping": [0.05, [0.03], {"2": 0.04}],
        "leave": [[1], [2], [1, 2]],
        "poles": [PAIRS, PAIRS[:4]],
        "observer_speed": [2.0, 4.0],
        "observer_damping": [0.2, 0.3],
        "observer_poles": [PAIRS, PAIRS[:2]],
        "sample_time": [0.05],
        "delay": [0.01, 0.07],
    },
    "pd-notch": {
        "bandwidth_hz": [0.05, 0.1],
        "damping_ratio": [0.5, 1.0],
        "notch_modes": [[], [2], [1, 2]],
        "notch_depth": [0.2, 0.05],
        "notch_width": [0.2, 0.8],
        "rolloff_hz": [2.0, 7.0],
        **CLOCK,
    },
    "positive-position": {
        "bandwidth_hz": [0.05, 0.1],
        "damping_ratio": [0.5, 1.0],
        "modes": [[2], [1, 2]],
        "gain": [0.1, [0.3]],
        "filter_damping": [0.1, 0.6],
        "rolloff_hz": [2.0, 7.0],
        **CLOCK,
    },
    "lead": {
        "crossover_hz": [0.05, 0.1],
        "phase_lead_deg": [30.0, 45.0],
        "rolloff_hz": [2.0, 7.0],
        **CLOCK,
    },
}
# Of designs by matrix inequalities: what each is given, and each option in turn changed so
# that it binds.
BINDING: dict[str, tuple[dict[str, object], dict[str, object]]] = {
    "h2-lmi": ({}, {"formulation": "joint"}),
    "h2-region": (
        {},
        {
            "decay_rate_min": 0.1,
            "damping_ratio_min": 0.03,
            "radius_max": 100.0,
            "observer_decay_rate_min": 0.1,
            "observer_damping_ratio_min": 0.03,
            "observer_radius_max": 100.0,
        },
    ),
    "h2-hinf": ({"hinf_max": 1e3, "weight_hz": 1.0}, {"hinf_max": 999.0, "weight_hz": 1.1}),
    "payload-lmi": (
        {"payload_mass": [0.0, 0.05]},
        {"payload_mass": [0.0, 0.06], "stiffness": [0.98, 1.0], "decay_rate_min": 0.01},
    ),
    "variance-bound": (
        {"std_max": {"torque": 1e3}},
        {"std_max": {"torque": 999.0}, "minimise": "tip"},
    ),
}


def said(controller: sc.Controller) -> str:
    """Return what is promised and assumed, without how long it took."""
    return str((controller.guarantees, controller.assumptions))


def alike(one: sc.Controller, other: sc.Controller) -> bool:
    """Return whether two controllers are one, with one promise."""
    clocks = {(c.system.dt, c.delay) for c in (one, other)}
    if len(clocks) > 1 or one.system.nstates != other.system.nstates:
        return False
    first, second = (transfer(c.system, POINTS) for c in (one, other))
    return bool(np.allclose(first, second, rtol=1e-9, atol=0.0)) and said(one) == said(other)


def designed(method: str, given: Mapping[str, object]) -> sc.Controller | None:
    """Return a design, None if it is refused."""
    try:
        return METHODS[method](PLANT, **given)
    except sc.SlewctlError:
        return None


@st.composite
def choices(draw: st.DrawFn) -> tuple[str, dict[str, object]]:
    """Draw a method and values for some of its options."""
    method = draw(st.sampled_from(list(POOLS)))
    names = draw(st.sets(st.sampled_from(list(POOLS[method])), min_size=1))
    first = next(iter(POOLS[method]))
    if method != "lqg" and "poles" not in names:  # without it all are refused
        names.add(first)
    return method, {name: draw(st.sampled_from(POOLS[method][name])) for name in names}


def test_every_option_is_tried() -> None:
    # The forms of a given law exclude each other, and have tests of their own.
    for method in set(METHODS) - {"given"}:
        tried = set(POOLS.get(method, ())) | set(BINDING.get(method, ({}, {}))[1])
        # A name of a sensor, of which the plant has one that shows the bending.
        # The clock of inequalities' designs is that of the others.
        assert tried | {"signal_used", *CLOCK} >= set(options(method)), method


@pytest.mark.slow
@given(choices())
@settings(max_examples=60, deadline=None)
def test_no_option_is_swallowed(choice: tuple[str, dict[str, object]]) -> None:
    """Left out, each option that was accepted leaves another controller, or none."""
    method, given = choice
    found = designed(method, given)
    if found is None:
        return
    for name in given:
        without = designed(method, {key: given[key] for key in given if key != name})
        assert without is None or not alike(found, without), (method, given, name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "option"), [(method, name) for method in BINDING for name in BINDING[method][1]]
)
def test_options_of_inequalities_count(method: str, option: str) -> None:
    base, others = BINDING[method]
    before = METHODS[method](PLANT, **base)
    after = METHODS[method](PLANT, **{**base, option: others[option]})
    assert not alike(before, after)


@pytest.mark.parametrize(
    ("option", "given"),
    [
        ("observer_damping", {"added_damping": 0.05, "observer_damping": 0.3}),
        ("observer_damping", {"leave": [1, 2], "observer_damping": 0.3}),
        ("observer_damping", {"leave": [2], "added_damping": [0.1], "observer_damping": 0.0}),
        ("added_damping", {"leave": [1, 2], "added_damping": 0.05}),
    ],
)
def test_what_moves_no_mode_is_refused(option: str, given: dict[str, object]) -> None:
    with pytest.raises(InputError, match="no mode") as refusal:
        sc.pole_placement(PLANT, bandwidth_hz=0.1, **given)
    assert refusal.value.where == option


@pytest.mark.parametrize("option", ["integral_limit", "sample_time", "delay"])
def test_a_sampled_plant_has_its_own_clock(option: str) -> None:
    """Whatever is given, zero and nonsense too."""
    plant = random_plant(3, sampled=True)
    assert sc.lqg(plant).certificate.verified
    for value in (0.0, -1.0, 0.1, math.nan, "x"):
        if option == "delay" and value == 0.0:
            continue  # no delay is what it has
        with pytest.raises(InputError) as refusal:
            sc.lqg(plant, **{option: value})
        assert refusal.value.where == option
