"""What a file may say of a beam and of what it carries."""

from __future__ import annotations

from pathlib import Path

import pytest

from slewctl import Arm, Beam, InputError, LumpedMass
from slewctl.files import read_arm

STEEL = "youngs_modulus = 2.0e11, density = 7850.0"
RULER = f"section = {{ width = 0.03, thickness = 0.0015, {STEEL} }}"


def arm_of(tmp_path: Path, *lines: str, head: str = "[arm]") -> Arm:
    path = tmp_path / "arm.toml"
    path.write_text("\n".join([head, "[arm.beam]", "length = 0.6", *lines]), encoding="utf-8")
    return read_arm(path)


def test_a_section_makes_the_beam_that_python_makes_of_it(tmp_path: Path) -> None:
    steel = {"youngs_modulus": 2.0e11, "density": 7850.0}
    assert arm_of(tmp_path, RULER).beam == Beam.rectangular(
        0.6, width=0.03, thickness=0.0015, **steel
    )
    rod = arm_of(tmp_path, f"section = {{ outer_diameter = 0.02, {STEEL} }}")
    assert rod.beam == Beam.tube(0.6, outer_diameter=0.02, **steel)


MASSES = "masses = [{ x = 0, mass = 0.05 }, { x = 0.6, mass = 0.1, inertia = 1e-4 }]"


def test_masses_along_the_beam_are_read_and_written(tmp_path: Path) -> None:
    arm = arm_of(tmp_path, RULER, head=f"[arm]\n{MASSES}")
    assert arm.masses == (LumpedMass(0.0, 0.05), LumpedMass(0.6, 0.1, 1e-4))
    path = tmp_path / "again.toml"
    path.write_text(arm.to_toml(), encoding="utf-8")
    assert read_arm(path) == arm


def test_a_mass_beyond_the_tip_is_refused_on_its_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"arm.toml:2: arm.masses.1.x: 0.7 m is beyond the tip"):
        arm_of(tmp_path, RULER, head=f"[arm]\n{MASSES.replace('0.6', '0.7')}")


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ([RULER, "mass_per_length = 2.0"], r"arm.toml:5: arm.beam.mass_per_length: the section gives it already; leave it out"),
        ([RULER.replace("width", "outer_diameter")], "section.thickness: unknown key"),
        ([RULER.replace("width = 0.03, ", "")], "arm.beam.section.width: missing; add it"),
        ([RULER.replace("0.03", "-0.03")], "section.width: -0.03 is not allowed"),
        ([f"section = {{ outer_diameter = 0.02, inner_diameter = 0.03, {STEEL} }}"], "arm.beam.section.inner_diameter: the hole"),
        (["mass_per_length = 2.0"], "arm.beam.bending_stiffness: missing; add it"),
    ],
)  # fmt: skip
def test_a_wrong_beam_is_refused_where_it_is_wrong(
    tmp_path: Path, lines: list[str], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        arm_of(tmp_path, *lines)
