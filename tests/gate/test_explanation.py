"""What limits a design, and that the change which is advised does what is said of it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from slewctl.check import DesignResult
from slewctl.compare import evaluate
from slewctl.compare.comparison import loop_curves
from slewctl.files import DesignFile, read_design
from slewctl.gate import examine, explain, small_changes

DESIGN = """
arm = {{ catalogue = "paper-beam", hub.inertia = 0.2, damping_ratio = 0.01 }}
model = {{ basis = "clamped-free", n = 1 }}
truth = {{ modes = 6 }}
requirements = {{ gain_margin_db = 3.0, phase_margin_deg = 40.0 }}
[controller]
method = "lqg"
limits = {{ tip = 0.03, torque = {torque} }}
noise = {{ torque = 0.1, theta = {theta} }}
[variations.heavy]
payload_mass = 0.05
"""
GIVEN = """
arm = { catalogue = "paper-beam", hub.inertia = 0.2, damping_ratio = 0.01 }
truth = { modes = 6 }
requirements = { disk_margin = 0.9 }
[controller]
method = "given"
inputs = ["theta"]
output = "torque"
"""
PID = "pid = { kp = 1.0, kd = 1.0, filter_hz = 20.0 }\n"


def written(folder: Path, text: str) -> DesignFile:
    path = folder / "arm.toml"
    path.write_text(text)
    return read_design(path)


def room(result: DesignResult) -> float:
    """Return the least relative room of any margin, on any arm."""
    rooms = []
    for finding in result.findings:
        verdict = finding.verdict
        if not verdict.passed and verdict.requirement == "stable":
            return -math.inf
        if verdict.requirement != "stable" and verdict.value is not None:
            rooms.append(verdict.value / verdict.limit - 1)
    return min(rooms)


@pytest.mark.slow
def test_the_advice_is_the_change_that_leaves_the_most_room(tmp_path: Path) -> None:
    design = written(tmp_path, DESIGN.format(torque=1.0, theta=0.01))
    found = explain(design)
    judged = {
        change.words: room(examine(replace(design, case=change.case)))
        for change in small_changes(design.case)
    }
    told = {trial.change.words: trial.room for trial in found.trials}
    assert {words: told[words] for words in judged} == pytest.approx(judged)
    rooms = [trial.room for trial in found.trials]
    assert rooms == sorted(rooms, reverse=True)
    assert any(found.trials[0].change.words in sentence for sentence in found.sentences)
    assert found.tightest.verdict.slack == pytest.approx(room(examine(design)))
    assert len(found.sentences) <= 10


@pytest.mark.slow
def test_a_design_that_is_lost_is_told_its_mode_and_to_slow_down(tmp_path: Path) -> None:
    beyond = DESIGN.format(torque=10.0, theta=1e-4).replace("theta =", "tip =")
    design = written(tmp_path, beyond)
    found = explain(design)
    assert found.tightest.verdict.requirement == "stable"
    (unstable,) = [s for s in found.sentences if s.startswith("On its own arm")]
    assert "(neglected)" in unstable
    helps = found.trials[0]
    assert "controller.limits.torque" in helps.change.words
    again = examine(replace(design, case=helps.change.case))
    assert all(f.verdict.passed for f in again.findings if f.verdict.requirement == "stable")


def test_what_is_asked_of_stability_alone_is_held_to_a_disk_margin(tmp_path: Path) -> None:
    text = GIVEN.replace("requirements = { disk_margin = 0.9 }", "") + PID
    found = explain(written(tmp_path, text))
    assert found.tightest.verdict.requirement == "disk_margin"
    assert "0.7 times the gains" in " ".join(found.sentences)


def test_gains_are_changed_and_nothing_else_of_a_given_law(tmp_path: Path) -> None:
    design = written(tmp_path, GIVEN + PID)
    slower, faster = small_changes(design.case)
    assert slower.case.options["pid"] == pytest.approx({"kp": 0.7, "kd": 0.7, "filter_hz": 20})
    assert faster.case.options["pid"] == pytest.approx({"kp": 1.4, "kd": 1.4, "filter_hz": 20})


def test_a_clock_is_shortened_where_the_law_may_be_made_again(tmp_path: Path) -> None:
    clock = "sample_time = 0.01\ndelay = 0.004\n"
    made = written(tmp_path, GIVEN + PID + clock + 'discretise = "tustin"\n')
    words = [change.words for change in small_changes(made.case)]
    assert words[2:] == ["controller.sample_time = 0.005", "controller.delay = 0.002"]
    law = "num = [1.0, -0.9]\nden = [1.0, -0.5]\nfeedback = 'negative'\n"
    as_it_is = written(tmp_path, GIVEN + law + clock)
    assert [c.words for c in small_changes(as_it_is.case)] == ["controller.delay = 0.002"]


def test_a_law_that_nothing_is_known_of_is_left_alone(tmp_path: Path) -> None:
    law = "num = [1.0, 1.0]\nden = [0.01, 1.0]\nfeedback = 'negative'\n"
    design = written(tmp_path, GIVEN + law)
    assert not small_changes(design.case)
    assert "nothing here that could be changed" in explain(design).sentences[-1]


def test_no_model_is_larger_than_the_truth_or_the_data_of_an_arm(tmp_path: Path) -> None:
    text = """
