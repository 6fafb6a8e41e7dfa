"""`assert_margins`: it turns at the measured value and says which margin is too small."""

from __future__ import annotations

import math
from dataclasses import replace
from inspect import signature

import control
import numpy as np
import pytest

from slewctl import (
    Arm,
    ClampedFree,
    Hub,
    InputError,
    Loop,
    Objective,
    arms,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.compare import QUANTITIES
from slewctl.loop import Crossing
from slewctl.loop.margin_functions import margins as sc_margins
from slewctl.testing import assert_margins

OBJECTIVE = Objective(
    {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
)
# What may be asked, and the field of `Margins` that is the one it is read from.
FIELDS = {
    "gain_margin_db": "gain_db",
    "gain_margin_up_db": "gain_db",
    "gain_margin_down_db": "gain_reduction_db",
    "phase_margin_deg": "phase_deg",
    "delay_margin_s": "delay_s",
    "modulus_margin": "modulus",
    "disk_margin": "disk",
}
NAMES = list(FIELDS)


def made(hub_inertia: float) -> Loop:
    arm = Arm(arms.paper_beam().beam, Hub(hub_inertia), damping_ratio=0.005)
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(2)), OBJECTIVE))
    return close(truth(arm, 5), OBJECTIVE, controller)


@pytest.fixture(scope="module")
def loop() -> Loop:
    return made(0.1944)


def with_margins(loop: Loop, **changes: object) -> Loop:
    """Return the same loop with other margins, as if they had been computed."""
    other = Loop(loop.model, loop.objective, loop.controller)
    vars(other)["margins"] = replace(loop.margins, **changes)  # type: ignore[arg-type]
    return other


def value(loop: Loop, name: str) -> float:
    found = getattr(loop.margins, FIELDS[name]).value
    return min(found, loop.margins.gain_reduction_db.value) if name == "gain_margin_db" else found


def test_every_margin_of_the_registry_can_be_asked_for() -> None:
    asked = set(signature(assert_margins).parameters) - {"loop", "controller", "sign"}
    assert asked == set(NAMES) == {name for name, q in QUANTITIES.items() if q.margin}


@pytest.mark.parametrize("name", NAMES)
def test_it_turns_at_the_value(loop: Loop, name: str) -> None:
    loop = with_margins(loop, gain_reduction_db=Crossing(30.0, 1.0))
    limit = value(loop, name)
    assert_margins(loop, **{name: limit * (1 - 1e-9)})
    with pytest.raises(AssertionError) as caught:
        assert_margins(loop, **{name: limit * (1 + 1e-3)})
    text = str(caught.value)
    assert text.startswith(f"{name}: {limit:.4g}")
    assert f"required >= {limit * (1 + 1e-3):.4g}" in text
    assert " Hz" in text


def test_every_margin_that_is_too_small_is_named(loop: Loop) -> None:
    with pytest.raises(AssertionError) as caught:
        assert_margins(loop, gain_margin_up_db=1e3, phase_margin_deg=1e-3, disk_margin=1e3)
    lines = str(caught.value).splitlines()
    assert {line.partition(":")[0] for line in lines} == {"gain_margin_up_db", "disk_margin"}


def test_no_limit_asks_for_stability_alone(loop: Loop) -> None:
    assert_margins(loop)


def test_an_unstable_loop_has_no_margin() -> None:
    wild = made(0.0)
    assert not wild.stable
    for limits in ({}, {"gain_margin_db": 0.0}):
        with pytest.raises(AssertionError, match=r"unstable at [\d.]+ Hz.*no margin"):
            assert_margins(wild, **limits)


@pytest.mark.parametrize(
    ("name", "field"), [*FIELDS.items(), ("gain_margin_db", "gain_reduction_db")]
)
def test_nan_never_passes(loop: Loop, name: str, field: str) -> None:
    broken = with_margins(loop, **{field: Crossing(math.nan, None)})
    with pytest.raises(AssertionError, match="not a number"):
        assert_margins(broken, **{name: 0.0})


def test_infinite_margins_pass_and_doubtful_ones_do_not(loop: Loop) -> None:
    assert_margins(with_margins(loop, delay_s=Crossing(math.inf, None)), delay_margin_s=1e6)
    doubtful = with_margins(loop, confirmed=False, doubts=("a pole says otherwise",))
    with pytest.raises(AssertionError, match="not confirmed: a pole says otherwise"):
        assert_margins(doubtful, gain_margin_db=0.0)


