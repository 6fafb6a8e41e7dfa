"""``recommend`` for a controller on a clock, and what it says while it works."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import slewctl as sc
from slewctl.cli.study import print_recommendation
from slewctl.compare import Trial, recommend
from slewctl.compare.study.grid import objective_of
from slewctl.errors import InputError


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slewctl.compare.study.recommend.BANDWIDTHS", (0.1,))
    monkeypatch.setattr("slewctl.compare.study.recommend.ORDERS", (1,))


def test_trials_are_those_of_the_clock_and_its_own_optimum() -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    clock = {"sample_time": 0.05, "delay": 0.03}
    found = recommend(arm, truth_modes=6, **clock)
    assert (found.sample_time, found.delay) == (0.05, 0.03)
    assert "a clock of 50 ms and 30 ms of delay" in str(found)
    trial = next(t for t in found.trials if t.basis == "slewing")
    objective = objective_of(arm, 0.1, found.sensors)
    problem = sc.Problem(arm, objective.limits, objective.noise, truth_modes=6)
    judged = problem.judge(sc.lqg(problem.plant("slewing", n=1), **clock))
    assert trial.phase_margin_deg == pytest.approx(judged.margins.phase_deg.value, rel=1e-6)
    assert trial.loss == pytest.approx(judged.loss, rel=1e-4, abs=1e-6)
    assert isinstance(trial, Trial)
    assert math.isfinite(found.bandwidth_hz)


def test_a_program_in_a_pipe_is_told_that_it_goes_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("slewctl.cli.study.PATIENCE", 0.0)
    print_recommendation("quanser-flexible-link", "theta,theta_dot", 0.005, 0.0, as_json=True)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("slewctl: 0 of 5 done; ")
    assert lines[-1].startswith("slewctl: 4 of 5 done; ")


@pytest.mark.parametrize(
    ("sample_time", "delay", "told"),
    [
        (None, 0.1, "--delay: "),
        (0.0, 0.0, "--sample-time: "),
        (0.1, 5.0, "--delay: "),
        (10.0, 0.0, "--sample-time: a clock of 10 s knows nothing beyond 0.05 Hz"),
    ],
)
def test_an_impossible_clock_is_told_by_its_option(
    sample_time: float | None, delay: float, told: str
) -> None:
    with pytest.raises(InputError, match=told):
        print_recommendation("paper-beam", "theta", sample_time, delay, as_json=False)


def test_what_no_basis_can_be_blamed_for_is_told_as_it_is() -> None:
    """A drive that is later than ten samples, and sensors that are unlike: no design is at fault."""
    rig = replace(sc.arms.quanser_flexible_link(), damping_ratio=0.01)
    late = replace(rig, actuator=sc.Actuator(delay=0.012))
    with pytest.raises(
        InputError, match=r"more than 10 sample times of 0\.001 s; sample more slowly"
    ):
        recommend(late, truth_modes=10, sample_time=0.001)
    unlike = replace(rig, sensors={"theta": sc.Sensor(delay=0.002)})
    with pytest.raises(InputError, match="sensors of unlike dead times in one loop"):
        recommend(unlike, truth_modes=10)
