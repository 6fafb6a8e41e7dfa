"""How much of its margins a rig uses up: its gain and dead time beside those of the model."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slewctl.loop.closed import Loop
from slewctl.measured.fit import fit
from slewctl.measured.log import Log
from slewctl.plant.dead_time import loop_dead_time

# Probability of the intervals.
_LEVEL = 0.95


@dataclass(frozen=True)
class MarginUse:
    """What a log tells of gain and dead time, and what the loop stands.

    Attributes
    ----------
    gain_db, delay_s : tuple of float
        Of the rig over the model: the 95 % interval of the gain, and of the dead time beyond
        that of the model.
    gain_margins_db : tuple of float
        How much the gain may fall, as a negative number, and rise.
    delay_margin_s : float
    """

    gain_db: tuple[float, float]
    delay_s: tuple[float, float]
    gain_margins_db: tuple[float, float]
    delay_margin_s: float

    @property
    def holds(self) -> bool:
        """Whether both intervals are within the margins, each alone."""
        low, high = self.gain_margins_db
        within = low < self.gain_db[0] and self.gain_db[1] < high
        return within and self.delay_s[1] < self.delay_margin_s

    def __str__(self) -> str:
        low, high = self.gain_margins_db
        verdict = "within" if self.holds else "NOT within"
        return (
            f"gain {self.gain_db[0]:+.2f} to {self.gain_db[1]:+.2f} dB of the model's (margins "
            f"{low:+.3g} and {high:+.3g} dB), dead time {1e3 * self.delay_s[0]:+.2f} to "
            f"{1e3 * self.delay_s[1]:+.2f} ms beyond it (margin {1e3 * self.delay_margin_s:.3g} "
            f"ms): {verdict} the margins"
        )


def margin_use(loop: Loop, log: Log) -> MarginUse:
    """Return what a log says of gain and dead time, beside the margins of the loop.

    Gain and dead time alone are fitted to the log, the arm as it is: what else differs shows
    in them, or in the fit of a replay.

    Parameters
    ----------
    loop : Loop
        Stable, on the arm that the log should be of.
    log : Log

    Returns
    -------
    MarginUse

    Raises
    ------
    InputError, AccuracyError
        If the log does not tell, as `slewctl.fit`.

    Examples
    --------
    >>> import slewctl as sc
    >>> use = sc.margin_use(loop, sc.read_log("slew.csv"))  # doctest: +SKIP
    >>> use.holds  # doctest: +SKIP
    """
    arm, controller = loop.model.arm, loop.controller
    found = fit(arm, log, ["gain", "delay"])
    gain, delay = (found.interval(name, _LEVEL) for name in ("gain", "delay"))
    known = loop_dead_time(arm, [log.sensor]) + controller.delay
    margins = loop.margins
    return MarginUse(
        (_decibels(gain[0]), _decibels(gain[1])),
        (delay[0] - known, delay[1] - known),
        (-margins.gain_reduction_db.value, margins.gain_db.value),
        margins.delay_s.value,
    )


def _decibels(gain: float) -> float:
    return 20 * math.log10(gain) if gain > 0 else -math.inf
