"""The return ratio of a measured plant and a known controller, at and between the points.

The controller is evaluated exactly everywhere, the plant as `MeasuredCurve` has it.  Places are
put so close that the straight segments between them are L, but for a bend that is known: no
figure depends on where they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError
from slewctl.loop.measured_curve import MeasuredCurve
from slewctl.measured.response import Response
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.linear_system import LinearSystem, nameless

# Places on each interval between two points to begin with, and how often they are halved.
_PLACES, _HALVINGS = 4, 14
# L bends, and its disk grows, between two places by no more than these parts of the disk and
# of |L| and |1 + L| together.
_OF_DISK, _OF_SIZE = 0.02, 1e-4
# A controller's pole turns L within these multiples of its distance from the axis.
_BESIDE_POLES = (-8.0, -3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0, 8.0)
# A pole this near to zero, over the fastest, is one at zero.
_AT_ZERO = 1e-9
_FEWEST = 3  # points that a curve needs
_IN_A_ROW = 5  # points above the noise, which by accident is one alone, or two
_SAME_CLOCK = 1e-6  # relative: rounding of times in a log


@dataclass(frozen=True, eq=False)
class KnownLaw:
    """What L is over the plant: a controller for negative feedback, its hold and dead time.

    Attributes
    ----------
    response : FrequencyResponse
    hold : float
        Sample time in s of a hold before a plant that was measured as a continuous one, or zero.
    delay : float
        In s.
    """

    response: FrequencyResponse
    hold: float
    delay: float

    def at(self, hz: Array) -> ComplexArray:
        """Return the factor at frequencies."""
        omega = 2 * np.pi * hz
        factor = self.response(omega) * np.exp(-1j * omega * self.delay)
        if not self.hold:
            return np.asarray(factor)
        half = omega * self.hold / 2
        return np.asarray(factor * np.sinc(half / np.pi) * np.exp(-1j * half))

    def places(self) -> Array:
        """Return frequencies in Hz about which it may turn quickly."""
        s: ComplexArray = self.response.poles
        if self.response.sample_time:
            with np.errstate(divide="ignore", invalid="ignore"):
                s = np.asarray(np.log(s) / self.response.sample_time)
            s = s[np.isfinite(s)]
        beside = np.abs(s.imag + np.multiply.outer(_BESIDE_POLES, s.real))
        return np.asarray(beside.ravel() / (2 * np.pi))


@dataclass(frozen=True, eq=False)
class MeasuredLoop:
    """L for negative feedback over the measured band: at places, and anywhere between.

    Attributes
    ----------
    curve : MeasuredCurve
    law : KnownLaw
    hz : ndarray, shape (m,)
        Places, increasing.
    L : ndarray, shape (m,)
    radius : ndarray, shape (m,)
        Of the disk in which L lies.
    bend : ndarray, shape (m - 1,)
        How far L is from the straight segment between two places at most.
    plant_poles_at_zero : int
    controller_poles_at_zero : int
    unstable_poles : int
        Of the controller.
    assumptions : tuple of str
    """

    curve: MeasuredCurve
    law: KnownLaw
    hz: Array
    L: ComplexArray
    radius: Array
    bend: Array
    plant_poles_at_zero: int
    controller_poles_at_zero: int
    unstable_poles: int
    assumptions: tuple[str, ...]

    @property
    def poles_at_zero(self) -> int:
        """Order of the pole of L at zero."""
        return self.plant_poles_at_zero + self.controller_poles_at_zero

    def at(self, hz: Array) -> tuple[ComplexArray, Array]:
        """Return L at frequencies in the band and the radii of its disks."""
        return _evaluated(self.curve, self.law, hz)


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
    K = FrequencyResponse(negative)
    step, clock = response.sample_time, K.sample_time
    held = clock if clock and not step else 0.0
    if held:
        told.append("the hold of the sampled controller is that of a slow signal: no aliasing")
        if (last := response.frequencies_hz[-1]) > 0.5 / clock:
            raise InputError(
                f"the response reaches {last:.4g} Hz, beyond half of the controller's clock",
                where="response",
                remedy=f"keep what is below it: response.between(0, {0.5 / clock:.6g})",
            )
    elif len(negative.A) and abs(clock - step) > _SAME_CLOCK * step:
        raise InputError(
            f"the response has the clock {step:g} s, the controller {clock:g} s",
            where="controller",
            remedy="sample both alike, as with sc.given(…, discretise='tustin')",
        )
    curve, law = MeasuredCurve(response, poles_at_zero), KnownLaw(K, held, delay)
    at_zero, unstable = _poles(K, negative)
    return MeasuredLoop(
        curve, law, *_placed(curve, law, response.frequencies_hz),
        poles_at_zero, at_zero, unstable, tuple(told),
    )  # fmt: skip


def _evaluated(curve: MeasuredCurve, law: KnownLaw, hz: Array) -> tuple[ComplexArray, Array]:
    (values, radius), factor = curve.at(hz), law.at(hz)
    return values * factor, radius * np.abs(factor)


def _placed(
    curve: MeasuredCurve, law: KnownLaw, points: Array
) -> tuple[Array, ComplexArray, Array, Array]:
    """Return places, L, radii, and how much L bends between the places."""
    part = np.arange(_PLACES) / _PLACES
    between = (points[:-1, None] * (points[1:] / points[:-1])[:, None] ** part).ravel()
    own = law.places()
    own = own[(own > points[0]) & (own < points[-1])]
    hz = np.unique(np.concatenate([between, points[-1:], own]))
    L, radius = _evaluated(curve, law, hz)
    clear = np.isfinite(L)  # but at an undamped pole
    hz, L, radius = hz[clear], L[clear], radius[clear]
    bend, open_ = np.zeros(len(hz) - 1), np.ones(len(hz) - 1, dtype=bool)
    for _ in range(_HALVINGS):
        k = np.flatnonzero(open_)
        if not len(k):
            break
        middle = np.sqrt(hz[k] * hz[k + 1])
        L_middle, r_middle = _evaluated(curve, law, middle)
        bend[k] = np.abs(L_middle - 0.5 * (L[k] + L[k + 1]))
        size = np.minimum(np.abs(L_middle), np.abs(1 + L_middle))
        change = np.maximum(radius[k], radius[k + 1]) - r_middle
        open_[k] = bend[k] + np.abs(change) > _OF_DISK * r_middle + _OF_SIZE * size
        hz, L, radius = (
            np.insert(x, k + 1, y) for x, y in ((hz, middle), (L, L_middle), (radius, r_middle))
        )
        # Of each half a quarter is to be expected.
        bend, open_ = np.insert(bend, k + 1, bend[k]), np.insert(open_, k + 1, open_[k])
    return hz, L, radius, bend


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
