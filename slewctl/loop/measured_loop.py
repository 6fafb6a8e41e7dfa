"""The return ratio of a measured plant and a known controller, at and between the points.

The controller is evaluated exactly everywhere.  The plant is measured at points; between them
G·s^k, with k its poles at zero, is interpolated by Akima's curve, and how far that is from the
straight line between the points counts as uncertainty, beside that of the points themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError
from slewctl.measured.response import Response
from slewctl.numerics.frequency_response import FrequencyResponse, axis_points
from slewctl.numerics.linear_system import LinearSystem, nameless

# Places on each interval between two points.
_PLACES = 12
# A pole this near to zero, over the fastest, is one at zero.
_AT_ZERO = 1e-9
_FEWEST = 3  # points that a curve needs
_IN_A_ROW = 5  # points above the noise, which by accident is one alone, or two
_SAME_CLOCK = 1e-6  # relative: rounding of times in a log


@dataclass(frozen=True, eq=False)
class MeasuredLoop:
    """L for negative feedback on a fine grid over the measured band.

    Attributes
    ----------
    hz : ndarray, shape (m,)
    L : ndarray, shape (m,)
    radius : ndarray, shape (m,)
        Of the disk in which L lies.
    controller : ndarray, shape (m,)
        L over the plant: its sign, hold and dead time included.
    plant_poles_at_zero : int
    controller_poles_at_zero : int
    unstable_poles : int
        Of the controller.
    assumptions : tuple of str
    """

    hz: Array
    L: ComplexArray
    radius: Array
    controller: ComplexArray
    plant_poles_at_zero: int
    controller_poles_at_zero: int
    unstable_poles: int
    assumptions: tuple[str, ...]

    @property
    def poles_at_zero(self) -> int:
        """Order of the pole of L at zero."""
        return self.plant_poles_at_zero + self.controller_poles_at_zero


def measured_loop(
    response: Response, negative: LinearSystem, delay: float, poles_at_zero: int | None
) -> MeasuredLoop:
    """Return the loop of a response and a controller for negative feedback.

    Parameters
    ----------
    response : Response
    negative : LinearSystem
        u = −K y.
    delay : float
        Further dead time in s.
    poles_at_zero : int or None
        Of the plant; None to take them from the phase of the first point.
    """
    if len(response.values) < _FEWEST:
        raise InputError(
            f"{len(response.values)} points", where="response", remedy="measure at three or more"
        )
    told: list[str] = []
    response = _shown(response, told)
    if poles_at_zero is None:
        quarters = round(float(np.angle(response.values[0])) / (np.pi / 2))
        poles_at_zero = abs(quarters)  # a lead of a quarter is a lag of one with a minus
        source = "from the phase of the first point"
    else:
        source = "as given"
    poles = "pole" if poles_at_zero == 1 else "poles"
    told.append(f"{poles_at_zero} {poles} of the plant at zero, {source}")
    hz, values, radius = _between(response, poles_at_zero)
    omega = 2 * np.pi * hz
    K = FrequencyResponse(negative)
    step, clock = response.sample_time, K.sample_time
    factor = K(omega)
    if clock and not step:
        half = omega * clock / 2
        factor = factor * np.sinc(half / np.pi) * np.exp(-1j * half)
        told.append("the hold of the sampled controller is that of a slow signal: no aliasing")
        if hz[-1] > 0.5 / clock:
            raise InputError(
                f"the response reaches {hz[-1]:.4g} Hz, beyond half of the controller's clock",
                where="response",
                remedy=f"keep what is below it: response.between(0, {0.5 / clock:.6g})",
            )
    elif len(negative.A) and abs(clock - step) > _SAME_CLOCK * step:
        raise InputError(
            f"the response has the clock {step:g} s, the controller {clock:g} s",
            where="controller",
            remedy="sample both alike, as with sc.given(…, discretise='tustin')",
        )
    factor = factor * np.exp(-1j * omega * delay)
    at_zero, unstable = _poles(K, negative)
    return MeasuredLoop(
        hz, values * factor, radius * np.abs(factor), factor,
        poles_at_zero, at_zero, unstable, tuple(told),
    )  # fmt: skip


def _shown(response: Response, told: list[str]) -> Response:
    """Return the band in which the response is seen; beyond, the disks hold zero as well."""
    seen = ~(response.radius() >= np.abs(response.values))
    width = min(_IN_A_ROW, len(seen))
    rows = np.flatnonzero(np.convolve(seen, np.ones(width), "valid") > width - 0.5)
    if not len(rows):
        raise InputError(
            "it shows nothing: the noise is as large as the response at nearly every point",
            where="response",
            remedy="measure longer, or excite more",
        )
    kept = slice(int(rows[0]), int(rows[-1]) + width)
    left_out = len(response.values) - (kept.stop - kept.start)
    if left_out:
        told.append(f"{left_out} points at the ends show nothing but noise and are left out")
    return response.at_points(kept)


def check_reads(controller: LinearSystem, response: Response) -> None:
    """Refuse a controller that reads or commands something else than was measured."""
    if (controller.ninputs, controller.noutputs) != (1, 1):
        raise InputError(
            f"it reads {', '.join(controller.input_labels)}; measured is {response.sensor}",
            where="controller",
            remedy="give one that reads what was measured alone",
        )
    for own, other in (
        (controller.input_labels, response.sensor),
        (controller.output_labels, response.actuator),
    ):
        if not nameless(own) and own[0] != other:
            raise InputError(
                f"it has the signal {own[0]}; measured is {other}",
                where="controller",
                remedy="name the measured signals as they are, or the controller's none",
            )


def _between(response: Response, order: int) -> tuple[Array, ComplexArray, Array]:
    """Return places, values and radii of the plant at the points and between them."""
    from scipy.interpolate import Akima1DInterpolator  # slow to load: not before it is wanted

    hz, omega = response.frequencies_hz, response.omega
    part = np.arange(_PLACES) / _PLACES
    places = (hz[:-1, None] * (hz[1:] / hz[:-1])[:, None] ** part).ravel()
    places = np.append(places, hz[-1])
    step = response.sample_time
    rigid = axis_points(omega, step) ** order
    even = response.values * rigid
    curve = Akima1DInterpolator(hz, even.real)(places) + 1j * Akima1DInterpolator(hz, even.imag)(
        places
    )
    line = np.interp(places, hz, even.real) + 1j * np.interp(places, hz, even.imag)
    noise = np.interp(places, hz, np.nan_to_num(response.radius()) * np.abs(rigid))
    back = axis_points(2 * np.pi * places, step) ** order
    return places, curve / back, (np.abs(curve - line) + noise) / np.abs(back)


def _poles(K: FrequencyResponse, system: LinearSystem) -> tuple[int, int]:
    """Return how many poles of a controller lie at zero, and how many are unstable."""
    if not len(system.A):
        return 0, 0
    sampled = bool(K.sample_time)
    poles = K.poles - (1.0 if sampled else 0.0)
    small = np.abs(poles) <= _AT_ZERO * max(float(np.abs(poles).max()), 1e-300)
    if sampled:
        small = np.abs(poles) <= np.sqrt(np.finfo(float).eps)
        outside = np.abs(K.poles) > 1
    else:
        outside = poles.real > 0
    return int(np.count_nonzero(small)), int(np.count_nonzero(outside & ~small))
