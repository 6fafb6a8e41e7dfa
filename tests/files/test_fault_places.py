"""Every key that a design file's refusal tells is the path of that key in the file."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from slewctl.errors import InputError, SlewctlError, faults_of
from slewctl.export import toml_text
from slewctl.files import read_arm, read_design

BEAM: dict[str, Any] = {
    "arm": {
        "beam": {
            "length": 0.6,
            "mass_per_length": {"x": [0.0, 0.3, 0.6], "values": [0.5, 0.4, 0.3]},
            "bending_stiffness": [1.5, 1.0, 0.5],
        },
        "hub": {"inertia": 0.02, "friction": 0.01, "radius": 0.05},
        "payload": {"mass": 0.05, "inertia": 1e-5},
        "masses": [{"x": 0.3, "mass": 0.05, "inertia": 1e-5}, {"x": 0.4, "mass": 0.05}],
        "motor": {
            "resistance": 2.6, "torque_constant": 0.01, "back_emf_constant": 0.01, "gear_ratio": 70.0,
            "gear_efficiency": 0.9, "motor_efficiency": 0.7, "rotor_inertia": 4e-7, "torque_limit": 5.0,
            "voltage_limit": 15.0,
        },
        "joint": {"stiffness": 100.0, "damping": 0.01, "rotor_inertia": 0.01, "rotor_friction": 0.01},
        "actuator": {"frequency_hz": 100.0, "damping_ratio": 0.7, "delay": 0.001},
        "sensors": {"theta": {"lag": 0.001, "delay": 0.001}, "tip": {"lag": 0.001, "delay": 0.001}},
        "damping": {"kind": "rayleigh", "alpha": 0.1, "beta": 1e-5},
        "damping_ratio": [0.01, 0.02],
        "appendages": 2,
    },
}  # fmt: skip
SECTION: dict[str, Any] = {
    "arm": {
        "beam": {
            "length": 0.6,
            "section": {
                "outer_diameter": 0.02, "inner_diameter": 0.018, "youngs_modulus": 7e10, "density": 2700.0
            },
        },
        "damping": {"kind": "drag", "per_length": 0.1},
        "actuator": {"lag": 0.001, "delay": 0.001, "torque_limit": 2.0},
    },
}  # fmt: skip
PLATE: dict[str, Any] = {
    "arm": {
        "beam": {
            "length": 0.6,
            "section": {"width": 0.02, "thickness": 0.002, "youngs_modulus": 7e10, "density": 2700.0},
        },
        "damping": {"kind": "kelvin-voigt", "retardation_time": 1e-4},
    },
}  # fmt: skip
DATA: dict[str, Any] = {
    "inertia": 600.0,
    "frequencies_hz": [0.2, 1.3],
    "coupling": [20.0, 4.0],
    "places": [
        {"name": "tip", "lever": 8.0, "shapes": [0.15, -0.16]},
        {"name": "root", "moments": [3.0, 5.0]},
    ],
}
MODAL: dict[str, Any] = {
    "arm": {"modal_data": DATA, "hub": {"inertia": 100.0}, "damping_ratio": 0.01, "appendages": 2}
}
WINGS: dict[str, Any] = {
    "arm": {
        "wings": {
            "left": {**DATA, "damping_ratio": [0.01, 0.02], "count": 2},
            "right": {**DATA, "places": [], "damping_ratio": 0.01},
        },
        "hub": {"inertia": 100.0},
    }
}
ARMS = {"beam": BEAM, "tube": SECTION, "plate": PLATE, "modal data": MODAL, "wings": WINGS}
REST: dict[str, Any] = {
    "arm": {"catalogue": "paper-beam", "damping_ratio": 0.01, "hub": {"inertia": 0.2}},
    "model": {"basis": "clamped-free", "n": 2},
    "controller": {
        "method": "lqg", "limits": {"tip": 0.03, "torque": 1.0},
        "noise": {"torque": 0.1, "theta": {"encoder_counts": 4096, "sample_time": 0.005}},
        "sample_time": 0.005, "delay": 0.001,
    },
    "slew": {"angle_deg": 30.0, "duration_s": 4.0, "horizon_s": 12.0},
    "truth": {"modes": 8},
    "compare": {"bases": ["slewing"], "orders": [1, 2]},
    "uncertainty": {
        "box": {"payload_mass": [0.0, 0.2], "stiffness_factor": [0.9, 1.1]}, "quantity": "disk_margin",
        "samples": 4, "searches": 1, "evaluations": 4, "seed": 1,
    },
    "requirements": {"gain_margin_db": 6.0},
    "variations": {
        "heavy": {"payload_mass": 0.1, "stiffness_factor": 0.9, "requirements": {"gain_margin_db": 3.0}}
    },
}  # fmt: skip
GIVEN: dict[str, Any] = {
    "arm": {"catalogue": "paper-beam", "damping_ratio": 0.01, "hub": {"inertia": 0.2}},
    "controller": {
        "method": "given", "inputs": ["theta"], "output": "torque", "feedback": "negative",
        "pid": {"kp": 1.0, "ki": 0.1, "kd": 0.2, "filter_hz": 20.0},
        "sections": [{"notch_hz": 3.0, "width": 0.5, "depth": 0.1}, {"lowpass_hz": 50.0, "order": 2}],
        "sample_time": 0.005, "delay": 0.001, "discretise": "tustin",
    },
    "measured": {
        "file": "response.csv", "columns": {"gain_db": "mag"}, "actuator": "torque", "sensor": "theta",
        "sample_time": 0.005, "factor": 1.0, "averages": 10.0, "unstable_poles": 0, "poles_at_zero": 2,
        "requirements": {"modulus_margin": 0.3},
    },
}  # fmt: skip
DESIGNS = {"designed": REST, "given": GIVEN}
BAD: list[Any] = [-1.0, 1e300, "x", [], [1.0, 2.0, 3.0]]


def leaves(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Return the ways to all that is no table."""
    pairs: Any = ()
    if isinstance(value, dict):
        pairs = value.items()
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        pairs = enumerate(value)
    for key, inner in pairs:
        yield from leaves(inner, (*way, key))
    if not pairs and way:
        yield way


