"""What an arm does during a slew, as far as it is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, IntArray

# Pictures of a movement at first and at most, and points along the beam.
FIRST, FRAMES, STATIONS = 121, 1501, 17
# What a straight line between two pictures may leave out, of the largest deflection or turn.
_LEFT_OUT = 0.02


@dataclass(frozen=True, eq=False)
class Movement:
    """A turning arm at a few hundred times, seen along its axis.

    Attributes
    ----------
    t : ndarray, shape (frames,)
        In s, from 0.
    theta, theta_ref : ndarray, shape (frames,)
        Angle of the hub, and of a rigid arm that is exactly where it is told, in rad.
    x : ndarray, shape (stations,)
        Distance of points of the straight beam from the axis in m, increasing.
    bent : ndarray, shape (frames, stations)
        How far they are across the straight beam, in m.
    curves : mapping of str to (ndarray, ndarray)
        Times and values of what is drawn below, by name and unit.
    told : str
        What is to be said of the shape; empty where it is that of the truth.
    """

    t: Array
    theta: Array
    theta_ref: Array
    x: Array
    bent: Array
    curves: Mapping[str, tuple[Array, Array]]
    told: str = ""

    @property
    def reach(self) -> float:
        """From the axis to the tip in m."""
        return float(self.x[-1])

    def at(self, times: Array) -> Movement:
        """Return the movement at other times; it stays where it is before and after."""

        def between(values: Array) -> Array:
            return np.interp(times, self.t, values)

        bent = np.stack([between(column) for column in self.bent.T], axis=1)
        return Movement(
            times,
            between(self.theta),
            between(self.theta_ref),
            self.x,
            bent,
            self.curves,
            self.told,
        )

    def points(self, magnified: float) -> Array:
        """Return the beam in the plane, shape (frames, stations, 2), in m."""
        return _turned(self.theta, self.x, magnified * self.bent)

    def rigid(self) -> Array:
        """Return both ends of the rigid arm, shape (frames, 2, 2), in m."""
        ends = self.x[[0, -1]]
        return _turned(self.theta_ref, ends, np.zeros((len(self.t), 2)))


def frames_of(t: Array, moving: Array) -> IntArray:
    """Return which of many times are drawn: more where more moves, both ends among them.

    Parameters
    ----------
    t : ndarray, shape (times,)
    moving : ndarray, shape (times, signals)
        What straight lines between the pictures are to follow.

    Returns
    -------
    ndarray of int
        `FRAMES` at most; of as many the lines may leave something out.
    """
    size = np.ptp(moving, axis=0)
    scaled = moving / np.where(size > 0, size, 1.0)
    wanted = np.linspace(t[0], t[-1], min(FIRST, len(t)))
    kept = np.unique(np.searchsorted(t, wanted).clip(0, len(t) - 1))
    while len(kept) < FRAMES:
        lines = np.stack([np.interp(t, t[kept], column[kept]) for column in scaled.T], axis=1)
        off = np.abs(scaled - lines).max(axis=1)
        # The time that is farthest off between each two pictures.
        places = np.searchsorted(kept, np.arange(len(t)), side="left")
        order = np.lexsort((off, places))
        last = np.flatnonzero(np.diff(places[order], append=len(t) + 1))
        worst = order[last]
        more = worst[off[worst] > _LEFT_OUT]
        if not len(more):
            break
        most = more[np.argsort(-off[more])][: FRAMES - len(kept)]
        kept = np.union1d(kept, most)
    return kept


def _turned(angle: Array, x: Array, across: Array) -> Array:
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([x * cos - across * sin, x * sin + across * cos], axis=-1)
