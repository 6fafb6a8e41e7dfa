"""The face: a problem gives plants and judgements that agree with the steps beneath."""

from __future__ import annotations

import control
import numpy as np
import pytest
from matplotlib.figure import Figure

import slewctl as sc
from slewctl.compare import quantities_of
from slewctl.compare.judged import Judged

LIMITS = {"tip": 0.03, "torque": 1.0}
NOISE = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
ARM = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
PROBLEM = sc.Problem(ARM, LIMITS, NOISE)


@pytest.fixture(scope="module")
def judged() -> Judged:
    return PROBLEM.judge(sc.lqg(PROBLEM.plant("clamped-free", n=2)))


def test_the_face_and_the_steps_beneath_agree(judged: Judged) -> None:
    objective = sc.Objective(LIMITS, NOISE)
    plant = sc.generalised_plant(sc.assemble(ARM, sc.ClampedFree(2)), objective)
    np.testing.assert_array_equal(PROBLEM.plant(sc.ClampedFree(2)).A, plant.A)
    np.testing.assert_array_equal(PROBLEM.plant("clamped-free", 2).A, plant.A)
    loop = sc.close(sc.truth(ARM), objective, sc.lqg(plant))
    assert judged.cost == pytest.approx(loop.h2.value, rel=1e-12)
    assert judged.margins.phase_deg.value == pytest.approx(loop.margins.phase_deg.value, rel=1e-12)
    assert 0 <= judged.loss < 1e-4
    assert judged.optimum is PROBLEM.optimum


def test_a_judgement_says_what_a_person_asks_for(judged: Judged) -> None:
    lines = str(judged).splitlines()
    assert len(lines) <= 12
    assert "stable            on 20, 40, 80 modes" in lines
    assert any(line.startswith("phase_margin_deg  33 deg at 1.649 Hz (mode 1") for line in lines)
    assert lines[-1].startswith("design            verified by ")
    told = [quantity.name for quantity in quantities_of(judged.slew)]
    assert [row["quantity"] for row in judged.rows()] == told
    assert judged.followed("disk_margin").converged


def test_an_unstable_loop_has_no_margin_to_print() -> None:
    wrong = control.StateSpace(
        [], [], [], [[-5.0, -0.1]], inputs=["theta", "theta_dot"], outputs=["torque"]
    )
    judged = PROBLEM.judge(wrong)
    assert not judged.stable
    text = str(judged)
    assert "UNSTABLE at" in text
    assert "margin_db" not in text
    assert "given" not in text or "UNSTABLE" in text


def test_a_users_own_system_is_judged_as_the_controller_it_is(judged: Judged) -> None:
    own = PROBLEM.judge(judged.controller.system, sign=1)
    assert own.cost == pytest.approx(judged.cost, rel=1e-12)
    assert "given, without a certificate" in str(own)


def test_the_return_ratio_is_python_controls(judged: Judged) -> None:
    assert isinstance(judged.return_ratio, control.StateSpace)
    closed = control.feedback(judged.return_ratio, 1)
    assert np.all(closed.poles().real < 0)


@pytest.mark.parametrize("kind", ["bode", "nyquist", "nichols", "poles"])
def test_a_loop_is_drawn_on_the_axes_given(judged: Judged, kind: str) -> None:
    figure = Figure()
    axes = figure.subplots(2) if kind == "bode" else figure.subplots()
    assert judged.plot(kind, axes) is axes
    first = axes[0] if kind == "bode" else axes
    assert first.lines


@pytest.mark.parametrize("what", ["tip", "error", "torque", "actuator"])
def test_a_slew_is_drawn_curve_by_curve(judged: Judged, what: str) -> None:
    axes = Figure().subplots()
    assert judged.response.plot(what, axes) is axes
    assert what in [line.get_label() for line in axes.lines]
    with pytest.raises(sc.InputError, match="torque"):
        judged.response.plot("volts", axes)


def test_swings_and_fits_are_drawn() -> None:
    t = np.linspace(0, 1, 11)
    swing = sc.simulate_swing(sc.large_slew(sc.assemble(ARM, "slewing", 2)), t, 0.1)
    assert swing.plot(Figure().subplots()).lines
    found = sc.fit(ARM, {1: 1.0, 2: 4.1}, free=["beam.stiffness"])
    assert found.plot(Figure().subplots()).lines


def test_what_cannot_be_drawn_is_refused(judged: Judged) -> None:
    with pytest.raises(sc.InputError, match="bode"):
        judged.plot("step")
    with pytest.raises(sc.InputError, match="two axes"):
        judged.plot("bode", Figure().subplots())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((3, LIMITS, NOISE), "Arm"),
        ((ARM, {"tip": 1.0}, NOISE), r"limits.*torque"),
        ((ARM, LIMITS, {"torque": 1.0}), "noise"),
        ((ARM, LIMITS, NOISE, sc.Slew(30.0, 2.0), 61), "truth_modes"),
    ],
)
def test_impossible_problems_are_refused(arguments: tuple[object, ...], told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        sc.Problem(*arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("clamped-free",), "n too"),
        (("clamped free", 2), "clamped-free"),
        ((sc.ClampedFree(2), 2), "own number"),
        ((3,), "not a basis"),
        (("slewing", 0), "n"),
    ],
)
def test_impossible_bases_are_refused(arguments: tuple[object, ...], told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        PROBLEM.plant(*arguments)  # type: ignore[arg-type]


def test_what_is_typed_is_told_in_a_few_lines(judged: Judged) -> None:
    model = sc.assemble(ARM, "slewing", 3)
    results = (
        PROBLEM, PROBLEM.truth, PROBLEM.plant("slewing", 2), model, judged, judged.loop,
        judged.response, judged.controller, sc.large_slew(model), judged.margins,
        sc.balanced_truncation(PROBLEM.plant("slewing", 3), 4),
        sc.simulate_swing(sc.large_slew(model), np.linspace(0, 1, 11), 0.1),
    )  # fmt: skip
    for shown in results:
        assert len(repr(shown).splitlines()) <= 12, type(shown)
        assert "array(" not in repr(shown), type(shown)
        assert shown._repr_html_().startswith("<"), type(shown)
