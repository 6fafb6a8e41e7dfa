"""Controller design, one file per method, with one result type."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.design.classical.lead import lead
    from slewctl.design.classical.pd_notch import pd_notch
    from slewctl.design.classical.positive_position import positive_position
    from slewctl.design.energy_coordinates import ScaledPlant, scaled
    from slewctl.design.lmi.h2_gains import H2Gain, h2_estimator, h2_state_feedback
    from slewctl.design.lmi.h2_hinf import h2_hinf
    from slewctl.design.lmi.h2_joint import build_h2_joint, solve_h2_joint
    from slewctl.design.lmi.h2_lmi import build_h2, h2_lmi, solve_h2
    from slewctl.design.lmi.h2_region import h2_region
    from slewctl.design.lmi.payload import payload_lmi
    from slewctl.design.lmi.variance_bound import variance_bound
    from slewctl.design.methods import METHODS, options
    from slewctl.design.own.fit_signals import fitted
    from slewctl.design.own.fitted import fitted_law
    from slewctl.design.own.fitted import given_on_plant as given_on_plant
    from slewctl.design.own.given_controller import given
    from slewctl.design.own.given_controller import read_options as read_options
    from slewctl.design.placement.assignment import PoleSensitivity, pole_sensitivity
    from slewctl.design.placement.pole_placement import place, place_observer, pole_placement
    from slewctl.design.result import Certificate, Check, Controller, Guarantee, finished
    from slewctl.design.riccati.gains import QuadraticGain, dlqe, dlqr, kalman, lqr
    from slewctl.design.riccati.h2syn import h2syn
    from slewctl.design.riccati.lqg import lqg

__all__ = [
    "METHODS",
    "Certificate",
    "Check",
    "Controller",
    "Guarantee",
    "H2Gain",
    "PoleSensitivity",
    "QuadraticGain",
    "ScaledPlant",
    "build_h2",
    "build_h2_joint",
    "dlqe",
    "dlqr",
    "finished",
    "fitted",
    "fitted_law",
    "given",
    "h2_estimator",
    "h2_hinf",
    "h2_lmi",
    "h2_region",
    "h2_state_feedback",
    "h2syn",
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

__getattr__, __dir__ = attach(__name__, __file__)
