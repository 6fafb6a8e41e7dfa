"""A measured plant between its points.

G·sᵏ, with k the plant's poles at zero, is interpolated by Akima's curve, and how far that is from
the straight line between the points counts as uncertainty, beside that of the points themselves.
Where steps from point to point turn against each other a resonance passes on a circle, the more
of which no curve through the points shows the more they turn.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.measured.response import Response
from slewctl.numerics.frequency_response import axis_points

# Steps that noise makes, in radii of its disks, are none.
_NOISE = 2.0
# How far beyond its step a circle reaches at most, of which only that step is seen: that of a
# resonance as narrow as a quarter of the distance of the points.
_BEYOND = 3.0


class MeasuredCurve:
    """The values of a measured plant and the disks that they lie in, anywhere in its band.

    Parameters
    ----------
    response : Response
    order : int
        Poles of the plant at zero.
    """

    def __init__(self, response: Response, order: int) -> None:
        # Slow to load: not before it is wanted.
        from scipy.interpolate import Akima1DInterpolator

        self._hz, self._order, self._step = response.frequencies_hz, order, response.sample_time
        rigid = self._rigid(self._hz)
        self._even = response.values * rigid
        self._noise = np.nan_to_num(response.radius()) * np.abs(rigid)
        self._beside = _beside(self._even, self._noise)
        self._parts = [Akima1DInterpolator(self._hz, x) for x in (self._even.real, self._even.imag)]

    def at(self, hz: Array) -> tuple[ComplexArray, Array]:
        """Return the values at frequencies in the band and the radii of their disks."""
        real, imaginary = (part(hz) for part in self._parts)
        curve = real + 1j * imaginary
        off = np.abs(curve - np.interp(hz, self._hz, self._even))
        k = np.clip(np.searchsorted(self._hz, hz, "right") - 1, 0, len(self._hz) - 2)
        part = (hz - self._hz[k]) / (self._hz[k + 1] - self._hz[k])
        # Nothing at the points, and as a circle leaves them.
        off += self._beside[k] * np.sqrt(np.clip(4 * part * (1 - part), 0.0, 1.0))
        back = self._rigid(hz)
        return curve / back, (off + np.interp(hz, self._hz, self._noise)) / np.abs(back)

    def _rigid(self, hz: Array) -> ComplexArray:
        return np.asarray(axis_points(2 * np.pi * hz, self._step) ** self._order)


def _beside(values: ComplexArray, noise: Array) -> Array:
    """Return how far beside the step from each point to the next the values may pass.

    Of an arc θ of a circle the middle is tan(θ/4)/2 of the step aside.  Where the steps before
    and after turn by α and β against it, θ is α + β at most, since they belong to arcs too.
    """
    step = np.diff(values)
    size = np.abs(step)
    real = size > _NOISE * np.maximum(noise[:-1], noise[1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.abs(np.angle(step[1:] / step[:-1]))
    # Beside a step that noise makes nobody knows how much the other turns.
    turn = np.where(real[1:] & real[:-1], turn, np.pi / 2)
    arc = np.append(turn, 0.0) + np.append(0.0, turn)
    aside = np.minimum(0.5 * np.tan(np.minimum(arc, 1.99 * np.pi) / 4), _BEYOND)
    return np.where(real, size * aside, 0.0)
