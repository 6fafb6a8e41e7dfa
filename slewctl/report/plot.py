"""Plots of a page: vector figures that stand without script and hold the data for it.

A curve's path is its data: points in hundredths of a unit, on axes that the panel names, so
that the page's script reads from it what it tells and draws it again, enlarged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.escape import quoted
from slewctl.report.scale import Axis
from slewctl.report.thinning import thinned

# Units across every plot, which are pixels where it is shown as wide as that.
WIDTH = 480.0
# Of a panel that has a figure to itself.
HEIGHT = 372.0
# Parts of a unit that a path is written in.
FINE = 100
# What a line may be off when points are left out, in units.
_SIMPLE = 0.08
_LEFT, _RIGHT = 52.0, 10.0
# Classes of the marks at points, and their paths from there.
_GLYPHS = {"dots": ("p", "h0"), "crosses": ("x", "m-400-400l800 800m0-800l-800 800")}


@dataclass(frozen=True, eq=False)
class Item:
    """Something that is drawn on a pair of axes.

    Attributes
    ----------
    kind : {"curve", "dots", "crosses", "word"}
    x, y : ndarray
        In the units of the axes.
    look : str
        ``o0``, ``o1`` … for the designs in order, or a name that the style gives a look to.
    text : str
    dy : float
        How far below the point a word stands, in units.
    simple : bool
    of : object
        What it is the line of, if it can be known again by that.
    data : ndarray, optional
        What y is where the drawing ends at a floor.
    """

    kind: Literal["curve", "dots", "crosses", "word"]
    x: Array
    y: Array
    look: str
    text: str = ""
    dy: float = 0.0
    simple: bool = False
    of: object = None
    data: Array | None = None


# Paths of lines by what they are lines of, and then by axes and place: a page that is drawn again
# and again has lines that stay.
_DRAWN: WeakKeyDictionary[object, dict[tuple[object, ...], str]] = WeakKeyDictionary()


@dataclass
class Panel:
    """A pair of axes with what is drawn on them.

    Attributes
    ----------
    x, y : Axis
    top, height : float
        In units.
    link : str
        Panels of a design with the same name move together along x.
    role : str
        What the curves are, for the script: "gain", "phase", "nichols", "nyquist" …
    x_marked : bool
        Whether the x axis has its numbers and label: the lowest panel's of those above each
        other.
    left, width : float
    """

    x: Axis
    y: Axis
    top: float
    height: float
    link: str = ""
    role: str = ""
    x_marked: bool = True
    left: float = _LEFT
    width: float = WIDTH - _LEFT - _RIGHT
    items: list[Item] = field(default_factory=list)

    def curve(
        self,
        x: Array,
        y: Array,
        look: str,
        *,
        simple: bool = False,
        of: object = None,
        data: Array | None = None,
    ) -> None:
        """Draw a line; a value that is not finite is a gap in it.

        Parameters
        ----------
        x, y : ndarray
        look : str
            Classes.
        simple : bool
            Whether points that make no difference to the eye are left out of the page.
        of : object, optional
            What it is the line of.  In panels with the same role and axes the first line of
            one is always the same, and so is the second: they are written once.
        data : ndarray, optional
            What y is where the drawing ends at a floor.
        """
        self.items.append(Item("curve", x, y, look, simple=simple, of=of, data=data))

    def dots(self, x: Array, y: Array, look: str, *, data: Array | None = None) -> None:
        """Draw a dot at every point."""
        self.items.append(Item("dots", x, y, look, data=data))

    def crosses(self, x: Array, y: Array, look: str) -> None:
        """Draw a cross at every point."""
        self.items.append(Item("crosses", x, y, look))

    def across(self, value: float, look: str) -> None:
        """Draw a level line."""
        self.curve(np.array([self.x.low, self.x.high]), np.full(2, value), look)

    def upright(self, x: float, low: float, high: float, look: str) -> None:
        """Draw a line upwards."""
        self.curve(np.full(2, x), np.array([low, high]), look)

    def word(self, x: float, y: float, text: str, look: str = "", dy: float = 0.0) -> None:
        """Write at a point, or so many units below it."""
        self.items.append(Item("word", np.array([x]), np.array([y]), look, text, dy))

    def svg(self) -> str:
        """Return the panel's element."""
        box = f"{self.left:g} {self.top:g} {self.width:g} {self.height:g}"
        axes = "".join(
            f' data-{name}="{axis.kind} {axis.low:.9g} {axis.high:.9g} {axis.bend:g} {axis.step:g}"'
            f' data-{name}-label="{quoted(axis.label)}"'
            for name, axis in (("x", self.x), ("y", self.y))
        )
        told = f' data-link="{self.link}" data-role="{self.role}"' if self.link or self.role else ""
        marked = " data-x-marked" if self.x_marked else ""
        lines = "".join(self._paths())
        words = "".join(self._word(item) for item in self.items if item.kind == "word")
        return (
            f'<g class="panel" data-box="{box}"{axes}{told}{marked}><g class="marks">'
            f"{self._marks()}</g>{self._labels()}"
            f'<svg x="{self.left:g}" y="{self.top:g}" width="{self.width:g}"'
            f' height="{self.height:g}"><g transform="scale({1 / FINE:g})">'
            f"{lines}</g>{words}</svg></g>"
        )

    def _points(self, x: Array, y: Array) -> Array:
        """Return points in parts of a unit from the panel's upper left corner."""
        across, up = self.x.at(x) * self.width, (1 - self.y.at(y)) * self.height
        return np.column_stack([across, up]) * FINE

    def _paths(self) -> Iterator[str]:
        """Yield the paths of lines, dots and crosses in the order in which they were drawn."""
        items = [item for item in self.items if item.kind != "word"]
        written = [self._written(item, items[:k]) for k, item in enumerate(items)]
        new = [item for item, (known, key) in zip(items, written, strict=True) if key not in known]
        runs = [self._runs(item) for item in new]
        simple = [run for item, own in zip(new, runs, strict=True) if item.simple for run in own]
        fewer = iter(thinned(simple, FINE * _SIMPLE))
        drawn = iter(runs)
        for item, (known, key) in zip(items, written, strict=True):
            if item.kind == "curve":
                if key not in known:
                    own = ((next(fewer) if item.simple else run) for run in next(drawn))
                    known[key] = "".join(map(_line, own))
                name, path = "c", known[key]
            else:
                name, glyph = _GLYPHS[item.kind]
                path = "".join(f"{_line(p[None])}{glyph}" for run in next(drawn) for p in run)
            yield f'<path class="{name} {item.look}" d="{path}"/>' if path else ""

    def _written(
        self, item: Item, before: Sequence[Item]
    ) -> tuple[dict[tuple[object, ...], str], tuple[object, ...]]:
        """Return the paths of what an item is a line of, and by what its own is known there."""
        if item.of is None:
            return {}, ()
        place = sum(other.of is item.of for other in before)
        key = (self.role, self.x, self.y, self.width, self.height, place)
        return _DRAWN.setdefault(item.of, {}), key

    def _runs(self, item: Item) -> list[Array]:
        """Return the points of a line between its gaps."""
        points = self._points(item.x, item.y)
        known = np.isfinite(points).all(axis=1)
        ends = np.flatnonzero(np.diff(np.r_[False, known, False]))
        return [points[a:b] for a, b in zip(ends[::2], ends[1::2], strict=True)]

    def _word(self, item: Item) -> str:
        ((u, v),) = self._points(item.x, item.y) / FINE
        place = f'x="{u:.1f}" y="{v + item.dy:.1f}"'
        return f'<text class="w {item.look}" {place}>{quoted(item.text)}</text>'

    def _marks(self) -> str:
        """Return the grid with its numbers."""
        right, bottom = self.left + self.width, self.top + self.height
        lines, words = "", ""
        for value, text in self.x.marks():
            at = self.left + float(self.x.at(value)) * self.width
            lines += f"M{at:.1f} {self.top:g}V{bottom:g}"
            if self.x_marked:
                words += f'<text class="m" x="{at:.1f}" y="{bottom + 13:g}">{text}</text>'
        for value, text in self.y.marks():
            at = bottom - float(self.y.at(value)) * self.height
            lines += f"M{self.left:g} {at:.1f}H{right:g}"
            words += f'<text class="e" x="{self.left - 5:g}" y="{at + 4:.1f}">{text}</text>'
        return f'<path class="g" d="{lines}"/>{words}'

    def _labels(self) -> str:
        """Return the frame's two lines, and what the axes are."""
        bottom = self.top + self.height
        middle = self.top + self.height / 2
        words = f'<path class="f" d="M{self.left:g} {self.top:g}V{bottom:g}h{self.width:g}"/>'
        if self.left == _LEFT:
            turned = f'transform="translate(11 {middle:g})rotate(-90)"'
            words += f'<text class="m" {turned}>{quoted(self.y.label)}</text>'
        if self.x_marked:
            place = f'x="{self.left + self.width / 2:g}" y="{bottom + 28:g}"'
            words += f'<text class="m" {place}>{quoted(self.x.label)}</text>'
        return words


