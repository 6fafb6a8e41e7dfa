"""Bases before modelling against reductions after it, judged on the same truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import Hub, InputError, Objective, arms, close, generalised_plant, lqg, truth
from slewctl.compare import Case, Judgement, Reductions, compare_reductions, evaluate
from slewctl.plant import modal_truncation

pytestmark = pytest.mark.xdist_group("reductions")
OBJECTIVE = Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "tip": 1e-3})
NAMES = (
    "clamped-free",
    "slewing",
    "polynomial",
    "hub-matched",
    "arm-matched",
    "balanced-truncation",
    "balanced-control-path",
    "modal-truncation",
    "modal-truncation-static",
)


def case_of(ratio: float = 0.005, **changes: object) -> Case:
    arm = replace(arms.paper_beam(), hub=Hub(0.1944), damping_ratio=ratio)
    return Case("case", arm, OBJECTIVE, truth_modes=12, **changes)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def result() -> Reductions:
    return compare_reductions(case_of(), 2)


def judged(result: Reductions, name: str) -> Judgement:
    evaluation = result[name].evaluation
    assert evaluation is not None
    return evaluation.judgement


def test_every_way_has_a_row_of_the_same_size(result: Reductions) -> None:
    assert tuple(row.name for row in result.rows) == NAMES
    table = result.table()
    assert {row["states"] for row in table} == {6}
    assert [row["after"] for row in table] == [False] * 5 + [True] * 4
    assert all((row["bound"] is not None) == row["after"] for row in table)
    assert all(row["verified"] and not row["refused"] for row in table)
    with pytest.raises(KeyError):
        result["nothing"]


def test_figures_come_with_stability_only(result: Reductions) -> None:
    assert not result["slewing"].stable
    for row in result.rows:
        assert row.evaluation is not None
        assert (row.loss is not None) == row.stable
        assert bool(row.evaluation.judgement.unstable_hz) != row.stable
        if row.loss is not None:
            assert row.loss > -1e-7
            cost = row.evaluation.judgement.cost
            assert_allclose(cost, result.optimum * (1 + row.loss), rtol=1e-12)


def test_basis_rows_are_the_judges_own(result: Reductions) -> None:
    own = evaluate(case_of(basis="clamped-free", n=2)).judgement
    row = judged(result, "clamped-free")
    assert row.cost == own.cost
    assert row.margins.disk.value == own.margins.disk.value
    assert row.margins.gain_db.value == own.margins.gain_db.value


def test_static_correction_is_in_the_loop(result: Reductions) -> None:
    case = case_of()
    model = truth(case.arm, case.truth_modes)
    reduced = modal_truncation(generalised_plant(model, OBJECTIVE), 2)
    assert reduced.plant is not None
    controller = lqg(reduced.plant).system
    corrected = close(model, OBJECTIVE, reduced.corrected(controller), sign=1).h2.value
    plain = close(model, OBJECTIVE, controller, sign=1).h2.value
    assert_allclose(judged(result, "modal-truncation-static").cost, corrected, rtol=1e-9)
    assert_allclose(judged(result, "modal-truncation").cost, plain, rtol=1e-9)
    assert abs(corrected / plain - 1) > 1e-5


def test_losses_fall_with_the_order(result: Reductions) -> None:
    finer = compare_reductions(case_of(), 4)
    for name in ("clamped-free", "arm-matched", "balanced-truncation"):
        coarse, fine = result[name].loss, finer[name].loss
        assert coarse is not None
        assert fine is not None
        assert fine < 0.1 * coarse
    # The arm's own shapes, known without its truth, are as good as the reduction of it.
    matched, balanced = (
        [each[name].loss for each in (result, finer)]
        for name in ("arm-matched", "balanced-truncation")
    )
    assert_allclose(matched, balanced, rtol=0.2)


def test_undamped_arm_has_rows_that_say_why_not() -> None:
    result = compare_reductions(case_of(0.0), 2)
    refused = {row.name for row in result.rows if row.refused}
    assert refused == {"balanced-truncation", "balanced-control-path"}
    assert "undamped" in result["balanced-truncation"].refused
    assert result["modal-truncation"].told()["bound"] == np.inf


def test_orders_that_are_no_reduction_are_refused() -> None:
    for order in (0, 12, 2.5):
        with pytest.raises(InputError) as error:
            compare_reductions(case_of(), order)  # type: ignore[arg-type]
        assert error.value.where == "order"
