"""What an arm does during a slew, as far as it is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, IntArray

# Pictures of a movement at most, and points along the beam.
FRAMES, STATIONS = 361, 17


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


def frames_of(t: Array) -> IntArray:
    """Return which of many times are drawn: about equally far apart, both ends among them."""
    wanted = np.linspace(t[0], t[-1], min(FRAMES, len(t)))
    return np.unique(np.searchsorted(t, wanted).clip(0, len(t) - 1))


def _turned(angle: Array, x: Array, across: Array) -> Array:
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([x * cos - across * sin, x * sin + across * cos], axis=-1)
