"""Closed loops: stability first, then margins, norms and simulation."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.loop.closed import Loop
    from slewctl.loop.connect import close
    from slewctl.loop.logged_slew import Compared, Replay, replay
    from slewctl.loop.margin_functions import hybrid_delay_margin
    from slewctl.loop.motion.conditions import Conditions, Load
    from slewctl.loop.motion.feasible import told_time as told_time
    from slewctl.loop.motion.large_slew import Swing, simulate_swing
    from slewctl.loop.motion.shaped_slew import shaped as shaped
    from slewctl.loop.motion.shaping import Shaping, compare_commands
    from slewctl.loop.motion.simulation import Simulation, simulate
    from slewctl.loop.motion.slew import SlewResponse, SlewSummary, simulate_slew
    from slewctl.loop.motion.slew_inputs import Slew
    from slewctl.loop.motion.turned_hub import simulate_turned_hub
    from slewctl.loop.robust.multiloop import (
        MultiloopDisk,
        MultiloopMargins,
        multiloop_disk_margin,
        multiloop_margins,
        perturbation_system,
    )
    from slewctl.loop.robust.ncf_margin import GeneralisedMargin, best_output_scale, ncf_margin
    from slewctl.loop.robust.nu_gap import NuGap, PlantGraph, gap_between, nu_gap, plant_graph
    from slewctl.loop.robust.return_ratios import input_loop, input_output_loop, output_loop
    from slewctl.loop.robust.small_gain import (
        ResidualMode,
        SmallGain,
        Spillover,
        small_gain,
        spillover,
    )
    from slewctl.loop.sampled import SampledLoop
    from slewctl.loop.single.classical_margins import classical_margins
    from slewctl.loop.single.hybrid_delay import HybridDelay
    from slewctl.loop.single.margin_results import AxisCrossing, Crossing, Margins
    from slewctl.loop.single.perturbation import Perturbation
    from slewctl.loop.single.stability import UnstableLoopError
    from slewctl.loop.system_norm import norm
    from slewctl.loop.used_margins import MarginUse, margin_use
    from slewctl.numerics.frequency_response import FrequencyResponse
    from slewctl.numerics.hinf_norm import Peak, peak_gain

__all__ = [
    "AxisCrossing",
    "Compared",
    "Conditions",
    "Crossing",
    "FrequencyResponse",
    "GeneralisedMargin",
    "HybridDelay",
    "Load",
    "Loop",
    "MarginUse",
    "Margins",
    "MultiloopDisk",
    "MultiloopMargins",
    "NuGap",
    "Peak",
    "Perturbation",
    "PlantGraph",
    "Replay",
    "ResidualMode",
    "SampledLoop",
    "Shaping",
    "Simulation",
    "Slew",
    "SlewResponse",
    "SlewSummary",
    "SmallGain",
    "Spillover",
    "Swing",
    "UnstableLoopError",
    "best_output_scale",
    "classical_margins",
    "close",
    "compare_commands",
    "gap_between",
    "hybrid_delay_margin",
    "input_loop",
    "input_output_loop",
    "margin_use",
    "multiloop_disk_margin",
    "multiloop_margins",
    "ncf_margin",
    "norm",
    "nu_gap",
    "output_loop",
    "peak_gain",
    "perturbation_system",
    "plant_graph",
    "replay",
    "simulate",
    "simulate_slew",
    "simulate_swing",
    "simulate_turned_hub",
    "small_gain",
    "spillover",
]

__getattr__, __dir__ = attach(__name__, __file__)
