"""A quantity followed over truths of twice the modes, until it stands still.

What is read from a truth of N modes is true of the arm only if more modes change nothing.
Each quantity is therefore read on N, 2N, 4N … modes until two successive values agree, or
the limit of modes is reached and it is undecided.  Stability is asked on all of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from slewctl.compare.judgement import Judgement
from slewctl.compare.quantities import QUANTITIES, TRUTH_TOLERANCE, Quantity, Reading
from slewctl.compare.reading import read

# Successive values that differ by no more, relative, have converged.
AGREEMENT = 0.01


@dataclass(frozen=True)
class Seen:
    """A quantity on a truth of so many modes.

    Attributes
    ----------
    modes : int
        Of the truth.
    reading : Reading
    """

    modes: int
    reading: Reading


@dataclass(frozen=True)
class Followed:
    """What was read of a quantity on truths of twice the modes.

    Attributes
    ----------
    quantity : Quantity
    seen : tuple of Seen
        By increasing number of modes.
    converged : bool
        Whether the last two agree within 1 %, or the last is on all modes that there are.
    """

    quantity: Quantity
    seen: tuple[Seen, ...]
    converged: bool

    @property
    def deciding(self) -> tuple[Seen, ...]:
        """What a verdict rests on: the two that agree, or all where none do."""
        return self.seen[-2:] if self.converged else self.seen

    @property
    def reading(self) -> Reading:
        """The worst of those that decide, with a doubt if any of them has one."""
        readings = [seen.reading for seen in self.deciding]
        doubts = (
            f"{s.reading.doubt} (on {s.modes} modes)" for s in self.deciding if s.reading.doubt
        )
        worst = self.quantity.worst(*readings)
        return worst._replace(doubt=worst.doubt or next(doubts, ""))

    def __str__(self) -> str:
        first, *rest = (
            f"{_text(self.quantity, seen.reading)} on {seen.modes}" for seen in self.seen
        )
        return ", ".join([f"{first} modes", *rest])


def follow(judgement: Judgement, name: str) -> Followed:
    """Return a quantity on the judgement's truth, on twice its modes, and so on.

    Parameters
    ----------
    judgement : Judgement
    name : str
        Key of `slewctl.compare.QUANTITIES`.

    Returns
    -------
    Followed
        A value that is missing on one of the truths, as on an unstable loop, is the last.
        Stability is followed to the limit of modes.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.compare import follow
    >>> judged = problem.judge(sc.lqg(plant))
    >>> follow(judged, "gain_margin_db").converged
    True
    """
    quantity = QUANTITIES[name]
    seen: list[Seen] = []
    for judged in judgement.ladder():
        reading = _read(judged, name)
        if quantity.kind == "stability" and reading.doubt and _settled(quantity, seen):
            break  # what was asked beyond two that agree needs no truth that is not converged
        seen.append(Seen(judged.modes, reading))
        if _lost(quantity, reading):
            return Followed(quantity, tuple(seen), converged=False)
        # Yes and no approach no limit: two that agree prove less, and more of them cost little.
        if quantity.kind != "stability" and _settled(quantity, seen):
            return Followed(quantity, tuple(seen), converged=True)
    # The modes that modal data give are all there are: the last value is the one.
    complete = judged.yardstick.model.complete
    return Followed(quantity, tuple(seen), converged=complete or _settled(quantity, seen))


def at_once(judgement: Judgement, name: str) -> Followed:
    """Return a quantity on the judgement's own truth alone, taken as if it stood still there.

    Parameters
    ----------
    judgement : Judgement
    name : str
        Key of `slewctl.compare.QUANTITIES`.

    Returns
    -------
    Followed
        For a first look, while `follow` goes on.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> from slewctl.compare import at_once
    >>> judged = problem.judge(sc.lqg(problem.plant("clamped-free", n=1)))
    >>> [seen.modes for seen in at_once(judged, "gain_margin_db").seen]
    [20]
    """
    quantity, reading = QUANTITIES[name], _read(judgement, name)
    alone = (Seen(judgement.modes, reading),)
    return Followed(quantity, alone, converged=not _lost(quantity, reading))


def _read(judgement: Judgement, name: str) -> Reading:
    """Return a reading, in doubt where the truth itself is not converged."""
    reading, tolerance = read(judgement, name), judgement.yardstick.model.tolerance
    if tolerance > TRUTH_TOLERANCE:
        return reading._replace(doubt=f"the truth is converged to {tolerance:.0e} only")
    return reading


def _lost(quantity: Quantity, reading: Reading) -> bool:
    """Whether there is no value, or no stability, and nothing to be followed."""
    return math.isnan(reading.value) or (quantity.kind == "stability" and not reading.value)


def _settled(quantity: Quantity, seen: Sequence[Seen]) -> bool:
    """Whether the last two values agree."""
    if len(seen) < 2:
        return False
    first, second = (each.reading.value for each in seen[-2:])
    if first == second:  # infinite ones too
        return True
    allowed = max(AGREEMENT * max(abs(first), abs(second)), quantity.resolution)
    return abs(first - second) <= allowed and math.isfinite(allowed)


def _text(quantity: Quantity, reading: Reading) -> str:
    if quantity.kind == "stability":
        return "stable" if reading.value else reading.note.partition(" at ")[0].partition(":")[0]
    return reading.note if math.isnan(reading.value) else f"{reading.value:.3g}"