@dataclass(frozen=True, eq=False)
class Plot:
    """Panels that make one figure, and what they show, for readers who don't see it."""

    panels: Sequence[Panel]
    description: str

    def svg(self) -> str:
        """Return the ``<svg>`` of the panels, as high as they need."""
        height = max(p.top + p.height + (34 if p.x_marked else 8) for p in self.panels)
        inside = "".join(panel.svg() for panel in self.panels)
        return (
            f'<svg class="plot" role="img" aria-label="{quoted(self.description)}"'
            f' viewBox="0 0 {WIDTH:g} {height:g}">{inside}</svg>'
        )


def stacked(
    x: Axis, ys: Iterable[tuple[Axis, float, str]], link: str, top: float = 8.0
) -> list[Panel]:
    """Return panels above each other that share x, from axis, height and role of each."""
    listed, panels = list(ys), []
    for k, (y, height, role) in enumerate(listed):
        panels.append(Panel(x, y, top, height, link, role, k == len(listed) - 1))
        top += height + 12
    return panels


# How far in nepers, and in rad, a curve may go beyond two points of it between them.
_BEYOND = 1.0


def refined(omega: Array, values: ComplexArray, parts: int = 4) -> tuple[Array, ComplexArray]:
    """Return a loop's curve with more points: its log by a cubic through each pair of points.

    Beside a pole on the axis, where it is hardly a cubic, it stays near to both.
    """
    apart = np.r_[True, np.diff(np.log(omega)) > 0]
    omega, values = omega[apart], values[apart]
    u = np.log(omega)
    log = np.log(np.abs(values)) + 1j * np.unwrap(np.angle(values))
    slopes = np.gradient(log, u)
    width, t = np.diff(u)[:, None], np.arange(parts) / parts
    fine = np.append((u[:-1, None] + width * t).ravel(), u[-1])
    # Hermite's cubics, of the values at both ends and of the slopes there.
    ends = (1 + 2 * t) * (1 - t) ** 2 * log[:-1, None] + t**2 * (3 - 2 * t) * log[1:, None]
    bends = t * (1 - t) ** 2 * slopes[:-1, None] + t**2 * (t - 1) * slopes[1:, None]
    log_fine = ends + width * bends
    for part, cubic in ((log.real, log_fine.real), (log.imag, log_fine.imag)):
        both = np.stack([part[:-1, None], part[1:, None]])
        np.clip(cubic, both.min(axis=0) - _BEYOND, both.max(axis=0) + _BEYOND, out=cubic)
    return np.exp(fine), np.exp(np.append(log_fine.ravel(), log[-1]))


def _line(points: Array) -> str:
    """Return straight lines through points, each given by its distance from the last."""
    whole = np.rint(np.clip(points, -1e7, 1e7)).astype(int)
    steps = np.diff(whole, axis=0)
    moved = steps[(steps != 0).any(axis=1)]
    path = "M{} {}".format(*whole[0])
    if len(moved):
        path += "l" + " ".join(map(str, moved.ravel().tolist())).replace(" -", "-")
    return path
