"""Plots of a page: what is drawn is what was computed, and the script reads the same from it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from browsing import verdict
from hypothesis import given
from hypothesis import strategies as st

from slewctl.compare import CaseResult, Comparison
from slewctl.loop.curves import Curve
from slewctl.report.comparison import section, write_comparison
from slewctl.report.comparison_figures import figures
from slewctl.report.plot import FINE, Panel, Plot, refined
from slewctl.report.scale import Axis, around, prefixed
from slewctl.report.thinning import thinned

SVG = "{http://www.w3.org/2000/svg}"


def paths(svg: str, role: str) -> dict[str, np.ndarray]:
    """Return the lines of a panel by their classes, in the units of its axes."""
    tree = ElementTree.fromstring(svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
                                  .replace(" data-x-marked", ""))  # fmt: skip
    (panel,) = (g for g in tree.iter(f"{SVG}g") if g.get("data-role") == role)
    _, _, width, height = map(float, panel.get("data-box", "").split())
    x, y = (read_axis(panel.get(f"data-{name}", "")) for name in "xy")
    found = {}
    for path in panel.iter(f"{SVG}path"):
        look = path.get("class", "")
        if not look.startswith("c "):
            continue
        points = np.concatenate([
            np.cumsum(np.reshape([int(n) for n in re.findall(r"-?\d+", run)], (-1, 2)), axis=0)
            for run in path.get("d", "").split("M")[1:]
        ])  # fmt: skip
        across, up = points.T / FINE / np.array([[width], [height]])
        found[look.removesuffix(" own")] = np.column_stack([unbent(x, across), unbent(y, 1 - up)])
    return found


def read_axis(text: str) -> Axis:
    kind, low, high, bend, step = text.split()
    return Axis("", float(low), float(high), kind, float(bend), float(step))  # type: ignore[arg-type]


def unbent(axis: Axis, part: np.ndarray) -> np.ndarray:
    low, high = axis.bent(axis.low), axis.bent(axis.high)
    value = low + part * (high - low)
    return 10**value if axis.kind == "log" else value


@pytest.mark.slow
def test_curves_on_the_page_are_the_computed_ones(small_case: CaseResult) -> None:
    bode = next(plot.svg() for kind, plot, _ in figures(small_case) if kind == "bode")
    gains, phases = paths(bode, "gain"), paths(bode, "phase")
    for k, curve in enumerate(small_case.curves):
        u = np.log(curve.frequency_hz)
        assert (np.diff(u) > 0).all()
        for values, found in ((curve.gain_db, gains), (curve.phase_deg, phases)):
            line = found[f"c o{k}"]
            # Every point drawn lies on the computed line, within half a part of a unit ...
            size = np.ptp(np.concatenate([path[:, 1] for path in found.values()]))
            slope = np.abs(np.diff(values) / np.diff(u)).max()
            allowed = size / 160 / FINE + slope * np.ptp(u) / 400 / FINE
            assert np.abs(np.interp(np.log(line[:, 0]), u, values) - line[:, 1]).max() <= allowed
            # ... and none is left out, but where two fall on each other.
            assert len(line) >= 0.95 * len(values)


@pytest.mark.slow
def test_slew_on_the_page_is_the_computed_one(small_case: CaseResult) -> None:
    slew = next(plot.svg() for kind, plot, _ in figures(small_case) if kind == "slew")
    tips = paths(slew, "tip")
    computed = {k: c.slew for k, c in enumerate(small_case.curves) if c.slew is not None}
    assert {f"c o{k}" for k in computed} == {look for look in tips if "o" in look}
    for k, response in computed.items():
        line = tips[f"c o{k}"]
        assert np.interp(response.t, *line.T) == pytest.approx(response.tip, abs=1e-4)


@pytest.mark.slow
def test_disk_of_the_margin_touches_the_curve_and_is_not_entered(small_case: CaseResult) -> None:
    nyquist = next(plot.svg() for kind, plot, _ in figures(small_case) if kind == "nyquist")
    lines = paths(nyquist, "nyquist")
    disk = lines["c disk"]
    centre, radius = (disk[:, 0].min() + disk[:, 0].max()) / 2, np.ptp(disk[:, 0]) / 2
    own = next(k for k, c in enumerate(small_case.curves) if c.origin == small_case.chosen.origin)
    line = lines[f"c o{own}"]
    between = np.linspace(0, len(line) - 1, 50 * len(line))
    re_, im = (np.interp(between, np.arange(len(line)), part) for part in line.T)
    assert np.hypot(re_ - centre, im).min() == pytest.approx(radius, rel=0.01)


@given(st.lists(st.integers(1, 60), max_size=4), st.integers(0, 10**6), st.booleans())
def test_lines_with_fewer_points_are_as_near_as_was_asked(
    sizes: list[int], seed: int, level: bool
) -> None:
    random = np.random.default_rng(seed)
    lines = [random.normal(size=(size, 2)).cumsum(axis=0) for size in sizes]
    if level:  # points that are equally far, and that lie on each other
        lines = [np.rint(line) for line in lines]
    found = thinned(lines, 0.5)
    assert len(found) == len(lines)
    for points, kept in zip(lines, found, strict=True):
        np.testing.assert_array_equal(kept[[0, -1]], points[[0, -1]])
        if not level:  # which of two equally far points is taken, rounding decides
            np.testing.assert_array_equal(kept, one_by_one(points, 0.5))
        if len(kept) == 1:
            continue
        for p in points:
            ends = np.diff(kept, axis=0)
            size = np.maximum((ends**2).sum(1), 1e-300)
            along = np.clip(((p - kept[:-1]) * ends).sum(1) / size, 0, 1)
            off = np.hypot(*(p - kept[:-1] - along[:, None] * ends).T)
            assert off.min() <= 0.5 + 1e-9


def one_by_one(points: np.ndarray, allowed: float) -> np.ndarray:
    """Return the points that the way of Ramer, Douglas and Peucker keeps, piece by piece."""
    if len(points) < 3:
        return points
    chord = points[-1] - points[0]
    away = points[1:-1] - points[0]
    along = np.clip(away @ chord / max(chord @ chord, 1e-300), 0, 1)
    off = np.hypot(*(away - along[:, None] * chord).T)
    worst = int(off.argmax()) + 1
    if off[worst - 1] <= allowed:
        return points[[0, -1]]
    head, tail = one_by_one(points[: worst + 1], allowed), one_by_one(points[worst:], allowed)
    return np.concatenate([head[:-1], tail])


@given(
    st.floats(-1e9, 1e9), st.floats(1e-6, 1e9),
    st.sampled_from(["linear", "log", "symlog"]), st.sampled_from([0.0, 45.0]),
)  # fmt: skip
def test_marks_lie_on_the_axis_in_order(low: float, size: float, kind: str, step: float) -> None:
    if kind == "log":
        low = abs(low) + 1e-6
    axis = Axis("", low, low + max(size, 1e-6 * abs(low)), kind, 0.01, step)  # type: ignore[arg-type]
    values = [value for value, _ in axis.marks()]
    places = axis.at(np.array(values))
    assert (np.diff(places) > 0).all()
    assert ((places >= -1e-6) & (places <= 1 + 1e-6)).all()
    if kind == "linear" and not step:
        assert 2 <= len(values) <= 8


def test_ends_of_an_axis_are_never_the_same() -> None:
    for values in ([0.0], [3.0, 3.0], [np.nan], [-2.0]):
        low, high = around(np.array(values))
        assert low < high


def test_refined_curves_follow_a_resonance() -> None:
    omega = np.unique(np.r_[np.geomspace(0.1, 10, 60), np.linspace(0.8, 1.25, 60)])
    values = loop(omega)
    fine, found = refined(omega, values)
    assert np.isin(omega, fine).all() or np.allclose(fine[::4], omega)
    assert np.abs(found / loop(fine) - 1).max() < 0.02


@pytest.mark.parametrize("apart", [1e-4, 1e-9, 1e-14])
def test_refined_curves_stay_near_to_an_undamped_resonance(apart: float) -> None:
    """A cubic through a pole on the axis would go to 1e±1000 between two points."""
    near = apart * np.array([1.0, 0.7, 0.5])
    omega = np.unique(np.r_[np.geomspace(0.1, 10, 60), 1 - near, 1 + near])
    values = 1 / (1 - omega**2) + 0j
    _, found = refined(omega, values)
    assert np.abs(found).max() < np.e * np.abs(values).max()
    assert np.abs(found).min() > np.abs(values).min() / np.e
    assert np.ptp(np.unwrap(np.angle(found))) < np.pi + 2  # no turn that is not there


def loop(omega: np.ndarray) -> np.ndarray:
    s = 1j * omega
    return 1 / (s**2 + 0.1 * s + 1)


@given(st.floats(-3.1, 3.1), st.integers(0, 10**6))
def test_equal_loops_have_their_phase_on_the_same_turn(turn: float, seed: int) -> None:
    # A loop begins at a multiple of 90 degrees; rounding puts it on either side.
    omega = np.geomspace(0.01, 100, 200)
    for quarter in range(4):
        values = loop(omega) * 1j**quarter
        noise = 1 + 1e-9 * np.random.default_rng(seed).normal(size=200) * np.exp(1j * turn)
        one, other = Curve(omega, values).phase_deg, Curve(omega, values * noise).phase_deg
        assert np.abs(one - other).max() < 1e-3


def test_axes_and_names_are_escaped() -> None:
    panel = Panel(Axis('a "<b>', 0, 1), Axis("&", 0, 1), 0, 100)
    panel.word(0.5, 0.5, "</text>")
    ElementTree.fromstring(Plot([panel], '<"&>').svg().replace(" data-x-marked", ""))


@pytest.mark.slow
def test_page_begins_with_the_verdicts_and_folds_into_pages(
    small_case: CaseResult, tmp_path: Path
) -> None:
    asked = [verdict("nominal", "gain_margin_db", True), verdict("light", "gain_margin_db", False)]
    shown = [section(0, small_case, asked)]
    comparison = Comparison((small_case,))
    whole = write_comparison(comparison, tmp_path / "whole", sections=shown).read_text("utf-8")
    assert "1 of 2 requirements fail" in whole
    assert whole.index("<h2>Requirements</h2>") < whole.index("<details")
    markdown = (tmp_path / "whole" / "index.md").read_text("utf-8")
    assert "**1 of 2 requirements fail.**" in markdown
    assert re.search(r"\| light \| gain\S+ \| 4.2 dB \| \S*>= 6 dB \| \*\*no\*\* \|", markdown)
    split = write_comparison(comparison, tmp_path / "split", sections=shown, split=True)
    overview = split.read_text("utf-8")
    assert "<figure" not in overview
    (name,) = set(re.findall(r'href="([^"#]+\.html)"', overview))
    own = (split.parent / name).read_text("utf-8")
    assert re.findall(r"<figure.*?</figure>", own, re.S) == re.findall(
        r"<figure.*?</figure>", whole, re.S
    )
    assert json.loads((split.parent / "results.json").read_text())["cases"]


@given(st.floats(1e-13, 1e11), st.sampled_from([-1, 0, 1]))
def test_a_prefix_changes_the_unit_and_not_the_value(most: float, usual: int) -> None:
    values = np.array([-most, 0.5 * most, np.nan])
    factor, unit = prefixed(values, "m", usual)
    size = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
    assert factor * size[unit.removesuffix("m")] == pytest.approx(1.0)
    if 1e-12 <= most < 1e12:
        assert 1e-2 <= factor * most < 1e4
