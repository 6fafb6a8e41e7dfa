"""A controller on a measured response beside the same controller on an arm's model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design import Controller
from slewctl.loop.measured_margin_results import MeasuredMargins
from slewctl.loop.measured_margins import loop_on, measured_margins
from slewctl.loop.single.roots import passed
from slewctl.measured.response import Response
from slewctl.measured.response_data import channel_of, highest_seen, rig_response
from slewctl.measured.rig_model import modes_for
from slewctl.measured.rig_parameters import Rig
from slewctl.measured.roots import Root, figures, poles_and_zeros, seen


@dataclass(frozen=True)
class GainCrossing:
    """A frequency where |L| = 1.

    Attributes
    ----------
    frequency_hz : float
    phase_deg : float
        Of L, from −1: positive where it lags less than 180°.
    """

    frequency_hz: float
    phase_deg: float


@dataclass(frozen=True, eq=False)
class OnMeasured:
    """What a response shows beside what an arm's model says, and what a controller meets in each.

    Attributes
    ----------
    response : Response
    computed : ndarray, shape (m,)
        The model's at its frequencies, dead time and clock included.
    roots : tuple of Root
        Poles and zeros of the model up to where the response shows the arm, beside those that
        its points show.
    margins : MeasuredMargins
    hz : ndarray, shape (k,)
        At the points, and between them.
    loop, modelled_loop : ndarray, shape (k,)
        L for negative feedback, measured and of the model.
    radius : ndarray, shape (k,)
        Of the disk in which the measured one lies.
    crossings, modelled_crossings : tuple of GainCrossing
        Of the two loops.
    """

    response: Response
    computed: ComplexArray
    roots: tuple[Root, ...]
    margins: MeasuredMargins
    hz: Array
    loop: ComplexArray
    modelled_loop: ComplexArray
    radius: Array
    crossings: tuple[GainCrossing, ...]
    modelled_crossings: tuple[GainCrossing, ...]


def on_measured(
    response: Response,
    controller: Controller,
    rig: Rig,
    *,
    unstable_poles: int = 0,
    poles_at_zero: int | None = None,
) -> OnMeasured:
    """Return what a controller meets on a measured response and on a model of the rig.

    Parameters
    ----------
    response : Response
    controller : Controller
    rig : Rig
        The arm, its gain and its whole dead time.
    unstable_poles, poles_at_zero : int
        Of what was measured; see `slewctl.measured_margins`.

    Raises
    ------
    InputError
        As `slewctl.measured_margins`.
    """
    margins = measured_margins(
        response, controller, unstable_poles=unstable_poles, poles_at_zero=poles_at_zero
    )
    met = loop_on(response, controller, poles_at_zero=poles_at_zero)
    channel, highest = channel_of(response), highest_seen(response)
    modes = modes_for(rig.arm, float(response.frequencies_hz[-1]))
    roots = []
    for kind, found in zip(("pole", "zero"), poles_and_zeros(rig, channel, modes), strict=True):
        hertz, ratios = np.split(figures(found), 2)
        roots += [
            Root(kind, hz, np.nan, ratio, np.nan, *seen(response, hz, kind))
            for hz, ratio in zip(hertz.tolist(), ratios.tolist(), strict=True)
            if hz <= highest
        ]

    def modelled(hz: Array) -> ComplexArray:
        return rig_response(rig, channel, modes, 2 * np.pi * hz) * met.law.at(hz)

    return OnMeasured(
        response,
        rig_response(rig, channel, modes, response.omega),
        tuple(roots),
        margins,
        met.hz,
        met.L,
        modelled(met.hz),
        met.radius,
        gain_crossings(lambda hz: met.at(hz)[0], met.hz),
        gain_crossings(modelled, met.hz),
    )


def gain_crossings(L: Callable[[Array], ComplexArray], hz: Array) -> tuple[GainCrossing, ...]:
    """Return where |L| = 1 between frequencies of a fine grid, with the turn from −1 there."""
    places = passed(lambda f: np.abs(L(f)) - 1, hz)
    return tuple(map(GainCrossing, places.tolist(), np.angle(-L(places), deg=True).tolist()))
