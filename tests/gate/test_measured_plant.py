"""Controllers of design files on a measured response: what holds, what is undecided, what is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import slewctl as sc
from slewctl.check import NOMINAL
from slewctl.check.measured import MEASURED, READ, judge_measured
from slewctl.check.result import DesignResult, Finding
from slewctl.compare import evaluate
from slewctl.files import read_design
from slewctl.files.measured_file import read_measured
from slewctl.gate import check_file, examine, verdicts
from slewctl.measured.response_data import rig_response
from slewctl.measured.rig_model import Channel, Modes, integrations
from slewctl.measured.rig_parameters import Rig

T, LATE = 0.01, 0.004
ARM = sc.Arm(
    sc.Beam(0.6, 0.4, 0.5),
    sc.Hub(0.01, friction=0.01),
    damping_ratio=0.02,
    actuator=sc.Actuator(delay=LATE),
)
DESIGN = f"""\
[arm]
damping_ratio = 0.02
beam = {{ length = 0.6, mass_per_length = 0.4, bending_stiffness = 0.5 }}
hub = {{ inertia = 0.01, friction = 0.01 }}
actuator = {{ delay = {LATE} }}

[truth]
modes = 8

[controller]
method = "given"
pid = {{ kp = 0.3, kd = 0.1, filter_hz = 20.0 }}
inputs = ["theta"]
output = "torque"
sample_time = {T}
discretise = "tustin"

[measured]
file = "rig.csv"
sample_time = {T}

