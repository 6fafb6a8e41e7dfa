"""Control design for slewing flexible arms.

Describe an arm, get python-control models of it in several assumed-mode bases, design on a
small one, and judge every controller on a converged model of the same arm::

    Arm → assemble(arm, basis) → generalised_plant(model, objective) → lqg(plant)
        → close(truth(arm), objective, controller) → loop.stable, loop.margins, loop.h2
"""

from typing import TYPE_CHECKING

import slewctl._interrupt  # noqa: F401  (first: a Ctrl-C may come while the rest loads)
from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.arm import (
        Actuator,
        Arm,
        Beam,
        Drag,
        Hub,
        Joint,
        KelvinVoigt,
        LumpedMass,
        ModalData,
        Motor,
        Payload,
        Place,
        Rayleigh,
        Sensor,
        Stations,
        equal_appendages,
        stacked_appendages,
        vary,
    )
    from slewctl.arm import catalogue as arms
    from slewctl.basis import (
        ArmMatched,
        ClampedFree,
        HubMatched,
        Modal,
        Polynomial,
        Slewing,
        WithStatic,
    )
    from slewctl.compare import compare as compare_designs
    from slewctl.compare import recommend, run_study, worst_case
    from slewctl.design import (
        Controller,
        dlqe,
        dlqr,
        given,
        h2_estimator,
        h2_hinf,
        h2_lmi,
        h2_region,
        h2_state_feedback,
        h2syn,
        kalman,
        lead,
        lqg,
        lqr,
        payload_lmi,
        pd_notch,
        place,
        place_observer,
        pole_placement,
        pole_sensitivity,
        positive_position,
        variance_bound,
    )
    from slewctl.errors import AccuracyError, DesignError, InputError, SlewctlError
    from slewctl.loop import (
        Conditions,
        Load,
        Loop,
        Margins,
        MarginUse,
        Replay,
        SampledLoop,
        Shaping,
        Simulation,
        Slew,
        Swing,
        UnstableLoopError,
        close,
        compare_commands,
        margin_use,
        multiloop_margins,
        ncf_margin,
        norm,
        nu_gap,
        replay,
        simulate,
        simulate_slew,
        simulate_swing,
        simulate_turned_hub,
        small_gain,
        spillover,
    )
    from slewctl.loop.margin_functions import hybrid_delay_margin, margins
    from slewctl.loop.measured_margin_results import MeasuredMargins
    from slewctl.loop.measured_margins import measured_margins
    from slewctl.measured.estimate import estimate_response
    from slewctl.measured.excitation import prbs
    from slewctl.measured.fit import fit
    from slewctl.measured.fit_result import Fit
    from slewctl.measured.log import Log
    from slewctl.measured.rational import RationalFit, fit_rational
    from slewctl.measured.read_log import read_log
    from slewctl.measured.read_response import read_response
    from slewctl.measured.response import Response
    from slewctl.measured.rig_fit_result import RigFit
    from slewctl.measured.roots import Root
    from slewctl.measured.simulated import simulated_log
    from slewctl.model import (
        Model,
        NonlinearModel,
        Truth,
        arm_modes,
        assemble,
        hub_locked_frequencies_hz,
        large_slew,
        modal_data,
        spin_frequencies_hz,
        truth,
    )
    from slewctl.plant import (
        GeneralisedPlant,
        Objective,
        balanced_truncation,
        encoder_noise,
        generalised_plant,
        modal_truncation,
        nonlinear_system,
        sampled_plant,
        state_space,
    )
    from slewctl.problem import Problem
    from slewctl.trajectory.limited_turn import Drive, HeldTurn, limited_turn
    from slewctl.trajectory.profiles import MinimumJerk, RigidTimeOptimal, SCurve, Versine
    from slewctl.trajectory.rest_to_rest import BangBang, rest_to_rest
    from slewctl.trajectory.robust_shaper import Band, robust_shaper
    from slewctl.trajectory.sampled_shaper import sampled_shaper
    from slewctl.trajectory.shapers import Mode, Shaper, compare_shapers, shaper
    from slewctl.trajectory.timed_profiles import timed_profile

__version__ = "0.2.0"

__all__ = [
    "AccuracyError",
    "Actuator",
    "Arm",
    "ArmMatched",
    "Band",
    "BangBang",
    "Beam",
    "ClampedFree",
    "Conditions",
    "Controller",
    "DesignError",
    "Drag",
    "Drive",
    "Fit",
    "GeneralisedPlant",
    "HeldTurn",
    "Hub",
    "HubMatched",
    "InputError",
    "Joint",
    "KelvinVoigt",
    "Load",
    "Log",
    "Loop",
    "LumpedMass",
    "MarginUse",
    "Margins",
    "MeasuredMargins",
    "MinimumJerk",
    "Modal",
    "ModalData",
    "Mode",
    "Model",
    "Motor",
    "NonlinearModel",
    "Objective",
    "Payload",
    "Place",
    "Polynomial",
    "Problem",
    "RationalFit",
    "Rayleigh",
    "Replay",
    "Response",
    "RigFit",
    "RigidTimeOptimal",
    "Root",
    "SCurve",
    "SampledLoop",
    "Sensor",
    "Shaper",
    "Shaping",
    "Simulation",
    "Slew",
    "SlewctlError",
    "Slewing",
    "Stations",
    "Swing",
    "Truth",
    "UnstableLoopError",
    "Versine",
    "WithStatic",
    "arm_modes",
    "arms",
    "assemble",
    "balanced_truncation",
    "close",
    "compare_commands",
    "compare_designs",
    "compare_shapers",
    "dlqe",
    "dlqr",
    "encoder_noise",
    "equal_appendages",
    "estimate_response",
    "fit",
    "fit_rational",
    "generalised_plant",
    "given",
    "h2_estimator",
    "h2_hinf",
    "h2_lmi",
    "h2_region",
    "h2_state_feedback",
    "h2syn",
    "hub_locked_frequencies_hz",
    "hybrid_delay_margin",
    "kalman",
    "large_slew",
    "lead",
    "limited_turn",
    "lqg",
    "lqr",
    "margin_use",
    "margins",
    "measured_margins",
    "modal_data",
    "modal_truncation",
    "multiloop_margins",
    "ncf_margin",
    "nonlinear_system",
    "norm",
    "nu_gap",
    "payload_lmi",
    "pd_notch",
    "place",
    "place_observer",
    "pole_placement",
    "pole_sensitivity",
    "positive_position",
    "prbs",
    "read_log",
    "read_response",
    "recommend",
    "replay",
    "rest_to_rest",
    "robust_shaper",
    "run_study",
    "sampled_plant",
    "sampled_shaper",
    "shaper",
    "simulate",
    "simulate_slew",
    "simulate_swing",
    "simulate_turned_hub",
    "simulated_log",
    "small_gain",
    "spillover",
    "spin_frequencies_hz",
    "stacked_appendages",
    "state_space",
    "timed_profile",
    "truth",
    "variance_bound",
    "vary",
    "worst_case",
]

__getattr__, __dir__ = attach(__name__, __file__)
