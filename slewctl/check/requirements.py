"""Requirements on a design, and the verdict on each.

A requirement is a name and a limit.  Its value is read from the evaluation on the truth;
NaN never passes, and an unstable loop passes none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from slewctl.compare import Evaluation
from slewctl.compare.evaluation import PoleDamping
from slewctl.errors import InputError, check_choice, check_nonnegative
from slewctl.loop import Crossing, Margins

# Verdicts rest on a truth whose frequencies are known this well, relative, and on costs
# that two Gramians give alike.
TRUTH_TOLERANCE = 1e-6
COST_TOLERANCE = 1e-6


class Reading(NamedTuple):
    """A value; the frequency and mode that set it, where there are any; why it is infinite."""

    value: float
    frequency_hz: float | None = None
    mode: str = ""
    note: str = ""


@dataclass(frozen=True)
class Requirement:
    """How to read a quantity from an evaluation, and in which sense it is limited."""

    read: Callable[[Evaluation], Reading]
    sense: Literal["at least", "at most"]
    unit: str
    meaning: str


@dataclass(frozen=True)
class Verdict:
    """A requirement with its value on the truth.

    Attributes
    ----------
    requirement : str
    value : float or None
        None when the loop is unstable and has no such value.
    limit : float
    unit, sense : str
    frequency_hz : float or None
        Where the value is reached, or where the loop is unstable.
    passed : bool
    note : str
        Why a value is infinite or missing.
    mode : str
        The mode nearest to that frequency, such as "mode 3 (12.4 Hz)".
    """

    requirement: str
    value: float | None
    limit: float
    unit: str
    sense: str
    frequency_hz: float | None
    passed: bool
    note: str
    mode: str = ""

    @property
    def slack(self) -> float:
        """How far the value is on the right side of the limit, relative to the limit.

        Zero on the limit, negative beyond it, infinite for an infinite margin and for a limit
        of zero that is kept; NaN, or no value, is minus infinity.
        """
        if self.value is None or math.isnan(self.value):
            return -math.inf
        room = self.value - self.limit if self.sense == "at least" else self.limit - self.value
        return room / self.limit if self.limit else math.copysign(math.inf, room)


def _margin(choose: Callable[[Margins], Crossing]) -> Callable[[Evaluation], Reading]:
    """Return how to read one of the margins of a loop that has any."""

    def read(evaluation: Evaluation) -> Reading:
        if evaluation.margins is None:
            return Reading(math.nan)
        crossing = choose(evaluation.margins)
        return Reading(crossing.value, crossing.frequency_hz, crossing.mode, crossing.note)

    return read


def _smaller_gain(margins: Margins) -> Crossing:
    """Return the smaller of rise and fall: if it is infinite, each is for its own reason."""
    return replace(margins.smaller_gain_db, note="")


def _number(value: float | None) -> Reading:
    return Reading(math.nan if value is None else value)


def _pole(found: PoleDamping) -> Reading:
    return Reading(found.value, found.frequency_hz)


REQUIREMENTS: dict[str, Requirement] = {
    "stable": Requirement(
        lambda e: _number(float(e.stable)), "at least", "", "the closed loop on the truth is stable"
    ),
    "gain_margin_db": Requirement(
        _margin(_smaller_gain),
        "at least",
        "dB",
        "smaller of the gain's rise and fall to the stability limit",
    ),
    "phase_margin_deg": Requirement(
        _margin(lambda m: m.phase_deg),
        "at least",
        "deg",
        "smallest phase change of either sign to the limit",
    ),
    "delay_margin_s": Requirement(
        _margin(lambda m: m.delay_s), "at least", "s", "smallest added delay to the limit"
    ),
    "modulus_margin": Requirement(
        _margin(lambda m: m.modulus), "at least", "", "distance of the Nyquist curve from -1"
    ),
    "disk_margin": Requirement(
        _margin(lambda m: m.disk),
        "at least",
        "",
        "symmetric disk margin for gain and phase together",
    ),
    "damping_ratio_min": Requirement(
        lambda e: _pole(e.damping_ratio),
        "at least",
        "",
        "smallest damping ratio of the closed-loop poles",
    ),
    "decay_rate_min": Requirement(
        lambda e: _pole(e.decay_rate),
        "at least",
        "1/s",
        "smallest decay rate of the closed-loop poles",
    ),
    "h2_loss_max": Requirement(
        lambda e: _number(e.loss), "at most", "", "H2 cost over the truth's optimum, minus one"
    ),
    "torque_peak_max": Requirement(
        lambda e: _number(e.slew.peak_torque if e.slew else None),
        "at most",
        "N·m",
        "largest torque in the slew",
    ),
    "voltage_peak_max": Requirement(
        lambda e: _number(e.slew.peak_voltage if e.slew else None),
        "at most",
        "V",
        "largest motor voltage in the slew",
    ),
    "settling_time_max": Requirement(
        lambda e: _number(e.slew.settling_time_s if e.slew else None),
        "at most",
        "s",
        "time until the tip stays within 2 % of its travel",
    ),
}


# Always recorded, required or not: what a change to a design must not make worse unseen.
MARGINS = tuple(name for name in REQUIREMENTS if "margin" in name)

# Why a value is infinite, where the loop does not say it better.
_INFINITE = {
    "gain_margin_db": "no rise or fall of the gain makes the loop unstable",
    "phase_margin_deg": "the gain never crosses one: no turn of the phase makes it unstable",
    "delay_margin_s": "the gain never crosses one: no delay makes it unstable",
    "h2_loss_max": "sensor noise passes straight to the actuator",
    "settling_time_max": "not settled within the time simulated",
}


def check_limits(limits: Mapping[str, float | bool]) -> dict[str, float]:
    """Return the limits as numbers; ``stable`` must be true.

    Raises
    ------
    InputError
        For an unknown requirement or an impossible limit.
    """
    numbers = {}
    for name, limit in limits.items():
        check_choice(name, REQUIREMENTS, "requirements")
        if name == "stable":
            if limit is not True:
                raise InputError(
                    f"{limit!r} cannot be required",
                    where="requirements.stable",
                    remedy="write stable = true, or leave it out",
                )
            numbers[name] = 1.0
        else:
            numbers[name] = check_nonnegative(limit, f"requirements.{name}")
    return numbers


def judge(evaluation: Evaluation, limits: Mapping[str, float | bool]) -> tuple[Verdict, ...]:
    """Return the verdict on each requirement; stability is always the first.

    Parameters
    ----------
    evaluation : Evaluation
        From `slewctl.compare.evaluate`.
    limits : mapping of str to float
        Requirement names (see `REQUIREMENTS`) and their limits.

    Raises
    ------
    InputError
        For an unknown requirement or an impossible limit.
    """
    numbers = {"stable": 1.0, **check_limits(limits)}
    return tuple(_verdict(evaluation, name, limit) for name, limit in numbers.items())


def measure(evaluation: Evaluation, names: Iterable[str]) -> dict[str, Reading]:
    """Return the values of the named requirements, and of every margin, in a fixed order.

    Parameters
    ----------
    evaluation : Evaluation
    names : iterable of str
        Requirements beside the margins.

    Returns
    -------
    dict of str to Reading
        In the units of `REQUIREMENTS`.  An unstable loop has none of them; a margin that was
        not confirmed is NaN.
    """
    if not evaluation.stable:
        return {}
    wanted = {*MARGINS, *names} - {"stable"}
    margins = evaluation.margins
    values = {}
    for name, rule in REQUIREMENTS.items():
        if name in wanted:
            doubtful = name in MARGINS and (margins is None or not margins.confirmed)
            values[name] = Reading(math.nan) if doubtful else rule.read(evaluation)
    return values


def _verdict(evaluation: Evaluation, name: str, limit: float) -> Verdict:
    rule = REQUIREMENTS[name]
    if not evaluation.stable:
        note = f"unstable at {evaluation.unstable_hz[0]:.4g} Hz"
        value: float | None = 0.0 if name == "stable" else None
        return Verdict(
            name, value, limit, rule.unit, rule.sense, evaluation.unstable_hz[0], False, note
        )
    reading = rule.read(evaluation)
    value, margins = reading.value, evaluation.margins
    passed = value >= limit if rule.sense == "at least" else value <= limit
    note = "this arm has no such value" if math.isnan(value) else ""
    if math.isinf(value):
        note = reading.note or _INFINITE.get(name, "nothing limits it")
    if name in ("stable", "h2_loss_max"):
        passed, note = _on_finer_truth(evaluation, name, limit, passed, note)
    if evaluation.truth_tolerance > TRUTH_TOLERANCE:
        passed, note = False, f"the truth is converged to {evaluation.truth_tolerance:.0e} only"
    if "margin" in name and margins is not None and not margins.confirmed:
        doubts = "; ".join(margins.doubts) or "closed-loop poles do not agree"
        passed, note = False, f"the margin is not confirmed: {doubts}"
    if not evaluation.verified:
        passed, note = False, f"the design is not verified: {evaluation.certificate}"
    return Verdict(
        name,
        value,
        limit,
        rule.unit,
        rule.sense,
        reading.frequency_hz,
        passed,
        note,
        reading.mode,
    )


def _on_finer_truth(
    evaluation: Evaluation, name: str, limit: float, passed: bool, note: str
) -> tuple[bool, str]:
    """Return the verdict and note after a second look on a truth of twice the modes."""
    finer = evaluation.finer
    if finer is not None and not finer.stable:
        return False, f"unstable on a truth of {finer.modes} modes"
    if name == "stable":
        return passed, note
    if not evaluation.optimum_verified or (evaluation.cost_discrepancy or 0.0) > COST_TOLERANCE:
        return False, "the cost or the optimum that it is compared with is not verified"
    if finer is not None and finer.loss is not None and evaluation.loss is not None:
        if not finer.loss <= limit:
            passed = False
        moved = abs(finer.loss - evaluation.loss) > 0.01 * max(abs(evaluation.loss), 1e-6)
        if moved or not passed:
            note = f"{finer.loss:.4g} on a truth of {finer.modes} modes"
    return passed, note
