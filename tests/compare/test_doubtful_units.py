"""Questions about units: of no arm that is one, and of each that is a thousand times off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import slewctl as sc
from slewctl import Arm, Beam, Hub, Payload
from slewctl.compare import unit_notes
from slewctl.files import find_designs, read_design
from slewctl.gate import check_file

DESIGNS = Path(__file__).parents[2] / "designs"
STEEL = {"youngs_modulus": 2.0e11, "density": 7850.0}
RULER = Arm(Beam.rectangular(0.28, width=0.03, thickness=0.001, **STEEL), Hub(0.01))


@pytest.mark.parametrize("name", sc.arms.names())
def test_nothing_is_asked_of_an_arm_of_the_catalogue(name: str) -> None:
    assert unit_notes(sc.arms.get(name)) == ()


def test_nothing_is_asked_of_the_designs() -> None:
    for path in find_designs([DESIGNS]):
        design = read_design(path)
        for arm in (design.case.arm, *(variation.arm for variation in design.variations)):
            assert unit_notes(arm) == ()


WRONG = {
    "length 280 m with a first frequency of 1.04e-05 Hz: is the length in mm?": replace(
        RULER, beam=replace(RULER.beam, length=280.0)
    ),
    "is the modulus in GPa?": Arm(
        Beam.rectangular(0.28, width=0.03, thickness=0.001, youngs_modulus=200, density=7850)
    ),
    "hub inertia 10000 kg·m² is 5.8e+06": replace(RULER, hub=Hub(1e4)),
    "payload mass 100 kg is 1.5e+03 times the beam's own: is it in g?": replace(
        RULER, payload=Payload(100.0)
    ),
    "hub radius 30 m is 1.1e+02 times the beam's own: is it in mm?": replace(
        RULER, hub=Hub(0.01, 30.0)
    ),
    "damping ratio 0.5: is it in percent?": replace(RULER, damping_ratio=0.5),
    "first frequency of 2e-05 Hz with the hub held: is it in Hz?": Arm(
        sc.ModalData(10.0, (2e-5,), (1.0,))
    ),
}


@pytest.mark.parametrize("words", WRONG)
def test_what_looks_wrong_is_asked_about_and_nothing_else(words: str) -> None:
    (note,) = unit_notes(WRONG[words])
    assert words in note


def test_the_gate_tells_a_question_and_judges_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "mm.toml"
    path.write_text(
        """
arm = { catalogue = "paper-beam", hub.inertia = 0.2, damping_ratio = 0.4 }
model = { basis = "clamped-free", n = 1 }
requirements = { stable = true }
[controller]
method = "lqg"
limits = { tip = 0.03, torque = 1.0 }
noise = { torque = 0.1, theta = 0.01, theta_dot = 0.1 }
""",
        encoding="utf-8",
    )
    result = check_file(path)
    assert result.status == "passed"
    assert result.notes == ("damping ratio 0.4: is it in percent?",)
