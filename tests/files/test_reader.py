"""Design files: what is read, and that every refusal names file, key and remedy."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slewctl import InputError, Stations, arms
from slewctl.arm import KelvinVoigt, Motor, Rayleigh
from slewctl.files import find_designs, read_arm, read_design, read_designs

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


def test_keys_of_a_part_that_are_not_given_stay(tmp_path: Path) -> None:
    """One value of a hub or payload is changed; the others are those of the catalogue's arm."""
    spacecraft = arms.flexible_spacecraft()
    text = GOOD.replace("paper-beam", "flexible-spacecraft")
    text = text.replace("hub = { inertia = 0.5 }", "hub = { friction = 0.5 }\npayload.mass = 3.0")
    arm = read_design(written(tmp_path, text)).case.arm
    assert arm.hub == replace(spacecraft.hub, friction=0.5)
    assert arm.payload == replace(spacecraft.payload, mass=3.0)


@pytest.mark.parametrize("keys", ["", ", alpha = 0.0", ", alpha = 0.0, beta = 0.0"])
def test_a_damping_law_damps(tmp_path: Path, keys: str) -> None:
    law = f'damping = {{ kind = "rayleigh"{keys} }}'
    with pytest.raises(
        InputError, match=r"design.toml:\d+: arm.damping: damps nothing; give alpha"
    ):
        read_design(written(tmp_path, GOOD.replace("damping_ratio = 0.01", law)))


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
    ("n = 2", "n = 0", "model.n: 0 is not allowed; give a value greater than or equal to 1"),
    ("n = 2", "n = true", "model.n: True is not allowed"),
    ('basis = "slewing"', 'basis = "slew"', "model.basis: unknown name 'slew'; did you mean 'slewing'"),
    ('method = "lqg"', 'method = "magic"', "controller.method: unknown name 'magic'; known: "),
    ("torque = 1 }", "torqe = 1 }", "controller.limits.torqe: unknown name 'torqe'; did you mean 'torque'"),
    ("tip = 0.1", "tipp = 0.1", "limits.tipp: unknown name 'tipp'; did you mean 'tip'"),
    ("tip = 0.1", "tip = 0", "controller.limits.tip: 0 is not allowed"),
    ("theta = 1e-3", "tip_dott = 1e-3", "noise.tip_dott: unknown name 'tip_dott'; did you mean 'tip_dot'"),
    ("gain_margin_db", "gain_margin", "requirements.gain_margin: unknown name 'gain_margin'"),
    ("gain_margin_db = 6", 'gain_margin_db = "6"', "requirements.gain_margin_db"),
    ("stable = true", "stable = false", "requirements.stable: False cannot be required"),
    ("[slew]\nangle_deg = 30\nduration_s = 2\n[requirements]", "[requirements]\ntorque_peak_max = 1", "slew: missing; add it"),
    ("duration_s = 2", "duration_s = 0", "slew.duration_s: 0 is not allowed"),
    ("angle_deg = 30", "angle_deg = 0", "slew.angle_deg"),
    ('catalogue = "paper-beam"', "", "arm: give either catalogue or beam, or else modal_data or wings; catalogue arms: paper-beam"),
    ('"paper-beam"', '"paper_beam"', "did you mean 'paper-beam'"),
    ("[requirements]", "[truth]\nmodes = 3\n[requirements]", "truth.modes: a truth of 3 modes cannot judge"),
    ("[model]", "[model", "not valid TOML"),
    ("tip = 0.1", "tip = 0.1, moment@50mm = 1.0", 'a key with @ wants quotes, as in "moment@50mm" = 1.0'),
    ("tip = 0.1", '"deflection@0.5" = 0.1', "limits.deflection@0.5: 'deflection@0.5' names no station in whole millimetres"),
    ("theta = 1e-3", 'theta = 1e-3, "moment@1001mm" = 0.1', "controller.noise: moment@1001mm is beyond the tip of a beam of 1 m; give a station from 0mm to 1000mm"),
    ("torque = 1 }", "voltage = 1 }", "controller.limits.voltage: the arm has no motor; add [arm.motor]"),
    ("torque = 1 }", "torque = 1, voltage = 1 }", "controller.limits: values for both torque and voltage; keep the one"),
    ("damping_ratio = 0.01", "damping_ratio = 1.5", "arm.damping_ratio: 1.5 is not in [0, 1); give"),
    ("damping_ratio = 0.01", "damping_ratio = [0.01, -1]", "arm.damping_ratio.1: -1 is not in [0, 1); give"),
    ("damping_ratio = 0.01", "damping_ratio = []", "arm.damping_ratio: no ratio; give at least one"),
    ("damping_ratio = 0.01", 'damping_ratio = "a"', "arm.damping_ratio: 'a' is not a finite number; give a number"),
    ("hub =", "damping = { alpha = 1 }\nhub =", "arm.damping.kind: missing; add it, one of rayleigh, kelvin-voigt"),
    ("hub =", 'damping = { kind = "raleigh" }\nhub =', "arm.damping.kind: unknown name 'raleigh'; did you mean 'rayleigh'"),
    ("hub =", "damping = { kind = 3 }\nhub =", "arm.damping.kind: unknown name 3; known: drag, kelvin-voigt, rayleigh"),
    ("hub =", 'damping = { kind = "rayleigh", beta = -1 }\nhub =', "arm.damping.beta: -1 is not allowed; give a value greater than or equal to 0"),
    ("hub =", 'damping = { kind = "rayleigh", betta = 1 }\nhub =', "arm.damping.betta: unknown key; did you mean 'beta'"),
    ("hub =", 'damping = { kind = "rayleigh", retardation_time = 1 }\nhub =', "arm.damping.retardation_time: unknown key; known: alpha, beta, kind"),
    ("hub =", 'damping = { kind = "kelvin-voigt" }\nhub =', "arm.damping.retardation_time: missing; add it"),
    ("hub =", "damping = 0.01\nhub =", "arm.damping: 0.01 is not allowed; give a table"),
    ("hub =", "motor = { resistance = 2, back_emf_constant = 1 }\nhub =", "arm.motor.torque_constant: missing; add it"),
    ("hub =", "motor = { resistanze = 2, torque_constant = 1, back_emf_constant = 1, resistance = 1 }\nhub =", "arm.motor.resistanze: unknown key; did you mean 'resistance'"),
    ("hub =", "motor = { resistance = 0, torque_constant = 1, back_emf_constant = 1 }\nhub =", "arm.motor.resistance: 0 is not allowed; give a value greater than 0"),
    ("hub =", "motor = { resistance = 1, torque_constant = 1, back_emf_constant = 1, gear_efficiency = 1.1 }\nhub =", "arm.motor.gear_efficiency: 1.1 is not allowed; give a value less than or equal to 1"),
    ("hub =", 'motor = "maxon"\nhub =', "arm.motor: 'maxon' is not allowed; give a table"),
]  # fmt: skip

