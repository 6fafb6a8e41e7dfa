"""Verdicts: what passes, what fails, and that neither NaN nor an unstable loop ever passes."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from changed_judgement import changed

from slewctl import Hub, InputError, Objective, Slew, arms
from slewctl.arm import Motor
from slewctl.check import REQUIREMENTS, judge, measure
from slewctl.check.words import place_text
from slewctl.compare import Case, Judgement, evaluate, follow, quantities_of, read
from slewctl.compare.quantities import RECORDED
from slewctl.loop import Crossing
from slewctl.numerics.h2_norm import H2Cost

OBJECTIVE = Objective(
    {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
)


def design(hub_inertia: float, basis: str, **motor: float) -> Judgement:
    drive = Motor(
        resistance=2.0, torque_constant=0.1, back_emf_constant=0.1, gear_ratio=10, **motor
    )
    arm = replace(arms.paper_beam(), hub=Hub(hub_inertia), motor=drive, damping_ratio=0.005)
    return evaluate(Case("x", arm, OBJECTIVE, basis=basis, n=2, slew=Slew(30.0, 2.0))).judgement


@pytest.fixture(scope="module")
def good() -> Judgement:
    return design(0.1944, "clamped-free")


@pytest.fixture(scope="module")
def unstable() -> Judgement:
    return design(0.0, "clamped-free")


def with_slew(judgement: Judgement, **values: float | None) -> Judgement:
    """Return the judgement with other measures of its slew."""
    summary = replace(judgement.response.summary, **values)
    return changed(judgement, response=replace(judgement.response, summary=summary))


@pytest.mark.parametrize("name", [q.requirement for q in quantities_of(Slew(30.0, 2.0))[1:]])
def test_verdict_turns_at_the_worse_of_the_values_that_agree(good: Judgement, name: str) -> None:
    quantity = REQUIREMENTS[name]
    followed = follow(good, quantity.name)
    assert followed.converged
    values = [seen.reading.value for seen in followed.deciding]
    assert len(values) == 2
    sign = 1 if quantity.better == "greater" else -1
    value = sign * min(sign * v for v in values)
    if math.isinf(value):
        assert (quantity.better, judge(good, {name: 1e300})[-1].passed) == ("greater", True)
        return
    step = 1e-9 * abs(value) + 1e-300
    assert judge(good, {name: max(value - sign * step, 0.0)})[-1].passed
    if value + sign * step >= 0:
        assert not judge(good, {name: value + sign * step})[-1].passed


def test_unstable_loop_passes_nothing(unstable: Judgement) -> None:
    easy = {name: 0.0 if q.better == "greater" else 1e9 for name, q in REQUIREMENTS.items()}
    verdicts = judge(unstable, {**easy, "stable": True})
    assert len(verdicts) == len(REQUIREMENTS)
    for verdict in verdicts:
        assert not verdict.passed
        assert verdict.frequency_hz == unstable.unstable_hz[0]
        assert "unstable at" in verdict.note
        assert place_text(verdict) == ""  # the note tells it


def test_stability_is_judged_even_when_not_asked(unstable: Judgement) -> None:
    assert not judge(unstable, {})[0].passed


def test_voltage_of_an_arm_without_motor_never_passes(good: Judgement) -> None:
    verdict = judge(with_slew(good, peak_voltage=None), {"voltage_peak_max": 1e9})[-1]
    assert (verdict.passed, verdict.note) == (False, "the arm has no motor")


def test_a_slew_that_the_motor_cannot_make_has_no_measures() -> None:
    """A linear slew beyond the motor's limits is not what the arm does."""
    free = design(0.1944, "clamped-free")
    peak = free.response.summary.peak_voltage
    assert peak is not None
    limited = design(0.1944, "clamped-free", voltage_limit=peak / 2)
    assert limited.stable
    asked = ["settling_time_max", "torque_peak_max", "voltage_peak_max", "overshoot_max",
             "residual_vibration_max"]  # fmt: skip
    for verdict in judge(limited, dict.fromkeys(asked, 1e9))[1:]:
        assert (verdict.passed, verdict.value) == (False, None)
        assert f"the slew needs {peak:.3g} V, the motor has {peak / 2:.3g}" in verdict.note
    # What the slew has no part in is judged as before, and a weaker limit is no limit.
    assert judge(limited, {"gain_margin_db": 3.0})[-1].passed
    enough = design(0.1944, "clamped-free", voltage_limit=1.001 * peak)
    assert judge(enough, {"settling_time_max": 1e9})[-1].passed


