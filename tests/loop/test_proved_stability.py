"""Stability where computed poles cannot tell: proved by the argument principle, or undecided."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import control as ct
import numpy as np
import pytest
from click.testing import CliRunner

import slewctl as sc
from slewctl.arm import Actuator
from slewctl.cli.commands import cli
from slewctl.compare import evaluate, read
from slewctl.files import read_design
from slewctl.loop.noise import noise_levels
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


# An integrator that friction slows over a hundred thousand years: margins are proved, and the
# poles that levels and costs would come from are rounding.
FAINT = """
arm = { name = "faint", damping_ratio = 1e-3, beam = { length = 1.0, mass_per_length = 0.5, \\
bending_stiffness = 3.7e6 }, hub = { inertia = 2.0, friction = 0.18 } }
truth = { modes = 6 }
requirements = { stable = true, tip_rms_max = 0.001, torque_rms_max = 1e-9, h2_loss_max = 1.0 }
[controller]
method = "given"
A = [[-0.111]]
B = [[1.36e-12, 8.78e-08]]
C = [[1.0]]
D = [[0.0, 0.0]]
inputs = ["theta", "theta_dot"]
feedback = "negative"
limits = { theta = 0.1, torque = 1.0 }
noise = { torque = 0.1, theta = 0.01, theta_dot = 0.01 }
""".replace("\\\n", "")


def test_what_needs_the_poles_is_not_known_where_only_margins_are_proved(tmp_path: Path) -> None:
    path = tmp_path / "faint.toml"
    path.write_text(FAINT)
    judged = evaluate(read_design(path).case).judgement
    loop = judged.loop
    assert loop.stable
    assert not loop.stable_by_poles
    assert loop.margins.phase_deg.value > 30
    for name in ("tip_rms", "torque_rms", "h2_cost", "h2_loss", "settling_time"):
        reading = read(judged, name)
        assert np.isnan(reading.value)
        assert "nearer to the limit than rounding" in reading.note
    assert read(judged, "decay_rate_min").value == 0.0
    assert loop.describe().startswith("stable; ")
    assert "stable" in loop._repr_html_()
    checked = CliRunner().invoke(cli, ["check", str(path)])
    assert checked.exit_code == 1
    assert "BROKEN" not in checked.output
    with pytest.raises(sc.AccuracyError, match="levels under noise"):
        noise_levels(loop)


@pytest.mark.parametrize("sample_time", [0.0, 0.01])
@pytest.mark.parametrize("skew", [0.0, 1.0, 2.0])
def test_two_integrators_in_any_coordinates_are_not_proved_to_be_stable(
    sample_time: float, skew: float
) -> None:
    """Of θ and tip, summed into one torque: one of them drifts, and rounding links them."""
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    noise = {"torque": 0.1, "theta": 0.01, "tip": 0.01}
    asked = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, noise, truth_modes=4)
    tau, T = 0.02, sample_time
    decay = np.exp(-T / tau) if T else -1 / tau
    still, step, entry = (1.0, T, 1 - decay) if T else (0.0, 1.0, 1 / tau)
    A, B = np.diag([decay, still, still]), np.array([[entry, 0.0], [step, 0.0], [0.0, step]])
    C, D = np.array([[-0.5 / tau, 0.2, 0.1]]), np.array([[0.6 + 0.5 / tau, 0.0]])
    for seed in range(8):
        rng = np.random.default_rng(seed)
        U, V = (np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(2))
        S = U @ np.diag(10 ** np.linspace(0, skew, 3)) @ V
        own = S @ A @ np.linalg.inv(S), S @ B, C @ np.linalg.inv(S), D
        law = ct.ss(*own, *([T] if T else []), inputs=["theta", "tip"], outputs=["torque"])
        assert not asked.judge(law).loop.stable
        with pytest.raises(sc.SlewctlError):
            sc.margins(asked.plant("clamped-free", n=4), law)
