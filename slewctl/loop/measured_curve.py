"""A measured plant between its points.

G·sᵏ, with k the plant's poles at zero, is interpolated by Akima's curve, and how far that is from
the straight line between the points counts as uncertainty, beside that of the points themselves.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.measured.response import Response
from slewctl.numerics.frequency_response import axis_points


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
        self._parts = [Akima1DInterpolator(self._hz, x) for x in (self._even.real, self._even.imag)]

    def at(self, hz: Array) -> tuple[ComplexArray, Array]:
        """Return the values at frequencies in the band and the radii of their disks."""
        real, imaginary = (part(hz) for part in self._parts)
        curve = real + 1j * imaginary
        off = np.abs(curve - np.interp(hz, self._hz, self._even))
        back = self._rigid(hz)
        return curve / back, (off + np.interp(hz, self._hz, self._noise)) / np.abs(back)

    def _rigid(self, hz: Array) -> ComplexArray:
        return np.asarray(axis_points(2 * np.pi * hz, self._step) ** self._order)