def test_of_a_margin_that_is_known_less_narrowly_the_proved_part_counts(loop: Loop) -> None:
    wide = Crossing(12.0, 3.0, at_least=8.0)
    says = "gain_db is proved to be at least 8 only"
    known = with_margins(loop, gain_db=wide, confirmed=False, doubts=(says,))
    assert known.margins.unproved == ()
    assert_margins(known, gain_margin_up_db=7.9, gain_margin_db=6.0, phase_margin_deg=1.0)
    with pytest.raises(AssertionError, match=r"gain_margin_up_db: 8 dB"):
        assert_margins(known, gain_margin_up_db=8.1)
    both = with_margins(loop, gain_db=wide, confirmed=False, doubts=("a pole says otherwise", says))
    assert both.margins.unproved == ("a pole says otherwise",)
    with pytest.raises(AssertionError, match="not confirmed: a pole says otherwise"):
        assert_margins(both, gain_margin_db=1.0)
    endless = with_margins(
        loop, gain_db=Crossing(math.inf, None, at_least=20.0),
        gain_reduction_db=Crossing(30.0, 1.0, at_least=30.0), confirmed=False, doubts=(says,),
    )  # fmt: skip
    with pytest.raises(AssertionError, match=r"gain_margin_db: 20 dB"):
        assert_margins(endless, gain_margin_db=25.0)
    halved = with_margins(
        loop, modulus=Crossing(0.5, 1.0, at_least=0.4), confirmed=False, doubts=(says,)
    )
    peak = QUANTITIES["sensitivity_peak"].margin
    assert peak is None or peak(halved.margins).value == pytest.approx(2.5)


@pytest.mark.parametrize("limit", [-1.0, math.nan, math.inf, "6", True])
def test_impossible_limits_are_refused(loop: Loop, limit: object) -> None:
    with pytest.raises(InputError, match="gain_margin_db: "):
        assert_margins(loop, gain_margin_db=limit)  # type: ignore[arg-type]


def test_systems_of_python_control_are_taken_with_negative_feedback() -> None:
    # L = 2/(s (s + 1)²) has its phase crossover at 1 rad/s, where |L| = 1, halved: 6.02 dB.
    s = control.tf("s")
    plant, gain = 1 / (s * (s + 1) ** 2), 1.0
    assert_margins(plant * gain, gain_margin_db=6.02, phase_margin_deg=21)
    assert_margins(plant, gain, gain_margin_db=6.02, phase_margin_deg=21)
    for arguments in ((plant * gain,), (plant, gain)):
        with pytest.raises(AssertionError, match=r"gain_margin_db: 6\.021 dB at 0\.1592 Hz"):
            assert_margins(*arguments, gain_margin_db=6.03)
    with pytest.raises(AssertionError, match="not stable"):
        assert_margins(plant, 2.1)


def test_a_measured_loop_is_held_to_the_whole_of_its_intervals() -> None:
    """L = 1/(2s(s² + s + 1)): twice as much is the limit, at 1 rad/s."""
    s = control.tf("s")
    L = 0.5 / (s * (s**2 + s + 1))
    points = np.logspace(-2, 2, 400)
    seen = control.frd(L, points)
    low = sc_margins(seen).gain_db.low
    assert 5.9 < low < 20 * math.log10(2)
    assert_margins(seen, gain_margin_db=low, phase_margin_deg=20, modulus_margin=0.3)
    with pytest.raises(AssertionError, match=r"gain_margin_db: 6\.02.*measured: .* to "):
        assert_margins(seen, gain_margin_db=low * 1.0001)
    assert_margins(seen)
    for limits in ({}, {"phase_margin_deg": 0.0}):
        with pytest.raises(AssertionError, match="measured: NOT stable"):
            assert_margins(control.frd(20 * L, points), **limits)
    with pytest.raises(InputError, match="disk_margin: a measured response does not tell it"):
        assert_margins(seen, disk_margin=0.1)


def test_a_plant_and_a_design_give_the_loop_that_they_close(loop: Loop) -> None:
    limit = value(loop, "phase_margin_deg")
    assert_margins(loop.plant, loop.controller, phase_margin_deg=limit * (1 - 1e-6))
    with pytest.raises(AssertionError, match="phase_margin_deg"):
        assert_margins(loop.plant, loop.controller, phase_margin_deg=limit * (1 + 1e-6))


def test_what_is_no_loop_is_refused() -> None:
    with pytest.raises(InputError, match="3 is no state-space system"):
        assert_margins(3)  # type: ignore[arg-type]
