"""All that can be read from a judgement: the one list from which every output is made.

Requirements of design files, the gate's table, CSV and study columns, `assert_margins`,
descriptions and report tables take their names, units and words from here; a quantity that
is added here appears in all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from slewctl.compare.judgement import Judgement
from slewctl.design.result import COST_TOLERANCE
from slewctl.loop import Crossing, Margins, Slew
from slewctl.loop.noise import NoiseLevels

if TYPE_CHECKING:
    from slewctl.loop import SlewSummary

# Kinds of quantities that limits and noise weigh, and why there are none without.
WEIGHTED = ("cost", "noise")
UNWEIGHTED = "no limits and noise are given"
# Verdicts rest on a truth whose frequencies are known this well, relative.
TRUTH_TOLERANCE = 1e-6


class Reading(NamedTuple):
    """A value and where it is reached.

    Attributes
    ----------
    value : float
        NaN where there is none; then `note` says why.
    frequency_hz : float or None
    mode : str
        The mode that takes part there.
    note : str
        Why the value is infinite or missing.
    doubt : str
        Why the value may not be relied on; empty where it may.
    at_least : float or None
        Of a margin what is proved: it is nowhere smaller.  None where closed-loop poles alone
        confirm it.
    intervals : int
        How many intervals of the frequency axis prove it; zero where none do.
    """

    value: float
    frequency_hz: float | None = None
    mode: str = ""
    note: str = ""
    doubt: str = ""
    at_least: float | None = None
    intervals: int = 0


Kind = Literal["stability", "margin", "sensitivity", "pole", "cost", "noise", "slew"]
Scale = Literal["", "time", "rate", "length", "torque"]


@dataclass(frozen=True)
class Quantity:
    """Something that a controller achieves on the truth.

    Attributes
    ----------
    name : str
        Column of every table.
    unit : str
    symbol : str
        For headings.
    better : {"greater", "smaller"}
    meaning : str
        One phrase.
    kind : str
        What it is computed from; a slew that saturates has no quantity of kind "slew".
    read : callable
        From the judgement of a stable loop.
    margin : callable or None
        Of a margin: how to read it from `Margins` alone.
    infinite : str
        Why it is infinite, where the loop does not say it better.
    resolution : float
        A smaller change is noise.
    scale : str
        What makes it free of units in a study: the first mode's period for a time, the
        travel of the tip for a length, the torque that the rigid arm needs.
    needs : str
        Why an arm has it not, where it is missing.
    simulated : bool
        Whether only a slew that is simulated has it; see `quantities_of`.
    """

    name: str
    unit: str
    symbol: str
    better: Literal["greater", "smaller"]
    meaning: str
    kind: Kind
    read: Callable[[Judgement], Reading]
    margin: Callable[[Margins], Crossing] | None = None
    infinite: str = "nothing limits it"
    resolution: float = 0.0
    scale: Scale = ""
    needs: str = "this arm has no such value"
    simulated: bool = False

    def __reduce__(self) -> tuple[Callable[[str], Quantity], tuple[str]]:
        return _named, (self.name,)  # what it reads by cannot be sent to another process

    @property
    def requirement(self) -> str:
        """The key of a design file's requirements that limits it."""
        return self.name if self.better == "greater" else f"{self.name}_max"

    @property
    def sense(self) -> Literal["at least", "at most"]:
        """How a limit bounds it."""
        return "at least" if self.better == "greater" else "at most"

    def holds(self, value: float, limit: float) -> bool:
        """Whether a value is on the right side of a limit; NaN never is."""
        return value >= limit if self.better == "greater" else value <= limit

    def worst(self, *readings: Reading) -> Reading:
        """Return the worst reading; a missing value is worse than any."""
        sign = 1.0 if self.better == "greater" else -1.0
        return min(readings, key=lambda r: -math.inf if math.isnan(r.value) else sign * r.value)


def _named(name: str) -> Quantity:
    return QUANTITIES[name]


def _smaller_gain(margins: Margins) -> Crossing:
    """Return the smaller of rise and fall: if it is infinite, each is for its own reason."""
    return replace(margins.smaller_gain_db, note="")


def _reciprocal(crossing: Crossing) -> Crossing:
    value = math.inf if crossing.proved == 0 else 1 / crossing.proved
    return replace(crossing, value=value, note="", at_least=None)


def _decibels(reading: Reading) -> Reading:
    value = reading.value
    return reading._replace(value=20 * math.log10(value) if value > 0 else -math.inf)


