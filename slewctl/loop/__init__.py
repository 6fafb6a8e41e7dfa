"""Closed loops: stability first, then margins, norms and simulation."""

from slewctl.loop.closed import Loop, UnstableLoopError, close
from slewctl.loop.frequency import FrequencyResponse
from slewctl.loop.margins import Crossing, Margins, classical_margins
from slewctl.loop.slew import Slew, SlewResponse, SlewSummary, simulate_slew

__all__ = [
    "Crossing",
    "FrequencyResponse",
    "Loop",
    "Margins",
    "Slew",
    "SlewResponse",
    "SlewSummary",
    "UnstableLoopError",
    "classical_margins",
    "close",
    "simulate_slew",
]