# What pydantic says of a wrong type, in this project's words.
TYPES = [
    ("hub = { inertia = 0.5 }", "hub = 0.5", "arm.hub: 0.5 is not allowed; give a table"),
    ("limits = { tip = 0.1, torque = 1 }", "limits = [1]", "controller.limits: [1] is not allowed; give a table"),
    ("inertia = 0.5", 'inertia = "0.5"', "arm.hub.inertia: '0.5' is not allowed; give a number"),
    ("inertia = 0.5", "inertia = true", "arm.hub.inertia: True is not allowed; give a number"),
    ("inertia = 0.5", "inertia = inf", "arm.hub.inertia: inf is not allowed; give a finite number"),
    ("n = 2", 'n = "2"', "model.n: '2' is not allowed; give a whole number"),
    ("n = 2", "n = 2.5", "model.n: 2.5 is not allowed; give a whole number"),
    ('basis = "slewing"', "basis = 3", "model.basis: 3 is not allowed; give text in quotes"),
    ('title = "t"', "title = 2026-01-01", "title: datetime.date(2026, 1, 1) is not allowed; give text in quotes"),
    ("[requirements]", "[compare]\norders = 3\n[requirements]", "compare.orders: 3 is not allowed; give a list"),
    ("[requirements]", '[compare]\norders = [1, "2"]\n[requirements]', "compare.orders.1: '2' is not allowed; give a whole number"),
    ("gain_margin_db = 6", "gain_margin_db = [6]", "requirements.gain_margin_db: [6] is not a finite number; give a number"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "words"),
    REFUSALS + TYPES,
    ids=[words for _, _, words in REFUSALS + TYPES],
)
def test_refusals_name_file_key_and_remedy(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_design(path)
    message = str(caught.value)
    assert re.match(rf"{re.escape(str(path))}(:\d+)?: ", message)
    assert words in message
    assert "\n" not in message
    assert "instance of" not in message  # pydantic's classes mean nothing to the user


LINES = [
    ("n = 2", "n = 2\norder = 3", 10),
    ("inertia = 0.5", "inerta = 0.5", 6),
    ("tip = 0.1", "tipp = 0.1", 12),
    ('"paper-beam"', '"paper_beam"', 4),
    ("stable = true", "stable = false", 18),
    ("[model]", "[model", 7),
    ('method = "lqg"', "", 10),
    (
        "[slew]\nangle_deg = 30\nduration_s = 2\n[requirements]",
        "[requirements]\ntorque_peak_max = 1",
        1,
    ),
    ('[model]\nbasis = "slewing"\nn = 2\n', "", 1),
]


@pytest.mark.parametrize(("old", "new", "line"), LINES, ids=[new for _, new, _ in LINES])
def test_refusals_name_the_line(tmp_path: Path, old: str, new: str, line: int) -> None:
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_design(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")


DAMPINGS = [
    ("damping_ratio = [0.01, 0.02]", (0.01, 0.02), None),
    ('damping = { kind = "rayleigh", alpha = 0.5 }', 0.0, Rayleigh(0.5)),
    ('damping_ratio = 0.03\n[arm.damping]\nkind = "rayleigh"\nbeta = 1e-3', 0.03, Rayleigh(0, 1e-3)),
    ('damping = { kind = "kelvin-voigt", retardation_time = 2e-4 }', 0.0, KelvinVoigt(2e-4)),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "ratio", "law"), DAMPINGS, ids=[keys for keys, _, _ in DAMPINGS])
def test_damping_is_read(tmp_path: Path, keys: str, ratio: object, law: object) -> None:
    arm = read_arm(written(tmp_path, f'[arm]\ncatalogue = "paper-beam"\n{keys}\n'))
    assert (arm.damping_ratio, arm.damping, arm.motor) == (ratio, law, None)


MOTOR = """
[arm.motor]
resistance = 2.6
torque_constant = 7.68e-3
back_emf_constant = 0.008
gear_ratio = 70
gear_efficiency = 0.9
motor_efficiency = 0.69
rotor_inertia = 4e-7
torque_limit = 2
voltage_limit = 15.0
"""


def test_motor_is_read_and_its_voltage_designed_for(tmp_path: Path) -> None:
    text = GOOD.replace("torque = 1 }", '"deflection@500mm" = 0.1, voltage = 5 }')
    design = read_design(written(tmp_path, text.replace("[model]", MOTOR + "[model]")))
    assert design.case.arm.motor == Motor(2.6, 7.68e-3, 0.008, 70, 0.9, 0.69, 4e-7, 2, 15)
    assert design.case.objective.actuator == "voltage"
    assert design.case.objective.performance == ("tip", "deflection@500mm")


def test_motor_has_the_defaults_of_the_class(tmp_path: Path) -> None:
    table = "{ resistance = 1, torque_constant = 2, back_emf_constant = 3 }"
    path = written(tmp_path, f'[arm]\ncatalogue = "paper-beam"\nmotor = {table}\n')
    assert read_arm(path).motor == Motor(1, 2, 3)


def test_arm_that_is_no_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="arm: 3 is not allowed; give a table"):
        read_arm(written(tmp_path, "arm = 3\n"))