def _of_margins(choose: Callable[[Margins], Crossing]) -> Callable[[Judgement], Reading]:
    """Return how to read a margin of a loop, with what closed-loop poles say against it."""

    def read(judgement: Judgement) -> Reading:
        margins = judgement.margins
        crossing = choose(margins)
        doubts = "; ".join(margins.unproved)
        doubt = f"the margin is not confirmed: {doubts}" if doubts else ""
        least = crossing.at_least
        note = f"what is proved; computed {crossing.value:.6g}" if crossing.wide else crossing.note
        return Reading(
            crossing.proved,
            crossing.frequency_hz,
            crossing.mode,
            note,
            doubt,
            least,
            0 if least is None else margins.intervals,
        )

    return read


def _margin(
    name: str, unit: str, symbol: str, meaning: str, choose: Callable[[Margins], Crossing],
    infinite: str = "nothing limits it", scale: Scale = "",
) -> Quantity:  # fmt: skip
    return Quantity(
        name, unit, symbol, "greater", meaning, "margin", _of_margins(choose), choose, infinite,
        scale=scale,
    )  # fmt: skip


def _bandwidth(judgement: Judgement) -> Reading:
    hertz = judgement.margins.bandwidth_hz
    if hertz == 0:
        return Reading(hertz, note="|S| is above 1/√2 from the lowest frequency on")
    return Reading(hertz)


def _damping(judgement: Judgement) -> Reading:
    poles = judgement.poles
    return _of_poles(judgement, *judgement.smallest(-poles.real / np.abs(poles)))


def _decay(judgement: Judgement) -> Reading:
    return _of_poles(judgement, *judgement.smallest(-judgement.poles.real))


def _of_poles(judgement: Judgement, value: float, hertz: float) -> Reading:
    """Return what the poles of a stable loop have; nothing for sure where rounding hides it."""
    return Reading(max(value, 0.0) if judgement.loop.poles_known else 0.0, hertz)


def _cost(judgement: Judgement) -> Reading:
    return Reading(judgement.cost, doubt=_cost_doubt(judgement))


def _loss(judgement: Judgement) -> Reading:
    if math.isinf(judgement.cost):
        return Reading(math.nan, note=PASSES)
    doubt = _cost_doubt(judgement)
    if not (judgement.at_once or judgement.optimum.certificate.verified):
        doubt = "the optimum that the cost is compared with is not verified"
    return Reading(judgement.loss, doubt=doubt)


def _cost_doubt(judgement: Judgement) -> str:
    if judgement.loop.h2.discrepancy <= COST_TOLERANCE:
        return ""
    return "two Gramians do not give the same cost"


def _noise(choose: Callable[[NoiseLevels], float | None]) -> Callable[[Judgement], Reading]:
    return lambda judgement: _number(choose(judgement.noise))


def _slew(choose: Callable[[SlewSummary], float | None]) -> Callable[[Judgement], Reading]:
    return lambda judgement: _number(choose(judgement.response.summary))


def _number(value: float | None) -> Reading:
    return Reading(math.nan if value is None else value)


_NO_CROSSING = "the gain never crosses one: no {} makes it unstable"
PASSES = "white sensor noise passes straight to the actuator"
_MOTOR = "the arm has no motor"
_TIP = "the arm's modal data tell of no tip"
_SIMULATED = "the slew has no conditions under which it is simulated"
_ms = _of_margins(lambda m: _reciprocal(m.modulus))
_mt = _of_margins(lambda m: _reciprocal(m.complementary))

