"""Requirements on a design, and the verdict on each.

A requirement limits a quantity of `slewctl.compare.QUANTITIES`.  It holds only where the
quantity has stopped moving with the number of modes in the truth, or where every value seen
holds; NaN never passes, and an unstable loop passes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from slewctl.compare import QUANTITIES, Followed, Judgement, Quantity, Reading, at_once, follow
from slewctl.compare.quantities import RECORDED
from slewctl.errors import InputError, check_choice, check_nonnegative, shown

REQUIREMENTS: Mapping[str, Quantity] = MappingProxyType(
    {quantity.requirement: quantity for quantity in QUANTITIES.values()}
)
"""What a design file can require, by its key."""


@dataclass(frozen=True)
class Verdict:
    """A requirement with its value on the truth.

    Attributes
    ----------
    requirement : str
    value : float or None
        The worst of what decides; None when there is no such value.
    limit : float
    frequency_hz : float or None
        Where the value is reached, or where the loop is unstable.
    passed : bool
    note : str
        Why a value is infinite or missing, or fails though it is on the right side.
    mode : str
        The mode that takes part there, such as "mode 3 (12.4 Hz)".
    seen : tuple of (int, float or None)
        Modes of each truth that was asked, and the value there.
    at_least, intervals : float or None, int
        Of a margin, what is proved of it, and on how many intervals; see `Reading`.
    """

    requirement: str
    value: float | None
    limit: float
    frequency_hz: float | None
    passed: bool
    note: str
    mode: str = ""
    seen: tuple[tuple[int, float | None], ...] = ()
    at_least: float | None = None
    intervals: int = 0

    @property
    def quantity(self) -> Quantity:
        """What is limited."""
        return REQUIREMENTS[self.requirement]

    @property
    def slack(self) -> float:
        """How far the value is on the right side of the limit, relative to the limit.

        Zero on the limit, negative beyond it, infinite for an infinite margin and for a limit
        of zero that is kept; NaN, or no value, is minus infinity.
        """
        if self.value is None or math.isnan(self.value):
            return -math.inf
        greater = self.quantity.better == "greater"
        room = self.value - self.limit if greater else self.limit - self.value
        return room / self.limit if self.limit else math.copysign(math.inf, room)


def check_limits(limits: Mapping[str, float | bool]) -> dict[str, float]:
    """Return the limits as numbers; ``stable`` must be true.

    Parameters
    ----------
    limits : mapping of str to float or bool
        By requirement, in its own unit; see `REQUIREMENTS`.

    Returns
    -------
    dict of str to float

    Raises
    ------
    InputError
        For an unknown requirement or an impossible limit.

    Examples
    --------
    >>> from slewctl.check import check_limits
    >>> check_limits({"gain_margin_db": 6, "stable": True})
    {'gain_margin_db': 6.0, 'stable': 1.0}
    """
    numbers = {}
    for name, limit in limits.items():
        check_choice(name, REQUIREMENTS, f"requirements.{name}")
        if name == "stable":
            if limit is not True:
                raise InputError(
                    f"{shown(limit)} cannot be required",
                    where="requirements.stable",
                    remedy="write stable = true, or leave it out",
                )
            numbers[name] = 1.0
        else:
            numbers[name] = check_nonnegative(limit, f"requirements.{name}")
    return numbers


def judge(judgement: Judgement, limits: Mapping[str, float | bool]) -> tuple[Verdict, ...]:
    """Return the verdict on each requirement; stability is always the first.

    Parameters
    ----------
    judgement : Judgement
        From `slewctl.compare.Judge`.
    limits : mapping of str to float
        Requirement names (see `REQUIREMENTS`) and their limits.

    Returns
    -------
    tuple of Verdict

    Raises
    ------
    InputError
        For an unknown requirement or an impossible limit.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.check import judge
    >>> judged = problem.judge(sc.lqg(plant))
    >>> [(v.requirement, v.passed) for v in judge(judged, {"gain_margin_db": 3.0})]
    [('stable', True), ('gain_margin_db', True)]
    """
    return tuple(_verdicts(judgement, limits, follow))


def judge_at_once(judgement: Judgement, limits: Mapping[str, float | bool]) -> tuple[Verdict, ...]:
    """Return the verdicts as the judgement's own truth alone gives them, for a first look.

    Parameters
    ----------
    judgement : Judgement
    limits : mapping of str to float
        As for `judge`.

    Returns
    -------
    tuple of Verdict
        `judge` may take back what a finer truth does not hold.

    Raises
    ------
    InputError
        As `judge`.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> from slewctl.check import judge_at_once
    >>> judged = problem.judge(sc.lqg(problem.plant("clamped-free", n=1)))
    >>> [len(verdict.seen) for verdict in judge_at_once(judged, {"gain_margin_db": 3.0})]
    [1, 1]
    """
    return tuple(_verdicts(judgement, limits, at_once))


def _verdicts(
    judgement: Judgement,
    limits: Mapping[str, float | bool],
    followed: Callable[[Judgement, str], Followed],
) -> Iterator[Verdict]:
    for name, limit in {"stable": 1.0, **check_limits(limits)}.items():
        quantity = REQUIREMENTS[name].name
        yield _verdict(judgement, name, limit, followed(judgement, quantity))


def measure(judgement: Judgement, names: Iterable[str]) -> dict[str, Reading]:
    """Return the quantities of the named requirements, and of every margin, in a fixed order.

    Parameters
    ----------
    judgement : Judgement
    names : iterable of str
        Requirements beside the margins.

    Returns
    -------
    dict of str to Reading
        By the quantity's name: the worst of what decides a verdict on it.  An unstable loop
        has none of them; what may not be relied on is NaN.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.check import measure
    >>> judged = problem.judge(sc.lqg(plant))
    >>> measure(judged, ["phase_margin_deg"])["phase_margin_deg"].value > 10
    True
    """
    if not judgement.stable:
        return {}
    wanted = {*RECORDED, *(REQUIREMENTS[name].name for name in names)} - {"stable"}
    found = {name: follow(judgement, name).reading for name in QUANTITIES if name in wanted}
    return {
        name: reading._replace(value=math.nan) if reading.doubt else reading
        for name, reading in found.items()
    }


def _verdict(judgement: Judgement, requirement: str, limit: float, followed: Followed) -> Verdict:
    reading = followed.reading
    passed, note = _passes(followed, limit)
    certificate = judgement.controller.certificate
    if not certificate.verified:
        passed, note = False, f"the design is not verified: {certificate}"
    return Verdict(
        requirement,
        _number(reading),
        limit,
        reading.frequency_hz,
        passed,
        note,
        reading.mode,
        tuple((seen.modes, _number(seen.reading)) for seen in followed.seen),
        reading.at_least,
        reading.intervals,
    )


def _passes(followed: Followed, limit: float) -> tuple[bool, str]:
    """Return whether what decides is on the right side of a limit, and what to say of it."""
    reading, last = followed.reading, followed.seen[-1]
    unstable = followed.quantity.kind == "stability" and not last.reading.value
    if unstable or math.isnan(last.reading.value):
        return False, _missing(followed)
    if reading.doubt:
        return False, reading.doubt
    holds = all(followed.quantity.holds(seen.reading.value, limit) for seen in followed.deciding)
    if not followed.converged:
        if holds:
            return True, f"not converged, but every value holds: {followed}"
        return False, f"undecided: {followed}"
    if math.isinf(reading.value):
        return holds, reading.note
    moved = len(followed.seen) > 2 and followed.quantity.kind != "stability"
    return holds, str(followed) if moved else reading.note


def _missing(followed: Followed) -> str:
    """Say why there is no value, and on which truth where the first has one."""
    last = followed.seen[-1]
    if len(followed.seen) == 1:
        return last.reading.note
    return f"{last.reading.note} on a truth of {last.modes} modes"


def _number(reading: Reading) -> float | None:
    return None if math.isnan(reading.value) else reading.value
