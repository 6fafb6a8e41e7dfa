"""Requirements on a design, and the verdict on each.

A requirement is a name and a limit.  Its value is read from the evaluation on the truth;
NaN never passes, and an unstable loop passes none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from slewctl.compare import Evaluation
from slewctl.errors import InputError, check_choice, check_nonnegative
from slewctl.loop import Crossing

# Verdicts rest on a truth whose frequencies are known this well, relative, and on costs
# that two Gramians give alike.
TRUTH_TOLERANCE = 1e-6
COST_TOLERANCE = 1e-6

# A value and the frequency that sets it, where there is one.
Reading = tuple[float, float | None]


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
    """

    requirement: str
    value: float | None
    limit: float
    unit: str
    sense: str
    frequency_hz: float | None
    passed: bool
    note: str


def _gain(evaluation: Evaluation) -> Reading:
    margins = evaluation.margins
    if margins is None:
        return math.nan, None
    return _reading(min(margins.gain_db, margins.gain_reduction_db, key=lambda m: m.value))


def _phase(evaluation: Evaluation) -> Reading:
    return _reading(evaluation.margins.phase_deg) if evaluation.margins else (math.nan, None)


def _delay(evaluation: Evaluation) -> Reading:
    return _reading(evaluation.margins.delay_s) if evaluation.margins else (math.nan, None)


def _modulus(evaluation: Evaluation) -> Reading:
    return _reading(evaluation.margins.modulus) if evaluation.margins else (math.nan, None)


def _disk(evaluation: Evaluation) -> Reading:
    return _reading(evaluation.margins.disk) if evaluation.margins else (math.nan, None)


def _reading(crossing: Crossing) -> Reading:
    return crossing.value, crossing.frequency_hz


def _number(value: float | None) -> Reading:
    return (math.nan if value is None else value), None


def _damping(evaluation: Evaluation) -> Reading:
    return evaluation.damping_ratio.value, evaluation.damping_ratio.frequency_hz


def _decay(evaluation: Evaluation) -> Reading:
    return evaluation.decay_rate.value, evaluation.decay_rate.frequency_hz


def _stable(evaluation: Evaluation) -> Reading:
    return float(evaluation.stable), None


REQUIREMENTS: dict[str, Requirement] = {
    "stable": Requirement(_stable, "at least", "", "the closed loop on the truth is stable"),
    "gain_margin_db": Requirement(
        _gain, "at least", "dB", "smaller of the gain's rise and fall to the stability limit"
    ),
    "phase_margin_deg": Requirement(
        _phase, "at least", "deg", "smallest phase change of either sign to the limit"
    ),
    "delay_margin_s": Requirement(_delay, "at least", "s", "smallest added delay to the limit"),
    "modulus_margin": Requirement(
        _modulus, "at least", "", "distance of the Nyquist curve from -1"
    ),
    "disk_margin": Requirement(
        _disk, "at least", "", "symmetric disk margin for gain and phase together"
    ),
    "damping_ratio_min": Requirement(
        _damping, "at least", "", "smallest damping ratio of the closed-loop poles"
    ),
    "decay_rate_min": Requirement(
        _decay, "at least", "1/s", "smallest decay rate of the closed-loop poles"
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


def _verdict(evaluation: Evaluation, name: str, limit: float) -> Verdict:
    rule = REQUIREMENTS[name]
    if not evaluation.stable:
        note = f"unstable at {evaluation.unstable_hz[0]:.4g} Hz"
        value: float | None = 0.0 if name == "stable" else None
        return Verdict(
            name, value, limit, rule.unit, rule.sense, evaluation.unstable_hz[0], False, note
        )
    value, frequency = rule.read(evaluation)
    margins = evaluation.margins
    passed = value >= limit if rule.sense == "at least" else value <= limit
    note = "" if not math.isnan(value) else "this arm has no such value"
    if math.isinf(value):
        note = (
            "not settled within the time simulated"
            if name == "settling_time_max"
            else "the loop has no such crossing"
        )
    if name in ("stable", "h2_loss_max"):
        passed, note = _on_finer_truth(evaluation, name, limit, passed, note)
    if evaluation.truth_tolerance > TRUTH_TOLERANCE:
        passed, note = False, f"the truth is converged to {evaluation.truth_tolerance:.0e} only"
    if "margin" in name and margins is not None and not margins.confirmed:
        passed, note = False, "the margin could not be confirmed by closed-loop poles"
    if not evaluation.verified:
        passed, note = False, f"the design is not verified: {evaluation.certificate}"
    return Verdict(name, value, limit, rule.unit, rule.sense, frequency, passed, note)


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
