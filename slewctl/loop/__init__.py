"""Closed loops: stability first, then margins, norms and simulation."""

from slewctl.frequency import FrequencyResponse
from slewctl.loop.closed import Loop, UnstableLoopError
from slewctl.loop.connect import close
from slewctl.loop.gap import (
    GeneralisedMargin,
    NuGap,
    PlantGraph,
    best_output_scale,
    gap_between,
    nu_gap,
    plant_graph,
    stability_margin_bpc,
)
from slewctl.loop.hybrid import HybridDelay
from slewctl.loop.margins import Crossing, Margins, classical_margins
from slewctl.loop.multiloop import (
    MultiloopDisk,
    MultiloopMargins,
    multiloop_disk_margin,
    multiloop_margins,
    perturbation_system,
)
from slewctl.loop.opened import input_loop, input_output_loop, output_loop
from slewctl.loop.perturbation import Perturbation
from slewctl.loop.public import hybrid_delay_margin
from slewctl.loop.sampled import SampledLoop
from slewctl.loop.slew import SlewResponse, SlewSummary, simulate_slew
from slewctl.loop.slew_inputs import Slew
from slewctl.loop.smallgain import ResidualMode, SmallGain, Spillover, residual_modes, small_gain
from slewctl.loop.swing import Swing, simulate_swing
from slewctl.peaks import Peak, peak_gain

__all__ = [
    "Crossing",
    "FrequencyResponse",
    "GeneralisedMargin",
    "HybridDelay",
    "Loop",
    "Margins",
    "MultiloopDisk",
    "MultiloopMargins",
    "NuGap",
    "Peak",
    "Perturbation",
    "PlantGraph",
    "ResidualMode",
    "SampledLoop",
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
    "gap_between",
    "hybrid_delay_margin",
    "input_loop",
    "input_output_loop",
    "multiloop_disk_margin",
    "multiloop_margins",
    "nu_gap",
    "output_loop",
    "peak_gain",
    "perturbation_system",
    "plant_graph",
    "residual_modes",
    "simulate_slew",
    "simulate_swing",
    "small_gain",
    "stability_margin_bpc",
]
