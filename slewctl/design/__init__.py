"""Controller design, one file per method, with one result type."""

import inspect
from collections.abc import Callable

from slewctl.design.collocated import pd_notch
from slewctl.design.h2 import build_h2, h2_lmi, solve_h2
from slewctl.design.h2_gains import H2Gain, h2_estimator, h2_state_feedback
from slewctl.design.h2_joint import build_h2_joint, solve_h2_joint
from slewctl.design.lead import lead
from slewctl.design.lqg import lqg
from slewctl.design.lqr import kalman, lqr
from slewctl.design.mixed import h2_hinf
from slewctl.design.payload import payload_lmi
from slewctl.design.placement import place, place_observer, pole_placement
from slewctl.design.pole_assignment import PoleSensitivity, pole_sensitivity
from slewctl.design.positive_position import positive_position
from slewctl.design.regions import h2_region
from slewctl.design.result import Certificate, Check, Controller, Guarantee, finished, given
from slewctl.design.scaling import ScaledPlant, scaled
from slewctl.design.variance import variance_bound

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
    "H2Gain",
    "PoleSensitivity",
    "ScaledPlant",
    "build_h2",
    "build_h2_joint",
    "finished",
    "given",
    "h2_estimator",
    "h2_hinf",
    "h2_lmi",
    "h2_region",
    "h2_state_feedback",
    "kalman",
    "lead",
    "lqg",
    "lqr",
    "options",
    "payload_lmi",
    "pd_notch",
    "place",
    "place_observer",
    "pole_placement",
    "pole_sensitivity",
    "positive_position",
    "scaled",
    "solve_h2",
    "solve_h2_joint",
    "variance_bound",
]
