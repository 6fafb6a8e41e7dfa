"""What slewctl writes as a design file it reads as the same design."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from strategies import loaded_arms

import slewctl as sc
from slewctl.arm import Arm, catalogue
from slewctl.errors import InputError
from slewctl.files import read_arm, read_design

LIMITS, NOISE = {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "moment@50mm": 0.1}


def parts(arm: Arm) -> tuple[object, ...]:
    return (
        arm.beam,
        arm.hub,
        arm.payload,
        arm.damping_ratio,
        arm.damping,
        arm.motor,
        arm.name,
        arm.masses,
        arm.damping_modes,
    )


@pytest.mark.parametrize("name", catalogue.names())
def test_an_arm_of_the_catalogue_comes_back(tmp_path: Path, name: str) -> None:
    arm = catalogue.get(name)
    path = tmp_path / "arm.toml"
    path.write_text(arm.to_toml(), encoding="utf-8")
    assert parts(read_arm(path)) == parts(arm)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(arm=loaded_arms())
def test_any_arm_comes_back(tmp_path: Path, arm: Arm) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(arm.to_toml(), encoding="utf-8")
    assert parts(read_arm(path)) == parts(arm)


def test_a_function_cannot_be_written() -> None:
    arm = Arm(sc.Beam(1.0, lambda x: 2.0 + x, 40.0))
    with pytest.raises(InputError, match="tabulate it"):
        arm.to_toml()


def test_a_problem_comes_back(tmp_path: Path) -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005,
                 name='a "boom"')  # fmt: skip
    problem = sc.Problem(arm, LIMITS, NOISE, slew=sc.Slew(40.0, 3.0))
    path = tmp_path / "design.toml"
    text = problem.to_toml("lqg", n=3, sample_time=0.01, requirements={"disk_margin": 0.3})
    path.write_text(text, encoding="utf-8")
    design = read_design(path)
    case = design.case
    assert parts(case.arm) == parts(arm)
    assert (case.objective.limits, case.objective.noise) == (problem.limits, problem.noise)
    assert (case.method, case.n, case.options) == ("lqg", 3, {"sample_time": 0.01})
    assert (case.slew, case.truth_modes) == (problem.slew, problem.truth_modes)
    assert dict(design.requirements) == {"stable": True, "disk_margin": 0.3}


def test_a_fit_becomes_a_design_file(tmp_path: Path) -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    fitted = sc.fit(arm, {1: 2.6, 2: 17.0}, free=["beam.stiffness"])
    path = tmp_path / "design.toml"
    controller = {"method": "lqg", "limits": LIMITS, "noise": NOISE}
    path.write_text(fitted.to_toml(model={"basis": "arm-matched", "n": 2}, controller=controller))
    assert parts(read_design(path).case.arm) == parts(fitted.arm)
    path.write_text(fitted.to_toml())
    assert parts(read_arm(path)) == parts(fitted.arm)
