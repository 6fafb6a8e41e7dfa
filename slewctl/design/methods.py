"""The design methods by the names that design files call them."""

from __future__ import annotations

import inspect
from collections.abc import Callable

from slewctl.design.classical.lead import lead
from slewctl.design.classical.pd_notch import pd_notch
from slewctl.design.classical.positive_position import positive_position
from slewctl.design.lmi.h2_hinf import h2_hinf
from slewctl.design.lmi.h2_lmi import h2_lmi
from slewctl.design.lmi.h2_region import h2_region
from slewctl.design.lmi.payload import payload_lmi
from slewctl.design.lmi.variance_bound import variance_bound
from slewctl.design.own.fitted import given_on_plant
from slewctl.design.placement.pole_placement import pole_placement
from slewctl.design.result import Controller
from slewctl.design.riccati.lqg import lqg

GIVEN = "given"
"""The name of what is no method: a law that was made elsewhere, on nothing known here."""

# Each takes a plant and, by keyword alone, options of its own: the keys of [controller].
METHODS: dict[str, Callable[..., Controller]] = {
    "lqg": lqg,
    "h2-lmi": h2_lmi,
    "h2-region": h2_region,
    "h2-hinf": h2_hinf,
    "payload-lmi": payload_lmi,
    "variance-bound": variance_bound,
    "pole-placement": pole_placement,
    "pd-notch": pd_notch,
    "positive-position": positive_position,
    "lead": lead,
    GIVEN: given_on_plant,
}


def options(method: str) -> tuple[str, ...]:
    """Return the names of the options that a method of `METHODS` takes.

    Parameters
    ----------
    method : str
        Of `METHODS`.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> from slewctl.design import options
    >>> options("lqg")
    ('integral_limit', 'sample_time', 'delay')
    """
    parameters = inspect.signature(METHODS[method]).parameters.values()
    return tuple(p.name for p in parameters if p.kind is p.KEYWORD_ONLY)
