"""What is of another type than a function takes gets one line, not a traceback of what met it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import control as ct
import numpy as np
import pytest

import slewctl as sc
from slewctl.check import read_baseline
from slewctl.compare import rows
from slewctl.export import read_data
from slewctl.files import example_design, read_arm, read_design, read_designs, read_study
from slewctl.gate import check_designs, check_file

ARM = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
PLANT = ct.tf([1], [1, 1])


@cache
def loop() -> sc.Loop:
    problem = sc.Problem(ARM, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    return problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop


TAKEN: dict[str, Callable[[Any], object]] = {
    "slew": lambda bad: sc.simulate_slew(loop(), bad),
    "a slew in steps": lambda bad: sc.simulate(loop(), bad),
    "mode.ratio": lambda bad: sc.Mode(1.0, bad),
    "modes": lambda bad: sc.shaper("zv", bad),
    "modes of a turn": lambda bad: sc.rest_to_rest(1.0, 1.0, 1.0, modes=bad),
    "tolerance": lambda bad: sc.robust_shaper([sc.Band(10.0, 12.0)], tolerance=bad),
    "bands": lambda bad: sc.robust_shaper(bad),
    "p": lambda bad: sc.norm(PLANT, bad),
    "excitation": lambda bad: sc.simulated_log(ARM, bad, sample_time=0.01),
}
FILES: dict[str, Callable[[Any], object]] = {
    "a law": lambda bad: sc.given(file=bad),
    "a log": sc.read_log,
    "a response": sc.read_response,
    "a design": read_design,
    "designs": lambda bad: read_designs([bad]),
    "an arm": read_arm,
    "a study": read_study,
    "a baseline": read_baseline,
    "a gate": check_file,
    "data": read_data,
    "rows": rows,
}


@pytest.mark.parametrize("name", TAKEN)
@pytest.mark.parametrize("bad", [None, "x", [], 3.0 + 4j, np.array([])], ids=repr)
def test_another_type_is_refused_in_one_line(name: str, bad: object) -> None:
    with pytest.raises(sc.InputError) as caught:
        TAKEN[name](bad)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("bad", [3, 2.5, [], {}], ids=str)
def test_what_is_no_path_is_refused(name: str, bad: object) -> None:
    with pytest.raises(sc.InputError, match="is no path"):
        FILES[name](bad)


def test_a_path_may_be_a_text() -> None:
    path = example_design()
    assert read_design(str(path)).case.name == path.stem
    (found,) = check_designs(str(path))
    assert found.status == "passed"
    assert [design.path for design in read_designs(str(path.parent))] == [path]


@pytest.mark.parametrize(("angle", "limit"), [(1e-300, 1.0), (1.0, 1e300)])
def test_a_turn_that_is_nothing_is_refused(angle: float, limit: float) -> None:
    with pytest.raises(sc.InputError, match="SI units"):
        sc.rest_to_rest(angle, torque_limit=limit, inertia=1.0, modes=[sc.Mode(1.0)])
