"""The study: dimensionless settings, rows that any executor gives, and an honest count."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

import slewctl as sc
from slewctl.basis import NAMES, create
from slewctl.compare import (
    MEDIANS,
    QUANTITIES,
    Grid,
    Judge,
    Point,
    Setting,
    Study,
    Work,
    count_points,
    evaluate_point,
    recommend,
    run_study,
)
from slewctl.compare.case import Case
from slewctl.compare.study.answer import answer, duel
from slewctl.compare.study.designs import Designs
from slewctl.compare.study.grid import arm_of, objective_of, omega_of
from slewctl.compare.study.point import column
from slewctl.errors import DesignError, InputError
from slewctl.model import beam_inertia, beam_mass, total_inertia

PAPER = sc.arms.paper_beam()
SETTING = Setting(0.3, 0.5, 0.005, 0.3, ("theta", "theta_dot"))


def test_mass_and_inertia_of_the_paper_beam_are_its_integrals() -> None:
    # m̄ = 1 − (5/6) x³ on [0, 1]
    assert beam_mass(PAPER) == pytest.approx(1 - 5 / 24, rel=1e-14)
    assert beam_inertia(PAPER) == pytest.approx(1 / 3 - 5 / 36, rel=1e-14)


def test_settings_are_ratios_to_the_beam() -> None:
    arm = arm_of(PAPER, SETTING)
    assert arm.hub.inertia / beam_inertia(PAPER) == pytest.approx(0.3)
    assert arm.payload.mass / beam_mass(PAPER) == pytest.approx(0.5)
    assert total_inertia(arm) == pytest.approx(
        1.3 * beam_inertia(PAPER) + 0.5 * beam_mass(PAPER) * PAPER.beam.length**2
    )


def test_bandwidth_is_that_of_the_rigid_arm_under_lqr() -> None:
    """LQR of J θ̈ = τ with the objective's limits has |s| = ω_c and damping 1/√2."""
    arm = arm_of(PAPER, SETTING)
    limits = objective_of(arm, 0.3, ("theta",)).limits
    inertia = total_inertia(arm)
    # The algebraic solution: K = [√(q/r), √(2J √(q/r))] with q = (reach/y)², r = 1/u².
    stiffness = limits["torque"] * arm.beam.length / limits["tip"]
    damping = math.sqrt(2 * inertia * stiffness)
    poles = np.roots([inertia, damping, stiffness])
    assert np.abs(poles) == pytest.approx(omega_of(arm, 0.3), rel=1e-12)
    assert -poles.real / np.abs(poles) == pytest.approx(math.sqrt(0.5), rel=1e-12)


@settings(max_examples=6, deadline=None)
@given(st.floats(0.2, 5.0), st.floats(0.1, 20.0), st.floats(0.1, 20.0))
def test_rows_do_not_depend_on_units(length: float, mass: float, stiffness: float) -> None:
    """The same shape in another size gives the same dimensionless row."""
    small = Study("s", "", sc.Arm(sc.Beam(1.0, 1.0, 1.0)), (Grid(orders=(2,)),))
    big = replace(small, arm=sc.Arm(sc.Beam(length, mass, stiffness)))
    point = Point(replace(SETTING, payload_ratio=0.0), "clamped-free", 2, "lqg")
    one, two = (evaluate_point(Work(s.arm, 10, point))[0] for s in (small, big))
    assert one["outcome"] == two["outcome"] == "stable"
    free = [column(q) for q in QUANTITIES.values() if column(q) in one]
    assert len(free) > 12
    for key in (*free, "nu_gap", "generalised_margin"):
        assert two[key] == pytest.approx(one[key], rel=1e-5), key


def test_row_agrees_with_the_judge() -> None:
    point = Point(SETTING, "slewing", 3, "lqg")
    row = evaluate_point(Work(PAPER, 20, point))[0]
    arm = arm_of(PAPER, SETTING)
    case = Case("c", arm, objective_of(arm, 0.3, SETTING.sensors), "slewing", 3)
    judged = Judge(case).evaluate("slewing", 3)
    assert (row["outcome"] == "stable") == judged.stable
    assert row["h2_loss"] == (pytest.approx(judged.loss, rel=1e-9) if judged.stable else None)


