"""The reports in the repository belong to its designs and to this code."""

from __future__ import annotations

import csv
import gzip
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from browsing import value

from slewctl.compare import StudyResult, Work, evaluate, evaluate_point, quantities_of, read
from slewctl.compare.study.answer import PAPERS, along, answer
from slewctl.compare.study.designs import HUB, Designs
from slewctl.files import read_designs, read_study
from slewctl.report import write_study
from slewctl.report.export import to_plain

ROOT = Path(__file__).parents[2]
REPORTS = ROOT / "reports"
STUDY = ROOT / "designs" / "studies" / "basis.toml"


def test_comparison_holds_every_design_as_it_is() -> None:
    results = json.loads((REPORTS / "comparison" / "results.json").read_text())
    designs = read_designs([ROOT / "designs"])
    written = {case["case"]["name"]: case for case in results["cases"]}
    assert list(written) == [design.case.name for design in designs]
    for design in designs:
        assert anywhere(written[design.case.name]["case"]) == anywhere(to_plain(design.case))


def anywhere(case: dict[str, Any]) -> dict[str, Any]:
    """Return a case without where its files were found."""
    options = dict(case["options"])
    if "file" in options:
        options["file"] = Path(options["file"]).name
    return {key: case[key] for key in case if key != "source"} | {"options": options}


@pytest.mark.parametrize("name", ["02-hub-as-heavy-as-the-beam", "06-sampled-lqg-with-delay"])
def test_comparison_holds_the_numbers_of_this_code(name: str) -> None:
    results = json.loads((REPORTS / "comparison" / "results.json").read_text())
    (design,) = read_designs([ROOT / "designs" / f"{name}.toml"])
    found = evaluate(design.case)
    (written,) = (
        e
        for case in results["cases"]
        if case["case"]["name"] == name
        for e in case["evaluations"]
        if (e["basis"], e["n"]) == (found.basis, found.n)
    )
    assert set(written["quantities"]) == {q.name for q in quantities_of(design.case.slew)}
    for quantity, written_reading in written["quantities"].items():
        value = read(found.judgement, quantity).value
        if written_reading["value"] is None or math.isinf(float(written_reading["value"])):
            assert str(to_plain(value)) in {"nan", str(written_reading["value"])}
        else:
            assert written_reading["value"] == pytest.approx(value, rel=1e-6, abs=1e-9), quantity


def asked(study: dict[str, Any]) -> dict[str, Any]:
    """Return a study without the axis that its grids do not have."""
    grids = [{k: v for k, v in grid.items() if v != [None]} for grid in study["grids"]]
    return {**study, "grids": grids}


@pytest.mark.slow
def test_study_is_that_of_its_file_and_of_this_code() -> None:
    study = read_study(STUDY)
    written = json.loads((REPORTS / "study" / "results.json").read_text())
    assert asked(written["study"]) == asked(to_plain(study))
    with gzip.open(REPORTS / "study" / "rows.csv.gz", "rt") as file:
        rows = list(csv.DictReader(file))
    points = list(study.points())
    assert len(rows) == len(points)
    axes = ("hub_ratio", "payload_ratio", "damping_ratio", "bandwidth", "method", "basis", "n")
    by_axes = {tuple(row[a] for a in (*axes, "sensors")): row for row in rows}
    for point in points[:: len(points) // 4]:
        fresh = evaluate_point(Work(study.arm, study.truth_modes, point))[0]
        row = by_axes[tuple(str(to_plain(fresh[a])) for a in (*axes, "sensors"))]
        assert row["outcome"] == fresh["outcome"]
        if fresh["h2_loss"] is not None and math.isfinite(fresh["h2_loss"]):
            assert float(row["h2_loss"]) == pytest.approx(fresh["h2_loss"], rel=1e-5, abs=1e-8)


def study_rows() -> list[dict[str, Any]]:
    with gzip.open(REPORTS / "study" / "rows.csv.gz", "rt") as file:
        return [{k: value(k, v) for k, v in row.items()} for row in csv.DictReader(file)]


def test_the_guide_counts_what_the_study_does() -> None:
    rows = study_rows()
    designs = Designs(rows)
    found = answer(designs)
    text = " ".join((ROOT / "docs/does-the-basis-matter.md").read_text(encoding="utf-8").split())
    cantilever, slewing = PAPERS
    without, *others = along(designs, cantilever, slewing, HUB)
    assert without.value == 0
    won = [sum(d.first_wins for d in others), sum(d.second_wins for d in others)]
    right, all_won = found.told_by_frequencies
    gap = found.gap
    assert gap is not None
    assert gap.refuted == 0
    for told in (
        f"better in {without.second_wins} pairs of designs alike but for the basis and the "
        f"cantilever's in {without.first_wins};",
        f"the cantilever's in {won[0]} and the slewing ones in {won[1]}.",
        f"In {right} of the {all_won} pairs",
        f"certifies {gap.certified / gap.stable:.0%} of the stable designs".replace("%", " %"),
    ):
        assert told in text


@pytest.mark.slow
def test_study_says_what_this_code_makes_of_its_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # What is compared has no figures.
    monkeypatch.setattr("slewctl.report.study.map_figure", lambda *_: "")
    monkeypatch.setattr("slewctl.report.study.duel_figure", lambda *_: "")
    rows = study_rows()
    write_study(StudyResult(read_study(STUDY), rows), tmp_path)
    stamp = re.compile(r"^Made with .*$", re.M)
    fresh, written = (
        stamp.sub("", (folder / "index.md").read_text(encoding="utf-8"))
        for folder in (tmp_path, REPORTS / "study")
    )
    assert fresh == written
    # The rows' ten digits leave eight of what is counted from them.
    fresh_answer, written_answer = (
        json.loads((f / "results.json").read_text(), parse_float=lambda t: f"{float(t):.8g}")
        for f in (tmp_path, REPORTS / "study")
    )
    assert fresh_answer["answer"] == written_answer["answer"]


def test_reports_are_small() -> None:
    written = [path for path in REPORTS.rglob("*") if path.is_file()]
    # A study keeps its results as they come, to resume from; the repository does not.
    assert sum(path.stat().st_size for path in written if path.suffix != ".jsonl") < 3e6
