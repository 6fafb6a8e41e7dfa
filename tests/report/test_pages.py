"""The pages: self-contained, well-formed, the same bytes every time, every picture in them."""

from __future__ import annotations

import csv
import gzip
import json
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from slewctl.compare import compare, evaluate
from slewctl.files import read_design
from slewctl.paper import PaperReproduction
from slewctl.report import write_comparison, write_paper
from slewctl.report.comparison import _proof
from slewctl.report.page import hertz, number, percent

DESIGNS = Path(__file__).parents[2] / "designs"
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]
VOID = {"meta", "link", "br", "img", "hr"}


class Page(HTMLParser):
    """Collects what a page refers to, and checks that its elements close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: Counter[str] = Counter()
        self.addresses: list[str] = []
        self.pictures = 0
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.pictures += ("role", "img") in attrs
        for name, value in attrs:
            if name == "id":
                self.ids[value or ""] += 1
            if name in ("src", "href", "xlink:href"):
                self.addresses.append(value or "")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def pages(
    tmp_path_factory: pytest.TempPathFactory, reproduction: PaperReproduction
) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("reports")
    cases = [read_design(path).case for path in sorted(DESIGNS.glob("*.toml"))[:2]]
    comparison = compare([replace(case, orders=(1, 2)) for case in cases])
    for name in ("first", "second"):
        write_comparison(comparison, folder / f"comparison-{name}")
        write_paper(reproduction, folder / f"paper-{name}")
    return {p.parent.name: p for p in folder.glob("*/index.html")}


@pytest.mark.parametrize(("name", "pictures"), [("comparison-first", 16), ("paper-first", 7)])
def test_page_is_whole_and_self_contained(pages: dict[str, Path], name: str, pictures: int) -> None:
    text = pages[name].read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    assert page.pictures == pictures
    assert [i for i, count in page.ids.items() if count > 1] == []
    for address in page.addresses:
        assert address.startswith(("#", "data:")), address
        if address.startswith("#"):
            assert address[1:] in page.ids
    for reference in re.findall(r"url\(#([^)]+)\)", text):
        assert reference in page.ids
    shown = re.sub(r"<script>.*?</script>", "", text, flags=re.S)
    assert not re.search(r"\bnan\b", shown, flags=re.I)


def test_the_page_of_an_arm_without_damping_reads_as_sentences(tmp_path: Path) -> None:
    case = read_design(DESIGNS / "01-paper-beam.toml").case
    undamped = replace(case, arm=replace(case.arm, damping_ratio=0.0), orders=(3,), truth_modes=8)
    text = write_comparison(compare([undamped]), tmp_path).read_text(encoding="utf-8")
    assert "The arm has no damping" in text
    shown = re.sub(r"<(script|style|svg).*?</\1>", "", text, flags=re.S)
    words = re.sub(r"</?(b|i|a|span|sub|sup|code)\b[^>]*>", "", shown)
    assert not re.findall(r"[a-z)][.:;,][A-Z]\w*", words)


@pytest.mark.parametrize("kind", ["comparison", "paper"])
def test_reports_are_the_same_bytes_every_time(pages: dict[str, Path], kind: str) -> None:
    first, second = pages[f"{kind}-first"].parent, pages[f"{kind}-second"].parent
    for path in first.iterdir():
        assert path.read_bytes() == (second / path.name).read_bytes()


def test_a_page_says_what_proves_a_sampled_delay_margin() -> None:
    told = [
        _proof(evaluate(read_design(DESIGNS / f"{name}.toml").case))
        for name in ("02-hub-as-heavy-as-the-beam", "06-sampled-lqg-with-delay")
    ]
    assert all(text.startswith("are proved on ") for text in told)
    assert ["that of the delay" in text for text in told] == [False, True]


def test_unstable_designs_are_named_with_their_frequency(pages: dict[str, Path]) -> None:
    folder = pages["comparison-first"].parent
    results = json.loads((folder / "results.json").read_text())
    text = pages["comparison-first"].read_text(encoding="utf-8")
    unstable = [e for c in results["cases"] for e in c["evaluations"] if not e["stable"]]
    assert unstable
    for e in unstable:
        assert f"unstable<br>{number(e['unstable_hz'][0])} Hz" in text


def test_markdown_tells_the_same_designs(pages: dict[str, Path]) -> None:
    folder = pages["comparison-first"].parent
    text = (folder / "index.md").read_text(encoding="utf-8")
    results = json.loads((folder / "results.json").read_text())
    for case in results["cases"]:
        assert f"## {case['case']['name']}" in text
        for e in case["evaluations"]:
            loss = e["quantities"]["h2_loss"]["value"]
            told = number(loss, 3) if e["stable"] else f"**unstable**, {hertz(e['unstable_hz'][0])}"
            row = rf"^\| {e['basis']}[^|]*\| {e['n']}( \|.*)? \| {re.escape(told)} \|"
            assert re.search(row, text, re.M)
    tables = re.findall(r"(?:^\|.*\n)+", text, re.M)
    assert len(tables) == 5 * len(results["cases"])
    for table in tables:  # every row has as many cells as its heading
        assert len({line.count("|") for line in table.splitlines()}) == 1
        # Without this line under its heading nothing takes it for a table.
        assert re.fullmatch(r"\|(:?-{3,}:?\|)+", table.splitlines()[1])
    assert "\\|" not in text


def test_ladders_reach_the_whole_truth(pages: dict[str, Path]) -> None:
    folder = pages["comparison-first"].parent
    designs = list(csv.DictReader((folder / "designs.csv").open()))
    with gzip.open(folder / "ladders.csv.gz", "rt") as packed:
        rungs = list(csv.DictReader(packed))
    last = {(r["case"], r["basis"], r["n"]): r for r in rungs}
    assert last
    for design in designs:
        rung = last.get((design["case"], design["basis"], design["n"]))
        if rung is not None:
            assert rung["modes"] == "20"
            assert rung["stable"] == design["stable"]
            assert rung["disk_margin"] == design["disk_margin"]


def test_numbers_for_readers() -> None:
    assert number(None) == "–"
    assert number(float("inf")) == "∞"
    assert number(-1.5) == "−1.5"
    assert percent(0.0361) == "3.61 %"
    assert percent(1e-9) == "< 0.01 %"
    assert percent(115.0) == "11,500 %"