def moving(judgement: Judgement, *values: float) -> Judgement:
    """Return a judgement whose disk margin has these values on truths of twice the modes."""
    finer, modes = None, judgement.modes * 2 ** (len(values) - 1)
    for value in reversed(values):
        margins = replace(judgement.margins, disk=Crossing(value, 1.0))
        twin = changed(judgement, margins=margins, finer=finer)
        object.__setattr__(twin, "yardstick", _Sized(judgement.yardstick, modes))
        finer, modes = twin, modes // 2
    assert finer is not None
    return finer


class _Sized:
    """A yardstick that says that its truth has other modes."""

    def __init__(self, yardstick: object, modes: int) -> None:
        self._yardstick, self.modes = yardstick, modes

    def __getattr__(self, name: str) -> object:
        return getattr(self._yardstick, name)


def test_what_still_moves_fails_unless_every_value_passes(good: Judgement) -> None:
    wandering = moving(good, 0.207, 0.346, 0.374)
    verdict = judge(wandering, {"disk_margin": 0.3})[-1]
    assert not verdict.passed
    assert verdict.note == "undecided: 0.207 on 20 modes, 0.346 on 40, 0.374 on 80"
    assert verdict.value == 0.207
    assert verdict.seen == ((20, 0.207), (40, 0.346), (80, 0.374))
    verdict = judge(wandering, {"disk_margin": 0.2})[-1]
    assert verdict.passed
    assert "not converged, but every value holds" in verdict.note
    assert measure(wandering, [])["disk_margin"].value == 0.207


def test_two_values_that_agree_decide_whatever_came_before(good: Judgement) -> None:
    settling = moving(good, 0.1, 0.3, 0.302, 0.05)
    verdict = judge(settling, {"disk_margin": 0.29})[-1]
    assert verdict.passed
    assert verdict.value == 0.3
    assert verdict.note == "0.1 on 20 modes, 0.3 on 40, 0.302 on 80"
    assert not judge(settling, {"disk_margin": 0.301})[-1].passed
    # A percent is the agreement asked for, and no more.
    assert not judge(moving(good, 0.3, 0.297), {"disk_margin": 0.298})[-1].passed
    assert "undecided" in judge(moving(good, 0.3, 0.2969), {"disk_margin": 0.298})[-1].note


def test_a_loop_that_more_modes_destabilise_passes_nothing(
    good: Judgement, unstable: Judgement
) -> None:
    gone = changed(unstable, finer=None)
    object.__setattr__(gone, "yardstick", _Sized(good.yardstick, 40))
    whole = changed(good, finer=gone)
    for verdict in judge(whole, {"gain_margin_db": 0.0, "h2_loss_max": 1e9}):
        assert not verdict.passed
        assert "on a truth of 40 modes" in verdict.note


def test_what_is_compared_with_must_be_verified(good: Judgement) -> None:
    optimum = good.optimum
    checks = tuple(replace(check, error=math.inf) for check in optimum.certificate.checks)
    doubtful = replace(optimum, certificate=replace(optimum.certificate, checks=checks))
    for changes in (
        {"optimum": doubtful},
        {"h2": H2Cost(good.cost, 1e-3)},
        {"yardstick_tolerance": 1e-3},
    ):
        tolerance = changes.pop("yardstick_tolerance", None)
        twin = changed(good, **changes)
        if tolerance:
            errors = good.yardstick.model.frequency_errors + tolerance
            model = replace(good.yardstick.model, frequency_errors=errors)
            object.__setattr__(twin, "yardstick", replace(good.yardstick, model=model))
        assert not judge(twin, {"h2_loss_max": 0.1})[-1].passed
    assert judge(changed(good), {"h2_loss_max": 0.1})[-1].passed


def test_the_finer_optimum_must_be_verified_too(good: Judgement) -> None:
    optimum = good.optimum
    checks = tuple(replace(check, error=math.inf) for check in optimum.certificate.checks)
    doubtful = replace(optimum, certificate=replace(optimum.certificate, checks=checks))
    twin = changed(good, finer=changed(good, optimum=doubtful, finer=None))
    verdict = judge(twin, {"h2_loss_max": 0.1})[-1]
    assert not verdict.passed
    assert "not verified" in verdict.note


def test_nan_never_passes(good: Judgement) -> None:
    margins = replace(good.margins, phase_deg=Crossing(math.nan, None))
    broken = changed(good, margins=margins, h2=H2Cost(math.nan, 0.0))
    verdicts = judge(broken, {"phase_margin_deg": 0.0, "h2_loss_max": 1e9})
    assert [v.passed for v in verdicts] == [True, False, False]