@pytest.mark.slow
def test_study_is_the_same_over_threads_and_processes(tmp_path: Path) -> None:
    grid = Grid(bases=("clamped-free", "slewing"), orders=(1, 2), hub_ratios=(0.0, 1.0))
    study = Study("s", "", PAPER, (grid, grid), truth_modes=10)
    with ThreadPoolExecutor(2) as threads:
        first = run_study(study, tmp_path / "t", stamp={}, executor=threads)
    second = run_study(study, tmp_path / "p", stamp={}, workers=2)
    assert first.rows == second.rows
    assert len(first.rows) == len(grid) == 8  # a point in two grids is tried once
    assert len(first.slices) == 1
    assert {tuple(row) for row in first.rows} == {tuple(first.rows[0])}
    losses = first.slices[0].losses("slewing")
    assert losses.shape == (2, 2)
    assert not np.isnan(losses).any()


@st.composite
def studies(draw: st.DrawFn) -> Study:
    """Return a study of a few grids that overlap as they may."""

    def some(values: Sequence[Any]) -> st.SearchStrategy[tuple[Any, ...]]:
        return st.lists(st.sampled_from(values), min_size=1, max_size=5).map(tuple)

    grid = st.builds(
        Grid, bases=some(("clamped-free", "slewing")), orders=some((1, 2, 3)),
        methods=some(("lqg", "lead")), hub_ratios=some((0.0, 0.5, 1.0)),
        payload_ratios=some((0.0, 1.0)), bandwidths=some((0.1, 0.2)),
        sensors=some((("theta",), ("theta", "tip"))),
    )  # fmt: skip
    return Study("s", "", PAPER, tuple(draw(st.lists(grid, min_size=1, max_size=5))))


@settings(deadline=None)
@given(studies())
def test_points_are_counted_as_they_come(study: Study) -> None:
    points = list(study.points())
    assert count_points(study) == len(points) == len(set(points))
    assert set(points) == {point for grid in study.grids for point in grid.points()}


def test_a_large_study_is_counted_without_going_through_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ratios = [k / 7 for k in range(900)]
    grid = Grid(("slewing",), (1,), hub_ratios=ratios, payload_ratios=ratios)
    fewer = Grid(("slewing",), (1,), hub_ratios=ratios[:10], payload_ratios=(*ratios[:10], 1e3))
    monkeypatch.setattr(Grid, "points", pytest.fail)
    assert count_points(Study("s", "", PAPER, (grid, fewer))) == 900**2 + 10


@pytest.mark.parametrize(
    "axes",
    [
        {"hub_ratios": [k / 7 for k in range(3000)], "payload_ratios": range(3000)},
        {"hub_ratios": range(10**12)},
        # More than fit into what len() may return.
        dict.fromkeys(("hub_ratios", "payload_ratios", "orders", "bandwidths"), range(1, 100_000)),
    ],
)
def test_studies_without_end_are_refused(axes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"designs are too many for a study; keep at most 1,000,"):
        Grid(**axes)


def test_many_grids_are_refused_by_their_sum_and_their_number() -> None:
    ratios = [k / 7 for k in range(1, 800)]
    grid = Grid(("slewing",), (1,), hub_ratios=ratios, payload_ratios=ratios)
    other = replace(grid, bandwidths=(0.2,))
    with pytest.raises(InputError, match="1,276,802 designs are too many"):
        Study("s", "", PAPER, (grid, other))
    with pytest.raises(InputError, match="101 grids are too many"):
        Study("s", "", PAPER, (Grid(("slewing",), (1,)),) * 101)


@pytest.fixture(scope="module")
def some_rows() -> list[dict[str, object]]:
    """Two bases and two reductions, with a hub and without, on two sets of sensors."""
    grid = Grid(
        bases=("slewing", "arm-matched", "balanced-truncation", "modal-truncation-static"),
        orders=(1, 3), hub_ratios=(0.0, 1.0), sensors=(("theta", "theta_dot"), ("theta", "tip")),
    )  # fmt: skip
    study = Study("s", "", PAPER, (grid,), truth_modes=12)
    return [dict(evaluate_point(Work(PAPER, 12, point))[0]) for point in study.points()]


@pytest.mark.slow
@pytest.mark.xdist_group("study")
def test_a_gap_below_the_margin_means_a_stable_loop(some_rows: list[dict[str, object]]) -> None:
    """Vinnicombe's theorem, for bases and reductions, the static correction included."""
    safe = [row for row in some_rows if row["nu_gap"] < row["generalised_margin"]]  # type: ignore[operator]
    assert len(safe) >= 4
    assert {row["basis"] for row in safe} >= {"arm-matched", "balanced-truncation"}
    assert all(row["outcome"] == "stable" for row in safe)
    assert any(row["outcome"] == "unstable" for row in some_rows)


