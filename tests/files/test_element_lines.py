"""A wrong element of a list is refused at its own line."""

from __future__ import annotations

from pathlib import Path

import pytest

from slewctl.compare import Judge
from slewctl.design import Controller
from slewctl.errors import SlewctlError, faults_of
from slewctl.files import read_design, read_study

DESIGN = """\
[arm]
{arm}
[model]
basis = "clamped-free"
n = 2
[controller]
limits = {{ tip = 0.03, torque = 1.0 }}
noise = {{ torque = 0.1, theta = 0.01, root_moment = 0.1 }}
{controller}
[compare]
{compare}
"""
ARM = 'catalogue = "paper-beam"\ndamping_ratio = 0.01'
METHOD = 'method = "lqg"'
STUDY = """\
[arm]
catalogue = "paper-beam"
damping_ratio = 0.01
[[grid]]
orders = [1]
[[grid]]
{grid}
"""


def spread(key: str, *elements: str) -> str:
    """Return a list with an element a line, the wrong one marked."""
    return f"{key} = [\n" + "".join(f"  {element},\n" for element in elements) + "]"


def marked(path: Path, text: str) -> tuple[int, str]:
    """Write a text without its mark; return the line and the file's place of the mark."""
    line = next(i for i, each in enumerate(text.splitlines(), 1) if "!" in each)
    path.write_text(text.replace("!", ""), encoding="utf-8")
    return line, f"{path}:{line}: "


BEAM = "beam.length = 1.0\nbeam.{} = 1.0\n"
DESIGNS = {
    "bases": {"compare": spread("bases", '"slewing"', '!"slewin"')},
    "types of bases": {"compare": spread("bases", '"slewing"', "!3")},
    "orders": {"compare": spread("orders", "1", "2", "!0")},
    "orders beyond any truth": {"compare": spread("orders", "1", "2", "!5000")},
    "coefficients": {
        "arm": BEAM.format("mass_per_length")
        + spread("beam.bending_stiffness", "1.0", '!"a"', "1.0")
    },
    "stations": {
        "arm": BEAM.format("bending_stiffness")
        + "[arm.beam.mass_per_length]\n"
        + spread("x", "0.0", "0.5", "!0.4", "1.0")
        + "\nvalues = [1.0, 1.0, 1.0, 1.0]\n"
    },
    "values at stations": {
        "arm": BEAM.format("bending_stiffness")
        + "[arm.beam.mass_per_length]\n"
        + "x = [0.0, 0.5, 1.0]\n"
        + spread("values", "1.0", "!-1.0", "1.0")
    },
    "damping ratios": {
        "arm": 'catalogue = "paper-beam"\n' + spread("damping_ratio", "0.01", "!2.0", "0.1")
    },
    "modes": {
        "controller": 'method = "positive-position"\nbandwidth_hz = 0.5\n'
        + spread("modes", "1", "!0")
    },
    "gains": {
        "controller": 'method = "positive-position"\nbandwidth_hz = 0.5\nmodes = [1, 2]\n'
        + spread("gain", "0.1", "!-1")
    },
    "gains of one": {
        "controller": 'method = "positive-position"\nbandwidth_hz = 0.5\nmodes = [1, 2]\n'
        + spread("gain", "0.1", "!1.5")
    },
    "notches": {
        "controller": 'method = "pd-notch"\nbandwidth_hz = 0.5\n'
        + spread("notch_modes", "1", '!"a"')
    },
    "notches of modes that there are not": {
        "controller": 'method = "pd-notch"\nbandwidth_hz = 0.5\n'
        + spread("notch_modes", "1", "!3", "2")
    },
    "modes left alone": {
        "controller": 'method = "pole-placement"\nbandwidth_hz = 0.5\n' + spread("leave", "1", "!7")
    },
    "the rigid body left alone": {
        "controller": 'method = "pole-placement"\nbandwidth_hz = 0.5\n' + spread("leave", "1", "!0")
    },
    "damping added": {
        "controller": 'method = "pole-placement"\nbandwidth_hz = 0.5\n'
        + spread("added_damping", "!-0.1", "0.1")
    },
    "damping added to too many": {
        "controller": 'method = "pole-placement"\nbandwidth_hz = 0.5\n'
        + spread("added_damping", "0.1", "0.1", "!0.1")
    },
    "too much damping added": {
        "controller": 'method = "pole-placement"\nbandwidth_hz = 0.5\n'
        + spread("added_damping", "0.1", "!1.0")
    },
    "poles": {"controller": 'method = "pole-placement"\n' + spread("poles", "-1.0", '!"a"')},
    "poles without conjugate": {
        "controller": 'method = "pole-placement"\n' + spread("poles", "-1.0", "![-1.0, 2.0]")
    },
    "unstable poles": {
        "controller": 'method = "pole-placement"\n'
        + spread("poles", "-1.0", "!1.0", "-3", "-4", "-5", "-6")
    },
    "masses": {"controller": 'method = "payload-lmi"\n' + spread("payload_mass", "0.0", '!"a"')},
}
STUDIES = {
    "bases": spread("bases", '"slewing"', '!"slewin"'),
    "methods": spread("methods", '"lqg"', '!"lqgg"'),
    "sensors": spread("sensors", '["theta"]', '!["thet"]'),
    "a sensor": "sensors = [\n['theta',\n!'thet']]",
    "ratios": spread("hub_ratios", "0.0", "!-1.0"),
    "damping": spread("damping_ratios", "0.0", "!1.5"),
    "bandwidths": spread("bandwidths", "0.1", "!nan"),
    "orders": spread("orders", "1", "!0"),
}


def designed(path: Path) -> Controller:
    design = read_design(path)
    with design.source.computing():
        return Judge(design.case).own[1]


@pytest.mark.parametrize("case", DESIGNS)
def test_elements_of_designs(tmp_path: Path, case: str) -> None:
    parts = {"arm": ARM, "controller": METHOD, "compare": "", **DESIGNS[case]}
    path = tmp_path / "x.toml"
    line, place = marked(path, DESIGN.format(**parts))
    with pytest.raises(SlewctlError) as refusal:
        designed(path)
    (fault,) = faults_of(refusal.value)
    assert fault.where.startswith(place), (line, str(fault))


@pytest.mark.parametrize("case", STUDIES)
def test_elements_of_studies(tmp_path: Path, case: str) -> None:
    path = tmp_path / "x.toml"
    line, place = marked(path, STUDY.format(grid=STUDIES[case]))
    with pytest.raises(SlewctlError) as refusal:
        read_study(path)
    (fault,) = faults_of(refusal.value)
    assert fault.where.startswith(place), (line, str(fault))
