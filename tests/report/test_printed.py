"""Figures, tables and data for papers."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from slewctl.compare import CaseResult, Comparison
from slewctl.errors import InputError
from slewctl.report import write_figures
from slewctl.report.comparison_figures import figures
from slewctl.report.printed import STYLES, _data, _table, _tex, design_files

KINDS = ("bode", "poles", "shapes")


@pytest.fixture(scope="module")
def written(
    small_case: CaseResult, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, str | bytes]]:
    # All kinds of axes, marks and words are in three of the figures; all would take long.
    some = [each for each in figures(small_case) if each[0] in KINDS]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("slewctl.report.printed.figures", lambda _: some)
        files = design_files(0, small_case, "paper")
    folder = write_figures(
        Comparison((small_case,)), tmp_path_factory.mktemp("figures"), drawn=[files]
    )
    return folder, files


@pytest.mark.slow
def test_figures_are_written_at_the_papers_width(
    written: tuple[Path, dict[str, str | bytes]],
) -> None:
    folder, files = written
    assert len(files) == 3 * len(KINDS) + 2
    for kind in KINDS:
        pdf, picture = (next(folder.glob(f"*-{kind}.{end}")) for end in ("pdf", "png"))
        assert pdf.read_bytes().startswith(b"%PDF")
        box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ", pdf.read_bytes())
        assert box
        assert float(box[1]) == pytest.approx(72 * STYLES["paper"].width)
        with Image.open(picture) as image:
            assert image.width == 300 * STYLES["paper"].width
            assert len(image.convert("L").getcolors()) > 50


@pytest.mark.slow
def test_data_beside_a_figure_are_the_computed_curves(
    written: tuple[Path, dict[str, str | bytes]], small_case: CaseResult
) -> None:
    (path,) = written[0].glob("*-bode.csv")
    rows = list(csv.DictReader(path.open(encoding="utf-8")))
    for curve in small_case.curves:
        for quantity, values in (("|L| (dB)", curve.gain_db), ("arg L (deg)", curve.phase_deg)):
            own = [
                (float(r["frequency (Hz)"]), float(r["value"]))
                for r in rows
                if r["design"].startswith(str(curve.origin)) and r["quantity"] == quantity
            ]
            expected = np.column_stack([curve.frequency_hz, values])
            assert np.array(own) == pytest.approx(expected, rel=1e-8)


def test_data_are_what_was_computed_and_not_the_drawing_of_it(small_case: CaseResult) -> None:
    """Floors, gaps and marks of a drawing are none of its data."""
    labels = [{"label": str(curve.origin)} for curve in small_case.curves]
    drawn = {kind: plot for kind, plot, _ in figures(small_case)}
    rows = {
        kind: list(_data(drawn[kind].panels, labels))
        for kind in ("ladder", "sensitivity", "nyquist")
    }
    for kind, own in rows.items():
        assert len({tuple(row.values()) for row in own}) == len(own)
        numbers = [v for row in own for v in row.values() if not isinstance(v, str)]
        assert np.isfinite(numbers).all(), kind
    told = [row["value"] for row in rows["ladder"] if row["quantity"] == "lost (%)"]
    losses = [rung.value("h2_loss") for ladder in small_case.ladders for rung in ladder.rungs]
    assert told == [100 * loss for loss in losses if loss is not None and np.isfinite(loss)]
    for quantity in ("|S| (dB)", "|T| (dB)"):
        values = [row["value"] for row in rows["sensitivity"] if row["quantity"] == quantity]
        assert values.count(-90.0) <= 1


@pytest.mark.slow
def test_tables_are_whole_tabulars(written: tuple[Path, dict[str, str | bytes]]) -> None:
    for path in written[0].glob("*.tex"):
        lines = path.read_text("utf-8").splitlines()
        columns = re.fullmatch(r"\\begin\{tabular\}\{([lr]+)\}", lines[1])
        assert columns
        rows = [line for line in lines if line.endswith("\\\\")]
        assert {line.count(" & ") for line in rows} == {len(columns[1]) - 1}
        beside = list(csv.reader(path.with_suffix(".csv").open(encoding="utf-8")))
        assert len(beside) == len(rows)
        assert [lines[k] for k in (2, 4, -2, -1)] == [
            "\\toprule", "\\midrule", "\\bottomrule", "\\end{tabular}",
        ]  # fmt: skip


@given(st.text(st.characters(codec="ascii"), min_size=1))
def test_no_text_is_a_command_in_latex(text: str) -> None:
    plain = re.sub(r"\\text[a-z]+\{\}|\\[&%$#_{}]", "", _tex(text))
    assert not set(plain) & set("\\&%$#_{}~^")


def test_numbers_stand_in_mathematics() -> None:
    tables = _table("t", [{"a": 1.5e-9, "b": float("inf"), "c": None, "d": -2.0, "e": "x_y"}])
    text = tables["t.tex"]
    assert isinstance(text, str)
    row = text.splitlines()[5]
    assert row == "$1.5 \\times 10^{-9}$ & $\\infty$ & $-2$ & x\\_y \\\\"
    assert list(csv.reader(io.StringIO(str(tables["t.csv"]))))[1][2] == ""


def test_an_unknown_style_is_refused_with_the_nearest(small_case: CaseResult) -> None:
    with pytest.raises(InputError, match="did you mean 'paper'"):
        design_files(0, small_case, "papper")
