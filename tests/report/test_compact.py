"""Figures with less text: the same points, the same looks, every reference whole."""

from __future__ import annotations

import io
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slewctl.report.compact import compact
from slewctl.report.drawing import figure, legend, svg

coordinates = st.floats(-500, 500).map(lambda x: round(x, 6))
lines = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=20)


def points_of(path: str) -> list[tuple[float, float]]:
    """Return the points of a path of M, L and l, which may leave out spaces before a minus."""
    found: list[tuple[float, float]] = []
    for command, text in re.findall(r"([MLl])([^MLl]*)", path):
        numbers = [float(n) for n in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", text)]
        for x, y in zip(numbers[::2], numbers[1::2], strict=True):
            x0, y0 = found[-1] if command == "l" else (0.0, 0.0)
            found.append((x + x0, y + y0))
    return found


@given(st.lists(lines, min_size=1, max_size=3))
def test_paths_keep_their_points(parts: list[list[tuple[float, float]]]) -> None:
    path = " ".join("M " + " L ".join(f"{x:.6f} {y:.6f}" for x, y in part) for part in parts)
    short = compact(f'<svg><style></style><path d="{path}"/></svg>', "f")
    drawn = points_of(re.findall(r'd="([^"]*)"', short)[0])
    # Half a tenth of a point for rounding, and nothing that adds up along the line.
    assert np.abs(np.array(drawn) - np.concatenate(parts)).max() <= 0.05 + 1e-9


@pytest.fixture(scope="module")
def drawn() -> str:
    fig, axes = figure(1, 2)
    for ax in axes:
        ax.plot([1, 2, 3], [3, 1, 2], "o--", label="a & b")
        ax.set_yscale("log")
        legend(ax)
    return svg(fig, "x0", 'A "picture"')


def test_figure_is_well_formed_and_every_reference_is_there(drawn: str) -> None:
    tree = ElementTree.fromstring(drawn)
    ids = [e.get("id") for e in tree.iter() if e.get("id")]
    assert len(ids) == len(set(ids))
    for reference in re.findall(r'(?:url\(#|href="#)([^")]+)', drawn):
        assert reference in ids


def test_every_class_has_its_rule_and_is_the_figures_own(drawn: str) -> None:
    classes = set(re.findall(r'class="([^"]+)"', drawn))
    rules = dict(re.findall(r"\.([\w-]+)\{([^}]+)\}", drawn))
    assert classes == set(rules)
    assert all(name.startswith("x0-") for name in classes)
    assert any("stroke" in rule for rule in rules.values())


def test_empty_groups_leave_the_others_closed() -> None:
    text = '<svg><style></style><g><g id="a"/><g transform="scale(1)"><g><g/></g></g></g></svg>'
    assert compact(text, "f") == '<svg><style></style><g transform="scale(1)"></g></svg>'


def test_it_is_shorter_by_more_than_half() -> None:
    fig, axes = figure()
    axes[0].plot(np.linspace(0, 1, 300), np.sin(np.linspace(0, 40, 300)))
    axes[0].set_xscale("log")
    plain = io.StringIO()
    fig.savefig(plain, format="svg")
    assert len(svg(fig, "x", "wave")) < 0.5 * len(plain.getvalue())