def told(path: Path, read: Any) -> list[SlewctlError]:
    try:
        read(path)
    except InputError as error:
        return list(faults_of(error))
    return []


def changed(tables: dict[str, Any], way: tuple[Any, ...], bad: Any) -> dict[str, Any]:
    copy = json.loads(json.dumps(tables))
    table = copy
    for key in way[:-1]:
        table = table[key]
    table[way[-1]] = bad
    return copy


def misplaced(path: Path, tables: dict[str, Any], read: Any) -> list[str]:
    """Return what is told without a line, or with a key that is no path in the file.

    Behind a key that names another file stands the place in that one.
    """
    path.write_text(toml_text(tables), encoding="utf-8")
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    wrong = []
    for fault in told(path, read):
        found = re.fullmatch(rf"{re.escape(str(path))}:\d+(?:: (\S+?)(?:: .*)?)?", fault.where)
        if not found or not _leads(content, (found[1] or "").split(".")):
            wrong.append(str(fault).replace(str(path), ""))
    return wrong


def _leads(content: Any, keys: list[str]) -> bool:
    """Return whether the keys lead to something; the last of them may be missing there."""
    for key in keys[:-1]:
        if isinstance(content, dict) and key in content:
            content = content[key]
        elif isinstance(content, list) and key.isdigit() and int(key) < len(content):
            content = content[int(key)]
        else:
            return False
    return isinstance(content, dict | list)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*ARMS, *DESIGNS])
def test_what_is_wrong_is_told_at_its_key(tmp_path: Path, kind: str) -> None:
    tables, read = (ARMS[kind], read_arm) if kind in ARMS else (DESIGNS[kind], read_design)
    path = tmp_path / "x.toml"
    path.write_text(toml_text(tables), encoding="utf-8")
    (tmp_path / "response.csv").write_text("frequency_hz,mag,phase_deg\n1,0,-90\n2,-6,-100\n")
    read(path)
    wrong: list[str] = []
    for way in leaves(tables):
        for bad in BAD:
            wrong += misplaced(path, changed(tables, way, bad), read)
    assert not wrong