@pytest.mark.slow
@pytest.mark.xdist_group("study")
def test_unstable_rows_name_the_mode_that_grows(some_rows: list[dict[str, object]]) -> None:
    for row in some_rows:
        lost = row["outcome"] == "unstable" or not row["stable_on_twice"]
        assert (row["unstable_mode"] is not None) == lost
        assert (row["unstable_ratio"] is not None) == (row["outcome"] == "unstable")


@pytest.mark.slow
@pytest.mark.xdist_group("study")
def test_only_reductions_have_an_error_bound(some_rows: list[dict[str, object]]) -> None:
    for row in some_rows:
        assert (row["error_bound"] is None) == ("truncation" not in str(row["basis"]))
        assert (row["condition"] is None) == ("truncation" in str(row["basis"]))


def test_points_of_overlapping_grids_come_once() -> None:
    bases = ("clamped-free", "slewing")
    first = Grid(bases, orders=(1, 2, 1), hub_ratios=(0.0, 1.0, 0.0))
    second = Grid(bases, orders=(2, 3), hub_ratios=(1.0, 2.0))
    points = list(Study("s", "", PAPER, (first, second, first)).points())
    assert len(first) == 8  # a value given twice counts once
    assert len({point.key for point in points}) == len(points) == 8 + 8 - 2


def test_bad_grids_are_refused_with_their_axis() -> None:
    with pytest.raises(InputError, match="bandwidths"):
        Grid(bandwidths=(0.0,))
    with pytest.raises(InputError, match=r"bases\.0: unknown name 'slewin'"):
        Grid(bases=("slewin",))
    with pytest.raises(InputError, match="orders"):
        Grid(orders=())
    with pytest.raises(InputError, match=r"sensors\.0\.1: unknown name 'tipp'"):
        Grid(sensors=(("theta", "tipp"),))
    with pytest.raises(InputError, match="is not a list of sensors"):
        Grid(sensors=("theta",))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"damping_ratios\.0: 2 is not in \[0, 1\)"):
        Grid(damping_ratios=(2.0,))
    with pytest.raises(InputError, match="keep at most 60"):
        Study("s", "", PAPER, (Grid(),), truth_modes=61)
    with pytest.raises(InputError, match=r"truth\.modes"):
        Study("s", "", PAPER, (Grid(orders=(15,)),))


def invented(basis: str, hub: float, n: int, loss: float | None) -> dict[str, object]:
    return {
        "hub_ratio": hub, "payload_ratio": 0.0, "damping_ratio": 0.01, "bandwidth": 0.3,
        "sensors": "theta", "method": "lqg", "basis": basis, "n": n, "h2_loss": loss,
        "outcome": "unstable" if loss is None else "stable", "stable_on_twice": loss is not None,
        "unstable_mode": n + 1 if loss is None else None, "worst_frequency_error": loss or 1.0,
        **dict.fromkeys(MEDIANS, None if loss is None else 10 * loss), "condition": float(n),
        "nu_gap": 0.2, "generalised_margin": 0.1 if loss is None else 0.1 + 0.1 / (1 + loss),
    }  # fmt: skip


def test_duels_count_wins_draws_and_losses() -> None:
    rows = [
        invented("clamped-free", 0.0, 1, None), invented("slewing", 0.0, 1, 0.5),
        invented("clamped-free", 0.0, 2, None), invented("slewing", 0.0, 2, None),
        invented("clamped-free", 1.0, 1, 0.001), invented("slewing", 1.0, 1, 0.2),
        invented("clamped-free", 1.0, 2, 0.001), invented("slewing", 1.0, 2, 0.002),
        invented("clamped-free", 1.0, 3, 0.001),  # no partner: no pair
    ]  # fmt: skip
    total = duel(Designs(rows), "clamped-free", "slewing")
    assert (total.first_wins, total.second_wins, total.draws) == (1, 1, 2)
    found = answer(Designs(rows))
    assert "2 of 4 pairs" in found.sentences[0]
    where = found.sentences[1].replace("\N{NO-BREAK SPACE}", " ")
    assert (
        "Without a hub the slewing basis wins more pairs, 1 to 0; with a hub inertia of 1 " in where
    )
    assert "Without a hub neither has a design that loses at most 5 %" in where
    turned = duel(Designs(rows), "slewing", "clamped-free")
    assert (turned.first_wins, turned.second_wins) == (total.second_wins, total.first_wins)
    assert found.told_by_frequencies == (2, 2)
    (by_order,) = {d.axis for d in found.elsewhere}
    assert by_order == "n"
    assert [(d.value, d.pairs) for d in found.elsewhere] == [(1, 2), (2, 2)]