def test_unverified_design_never_passes(good: Judgement) -> None:
    certificate = good.controller.certificate
    checks = tuple(replace(check, error=math.inf) for check in certificate.checks)
    twin = changed(good)
    controller = replace(good.controller, certificate=replace(certificate, checks=checks))
    object.__setattr__(twin.loop, "controller", controller)
    verdicts = judge(twin, {"gain_margin_db": 0.0})
    assert not any(v.passed for v in verdicts)
    assert "not verified" in verdicts[0].note


def test_unconfirmed_margin_never_passes(good: Judgement) -> None:
    broken = changed(good, margins=replace(good.margins, confirmed=False))
    verdicts = judge(
        broken, {"phase_margin_deg": 0.0, "sensitivity_peak_max": 99, "h2_loss_max": 1}
    )
    assert [v.passed for v in verdicts] == [True, False, False, True]


def test_gain_margin_is_the_smaller_of_rise_and_fall(good: Judgement) -> None:
    margins = replace(
        good.margins, gain_db=Crossing(9.0, 1.0), gain_reduction_db=Crossing(4.0, 2.0)
    )
    asked = {"gain_margin_db": 6.0, "gain_margin_up_db": 6.0, "gain_margin_down_db": 6.0}
    _, one, up, down = judge(changed(good, margins=margins), asked)
    assert (one.value, one.frequency_hz, one.passed) == (4.0, 2.0, False)
    assert (up.value, up.frequency_hz, up.passed) == (9.0, 1.0, True)
    assert (down.value, down.frequency_hz, down.passed) == (4.0, 2.0, False)


@pytest.mark.parametrize("name", ["gain_margin_db", "phase_margin_deg", "delay_margin_s"])
def test_infinite_margin_is_explained(good: Judgement, name: str) -> None:
    none = Crossing(math.inf, None)
    margins = replace(
        good.margins, delay_s=none, phase_deg=none, gain_db=none, gain_reduction_db=none
    )
    verdict = judge(changed(good, margins=margins), {name: 1.0})[-1]
    assert verdict.passed
    assert verdict.slack == math.inf
    assert "unstable" in verdict.note
    told = replace(none, note="|L| is below one at all frequencies")
    margins = replace(margins, delay_s=told, phase_deg=told)
    verdict = judge(changed(good, margins=margins), {"delay_margin_s": 1.0})[-1]
    assert verdict.note == told.note


def test_a_slew_that_does_not_settle_is_explained_and_fails(good: Judgement) -> None:
    verdict = judge(with_slew(good, settling_time_s=math.inf), {"settling_time_max": 1e9})[-1]
    note = "the tip is not seen to stay within 2 %, for ever or until slew.horizon_s"
    assert (verdict.passed, verdict.note) == (False, note)


@pytest.mark.parametrize("side", ["gain_db", "gain_reduction_db"])
def test_a_gain_margin_of_nan_is_not_hidden_by_the_other_side(good: Judgement, side: str) -> None:
    margins = replace(good.margins, **{side: Crossing(math.nan, None)})
    assert not judge(changed(good, margins=margins), {"gain_margin_db": 0.0})[-1].passed


def test_slack_is_relative_and_signed(good: Judgement) -> None:
    margins = replace(good.margins, modulus=Crossing(0.6, 1.0, "mode 1 (1 Hz)"))
    twin = changed(good, margins=margins)
    verdicts = [judge(twin, {"modulus_margin": x})[-1] for x in (0.5, 0.8, 0.0)]
    assert [v.slack for v in verdicts] == pytest.approx([0.2, -0.25, math.inf])
    assert verdicts[0].mode == "mode 1 (1 Hz)"
    for verdict in verdicts:
        assert verdict.passed == (verdict.slack >= 0)
    nothing = replace(verdicts[0], value=None), replace(verdicts[0], value=math.nan)
    assert [v.slack for v in nothing] == [-math.inf, -math.inf]


def test_all_margins_and_what_is_required_are_recorded(
    good: Judgement, unstable: Judgement
) -> None:
    found = measure(good, ["stable", "torque_peak_max"])
    assert list(found) == [*RECORDED, "torque_peak"]
    for name, reading in found.items():
        assert reading.value in {read(good, name).value, read(good.finer, name).value}
    assert measure(unstable, ["torque_peak_max"]) == {}
    doubtful = changed(good, margins=replace(good.margins, confirmed=False))
    assert all(math.isnan(measure(doubtful, [])[name].value) for name in RECORDED)


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
    good: Judgement, limits: dict[str, float | bool], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        judge(good, limits)
    assert words in str(caught.value)
    assert "requirements" in str(caught.value)
