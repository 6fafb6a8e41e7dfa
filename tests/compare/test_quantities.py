"""The registry of quantities: readable, with units, in every output, followed to convergence."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from quick_design import QUICK

from slewctl import Actuator, Conditions, Hub, Motor, Objective, Slew, arms
from slewctl.check import REQUIREMENTS, to_junit, to_record
from slewctl.cli.verdicts import verdict_table
from slewctl.compare import (
    COLUMNS,
    QUANTITIES,
    Case,
    Judgement,
    compare,
    describe,
    evaluate,
    follow,
    read,
)
from slewctl.compare.quantities import RECORDED, quantities_of
from slewctl.compare.reading import row
from slewctl.compare.study.answer import HUB, OTHER_AXES
from slewctl.compare.study.point import column
from slewctl.files import read_design
from slewctl.gate import examine
from slewctl.report.export import json_text

MOTOR = Motor(resistance=2.0, torque_constant=0.1, back_emf_constant=0.1, gear_ratio=10)
ARM = replace(arms.paper_beam(), hub=Hub(0.2), motor=MOTOR, damping_ratio=0.005)
OBJECTIVE = Objective(
    {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
)
pytestmark = pytest.mark.xdist_group("quantities")
CASE = Case("case", ARM, OBJECTIVE, n=2, truth_modes=10, slew=Slew(30.0, 2.0),
            bases=("clamped-free",), orders=(2,))  # fmt: skip
AXES = (HUB, *OTHER_AXES, "basis")
CLOCKED = replace(CASE, options={"sample_time": 0.01, "delay": 0.004})


# A limit that the slew does not reach.
HELD = replace(CLOCKED, arm=replace(ARM, actuator=Actuator(torque_limit=5.0)),
               slew=Slew(30.0, 2.0, conditions=Conditions(saturate=True)))  # fmt: skip


@pytest.fixture(scope="module", params=[CASE, CLOCKED, HELD],
                ids=["continuous", "sampled", "simulated"])  # fmt: skip
def judged(request: pytest.FixtureRequest) -> Judgement:
    return evaluate(request.param).judgement


def test_a_margin_says_what_is_proved_of_it_and_nothing_else_does(judged: Judgement) -> None:
    for name, quantity in QUANTITIES.items():
        found = read(judged, name)
        if quantity.kind != "margin":
            assert (found.at_least, found.intervals) == (None, 0), name
            continue
        if name == "delay_margin_s" and judged.controller.sample_time:
            # Of the torque on its way to the arm: poles confirm it.
            assert (found.at_least, found.intervals) == (None, 0)
            assert judged.margins.confirmed
            continue
        assert found.intervals == judged.margins.intervals > 0
        assert found.at_least is not None
        if math.isfinite(found.value):
            assert found.value * (1 - 1e-6) <= found.at_least <= found.value * (1 + 1e-12), name


def test_every_quantity_is_readable_and_has_what_a_reader_needs(judged: Judgement) -> None:
    values = row(judged)
    assert list(values) == list(QUANTITIES)
    for name, quantity in QUANTITIES.items():
        assert quantity.name == name
        assert quantity.meaning
        assert quantity.symbol
        assert quantity.better in ("greater", "smaller")
        reading = read(judged, name)
        if quantity.simulated and judged.slew.exact:
            assert math.isnan(reading.value)
            assert "no conditions" in reading.note
            continue
        assert not math.isnan(reading.value), name
        assert not reading.doubt, (name, reading.doubt)
        if math.isinf(reading.value):
            assert reading.note, name


def test_every_quantity_is_followed_until_two_truths_agree(judged: Judgement) -> None:
    for quantity in quantities_of(judged.slew):
        name = quantity.name
        followed = follow(judged, name)
        assert followed.converged, name
        assert [seen.modes for seen in followed.seen[:2]] == [10, 20]
        first, second = (seen.reading.value for seen in followed.deciding)
        if math.isfinite(first):
            assert abs(first - second) <= max(0.01 * abs(first) * 1.01, quantity.resolution)
        assert followed.reading.value in (first, second)


def test_decibels_and_ratios_are_the_same(judged: Judgement) -> None:
    values = row(judged)
    for name in ("sensitivity_peak", "complementary_peak"):
        assert_allclose(values[f"{name}_db"], 20 * np.log10(values[name]), rtol=1e-12)
    assert_allclose(values["sensitivity_peak"], 1 / values["modulus_margin"], rtol=1e-12)
    both = values["gain_margin_up_db"], values["gain_margin_down_db"]
    assert values["gain_margin_db"] == min(both)


def test_every_quantity_appears_in_every_output(judged: Judgement) -> None:
    """One registry: design file, gate, tables, columns of studies and descriptions."""
    assert {quantity.name for quantity in REQUIREMENTS.values()} == set(QUANTITIES)
    text = describe(judged)
    for quantity in quantities_of(judged.slew):
        assert quantity.name in text
    left_out = {"stable", "h2_cost", "sensitivity_peak_db", "complementary_peak_db"}
    for name, quantity in QUANTITIES.items():
        scaled = name not in left_out and quantity.kind != "noise" and quantity.unit != "V"
        scaled = scaled and not quantity.simulated  # the slews of a study are exact
        assert (column(quantity) in COLUMNS) == scaled
    assert not {column(quantity) for quantity in QUANTITIES.values()} & set(AXES)
    assert set(RECORDED) < set(QUANTITIES)


def test_every_quantity_is_a_column_of_the_comparison() -> None:
    (case,) = compare([CASE]).cases
    for found in case.rows():
        assert set(QUANTITIES) < set(found)


def test_every_requirement_is_told_by_the_gate(tmp_path: Path) -> None:
    limits = {
        key: 0.0 if quantity.better == "greater" else 1e9
        for key, quantity in REQUIREMENTS.items()
        if key != "stable"
    }
    path = tmp_path / "x.toml"
    path.write_text(QUICK.partition("[requirements]")[0] + "[requirements]\n" + "".join(
        f"{key} = {limit}\n" for key, limit in limits.items()
    ))  # fmt: skip
    result = examine(read_design(path))
    assert not result.error
    table = verdict_table([result], every=True, failures=False)
    assert table is not None
    outputs = {
        "table": " ".join(str(cell) for cell in table.columns[2].cells),
        "junit": to_junit([result]),
        "json": json_text(to_record([result], "1")),
    }
    for key in REQUIREMENTS:
        for name, text in outputs.items():
            assert key in text, (key, name)


def test_the_optimum_has_the_clock_of_the_controller() -> None:
    """A sampled design is compared with the best that has its clock and delay."""
    sampled = evaluate(CLOCKED).judgement
    continuous = evaluate(CASE).judgement
    assert sampled.optimum.sample_time == 0.01
    assert sampled.optimum.delay == 0.004
    assert sampled.optimum.h2_cost > continuous.optimum.h2_cost
    assert 0 < sampled.loss < 1e-3
    against_continuous = sampled.cost / continuous.optimum.h2_cost - 1
    assert against_continuous > 10 * sampled.loss
