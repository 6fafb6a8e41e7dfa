"""Design files: what is read, and that every refusal names file, key and remedy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slewctl import InputError, Stations, arms
from slewctl.files import find_designs, read_arm, read_design

DESIGNS = Path(__file__).parents[2] / "designs"

GOOD = """
title = "t"
[arm]
catalogue = "paper-beam"
damping_ratio = 0.01
hub = { inertia = 0.5 }
[model]
basis = "slewing"
n = 2
[controller]
method = "lqg"
limits = { tip = 0.1, torque = 1 }
noise = { torque = 0.1, theta = 1e-3 }
[slew]
angle_deg = 30
duration_s = 2
[requirements]
stable = true
gain_margin_db = 6
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "design.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_catalogue_arm_is_changed_where_given(tmp_path: Path) -> None:
    design = read_design(written(tmp_path, GOOD))
    arm = design.case.arm
    assert arm.beam == arms.paper_beam().beam
    assert (arm.hub.inertia, arm.hub.radius, arm.damping_ratio) == (0.5, 0.0, 0.01)
    assert (design.case.basis, design.case.n, design.case.name) == ("slewing", 2, "design")
    assert design.case.objective.sensors == ("theta",)
    assert design.requirements == {"stable": True, "gain_margin_db": 6.0}


def test_full_description_with_stations_and_coefficients(tmp_path: Path) -> None:
    beam = """
[arm.beam]
length = 2.0
mass_per_length = { x = [0, 1, 1, 2], values = [3, 3, 2, 1] }
bending_stiffness = [5, -1.5]
"""
    text = GOOD.replace('catalogue = "paper-beam"', 'name = "boom"').replace(
        "[model]", beam + "[model]"
    )
    arm = read_design(written(tmp_path, text)).case.arm
    assert arm.name == "boom"
    assert arm.beam.mass_per_length == Stations([0, 1, 1, 2], [3, 3, 2, 1])
    assert arm.beam.breakpoints == (0.5,)
    np.testing.assert_allclose(arm.beam.stiffness_profile(np.array([0.0, 1.0])), [5.0, 3.5])


REFUSALS = [
    ("n = 2", "n = 2\norder = 3", "model.order: unknown key"),
    ("hub = { inertia = 0.5 }", "hub = { inerta = 0.5 }", "arm.hub.inerta: unknown key; did you mean 'inertia'"),
    ("inertia = 0.5", "inertia = -0.5", "arm.hub.inertia: -0.5 is not allowed"),
    ("inertia = 0.5", "inertia = nan", "arm.hub.inertia: nan is not allowed"),
    ("inertia = 0.5", 'inertia = "0.5"', "arm.hub.inertia: '0.5' is not allowed"),
    ("n = 2", "n = 0", "model.n: 0 is not allowed; give greater than or equal to 1"),
    ("n = 2", "n = 2.5", "model.n: 2.5 is not allowed"),
    ("n = 2", "n = true", "model.n: True is not allowed"),
    ('basis = "slewing"', 'basis = "slew"', "model.basis: unknown name 'slew'; did you mean 'slewing'"),
    ('method = "lqg"', 'method = "magic"', "controller.method: unknown name 'magic'; known: lqg"),
    ("torque = 1 }", "torqe = 1 }", "controller.limits: no value for torque; add limits.torque"),
    ("tip = 0.1", "tipp = 0.1", "limits: unknown name 'tipp'; did you mean 'tip'"),
    ("tip = 0.1", "tip = 0", "controller.limits.tip: 0 is not allowed"),
    ("theta = 1e-3", "tip_dott = 1e-3", "noise: unknown name 'tip_dott'; did you mean 'tip_dot'"),
    ("gain_margin_db", "gain_margin", "requirements: unknown name 'gain_margin'"),
    ("gain_margin_db = 6", 'gain_margin_db = "6"', "requirements.gain_margin_db"),
    ("stable = true", "stable = false", "requirements.stable: False cannot be required"),
    ("[slew]\nangle_deg = 30\nduration_s = 2\n", "", "slew: missing; add it"),
    ("duration_s = 2", "duration_s = 0", "slew.duration_s: 0 is not allowed"),
    ("angle_deg = 30", "angle_deg = 0", "slew.angle_deg"),
    ('catalogue = "paper-beam"', "", "arm: give either catalogue or beam; catalogue arms: paper-beam"),
    ('"paper-beam"', '"paper_beam"', "did you mean 'paper-beam'"),
    ("[requirements]", "[truth]\nmodes = 3\n[requirements]", "truth.modes: a truth of 3 modes cannot judge"),
    ("[model]", "[model", "not valid TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), REFUSALS, ids=[words for _, _, words in REFUSALS])
def test_refusals_name_file_key_and_remedy(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_design(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert words in message
    assert "\n" not in message


BEAMS = [
    ("mass_per_length = -1.0", "arm.beam.mass_per_length: -1 is not positive" ),
    ("mass_per_length = [1.0, -2.0]", "beam.mass_per_length: falls to -1 on the beam"),
    ("mass_per_length = []", "beam.mass_per_length: no coefficients"),
    ('mass_per_length = ["a"]', "beam.mass_per_length: 'a' is not a finite number"),
    ("mass_per_length = { x = [0, 2], values = [1, 1] }", "stations run from 0 to 2 m"),
    ("mass_per_length = { x = [0, 1] }", "give { x = [...], values = [...] }"),
    ("mass_per_length = { x = [0, 1], values = [1] }", "2 stations with 1 values"),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "words"), BEAMS, ids=[words for _, words in BEAMS])
def test_impossible_beams_are_refused(tmp_path: Path, profile: str, words: str) -> None:
    text = f"[arm.beam]\nlength = 1.0\n{profile}\nbending_stiffness = 1.0\n"
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_arm(path)
    if "-1 is not positive" in words:
        words = "falls to -1"
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file or folder"):
        find_designs([tmp_path / "nothing"])
    with pytest.raises(InputError, match=r"no \.toml file"):
        find_designs([tmp_path])
    with pytest.raises(InputError, match="cannot be read"):
        read_design(tmp_path / "nothing.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        read_design(tmp_path / "bytes.toml")
    (tmp_path / "empty.toml").write_text("")
    with pytest.raises(InputError, match=r"arm: missing"):
        read_design(tmp_path / "empty.toml")
    with pytest.raises(InputError, match=r"no \[arm\] table"):
        read_arm(tmp_path / "empty.toml")


def test_find_designs_sorts_and_names_each_once() -> None:
    found = find_designs([DESIGNS, DESIGNS / "01-paper-beam.toml"])
    assert list(found) == sorted(DESIGNS.glob("*.toml"))


@pytest.mark.parametrize("path", sorted(DESIGNS.glob("*.toml")), ids=lambda p: p.stem)
def test_every_design_file_reads(path: Path) -> None:
    design = read_design(path)
    assert design.case.title
    assert design.requirements
