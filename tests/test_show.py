"""Results show themselves in a notebook: HTML that closes, frames with their rows, axes."""

from __future__ import annotations

from xml.etree import ElementTree

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import slewctl as sc
from slewctl._show import axes_or_new, table_html, to_frame
from slewctl.compare import (
    SOURCES,
    Case,
    Judge,
    compare,
    compare_reductions,
    spillover_ladder,
    worst_case,
)

ARM = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.005)
OBJECTIVE = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
CASE = Case("c", ARM, OBJECTIVE, n=2, bases=("clamped-free",), orders=(2,), truth_modes=6)


def test_tables_are_well_formed_and_escaped() -> None:
    rows = [{"a<b": 1.23456, "ok": True, "none": None}, {"a<b": np.inf, "ok": False, "none": "&"}]
    table = ElementTree.fromstring(table_html(rows, "1 < 2"))
    cells = [cell.text for cell in table.iter("td")]
    assert cells == ["1.235", "yes", "–", "inf", "no", "&"]
    assert table_html([], "nothing") == "<p>nothing</p>"


def test_results_show_themselves() -> None:
    evaluation = Judge(CASE).evaluate("clamped-free", 2)
    loop, slew = evaluation.judgement.loop, evaluation.judgement.response
    ladder, comparison = spillover_ladder(CASE), compare([CASE])
    (case,) = comparison.cases
    reductions = compare_reductions(CASE, 2)
    worst = worst_case(CASE, {"payload_mass": (0.0, 0.1)}, samples=1, searches=0)
    results = (loop, loop.controller, loop.margins, ladder, comparison,
               case, reductions, worst)  # fmt: skip
    for shown in results:
        ElementTree.fromstring(shown._repr_html_())
    assert next(iter(loop.margins.to_frame()["margin"])) == "gain_db"
    assert len(ladder.to_frame()) == len(ladder.rungs)
    assert comparison.to_frame()["h2_loss"][0] == evaluation.loss
    assert list(reductions.to_frame()["name"]) == list(SOURCES)
    assert list(worst.to_frame()["disk_margin"]) == [trial.value for trial in worst.trials]
    np.testing.assert_array_equal(slew.to_frame()["tip"], slew.tip)
    ax = Figure().subplots()
    for drawn in (slew, ladder, case):
        assert drawn.plot(ax=ax) is ax
    assert len(ax.lines) == 5


def test_a_new_figure_is_made_only_without_axes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    before = set(plt.get_fignums())
    new = axes_or_new(None)
    assert set(plt.get_fignums()) - before == {new.figure.number}
    assert axes_or_new(new) is new
    assert len(plt.get_fignums()) == len(before) + 1
    plt.close(new.figure)
    assert to_frame([]).empty