[arm]
catalogue = "two-wing-satellite"
damping_ratio = 0.005
[model]
basis = "modal"
n = 3
[controller]
method = "lqg"
limits = { tip = 0.45, torque = 13 }
noise = { torque = 0.26, theta = 0.00025, theta_dot = 0.00014 }
"""
    words = [change.words for change in small_changes(written(tmp_path, text).case)]
    assert words == ["controller.limits.torque = 9.1", "controller.limits.torque = 18.2"]


UNDAMPED = """
arm = { name = "undamped", beam = { length = 1.0, mass_per_length = 0.5, bending_stiffness = 5.0 },
        hub = { inertia = 0.02, friction = 0.05 } }
model = { basis = "arm-matched", n = 2 }
compare = { bases = ["arm-matched"], orders = [2] }
requirements = { gain_margin_db = 3.0, phase_margin_deg = 20.0 }
[controller]
method = "lqg"
limits = { tip = 0.02, torque = 0.3 }
noise = { torque = 0.01, theta = 5e-4 }
"""


def test_what_the_gate_judges_is_explained_and_compared_though_its_slew_is_not_known(
    tmp_path: Path,
) -> None:
    """Modes that last for years cannot be told apart to rounding; no slew was asked for."""
    design = written(tmp_path, UNDAMPED.replace(",\n        hub", ", hub"))
    found = explain(design)
    assert found.sentences[0] == "arm: lqg on arm-matched, n = 2, keeps all 3 of its requirements."
    compared = evaluate(design.case)
    assert compared.judgement.moved is None
    assert loop_curves(compared).slew is None


def test_the_delay_that_a_loop_stands_is_told_with_where_it_is_lost(tmp_path: Path) -> None:
    """A heavy payload on a fast law: nearest to -1 at 0.07 Hz, and the delay counts at 100 Hz."""
    design = written(
        tmp_path,
        """
arm = { name = "heavy", beam = { length = 1.0, mass_per_length = 0.5, bending_stiffness = 5.0 }, \
hub = { inertia = 0.02, friction = 0.05 }, payload = { mass = 5.0, inertia = 0.1 }, \
damping_ratio = 1e-4 }
requirements = { phase_margin_deg = 5.0 }
controller = { method = "given", num = [0.5, 1.0], den = [0.01, 1.0], feedback = "negative" }
""".replace("\\\n", ""),
    )
    margins = evaluate(design.case).judgement.margins
    assert margins.delay_s.frequency_hz > 100 * margins.modulus.frequency_hz
    (told,) = (s for s in explain(design).sentences if "of delay beyond its own" in s)
    assert f"lost first at {margins.delay_s.frequency_hz:.4g} Hz" in told
    assert f"{1e3 * margins.delay_s.value:.3g} ms" in told
