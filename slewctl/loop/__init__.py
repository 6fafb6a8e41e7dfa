"""Closed loops: stability first, then margins, norms and simulation."""

from slewctl.loop.closed import Loop, UnstableLoopError, close
from slewctl.loop.frequency import FrequencyResponse
from slewctl.loop.margins import Crossing, Margins, classical_margins
from slewctl.loop.peaks import Peak, peak_gain
from slewctl.loop.slew import Slew, SlewResponse, SlewSummary, simulate_slew
from slewctl.loop.swing import Swing, simulate_swing

__all__ = [
    "Crossing",
    "FrequencyResponse",
    "Loop",
    "Margins",
    "Peak",
    "Slew",
    "SlewResponse",
    "SlewSummary",
    "Swing",
    "UnstableLoopError",
    "classical_margins",
    "close",
    "peak_gain",
    "simulate_slew",
    "simulate_swing",
]
