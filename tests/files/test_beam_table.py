"""What a file may say of a beam and of what it carries."""

from __future__ import annotations

from pathlib import Path

import pytest

from slewctl import Arm, Beam, InputError
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
