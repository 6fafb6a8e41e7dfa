"""All faults of a file are told in one run, each on a line with its place."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import pytest
from quick_design import QUICK

from slewctl import InputError
from slewctl.errors import FaultsError
from slewctl.files import read_arm, read_design, read_study

WRONG = """\
title = 3
[arm]
catalogue = "paper_beam"
damping_ratio = 1.5
hub = { inerta = 0.2 }
motor = { R = 2.6, torque_constant = 0.01, back_emf_constant = 0.01 }
[controller]
method = "lgq"
limits = { tipp = 0.03 }
noise = { torque = 0.1, theta = -1 }
[slew]
angle_deg = 0
duration_s = 2
[truth]
mode = 6
[requirements]
gain_margin = 6
disk_margin = -1
[variations.heavy]
payload_mas = 1
mass_factor = 0
[tests]
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "design.toml"
    path.write_text(text, encoding="utf-8")
    return path


def told(path: Path) -> dict[str, int]:
    """Return the keys that reading a design refuses, with their lines."""
    with pytest.raises(InputError) as caught:
        read_design(path)
    found = re.findall(rf"^{re.escape(str(path))}:(\d+): (\S+): ", str(caught.value), re.M)
    assert len(found) == len(str(caught.value).split("\n"))
    return {key: int(line) for line, key in found}


def test_every_fault_of_a_first_file_is_told_at_once(tmp_path: Path) -> None:
    faults = told(written(tmp_path, WRONG))
    assert faults == {
        "title": 1, "arm.catalogue": 3, "arm.damping_ratio": 4, "arm.hub.inerta": 5, "arm.motor.R": 6, "arm.motor.resistance": 6, "model": 1,
        "controller.method": 8, "controller.limits.tipp": 9, "controller.noise.theta": 10, "slew.angle_deg": 12, "truth.mode": 15,
        "requirements.gain_margin": 17, "requirements.disk_margin": 18, "variations.heavy.payload_mas": 20,
        "variations.heavy.mass_factor": 21, "tests": 22,
    }  # fmt: skip
    assert list(faults.values()) == sorted(faults.values())


def test_what_lies_behind_the_types_is_told_at_once_too(tmp_path: Path) -> None:
    text = WRONG.replace("inerta", "inertia").replace("R = 2.6", "resistance = 2.6")
    text = text.replace("theta = -1", "thetaa = 1").replace("mode = 6", "modes = 1")
    text += '[model]\nbasis = "clamped"\nn = 2\n[compare]\nbases = ["slew"]\n'
    faults = told(written(tmp_path, text))
    assert faults.keys() == {
        "title", "arm.catalogue", "arm.damping_ratio", "controller.method", "controller.limits.tipp",
        "controller.noise.thetaa", "slew.angle_deg", "truth.modes", "requirements.gain_margin",
        "requirements.disk_margin", "variations.heavy.payload_mas",
        "variations.heavy.mass_factor", "tests", "model.basis", "compare.bases.0",
    }  # fmt: skip


def test_every_unknown_option_and_signal_is_told(tmp_path: Path) -> None:
    text = QUICK.replace('"lqg"', '"lqg"\nspeed = 1\nweights = 2').replace(
        "tip = 0.03", "tipp = 0.03, thet = 1"
    )
    path = written(tmp_path, text)
    with pytest.raises(FaultsError) as caught:
        read_design(path)
    words = str(caught.value)
    assert [fault.where.rpartition(": ")[2] for fault in caught.value.faults] == [
        "controller.speed", "controller.weights", "controller.limits.tipp", "controller.limits.thet",
    ]  # fmt: skip
    assert "'tipp'; did you mean 'tip'?" in words
    assert "'thet'; did you mean 'theta'?" in words


SPELT = [
    "[requirements]\ndisk_margin = 0.1\nzz = 1",
    '[requirements]\ndisk_margin = 0.1\n"z.z" = 1',
    "requirements.disk_margin = 0.1\nrequirements.zz = 1\n",
    "[variations.a]\nmass_factor = 2\nrequirements.zz = 1",
    '[variations."a.b"]\nmass_factor = 2\n[variations."a.b".requirements]\nzz = 1',
    "[variations]\na = { mass_factor = 2, requirements = { disk_margin = 0.1, zz = 1 } }",
]


