"""Stability where computed poles cannot tell: proved by the argument principle, or undecided."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import slewctl as sc
from slewctl.arm import Actuator
from slewctl.cli.commands import cli
from slewctl.compare import read
from slewctl.loop.single.proved_stability import proved_stability

# No damping but that of the hub, and torque against angle and rate at the same place.
ARM = sc.Arm(sc.Beam(1.0, 0.5, 5.0), sc.Hub(2.0, friction=0.5), name="passive")
PD = {"kp": 0.5, "kd": 1.0, "filter_hz": 2.0}


def loop_of(modes: int) -> sc.Loop:
    objective = sc.Objective({"theta": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    return sc.close(sc.truth(ARM, modes), objective, sc.given(pid=PD))


@pytest.mark.parametrize("modes", [20, 30, 40])
def test_a_passive_loop_is_stable_on_any_number_of_modes(modes: int) -> None:
    """A spring and a filtered damper at the hub take energy from every mode, never give any."""
    loop = loop_of(modes)
    assert loop.stable
    assert (loop.undecided, loop.fault) == ("", "")
    assert loop.margins.gain_db.value == np.inf
    if modes == 40:
        assert not loop.stable_by_poles  # which are nearer to the axis than rounding


def test_the_same_loop_with_its_feedback_reversed_is_unstable_for_sure() -> None:
    loop = loop_of(20)
    turned = replace(loop, controller=sc.given(pid={k: -v if k != "filter_hz" else v
                                                    for k, v in PD.items()}))  # fmt: skip
    assert not turned.stable
    assert turned.undecided == ""
    assert turned.fault.startswith("unstable at ")
    assert proved_stability(turned.factors) is False


def test_what_nothing_proves_is_called_neither() -> None:
    """Of eighty modes the highest are moved by less than what twice the digits would show."""
    loop = loop_of(80)
    assert not loop.stable
    assert "nearer to the limit than rounding" in loop.undecided
    assert loop.fault == f"not proved to be stable: {loop.undecided}"
    assert loop.describe().startswith("NOT PROVED to be stable")
    with pytest.raises(sc.UnstableLoopError, match="not proved to be stable"):
        loop.require_stable("a cost")


def test_a_dead_time_beside_undamped_modes_fails_with_its_reason(tmp_path: Path) -> None:
    late = replace(ARM, hub=sc.Hub(2.0), actuator=Actuator(delay=0.002))
    problem = sc.Problem(
        late, {"theta": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01}, truth_modes=20
    )
    judged = problem.judge(sc.given(pid=PD))
    assert not judged.stable
    assert "nothing is certain of the loop with dead time" in read(judged, "stable").note
    path = tmp_path / "late.toml"
    path.write_text(
        "arm = { name = 'late', beam = { length = 1.0, mass_per_length = 0.5, bending_stiffness = "
        "5.0 }, hub = { inertia = 2.0 }, actuator = { delay = 0.002 } }\n"
        "controller = { method = 'given', pid = { kp = 0.5, kd = 1.0, filter_hz = 2.0 } }\n"
        "requirements = { stable = true }\n"
    )
    checked = CliRunner().invoke(cli, ["check", str(path)])
    assert checked.exit_code == 1
    assert "not proved to be stable: nothing is certain" in " ".join(checked.output.split())
    assert "BROKEN" not in checked.output
