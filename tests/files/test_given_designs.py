"""Design files with a controller that was made elsewhere."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import slewctl as sc
from slewctl.compare import Judge, compare, evaluate
from slewctl.errors import InputError
from slewctl.files import read_design
from slewctl.gate import check_file

ARM = '[arm]\ncatalogue = "quanser-flexible-link"\ndamping_ratio = 0.01\n'
PID = 'method = "given"\npid = { kp = 14.0, kd = 0.6, filter_hz = 40.0 }\noutput = "voltage"\n'
WEIGHTS = "limits = { tip = 0.03, voltage = 8.0 }\nnoise = { torque = 0.01, theta = 0.001 }\n"


def write(folder: Path, controller: str, rest: str = "") -> Path:
    path = folder / "design.toml"
    path.write_text(f"{ARM}[controller]\n{controller}{rest}")
    return path


def law(folder: Path, **values: object) -> Path:
    path = folder / "law.json"
    data = {"num": [106.61, -95.804], "den": [1.0, -0.22826], "feedback": "negative",
            "sample_time": 0.005, **values}  # fmt: skip
    path.write_text(json.dumps(data))
    return path


def test_a_given_law_needs_no_model_and_no_weights(tmp_path: Path) -> None:
    design = read_design(write(tmp_path, PID, "[requirements]\nphase_margin_deg = 30.0\n"))
    judged = Judge(design.case).evaluate(*Judge(design.case).chosen).judgement
    problem = sc.Problem(design.case.arm, limits={"tip": 1.0, "voltage": 1.0},
                         noise={"torque": 1.0, "theta": 1.0})  # fmt: skip
    K = sc.given(pid={"kp": 14.0, "kd": 0.6, "filter_hz": 40.0}, output="voltage")
    phase = problem.judge(K).margins.phase_deg.value
    assert judged.margins.phase_deg.value == pytest.approx(phase, rel=1e-9)


def test_what_weights_say_is_not_read_without_them(tmp_path: Path) -> None:
    path = write(tmp_path, PID, "[requirements]\nh2_loss_max = 0.1\n")
    with pytest.raises(InputError, match=r"requirements\.h2_loss_max: no limits and noise"):
        read_design(path)


def test_with_weights_a_law_is_compared_with_the_optimum(tmp_path: Path) -> None:
    law(tmp_path, delay=0.005)
    path = write(tmp_path, f'method = "given"\nfile = "law.json"\noutput = "voltage"\n{WEIGHTS}')
    found = compare([read_design(path).case]).cases[0]
    assert found.chosen.stable
    assert found.chosen.loss is not None
    assert found.chosen.loss > 0
    assert len(found.evaluations) == 1


def test_the_content_of_the_file_is_part_of_the_fingerprint(tmp_path: Path) -> None:
    path = write(tmp_path, 'method = "given"\nfile = "law.json"\noutput = "voltage"\n')
    law(tmp_path)
    one = check_file(path)
    again = check_file(path)
    law(tmp_path, num=[106.62, -95.804])
    other = check_file(path)
    assert not one.error
    assert (one.fingerprint, one.digest) == (again.fingerprint, again.digest)
    assert one.fingerprint != other.fingerprint
    assert one.digest != other.digest


REFUSED = [
    ('method = "given"\nfile = "none.json"\n', "controller.file: ", "there is no such file"),
    ('method = "given"\nfile = 3\n', "design.toml:6: controller.file", "it is no path"),
    ('method = "given"\npid = { kp = 1.0, kd = 1.0 }\n', "design.toml:6: controller.pid",
     "the derivative needs filter_hz"),
    ('method = "given"\npid = { kp = 1.0 }\ninputs = ["moment@900mm"]\n', "controller.inputs",
     "beyond the tip"),
    ('method = "given"\npid = { kp = 1.0 }\ninputs = ["theata"]\n', "controller.inputs",
     "did you mean 'theta'?"),
    ('method = "given"\npid = { kp = 1.0 }\nlimits = { tip = 1.0, torque = 1.0 }\n',
     "controller.noise", "missing"),
    ('method = "given"\npid = { kp = 1.0 }\ninputs = ["tip"]\noutput = "voltage"\n' + WEIGHTS,
     "controller.inputs", "add the noise of tip"),
    ('method = "given"\npid = { kp = 1.0 }\noutput = "torque"\n' + WEIGHTS, "controller.output",
     "commands 'torque'"),
    ('method = "given"\npid = { kp = 1.0 }\n', "design.toml:4: controller.output",
     'missing: the arm has a motor, and the law may command the torque or the voltage; give "torque"'),
    ('method = "given"\npidd = { kp = 1.0 }\n', "controller.pidd", "did you mean 'pid'?"),
    ('method = "given"\n', "controller.pid", "give a control law"),
    ('method = "lqg"\n', "", "missing"),
]  # fmt: skip


@pytest.mark.parametrize(("controller", "place", "told"), REFUSED)
def test_a_wrong_law_is_told_at_its_place(
    tmp_path: Path, controller: str, place: str, told: str
) -> None:
    with pytest.raises(InputError) as refused:
        read_design(write(tmp_path, controller))
    assert place in str(refused.value)
    assert told in str(refused.value)


def test_a_file_that_lacks_a_part_is_told_with_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "law.json").write_text('{"num": [1.0], "kept": 3}')
    with pytest.raises(InputError, match="den is missing in it: it holds num, kept"):
        read_design(write(tmp_path, 'method = "given"\nfile = "law.json"\n'))


WRONG = """\
method = "given"
pid = { kp = "much", ki = 1.0, kd = 1.0, kx = 2.0 }
sections = [
    { notch_hz = -4.0, depth = 2.0 },
    { lowpass_hz = 60.0, order = 0, deep = 1 },
    { lead_hz = 1.0 },
]
inputs = ["theata", "moment@900mm"]
output = "volts"
feedback = "neg"
sample_time = 0.0
delay = -1.0
discretise = "euler"
prewarp_hz = "x"
[slew]
angle_deg = "far"
"""
FAULTS = {
    "pid.kp": 6, "pid.kx": 6, "pid.filter_hz": 6, "sections.0.notch_hz": 8, "sections.0.depth": 8,
    "sections.1.deep": 9, "sections.1.order": 9, "sections.2.lead_deg": 10, "output": 13,
    "feedback": 14, "sample_time": 15, "delay": 16, "discretise": 17, "prewarp_hz": 18,
}  # fmt: skip


def told(path: Path) -> list[tuple[str, int]]:
    """Return the keys that reading a design refuses, with their lines."""
    with pytest.raises(InputError) as caught:
        read_design(path)
    found = re.findall(rf"^{re.escape(str(path))}:(\d+): (\S+): ", str(caught.value), re.M)
    assert len(found) == len(str(caught.value).split("\n"))
    return [(key.removeprefix("controller."), int(line)) for line, key in found]


def test_all_that_is_wrong_with_a_law_is_told_at_once_each_on_its_line(tmp_path: Path) -> None:
    found = told(write(tmp_path, WRONG))
    assert sorted(found) == sorted(
        [*FAULTS.items(), ("inputs", 12), ("inputs", 12), ("slew.angle_deg", 20),
         ("slew.duration_s", 19)]
    )  # fmt: skip


def test_what_is_wrong_in_the_file_of_a_law_is_told_with_that_file(tmp_path: Path) -> None:
    law(tmp_path, num=["a"], den=[0.0], inputs=["thet"])
    path = write(tmp_path, 'method = "given"\ndelay = -1\nfile = "law.json"\n')
    with pytest.raises(InputError) as caught:
        read_design(path)
    lines = str(caught.value).split("\n")
    beside = f"{path}:7: controller.file: {tmp_path / 'law.json'}: "
    assert [line.startswith(beside) for line in lines] == [False, False, True, True]
    assert "controller.output: missing" in lines[0]
    assert f"{path}:6: controller.delay: -1 is negative" in lines[1]
    assert "'a'] is not a list of finite numbers" in lines[2]
    assert "did you mean 'theta'?" in lines[3]


def test_a_law_commands_what_leaves_no_doubt(tmp_path: Path) -> None:
    """What limits weigh, or the torque of an arm without a motor; a motor leaves a choice."""
    bare = 'method = "given"\npid = { kp = 1.0, filter_hz = 9.0 }\n'
    assert read_design(write(tmp_path, bare + WEIGHTS)).case.objective.actuator == "voltage"
    assert evaluate(read_design(tmp_path / "design.toml").case).stable
    no_motor = write(tmp_path, bare)
    no_motor.write_text(no_motor.read_text().replace("quanser-flexible-link", "paper-beam"))
    assert read_design(no_motor).case.objective.actuator == "torque"
    law(tmp_path, output="voltage")
    said = write(tmp_path, 'method = "given"\nfile = "law.json"\n')
    assert read_design(said).case.objective.actuator == "voltage"
