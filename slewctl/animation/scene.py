"""Where things stand in the picture of an animation: one scale for all arms and times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._types import Array
from slewctl.animation.movement import Movement

# In pixels: the room around the arms, that of a name above them, the width of a pane, and its
# height at least.
MARGIN, TITLE, PANE, LOWEST = 14.0, 18.0, 380.0, 120.0
# Poses of the picture that does not move.
POSES = 7
# A turn that takes less than this, in s, is slowed until it does.
_SEEN = 2.0
# Round factors by which time is slowed and deflections are magnified.
FACTORS = tuple(m * 10.0**k for k in range(9) for m in (1, 2, 5))
# Points of a curve at most: pairs of the least and the largest between two pixels.
_PIXELS = 300


@dataclass(frozen=True, eq=False)
class Scene:
    """Movements with names, a factor for their deflections, and the box that holds them.

    Parameters
    ----------
    movements : sequence of Movement
    names : sequence of str
    magnified : float
    """

    movements: Sequence[Movement]
    names: Sequence[str]
    magnified: float

    @cached_property
    def box(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of all that is ever seen, in m."""
        seen = [np.zeros((1, 2))]
        for one in self.movements:
            seen += [one.points(self.magnified).reshape(-1, 2), one.rigid().reshape(-1, 2)]
            seen += [one.x[0] * np.array([[1.0, 1.0], [-1.0, -1.0]])]
        places = np.concatenate(seen)
        (left, bottom), (right, top) = places.min(axis=0), places.max(axis=0)
        return float(left), float(bottom), float(right), float(top)

    @property
    def scale(self) -> float:
        """Pixels in a metre."""
        left, bottom, right, top = self.box
        return (PANE - 2 * MARGIN) / max(right - left, top - bottom)

    @property
    def height(self) -> float:
        """Of a pane in pixels."""
        _, bottom, _, top = self.box
        return max(LOWEST, (top - bottom) * self.scale + 2 * MARGIN) + TITLE

    def placed(self, points: Array) -> Array:
        """Return points of the plane in pixels of a pane, y downwards."""
        left, bottom, right, top = self.box
        middle = np.array([(left + right) / 2, (bottom + top) / 2])
        centre = np.array([PANE / 2, (self.height + TITLE) / 2])
        return np.asarray(centre + (points - middle) * self.scale * np.array([1.0, -1.0]))

    @property
    def end(self) -> float:
        """When the last of them ends, in s."""
        return max(float(one.t[-1]) for one in self.movements)

    @property
    def slowed(self) -> float:
        """How many times as long as the slew the animation takes."""
        return next((m for m in FACTORS if m * self.end >= _SEEN), 1.0)

    @property
    def curves(self) -> dict[str, list[tuple[Array, Array]]]:
        """Times and values of each kind of curve, one of each movement, peaks kept."""
        names = dict.fromkeys(name for one in self.movements for name in one.curves)
        empty = (np.zeros(0), np.zeros(0))
        return {
            name: [_thinned(*one.curves.get(name, empty), self.end) for one in self.movements]
            for name in names
        }


def _thinned(t: Array, values: Array, end: float) -> tuple[Array, Array]:
    """Return a curve by its least and largest value between two pixels, in their order."""
    if len(t) <= 2 * _PIXELS:
        return t, values
    pixel = np.minimum((t / end * _PIXELS).astype(int), _PIXELS - 1)
    starts = np.flatnonzero(np.diff(pixel, prepend=-1))
    kept = {0, len(t) - 1}
    for first, last in zip(starts, np.append(starts[1:], len(t)), strict=True):
        part = values[first:last]
        kept |= {int(first + part.argmin()), int(first + part.argmax())}
    order = sorted(kept)
    return t[order], values[order]