def test_the_basis_to_take_is_named_with_its_equals() -> None:
    rows = [invented(basis, 1.0, n, loss) for n in range(1, 101) for basis, loss in
            (("clamped-free", 0.01 if n > 40 else None), ("slewing", 0.9),
             ("hub-matched", 0.01 if n > 1 else 0.9), ("arm-matched", 0.01))]  # fmt: skip
    last = answer(Designs(rows)).sentences[-1].replace("\N{NO-BREAK SPACE}", " ")
    assert "take arm-matched (100 % of its 100 LQG and H2 designs are stable" in last
    assert ") or hub-matched (99 %); with clamped-free 60 % and with slewing 0 %." in last


def test_no_good_design_is_no_recommendation() -> None:
    rows = [invented("slewing", 1.0, n, 0.9) for n in (1, 2)]
    assert answer(Designs(rows)).sentences[-1].startswith("Of 2 LQG and H2 designs none are stable")
    assert answer(Designs([])).sentences == ("No design could be made; the rows say why.",)


def test_bases_that_share_no_setting_or_method_are_told_apart_without_a_crash() -> None:
    apart = [invented("clamped-free", 0.0, 2, 0.1), invented("slewing", 0.0, 3, 0.1)]
    found = answer(Designs(apart))
    assert found.duels == found.elsewhere == ()
    assert not any("pairs" in sentence for sentence in found.sentences)
    other = [invented("clamped-free", 0.0, 2, 0.01),
             invented("slewing", 0.0, 2, 0.01) | {"method": "pd-notch"}]  # fmt: skip
    assert [share.basis for share in answer(Designs(other)).shares] == ["clamped-free"]


def test_the_gap_is_held_against_the_truth_that_it_is_measured_to() -> None:
    row = invented("slewing", 0.0, 2, 0.1) | {"stable_on_twice": False, "generalised_margin": 0.3}
    gap = answer(Designs([row])).gap
    assert gap is not None
    assert (gap.stable, gap.certified, gap.refuted) == (1, 1, 0)


def test_an_optimum_that_is_not_verified_is_no_yardstick() -> None:
    setting = replace(SETTING, hub_ratio=0.1, payload_ratio=0.0, bandwidth=1e-7)
    (row,) = evaluate_point(Work(PAPER, 8, Point(setting, "clamped-free", 2, "lqg")))
    assert row["outcome"] == "no design"
    # At this edge of double precision the Riccati solver may give up before the checks do.
    reason = str(row["reason"])
    assert "the optimum to compare with is NOT verified" in reason or "no stabilising" in reason


def test_settings_beyond_double_precision_are_rows_with_a_reason() -> None:
    for setting in (replace(SETTING, hub_ratio=1e300), replace(SETTING, bandwidth=1e-300)):
        (row,) = evaluate_point(Work(PAPER, 6, Point(setting, "slewing", 1, "lqg")))
        assert row["outcome"] == "no design"
        assert row["reason"]
        assert row["h2_loss"] is None


def test_modes_lost_and_gaps_are_counted() -> None:
    rows = [invented("slewing", 0.0, n, loss) for n, loss in enumerate((None, 0.5, 0.2), start=1)]
    rows.append(invented("slewing", 1.0, 1, None) | {"unstable_mode": 0})
    rows.append(invented("slewing", 1.0, 2, None) | {"unstable_mode": 2})
    rows.append(invented("slewing", 1.0, 3, None) | {"unstable_mode": 9})
    found = answer(Designs(rows))
    (lost,) = found.lost
    assert (lost.rigid, lost.kept, lost.next, lost.higher) == (1, 1, 1, 1)
    gap = found.gap
    assert gap is not None
    assert (gap.designs, gap.stable, gap.certified, gap.refuted) == (6, 2, 0, 0)
    assert gap.auc == 1.0  # every unstable design has less margin under the same gap


def test_shares_tell_medians_of_the_stable_and_the_worst_condition() -> None:
    rows = [invented("slewing", 0.0, n, loss) for n, loss in enumerate((None, 0.5, 0.1, 0.2), 1)]
    (share,) = answer(Designs(rows)).shares
    assert (share.designs, share.stable, share.good, share.condition) == (4, 3, 0, 4.0)
    assert share.medians == dict.fromkeys(MEDIANS, 2.0)
    (none,) = answer(Designs(rows[:1])).shares
    assert none.medians == {}