[requirements]
modulus_margin = 0.6
gain_margin_db = 3.0
disk_margin = 0.5
"""


@pytest.fixture
def design(tmp_path: Path) -> Path:
    """Return a design file beside the exact response of its own arm, with a small deviation."""
    hz = np.linspace(0.1, 49.0, 490)
    values = rig_response(
        Rig(ARM, delay=LATE), Channel("torque", "theta", T), Modes(12), 2 * np.pi * hz
    )
    rows = [f"{f},{v.real:.9e},{v.imag:.9e},1e-3" for f, v in zip(hz, values, strict=True)]
    text = "\n".join(["frequency_hz,real,imag,deviation", *rows])
    (tmp_path / "rig.csv").write_text(text, encoding="utf-8")
    path = tmp_path / "rig.toml"
    path.write_text(DESIGN, encoding="utf-8")
    return path


def on(result: DesignResult, arm: str) -> dict[str, Finding]:
    return {found.verdict.requirement: found for found in result.findings if found.arm == arm}


def changed(path: Path, old: str, new: str) -> Path:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_the_exact_response_of_an_arm_is_judged_as_the_arm(design: Path) -> None:
    result = check_file(design)
    assert result.status == "passed", result.error
    arm, rig = on(result, NOMINAL), on(result, MEASURED)
    assert rig.keys() == arm.keys() - {"disk_margin"}
    for name in ("modulus_margin", "gain_margin_db"):
        value = arm[name].verdict.value
        assert rig[name].verdict.value == pytest.approx(value, rel=0.01)
        assert rig[name].line == arm[name].line
        low, high = rig[name].verdict.note.removeprefix("measured: ").split(" to ")
        assert float(low) <= value <= float(high)
    assert result.recorded[MEASURED]["modulus_margin"].value == pytest.approx(
        result.recorded[NOMINAL]["modulus_margin"].value, rel=0.01
    )
    assert "no response tells disk_margin" in result.notes[-1]
    assert "1 pole of the plant at zero" in result.notes[0]


def test_what_the_interval_leaves_open_fails_and_says_so(design: Path) -> None:
    found = on(check_file(design), MEASURED)["modulus_margin"].verdict
    low = float(found.note.removeprefix("measured: ").split(" to ")[0])
    assert low < found.value  # type: ignore[operator]
    between = (low + found.value) / 2  # type: ignore[operator]
    own = f"[measured.requirements]\nmodulus_margin = {between}\n\n[requirements]"
    result = check_file(changed(design, "[requirements]", own))
    assert all(finding.verdict.passed for finding in on(result, NOMINAL).values())
    open_ = on(result, MEASURED)["modulus_margin"]
    assert not open_.verdict.passed
    assert open_.verdict.note.startswith("undecided, measured: ")
    text = design.read_text(encoding="utf-8").splitlines()
    assert open_.line is not None
    assert text[open_.line - 1].startswith("modulus_margin = ")
    assert result.status == "failed"


def test_an_unstable_loop_passes_nothing(design: Path) -> None:
    for gains, told in (
        ("kp = 3.0, kd = 0.0", "measured: NOT stable"),
        ("kp = 30.0, kd = 10.0", "measured: stability not decided; |L| is 1.5 at the last point"),
    ):
        design.write_text(DESIGN.replace("kp = 0.3, kd = 0.1", gains), encoding="utf-8")
        result = check_file(design)
        assert len(on(result, MEASURED)) == 3
        for arm in (NOMINAL, MEASURED):
            assert not any(finding.verdict.passed for finding in on(result, arm).values())
        for finding in on(result, MEASURED).values():
            assert finding.verdict.note.startswith(told)
        assert result.recorded[MEASURED] == {}


def test_the_response_is_part_of_the_design(design: Path) -> None:
    before = check_file(design)
    changed(design.with_name("rig.csv"), "1e-3", "2e-3")
    after = check_file(design)
    assert before.fingerprint != after.fingerprint
    assert read_design(design).text != design.read_text(encoding="utf-8")


def test_what_is_wrong_is_told_in_one_line(design: Path) -> None:
    text = design.read_text(encoding="utf-8")
    for old, new, expected in (
        ("rig.csv", "gone.csv", "measured.file: .*gone.csv"),
        (
            "\n\n[requirements]",
            '\nsensor = "tip"\n\n[requirements]',
            "controller's sensor is theta",
        ),
        ("\n\n[requirements]", "\nfactor = -1.0\n\n[requirements]", "measured.factor"),
        (
            "\n\n[requirements]",
            '\ncolumns = { gain_db = "Mag" }\n\n[requirements]',
            "measured.file: .*Mag",
        ),
        (
            "\n\n[requirements]",
            "\n[measured.requirements]\ndisk_margin = 0.5\n\n[requirements]",
            "measured.requirements.disk_margin",
        ),
        (
            f'"rig.csv"\nsample_time = {T}',
            '"rig.csv"\nsample_time = 0.002',
            "the response has the clock",
        ),
        (
            "\n\n[requirements]",
            "\n\n[variations.measured]\nhub_inertia = 0.02\n\n[requirements]",
            "called 'measured' too",
        ),
    ):
        assert old in text
        design.write_text(text.replace(old, new), encoding="utf-8")
        result = check_file(design)
        assert result.status == "broken", new
        (told,) = [fault for fault, _ in result.faults]
        assert re.search(expected, told), told
    both = sc.Objective({"theta": 1.0, "torque": 1.0}, {"torque": 1.0, "theta": 1.0, "tip": 1.0})
    with pytest.raises(sc.InputError, match="reads theta, tip, a response is of one signal"):
        read_measured({"file": "rig.csv"}, design, ARM, both, {}, ())


def test_what_is_wrong_with_the_controller_hides_nothing_of_the_response(design: Path) -> None:
    text = design.read_text(encoding="utf-8")
    wrong = text.replace('inputs = ["theta"]', 'inputs = ["thta"]').replace("rig.csv", "gone.csv")
    design.write_text(wrong, encoding="utf-8")
    told = [fault for fault, _ in check_file(design).faults]
    assert ["controller.inputs" in told[0], "measured.file" in told[1]] == [True, True]
    assert len(told) == 2


def test_poles_at_zero_are_those_of_the_signal() -> None:
    free = sc.Arm(ARM.beam, sc.Hub(0.01), damping_ratio=0.02)
    driven = sc.Arm(ARM.beam, sc.Hub(0.01), damping_ratio=0.02, motor=sc.Motor(2.6, 0.5, 0.5))
    for arm, actuator, sensor, order in (
        (free, "torque", "theta", 2),
        (free, "torque", "theta_dot", 1),
        (ARM, "torque", "theta", 1),
        (ARM, "torque", "theta_dot", 0),
        (ARM, "torque", "tip", 1),
        (ARM, "torque", "root_moment", 0),
        (driven, "voltage", "theta", 1),
    ):
        assert integrations(arm, actuator, sensor) == order, (actuator, sensor)


def test_every_margin_of_a_response_is_read_for_the_requirement_it_answers() -> None:
    hz = np.geomspace(0.01, 10, 300)
    s = 2j * np.pi * hz
    margins = sc.measured_margins(sc.Response(hz, 1 / (s * (s + 1) ** 2)), 1.0)
    # L(jω) = -1 at ω = 1 with a gain of 2; |L| = 1 at 0.6823 with 21.39°; S peaks at 1 / 0.3483.
    exact = {
        "gain_margin_db": 6.0206,
        "gain_margin_up_db": 6.0206,
        "gain_margin_down_db": np.inf,
        "phase_margin_deg": 21.386,
        "delay_margin_s": np.deg2rad(21.386) / 0.6823,
    }
    for name, value in exact.items():
        assert READ[name](margins).value == pytest.approx(value, rel=1e-3), name
    peak = READ["sensitivity_peak_max"](margins)
    assert peak.value == pytest.approx(1 / margins.modulus.value)
    assert peak.low <= peak.value <= peak.high
    in_db = READ["sensitivity_peak_db_max"](margins)
    assert in_db.high == pytest.approx(20 * np.log10(peak.high))
    limit = peak.high * 1.001
    judged = judge_measured(margins, {"sensitivity_peak_max": limit})
    assert [verdict.passed for verdict in judged] == [True, True]
    assert not judge_measured(margins, {"sensitivity_peak_max": peak.value})[1].passed


@pytest.mark.slow
def test_a_page_tells_the_verdicts_that_the_gate_gives(tmp_path: Path) -> None:
    """On the arm, its variations and the rig: what was judged once is not judged otherwise."""
    rigs = Path(__file__).parents[2] / "designs/rigs"
    for name in ("servo-with-ruler.toml", "servo-with-ruler.csv"):
        text = (rigs / name).read_text()
        # Two of its ten variations are enough.
        (tmp_path / name).write_text(text.partition("[variations.fit-2-minus]")[0])
    design = read_design(tmp_path / "servo-with-ruler.toml")
    found = verdicts(design, evaluate(design.case).judgement)
    assert found == examine(design).findings
    assert {finding.arm for finding in found} >= {"nominal", "fit-1-plus", "measured"}