@pytest.mark.parametrize("spelt", SPELT)
def test_an_unknown_name_is_told_on_its_own_line(tmp_path: Path, spelt: str) -> None:
    """However the key is written, and whatever stands before and after it."""
    text = QUICK.partition("[requirements]")[0]
    text = spelt + "\n" + text if spelt.startswith("requirements.") else text + spelt + "\n"
    line = 1 + next(k for k, row in enumerate(text.split("\n")) if "zz" in row or "z.z" in row)
    (place,) = told(written(tmp_path, text)).items()
    assert place[0].endswith(("zz", "z.z"))
    assert place[1] == line


def test_limits_on_lines_of_their_own_are_told_there(tmp_path: Path) -> None:
    head, _, tail = QUICK.partition("limits = {")
    text = f"{head}limits.tipp = 1\nlimits.tip = 1\nlimits.torqe = 1\n{tail.partition(chr(10))[2]}"
    rows = text.split("\n")
    assert told(written(tmp_path, text)) == {
        "controller.limits.tipp": rows.index("limits.tipp = 1") + 1,
        "controller.limits.torqe": rows.index("limits.torqe = 1") + 1,
    }


def test_an_arm_and_a_study_tell_all_faults_too(tmp_path: Path) -> None:
    path = written(tmp_path, '[arm]\ncatalogue = "x"\nhubb = 1\npayload = { mass = -1 }\n')
    with pytest.raises(FaultsError) as arm:
        read_arm(path)
    assert [line.partition(": ")[0] for line in str(arm.value).split("\n")] == [
        f"{path}:3", f"{path}:4",
    ]  # fmt: skip
    path.write_text('[arm]\ncatalogue = "paper-beam"\n[[grid]]\norder = 1\nbases = 3\n')
    with pytest.raises(FaultsError) as study:
        read_study(path)
    assert len(str(study.value).split("\n")) == 2


@pytest.mark.slow
def test_many_faults_are_counted(tmp_path: Path) -> None:
    path = written(tmp_path, QUICK + "\n".join(f"r{k} = 1" for k in range(1900)))
    with pytest.raises(FaultsError) as caught:
        read_design(path)
    *first, last = str(caught.value).split("\n")
    assert len(first) == 20
    assert last == "and 1880 more faults"
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_stations_are_refused_at_their_own_key(tmp_path: Path) -> None:
    beam = """\
[arm.beam]
length = 1.0
mass_per_length = { x = [0, 1], values = [1] }
bending_stiffness = { x = [1, 0], values = [1, 1] }
"""
    path = written(tmp_path, beam)
    with pytest.raises(FaultsError) as caught:
        read_arm(path)
    first, second = str(caught.value).split("\n")
    assert first.startswith(f"{path}:3: arm.beam.mass_per_length: 2 stations with 1 values")
    assert second.startswith(f"{path}:4: arm.beam.bending_stiffness.x.1: stations do not increase")


def test_a_slew_is_asked_for_only_where_something_is_required_of_it(tmp_path: Path) -> None:
    text = re.sub(r"\[slew\]\n.*\n.*\n", "", QUICK)
    assert read_design(written(tmp_path, text)).requirements == {"gain_margin_db": 6}
    settling = "settling_time_max = 3\n"
    assert told(written(tmp_path, text + settling)) == {"slew": 1}
    varied = f"[variations.heavy]\npayload_mass = 0.1\nrequirements.{settling}"
    assert told(written(tmp_path, text + varied)) == {"slew": 1}


def test_a_design_file_may_say_what_it_is_written_for(tmp_path: Path) -> None:
    assert read_design(written(tmp_path, 'schema = "slewctl-design/1"\n' + QUICK)).case.n == 2
    for schema in ('"slewctl-design/2"', "1"):
        with pytest.raises(InputError) as caught:
            read_design(written(tmp_path, f"schema = {schema}\n" + QUICK + "nonsense = 1\n"))
        assert ":1: schema: " in str(caught.value)
        assert "; it reads 'slewctl-design/1'" in str(caught.value)
        assert "nonsense" not in str(caught.value)