BEAMS = [
    ("mass_per_length = -1.0", ":3: arm.beam.mass_per_length: falls to -1 on the beam; make it"),
    ("mass_per_length = [1.0, -2.0]", ":3: arm.beam.mass_per_length: falls to -1 on the beam; make it"),
    ("mass_per_length = []", ":3: arm.beam.mass_per_length: no coefficients; give at least one"),
    ('mass_per_length = ["a"]', ":3: arm.beam.mass_per_length.0: 'a' is not a finite number; give"),
    ("mass_per_length = { x = [0, 2], values = [1, 1] }",
     ":3: arm.beam.mass_per_length: stations run from 0 to 2 m but the beam from 0 to 1 m; make the"),
    ("mass_per_length = { x = [0, 1] }",
     ":3: arm.beam.mass_per_length: a table of stations with keys ['x']; give { x = [...]"),
    ("mass_per_length = { x = [0, 1], values = [1] }", "2 stations with 1 values; give at least"),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "words"), BEAMS, ids=[profile for profile, _ in BEAMS])
def test_impossible_beams_are_refused(tmp_path: Path, profile: str, words: str) -> None:
    text = f"[arm.beam]\nlength = 1.0\n{profile}\nbending_stiffness = 1.0\n"
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_arm(path)
    told = str(caught.value)
    assert told.startswith(f"{path}:")
    assert words in told.removeprefix(str(path))


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


def test_designs_of_one_name_are_told_apart(tmp_path: Path) -> None:
    paths = [tmp_path / folder / "x.toml" for folder in ("a", "b")]
    for path in paths:
        path.parent.mkdir()
        path.write_text(GOOD, encoding="utf-8")
    designs = read_designs([*paths, tmp_path / "a" / ".." / "a"])
    assert [design.case.name for design in designs] == ["a/x.toml", "b/x.toml"]


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "bom.toml"
    path.write_text(GOOD, encoding="utf-8-sig")
    assert read_design(path).case.n == 2
