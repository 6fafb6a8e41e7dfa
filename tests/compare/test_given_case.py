"""A given law in a comparison, a ladder and a report: nothing of it is made on a basis."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

import slewctl as sc
from slewctl.basis import NAMES
from slewctl.cli.comparing import print_ladder
from slewctl.compare import Case, Grid, compare, compare_reductions, spillover_ladder
from slewctl.errors import InputError
from slewctl.plant import Objective, signals_alone
from slewctl.report import write_comparison

ARM = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
NOISE = {"torque": 0.1, "theta": 0.01}
LAW = {"pid": {"kp": 1.0, "kd": 0.5, "filter_hz": 20.0}}
# The truth is made of polynomial functions, and says so.
MADE_ON = re.compile("|".join([*(set(NAMES) - {"polynomial"}), r"n = \d"]))
CASE = Case(
    "mine",
    ARM,
    Objective({"tip": 0.03, "torque": 1.0}, NOISE),
    basis="slewing",
    n=3,
    method="given",
    options=LAW,
    truth_modes=4,
)


def test_no_page_and_no_table_says_that_a_given_law_is_made_on_a_basis(tmp_path: Path) -> None:
    found = compare([CASE])
    (result,) = found.cases
    assert len(result.evaluations) == 1
    assert str(result.chosen.origin) == "given"
    assert result.chosen.worst_frequency_error is None
    write_comparison(found, tmp_path)
    for name in ("index.html", "index.md"):
        text = (tmp_path / name).read_text()
        section = text[text.index("Arm: ") :].partition("Made with")[0]
        assert MADE_ON.search(re.sub(r"<(svg|details).*?</\1>", "", section, flags=re.S)) is None
        assert "pillover: the same method" not in section
        # The derivative passes white noise straight to the torque.
        assert "white sensor noise passes straight to the actuator" in section
    (row,) = csv.DictReader((tmp_path / "designs.csv").open())
    assert (row["basis"], row["n"], row["worst_frequency_error"]) == ("", "", "")


def test_without_limits_and_noise_a_page_tells_of_no_cost(tmp_path: Path) -> None:
    case = replace(CASE, objective=signals_alone(["theta"], "torque"))
    found = compare([case])
    (result,) = found.cases
    assert result.chosen.loss is None
    write_comparison(found, tmp_path)
    for name in ("index.html", "index.md"):
        text = (tmp_path / name).read_text()
        section = text[text.index("Arm: ") :].partition("Made with")[0]
        assert re.search("optim|cost|lost of", section.partition("<details")[0]) is None
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["cases"][0]["truth"]["optimal_cost"] is None
    (row,) = csv.DictReader((tmp_path / "designs.csv").open())
    assert (row["optimal_cost"], row["h2_loss"]) == ("", "")
    assert float(row["phase_margin_deg"]) > 10


def test_ladder_of_a_given_law_begins_at_the_first_mode_and_blames_no_designer() -> None:
    ladder = spillover_ladder(CASE)
    assert [rung.modes for rung in ladder.rungs] == [1, 2, 3, 4]
    assert ladder.verdict.startswith("the given law is stable with N = 1 to 4 modes")
    from_tip = {**LAW, "inputs": ["tip"]}
    lost = replace(
        CASE, objective=Objective(CASE.objective.limits, NOISE | {"tip": 0.01}), options=from_tip
    )
    verdict = spillover_ladder(lost).verdict
    assert re.match(r"the given law is lost at N = \d: mode \d at [\d.]+ Hz, as a pole", verdict)


@pytest.mark.parametrize("other", [{"basis": "slewing"}, {"n": 1}])
def test_a_given_law_is_designed_on_nothing_else(other: dict[str, object]) -> None:
    with pytest.raises(InputError, match="a given law is made on no basis"):
        spillover_ladder(CASE, **other)  # type: ignore[arg-type]


def test_a_given_law_is_no_method_of_designs() -> None:
    with pytest.raises(InputError, match="made on no model"):
        compare_reductions(CASE, order=1)
    with pytest.raises(InputError, match="methods"):
        Grid(methods=("given",))


def test_ladder_without_weights_tells_no_loss(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A law from the root moment alone has no optimum at all: it does not see the angle."""
    case = replace(
        CASE,
        objective=signals_alone(["root_moment"], "torque"),
        options={"pid": {"kp": 1e-3}, "inputs": ["root_moment"]},
    )
    assert [row["h2_loss"] for row in spillover_ladder(case).rows()] == [None] * 4
    path = tmp_path / "mine.toml"
    path.write_text(
        '[arm]\ncatalogue = "paper-beam"\nhub = { inertia = 0.2 }\ndamping_ratio = 0.01\n'
        '[controller]\nmethod = "given"\npid = { kp = 1.0, kd = 0.5, filter_hz = 20.0 }\n'
        "[truth]\nmodes = 4\n"
    )
    print_ladder(path, None, None)
    printed = capsys.readouterr().out.splitlines()
    assert printed[1].split() == ["modes", "N", "up", "to", "(Hz)", "gain", "(dB)", "phase",
                                  "(deg)", "disk"]  # fmt: skip
    assert [len(line.split()) for line in printed[2:]] == [5] * 4  # as many as the file asks for