def test_a_reduction_is_counted_against_every_basis() -> None:
    rows = [invented(name, 0.0, n, loss) for n in (1, 2) for name, loss in
            (("slewing", 0.1), ("arm-matched", 0.001), ("balanced-truncation", 0.002))]  # fmt: skip
    found = answer(Designs(rows))
    assert {(d.first, d.second) for d in found.duels} == {("slewing", "arm-matched")}
    assert len(answer(Designs(rows[:3])).reductions) == 2  # one order is enough
    results = {(d.first, d.value): (d.first_wins, d.draws, d.second_wins) for d in found.reductions}
    assert results == {
        ("slewing", 1): (0, 0, 1), ("slewing", 2): (0, 0, 1),
        ("arm-matched", 1): (0, 1, 0), ("arm-matched", 2): (0, 1, 0),
    }  # fmt: skip


@pytest.fixture
def few_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slewctl.compare.study.recommend.BANDWIDTHS", (0.1, 0.3))
    monkeypatch.setattr("slewctl.compare.study.recommend.ORDERS", (1, 2))


@pytest.mark.slow
@pytest.mark.usefixtures("few_trials")
def test_recommendation_holds_when_it_is_followed() -> None:
    arm = sc.Arm(PAPER.beam, sc.Hub(0.05), damping_ratio=0.005)
    advice = recommend(arm, truth_modes=12)
    assert advice.limit(advice.basis, advice.n) == advice.bandwidth_hz > 0
    chosen = [t for t in advice.trials if (t.basis, t.n) == (advice.basis, advice.n)]
    for trial in chosen:
        if trial.bandwidth_hz <= advice.bandwidth_hz:
            objective = objective_of(arm, trial.bandwidth, advice.sensors)
            model = sc.assemble(arm, create(advice.basis, advice.n))
            loop = sc.close(
                sc.truth(arm), objective, sc.lqg(sc.generalised_plant(model, objective))
            )
            assert loop.stable
            assert loop.margins.phase_deg.value >= 30
    lines = advice.plot(Figure().subplots()).lines
    assert [line.get_label() for line in lines] == list(NAMES)
    fewer = [t for t in advice.trials if t.n < advice.n]
    assert all(advice.limit(t.basis, t.n) < advice.bandwidth_hz for t in fewer)


@pytest.mark.slow
@pytest.mark.usefixtures("few_trials")
def test_no_recommendation_where_nothing_is_stable() -> None:
    """Without damping every mode that the controller does not know is on the edge."""
    with pytest.raises(DesignError, match=r"no design for .*; damping ratio 0 \(as published\)"):
        recommend(sc.Arm(PAPER.beam, sc.Hub(0.05)), truth_modes=12, damping="0 (as published)")


def test_a_grid_varies_what_has_no_axis_of_its_own() -> None:
    arm = replace(PAPER, joint=sc.Joint(50.0, rotor_inertia=0.01))
    changed = {"actuator_delay": 0.002, "joint_stiffness": 20.0}
    axes = {"bandwidths": (0.05,), "damping_ratios": (0.02,)}
    grid = Grid(("slewing",), (2,), hub_ratios=(1.0,), variations=({}, changed, changed), **axes)
    plain = Grid(("slewing",), (2,), hub_ratios=(1.0, 2.0), **axes)
    study = Study("s", "", arm, (grid, plain), truth_modes=10)
    points = list(study.points())
    assert count_points(study) == len(points) == 3  # the arm as it is is in both grids
    assert len({point.key for point in points}) == 3
    late = arm_of(arm, points[1].setting)
    assert (late.drive.delay, late.joint and late.joint.stiffness) == (0.002, 20.0)
    assert arm_of(arm, points[0].setting).drive.delay == 0.0
    rows = [evaluate_point(Work(arm, 10, point))[0] for point in points[:2]]
    assert [row["variation"] for row in rows] == [
        "none", "actuator_delay = 0.002, joint_stiffness = 20",
    ]  # fmt: skip
    assert rows[0]["phase_margin_deg"] != rows[1]["phase_margin_deg"]
    assert "variation" not in evaluate_point(Work(PAPER, 10, next(plain.points())))[0]
    for wrong, where in (
        ({"hub_inertia": 1.0}, "variations.0.hub_inertia"),
        ({"actuator_dely": 1.0}, "variations.0.actuator_dely"),
        ({"actuator_delay": "x"}, "variations.0.actuator_delay"),
        (3, "variations.0"),
    ):
        with pytest.raises(sc.InputError) as refused:
            Grid(variations=(wrong,))
        assert refused.value.where == where
    with pytest.raises(sc.InputError, match="no elastic joint") as refused:
        Study("s", "", PAPER, (grid,), truth_modes=10)
    assert refused.value.where == "grid.0.variations.1.joint_stiffness"
