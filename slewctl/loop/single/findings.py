"""What a search of the axis finds: crossings between two frequencies, and smallest distances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.loop.single.roots import polished_by_slopes


@dataclass(eq=False)
class Points:
    """Crossings, each between two frequencies and known to a width; or boxes left undecided."""

    left: list[Array] = field(default_factory=list)
    right: list[Array] = field(default_factory=list)
    width: list[Array] = field(default_factory=list)
    off: Array = field(default_factory=lambda: np.zeros(0))

    def add(self, left: Array, right: Array, width: Array) -> None:
        self.left.append(left)
        self.right.append(right)
        self.width.append(width)

    def keep_lowest(self) -> None:
        """Leave the one at the lowest frequency alone."""
        left, right = self.ends
        lowest = np.argsort(left)[:1]
        width = np.concatenate([np.zeros(0), *self.width])
        self.left, self.right, self.width = [left[lowest]], [right[lowest]], [width[lowest]]

    @property
    def ends(self) -> tuple[Array, Array]:
        """The two frequencies of each."""
        none = np.zeros(0)
        return np.concatenate([none, *self.left]), np.concatenate([none, *self.right])

    def replace(self, roots: Array, off: Array) -> None:
        """Take roots in the place of the two frequencies of each, by how much they may be off.

        They are by increasing frequency then.
        """
        order = np.argsort(roots)
        roots, off = roots[order], off[order]
        width = np.concatenate([np.zeros(0), *self.width])[order]
        self.left, self.right, self.width = [roots], [roots], [width + off]
        self.off = off

    def tighten(self, error: Array, slope: Array) -> None:
        """Take widths that follow from error and least slope on the widths, where those are less.

        Before, both were those of the whole interval in which a root was found.
        """
        width = self.width[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.where(slope > 0, error / slope, np.inf) + self.off
        self.width = [np.fmin(width, found)]

    @property
    def arrays(self) -> tuple[Array, Array]:
        """v and width, by increasing v."""
        v = np.concatenate([np.zeros(0), *self.left])
        order = np.argsort(v)
        return v[order], np.concatenate([np.zeros(0), *self.width])[order]


@dataclass(frozen=True)
class Least:
    """A smallest value that was reached at v, and one that is nowhere gone below."""

    value: float
    v: float
    proved: float


def polish(
    unit: Points,
    level: Points,
    real: Points,
    high: float,
    slopes: Callable[[Array], tuple[ComplexArray, ComplexArray]],
) -> None:
    """Replace what lies between two frequencies by the root there, all together.

    Parameters
    ----------
    unit, level, real : Points
        Of log|L|, of log|1 + L| less that of `high`, and of Im L.
    high : float
    slopes : callable
        From v to L and its derivative.
    """
    ends = [points.ends for points in (unit, level, real)]
    first, second = np.cumsum([len(a) for a, _ in ends])[:2]

    def value(v: Array, which: IntArray) -> tuple[Array, Array]:
        L, slope = slopes(v)
        size = np.abs(L)
        above = (which >= first) & (which < second)
        w, limit = np.where(above, 1 + L, L), np.where(above, high, 1.0)
        turning, sine, cosine = slope / w, L.imag / size, L.real / size
        gain = which < second
        return (
            np.where(gain, np.log(np.abs(w) / limit), sine),
            np.where(gain, turning.real, cosine * turning.imag),
        )

    a, b = (np.concatenate(each) for each in zip(*ends, strict=True))
    roots, off = polished_by_slopes(value, a, b)
    for points, own in (
        (unit, slice(0, first)), (level, slice(first, second)), (real, slice(second, None))
    ):  # fmt: skip
        points.replace(roots[own], off[own])


def sort_out(
    once: BoolArray,
    signs: tuple[Array, Array],
    error: Array,
    off: Array,
    ends: tuple[Array, Array],
    into: tuple[Points, Points],
) -> BoolArray:
    """Record roots of a monotone function, and return where: crossed, or touched at one end."""
    (fa, fb), (a, b) = signs, ends
    off = np.minimum(off, b - a)
    crossed = once & ((fa > 0) != (fb > 0))
    if crossed.any():
        into[0].add(a[crossed], b[crossed], off[crossed])
    # Beyond an end where it is zero but for errors, inside, it has a root no farther than `off`.
    for f, middle in ((fa, a + off / 2), (fb, b - off / 2)):
        touched = once & ~crossed & (np.abs(f) <= error)
        if touched.any():
            into[1].add(middle[touched], middle[touched], off[touched] / 2)
    return crossed