_LIST = (
    Quantity(
        "stable", "", "stable", "greater", "the closed loop on the truth is stable", "stability",
        lambda judgement: Reading(1.0),
    ),
    _margin(
        "gain_margin_db", "dB", "GM",
        "smaller of the gain's rise and fall to the stability limit", _smaller_gain,
        "no rise or fall of the gain makes the loop unstable",
    ),
    _margin(
        "gain_margin_up_db", "dB", "GM↑", "rise of the gain to the stability limit",
        lambda m: m.gain_db,
    ),
    _margin(
        "gain_margin_down_db", "dB", "GM↓", "fall of the gain to the stability limit",
        lambda m: m.gain_reduction_db,
    ),
    _margin(
        "phase_margin_deg", "deg", "PM", "smallest phase change of either sign to the limit",
        lambda m: m.phase_deg, _NO_CROSSING.format("turn of the phase"),
    ),
    _margin(
        "delay_margin_s", "s", "DM", "smallest added delay to the limit", lambda m: m.delay_s,
        _NO_CROSSING.format("delay"), scale="time",
    ),
    _margin(
        "modulus_margin", "", "1/Ms", "distance of the Nyquist curve from -1", lambda m: m.modulus
    ),
    _margin(
        "disk_margin", "", "α", "symmetric disk margin for gain and phase together",
        lambda m: m.disk,
    ),
    Quantity(
        "sensitivity_peak", "", "Ms", "smaller", "largest gain of S = 1/(1 + L)", "sensitivity", _ms
    ),
    Quantity(
        "sensitivity_peak_db", "dB", "Ms", "smaller", "largest gain of S in decibels",
        "sensitivity", lambda judgement: _decibels(_ms(judgement)),
    ),
    Quantity(
        "complementary_peak", "", "Mt", "smaller", "largest gain of T = L/(1 + L)", "sensitivity",
        _mt,
    ),
    Quantity(
        "complementary_peak_db", "dB", "Mt", "smaller", "largest gain of T in decibels",
        "sensitivity", lambda judgement: _decibels(_mt(judgement)),
    ),
    Quantity(
        "closed_loop_bandwidth_hz", "Hz", "f_B", "greater",
        "frequency at which the gain of S first rises through 1/√2", "sensitivity", _bandwidth,
        infinite="|S| never rises through 1/√2", scale="rate",
    ),
    Quantity(
        "damping_ratio_min", "", "ζ", "greater", "smallest damping ratio of the closed-loop poles",
        "pole", _damping,
    ),
    Quantity(
        "decay_rate_min", "1/s", "σ", "greater", "smallest decay rate of the closed-loop poles",
        "pole", _decay, scale="rate",
    ),
    Quantity(
        "h2_cost", "", "J", "smaller", "squared H2 norm from the noise to the weighted outputs",
        "cost", _cost, infinite=PASSES,
    ),
    Quantity(
        "h2_loss", "", "J/J* − 1", "smaller",
        "H2 cost over the truth's optimum with the same clock and delay, minus one", "cost", _loss,
        infinite=PASSES, resolution=COST_TOLERANCE,
    ),
    Quantity(
        "tip_rms", "m", "tip rms", "smaller", "tip under the noise, root mean square", "noise",
        _noise(lambda n: n.tip), needs=_TIP, scale="length",
    ),
    Quantity(
        "torque_rms", "N·m", "τ rms", "smaller", "torque under the noise, root mean square",
        "noise", _noise(lambda n: n.torque), infinite=PASSES, scale="torque",
    ),
    Quantity(
        "voltage_rms", "V", "V rms", "smaller", "motor voltage under the noise, root mean square",
        "noise", _noise(lambda n: n.voltage), infinite=PASSES, needs=_MOTOR,
    ),
    Quantity(
        "settling_time", "s", "t_s", "smaller",
        "time until the tip stays within 2 % of its travel", "slew",
        _slew(lambda s: s.settling_time_s), scale="time",
        infinite="the tip is not seen to stay within 2 %, for ever or until slew.horizon_s",
    ),
    Quantity(
        "overshoot", "", "OS", "smaller", "largest tip beyond its travel, as a fraction of it",
        "slew", _slew(lambda s: s.overshoot), resolution=1e-6,
    ),
    Quantity(
        "residual_vibration", "m", "resid.", "smaller",
        "largest tip error after the reference has come to rest", "slew",
        _slew(lambda s: s.residual_m), scale="length",
    ),
    Quantity(
        "torque_peak", "N·m", "τ peak", "smaller", "largest torque in the slew", "slew",
        _slew(lambda s: s.peak_torque), scale="torque",
    ),
    Quantity(
        "voltage_peak", "V", "V peak", "smaller", "largest motor voltage in the slew", "slew",
        _slew(lambda s: s.peak_voltage), needs=_MOTOR,
    ),
    Quantity(
        "slew_energy", "J", "W", "smaller",
        "work of the actuator in a simulated slew, driving and braking alike", "slew",
        _slew(lambda s: s.energy_j), needs=_SIMULATED, simulated=True,
    ),
    Quantity(
        "saturation_time", "s", "t_sat", "smaller",
        "time for which the command is limited in a simulated slew", "slew",
        _slew(lambda s: s.saturation_s), needs=_SIMULATED, scale="time", simulated=True,
    ),
)  # fmt: skip

QUANTITIES: Mapping[str, Quantity] = MappingProxyType({q.name: q for q in _LIST})


def quantities_of(slew: Slew) -> tuple[Quantity, ...]:
    """Return the quantities that are told of a slew: those of a simulated one only if it is.

    Parameters
    ----------
    slew : Slew

    Returns
    -------
    tuple of Quantity

    Examples
    --------
    >>> import slewctl as sc
    >>> [q.name for q in quantities_of(sc.Slew(30.0, 2.0))][-1]
    'voltage_peak'
    """
    return tuple(q for q in _LIST if not (q.simulated and slew.exact))


# Recorded in every baseline: what a change to a design must not make worse unseen.
RECORDED = (
    "gain_margin_db", "phase_margin_deg", "delay_margin_s", "modulus_margin", "disk_margin",
)  # fmt: skip
