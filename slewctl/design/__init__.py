"""Controller design, one file per method, with one result type."""

import inspect
from collections.abc import Callable

from slewctl.design.collocated import pd_notch
from slewctl.design.h2 import build_h2, h2_lmi, solve_h2
from slewctl.design.lead import lead
from slewctl.design.lqg import lqg
from slewctl.design.lqr import kalman, lqr
from slewctl.design.placement import place, place_observer, pole_placement
from slewctl.design.pole_assignment import PoleSensitivity, pole_sensitivity
from slewctl.design.positive_position import positive_position
from slewctl.design.result import Certificate, Check, Controller, Guarantee, finished, given

# Each takes a plant and, by keyword alone, options of its own: the keys of [controller].
METHODS: dict[str, Callable[..., Controller]] = {
    "lqg": lqg,
    "h2-lmi": h2_lmi,
    "pole-placement": pole_placement,
    "pd-notch": pd_notch,
    "positive-position": positive_position,
    "lead": lead,
}


def options(method: str) -> tuple[str, ...]:
    """Return the names of the options that a method of `METHODS` takes."""
    parameters = inspect.signature(METHODS[method]).parameters.values()
    return tuple(p.name for p in parameters if p.kind is p.KEYWORD_ONLY)


__all__ = [
    "METHODS",
    "Certificate",
    "Check",
    "Controller",
    "Guarantee",
    "PoleSensitivity",
    "build_h2",
    "finished",
    "given",
    "h2_lmi",
    "kalman",
    "lead",
    "lqg",
    "lqr",
    "options",
    "pd_notch",
    "place",
    "place_observer",
    "pole_placement",
    "pole_sensitivity",
    "positive_position",
    "solve_h2",
]
