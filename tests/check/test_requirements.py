"""Verdicts: what passes, what fails, and that neither NaN nor an unstable loop ever passes."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from slewctl import Hub, InputError, Objective, Slew, arms
from slewctl.arm import Motor
from slewctl.check import MARGINS, REQUIREMENTS, judge, measure
from slewctl.compare import Case, Evaluation, evaluate
from slewctl.loop import Crossing

OBJECTIVE = Objective(
    {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
)


def design(hub_inertia: float, basis: str) -> Evaluation:
    motor = Motor(resistance=2.0, torque_constant=0.1, back_emf_constant=0.1, gear_ratio=10)
    arm = replace(arms.paper_beam(), hub=Hub(hub_inertia), motor=motor, damping_ratio=0.005)
    return evaluate(Case("x", arm, OBJECTIVE, basis=basis, n=2, slew=Slew(30.0, 2.0)))


@pytest.fixture(scope="module")
def good() -> Evaluation:
    return design(0.1944, "clamped-free")


@pytest.fixture(scope="module")
def unstable() -> Evaluation:
    return design(0.0, "clamped-free")


@pytest.mark.parametrize("name", [name for name in REQUIREMENTS if name != "stable"])
def test_verdict_turns_at_the_measured_value(good: Evaluation, name: str) -> None:
    value = REQUIREMENTS[name].read(good)[0]
    assert math.isfinite(value)
    if name == "h2_loss_max":  # must hold on the finer truth as well
        assert good.finer is not None
        assert good.finer.loss is not None
        value = max(value, good.finer.loss)
    step = 1e-9 * abs(value)
    sign = 1 if REQUIREMENTS[name].sense == "at least" else -1
    assert judge(good, {name: value - sign * step})[-1].passed
    assert not judge(good, {name: value + sign * step})[-1].passed


def test_unstable_loop_passes_nothing(unstable: Evaluation) -> None:
    easy = {name: 0.0 if r.sense == "at least" else 1e9 for name, r in REQUIREMENTS.items()}
    verdicts = judge(unstable, {**easy, "stable": True})
    assert len(verdicts) == len(REQUIREMENTS)
    for verdict in verdicts:
        assert not verdict.passed
        assert verdict.frequency_hz == unstable.unstable_hz[0]
        assert "unstable at" in verdict.note


def test_stability_is_judged_even_when_not_asked(unstable: Evaluation) -> None:
    assert not judge(unstable, {})[0].passed


def test_voltage_of_an_arm_without_motor_never_passes(good: Evaluation) -> None:
    assert good.slew is not None
    bare = replace(good, slew=replace(good.slew, peak_voltage=None))
    verdict = judge(bare, {"voltage_peak_max": 1e9})[-1]
    assert (verdict.passed, verdict.note) == (False, "this arm has no such value")


def test_both_truths_must_pass(good: Evaluation) -> None:
    """A verdict that turns with the modes kept is no verdict."""
    assert good.finer is not None
    worse = replace(good, finer=replace(good.finer, loss=0.5))
    assert judge(good, {"h2_loss_max": 0.1})[-1].passed
    verdict = judge(worse, {"h2_loss_max": 0.1})[-1]
    assert not verdict.passed
    assert "0.5 on a truth of 40 modes" in verdict.note
    gone = replace(good, finer=replace(good.finer, stable=False, loss=None))
    assert not judge(gone, {})[0].passed


def test_what_is_compared_with_must_be_verified(good: Evaluation) -> None:
    for doubtful in (
        replace(good, optimum_verified=False),
        replace(good, cost_discrepancy=1e-3),
        replace(good, truth_tolerance=1e-3),
    ):
        assert not judge(doubtful, {"h2_loss_max": 0.1})[-1].passed


def test_nan_never_passes(good: Evaluation) -> None:
    assert good.margins is not None
    margins = replace(good.margins, phase_deg=Crossing(math.nan, None))
    broken = replace(good, margins=margins, loss=math.nan)
    verdicts = judge(broken, {"phase_margin_deg": 0.0, "h2_loss_max": 1e9})
    assert [v.passed for v in verdicts] == [True, False, False]


def test_unverified_design_never_passes(good: Evaluation) -> None:
    verdicts = judge(replace(good, verified=False), {"gain_margin_db": 0.0})
    assert not any(v.passed for v in verdicts)
    assert "not verified" in verdicts[0].note


def test_unconfirmed_margin_never_passes(good: Evaluation) -> None:
    assert good.margins is not None
    broken = replace(good, margins=replace(good.margins, confirmed=False))
    verdicts = judge(broken, {"phase_margin_deg": 0.0, "h2_loss_max": 1.0})
    assert [v.passed for v in verdicts] == [True, False, True]


def test_gain_margin_is_the_smaller_of_rise_and_fall(good: Evaluation) -> None:
    assert good.margins is not None
    margins = replace(
        good.margins, gain_db=Crossing(9.0, 1.0), gain_reduction_db=Crossing(4.0, 2.0)
    )
    verdict = judge(replace(good, margins=margins), {"gain_margin_db": 6.0})[-1]
    assert (verdict.value, verdict.frequency_hz, verdict.passed) == (4.0, 2.0, False)


@pytest.mark.parametrize("name", ["gain_margin_db", "phase_margin_deg", "delay_margin_s"])
def test_infinite_margin_is_explained(good: Evaluation, name: str) -> None:
    assert good.margins is not None
    none = Crossing(math.inf, None)
    margins = replace(
        good.margins, delay_s=none, phase_deg=none, gain_db=none, gain_reduction_db=none
    )
    verdict = judge(replace(good, margins=margins), {name: 1.0})[-1]
    assert verdict.passed
    assert verdict.slack == math.inf
    assert "unstable" in verdict.note
    told = replace(none, note="|L| is below one at all frequencies")
    margins = replace(margins, delay_s=told, phase_deg=told)
    verdict = judge(replace(good, margins=margins), {"delay_margin_s": 1.0})[-1]
    assert verdict.note == told.note


def test_a_slew_that_does_not_settle_is_explained_and_fails(good: Evaluation) -> None:
    assert good.slew is not None
    still = replace(good, slew=replace(good.slew, settling_time_s=math.inf))
    verdict = judge(still, {"settling_time_max": 1e9})[-1]
    assert (verdict.passed, verdict.note) == (False, "not settled within the time simulated")


@pytest.mark.parametrize("side", ["gain_db", "gain_reduction_db"])
def test_a_gain_margin_of_nan_is_not_hidden_by_the_other_side(good: Evaluation, side: str) -> None:
    assert good.margins is not None
    margins = replace(good.margins, **{side: Crossing(math.nan, None)})
    verdict = judge(replace(good, margins=margins), {"gain_margin_db": 0.0})[-1]
    assert not verdict.passed


def test_slack_is_relative_and_signed(good: Evaluation) -> None:
    assert good.margins is not None
    margins = replace(good.margins, modulus=Crossing(0.6, 1.0, "mode 1 (1 Hz)"))
    evaluation = replace(good, margins=margins)
    verdicts = [judge(evaluation, {"modulus_margin": x})[-1] for x in (0.5, 0.8, 0.0)]
    assert [v.slack for v in verdicts] == pytest.approx([0.2, -0.25, math.inf])
    assert verdicts[0].mode == "mode 1 (1 Hz)"
    for verdict in verdicts:
        assert verdict.passed == (verdict.slack >= 0)
    nothing = replace(verdicts[0], value=None), replace(verdicts[0], value=math.nan)
    assert [v.slack for v in nothing] == [-math.inf, -math.inf]


def test_all_margins_and_what_is_required_are_recorded(
    good: Evaluation, unstable: Evaluation
) -> None:
    found = measure(good, ["stable", "torque_peak_max"])
    assert list(found) == [*MARGINS, "torque_peak_max"]
    for name, reading in found.items():
        assert reading == REQUIREMENTS[name].read(good)
    assert measure(unstable, ["torque_peak_max"]) == {}
    assert good.margins is not None
    doubtful = replace(good, margins=replace(good.margins, confirmed=False))
    assert all(math.isnan(measure(doubtful, [])[name].value) for name in MARGINS)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"gain_margin": 6.0}, "did you mean 'gain_margin_db'"),
        ({"phase_margin_deg": math.nan}, "not a finite number"),
        ({"stable": False}, "leave it out"),
        ({"gain_margin_db": True}, "not a finite number"),
        ({"h2_loss_max": -0.1}, "is negative"),
    ],
)
def test_impossible_requirements_are_refused(
    good: Evaluation, limits: dict[str, float | bool], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        judge(good, limits)
    assert words in str(caught.value)
    assert "requirements" in str(caught.value)
