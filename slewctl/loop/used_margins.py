"""How much of its margins a rig uses up: its gain and dead time beside those of the model."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slewctl.arm import Actuator
from slewctl.errors import InputError
from slewctl.loop.closed import Loop
from slewctl.loop.connect import close
from slewctl.loop.parts import times
from slewctl.loop.single.margin_results import Crossing
from slewctl.loop.single.stability import UnstableLoopError
from slewctl.measured.fit import fit
from slewctl.measured.log import Log
from slewctl.plant.dead_time import loop_dead_time

# Probability of the intervals.
_LEVEL = 0.95
# How much slower than the controller's a log's clock may be: what two clocks differ by.
_SLOWER = 0.01
# Dead times that are tried in a sample, and in all at most.
_IN_A_SAMPLE, _MOST = 32, 65


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
    together : bool
        Whether the loop is stable with every gain and dead time of both intervals at once.
    """

    gain_db: tuple[float, float]
    delay_s: tuple[float, float]
    gain_margins_db: tuple[float, float]
    delay_margin_s: float
    together: bool

    @property
    def holds(self) -> bool:
        """Whether the loop stands what the log tells, gain and dead time at once."""
        return self.together

    @property
    def each_holds(self) -> bool:
        """Whether both intervals are within the margins, each alone."""
        low, high = self.gain_margins_db
        within = low < self.gain_db[0] and self.gain_db[1] < high
        return within and self.delay_s[1] < self.delay_margin_s

    def __str__(self) -> str:
        low, high = self.gain_margins_db
        verdict = "within the margins" if self.holds else "NOT within the margins"
        if self.each_holds and not self.holds:
            verdict = "each within its margin, but NOT both together"
        return (
            f"gain {self.gain_db[0]:+.2f} to {self.gain_db[1]:+.2f} dB of the model's (margins "
            f"{low:+.3g} and {high:+.3g} dB), dead time {1e3 * self.delay_s[0]:+.2f} to "
            f"{1e3 * self.delay_s[1]:+.2f} ms beyond it (margin {1e3 * self.delay_margin_s:.3g} "
            f"ms): {verdict}"
        )


def margin_use(loop: Loop, log: Log) -> MarginUse:
    """Return what a log says of gain and dead time, beside the margins of the loop.

    Gain and dead time alone are fitted to the log, the arm as it is: what else differs shows
    in them, or in the fit of a replay.  Margins are of gain or dead time alone; whether the loop
    is stable with both at once is asked of the rectangle of their intervals: proved of a
    continuous loop, of a sampled one at dead times a thirty-second of a sample apart, or 65.

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
        If the log does not tell, as `slewctl.fit`, or is slower than the controller.

    Examples
    --------
    >>> import slewctl as sc
    >>> use = sc.margin_use(loop, sc.read_log("slew.csv"))  # doctest: +SKIP
    >>> use.holds  # doctest: +SKIP
    """
    arm, controller = loop.model.arm, loop.controller
    if log.sample_time > controller.sample_time * (1 + _SLOWER) > 0:
        raise InputError(
            f"a sample every {log.sample_time:g} s does not hold what is commanded every "
            f"{controller.sample_time:g} s",
            where="log",
            remedy="log on the controller's clock, or faster",
        )
    found = fit(arm, log, ["gain", "delay"])
    gain, delay = (found.interval(name, _LEVEL) for name in ("gain", "delay"))
    known = loop_dead_time(arm, [log.sensor]) + controller.delay
    margins, late = loop.margins, (max(delay[0], 0.0), max(delay[1], 0.0))
    return MarginUse(
        (_decibels(gain[0]), _decibels(gain[1])),
        (delay[0] - known, delay[1] - known),
        (-margins.gain_reduction_db.value, margins.gain_db.value),
        margins.delay_s.value,
        gain[0] > 0 and _stands(loop, gain, late),
    )


def _stands(loop: Loop, gain: tuple[float, float], late: tuple[float, float]) -> bool:
    """Whether a loop is stable with every gain factor and dead time between some.

    Gain margins tell of all gains at one dead time.  Of a continuous loop two are enough, with
    the delay margins at both gains: where g·L e^(−jωd) = −1, gain and dead time are functions of
    ω that are continuous but where the gain is zero or infinite, and end outside of any
    rectangle, so that none is inside it if none is on its edges.  Between samples a dead time
    does more than turn L, and margins know of whole samples alone: many dead times are tried.
    """
    low, high = gain
    middle, sampled = math.sqrt(low * high), loop.controller.sample_time
    up, down = _decibels(high / middle), _decibels(middle / low)
    span, tried = late[1] - late[0], 2
    if sampled:
        tried = min(2 + math.ceil(_IN_A_SAMPLE * span / sampled), _MOST)
    try:
        for time in np.unique(np.linspace(*late, tried)).tolist():
            found = _changed(loop, middle, time).margins
            if not (up < _proved(found.gain_db) and down < _proved(found.gain_reduction_db)):
                return False
        return bool(sampled) or all(
            span < _proved(_changed(loop, factor, late[0]).margins.delay_s) for factor in gain
        )
    except UnstableLoopError:
        return False


def _changed(loop: Loop, factor: float, time: float) -> Loop:
    """Return a loop with another gain, and so much dead time in all."""
    arm, own = loop.model.arm, loop.controller
    drive = replace(arm.actuator or Actuator(), delay=time)
    sensors = {name: replace(sensor, delay=0.0) for name, sensor in dict(arm.sensors).items()}
    model = replace(loop.model, arm=replace(arm, actuator=drive, sensors=sensors))
    return close(model, loop.objective, replace(own, system=times(factor, own.linear), delay=0.0))


def _proved(margin: Crossing) -> float:
    return margin.value if margin.at_least is None else margin.at_least


def _decibels(gain: float) -> float:
    return 20 * math.log10(gain) if gain > 0 else -math.inf
