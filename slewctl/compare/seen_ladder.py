"""The spillover ladder as it is seen at once: no margin is proved, no optimum confirmed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from slewctl.compare.case import Case, Origin
from slewctl.compare.judgement import Judgement, Yardstick
from slewctl.compare.ladder import Ladder, Rung
from slewctl.design import Controller
from slewctl.errors import SlewctlError
from slewctl.loop import close
from slewctl.loop.seen_disk import seen_disk_margin

_SEEN = ("disk_margin", "h2_loss")
# Two rungs between which nothing happens: how far values may differ, relative to the larger,
# or at all.
_SAME = {"disk_margin": (0.05, 0.0), "h2_loss": (0.2, 1e-4)}


@dataclass(frozen=True, eq=False)
class SeenRung(Rung):
    """A rung whose stability is told by poles, and its disk margin by a curve.

    With dead time the poles are those of an approximation.  `value` knows what a ladder's
    figure shows; all else is that of the judgement.

    Attributes
    ----------
    below : Yardstick or None
        Of a rung below.
    """

    below: Yardstick | None = None

    @property
    def stable(self) -> bool:
        """Whether the loop's poles are stable."""
        return self.judgement.loop.stable_by_poles

    def value(self, name: str) -> float | None:
        """Return ``disk_margin`` or ``h2_loss`` as it is seen, None where there is no value."""
        return self._seen[name] if name in _SEEN else super().value(name)

    @cached_property
    def _seen(self) -> dict[str, float | None]:
        """What is told; of both together, since the same eigenvectors tell them."""
        margin = seen_disk_margin(self.judgement.loop) if self.stable else None
        return dict(zip(_SEEN, (margin, self._loss()), strict=True))

    def _loss(self) -> float | None:
        """The cost over the least, less one; None without weights, or where it is not found."""
        loop = self.judgement.loop
        if not (self.stable and loop.objective.weighted):
            return None
        if math.isinf(loop.h2_by_poles.value):
            return math.inf
        try:
            least = self.judgement.yardstick.least_cost(*self.judgement.clock, self.below)
        except SlewctlError:  # it is told when the ladder is climbed
            return None
        return loop.h2_by_poles.value / least - 1


def climb_at_once(
    steps: Sequence[Yardstick], case: Case, origin: Origin, judgement: Judgement
) -> Ladder:
    """Return a ladder as `climb` does, in a fraction of the time, for a first look.

    Rungs are farther and farther apart.  What a mode does to a loop it does with every mode
    above it, too, so that nothing happens between two rungs that are alike; between others all
    are looked at until neighbours are alike.  Where a loop is lost is told to the mode.

    Parameters
    ----------
    steps : sequence of Yardstick
    case : Case
    origin : Origin
    judgement : Judgement
        Of the last step.

    Returns
    -------
    Ladder
        Of what is stable the disk margin is right to a part in a thousand, and the loss to 1e-6.

    Examples
    --------
    >>> from slewctl.compare import Judge
    >>> from slewctl.compare.ladder import climb, steps
    >>> from slewctl.compare.seen_ladder import climb_at_once
    >>> from slewctl.files import example_design, read_design
    >>> judge = Judge(read_design(example_design()).case)
    >>> given = steps(judge), judge.case, judge.case.origin, judge.judge(judge.own[1])
    >>> seen, proved = climb_at_once(*given), climb(*given)
    >>> len(seen.rungs), len(proved.rungs)
    (7, 20)
    >>> abs(seen.rungs[0].value("disk_margin") / proved.rungs[0].value("disk_margin") - 1) < 1e-3
    True
    """
    controller, last = judgement.controller, len(steps) - 1

    def seen(place: int, below: SeenRung | None) -> SeenRung:
        own = judgement if place == last else _closed(steps[place], controller, case)
        return SeenRung(own, None, below.judgement.yardstick if below else None)

    return Ladder(
        name=case.name,
        origin=origin,
        method=case.method,
        controller=controller,
        rungs=tuple(sparse(len(steps), seen)),
        truth_tolerance=judgement.yardstick.model.tolerance,
    )


def sparse(size: int, seen: Callable[[int, SeenRung | None], SeenRung]) -> list[SeenRung]:
    """Return some rungs of a ladder, in their order, between which nothing happens.

    Parameters
    ----------
    size : int
        How many there are.
    seen : callable
        Makes the rung of a place, from the next lower one that there is.

    Returns
    -------
    list of SeenRung
        The first and the last among them.

    Examples
    --------
    >>> from slewctl.compare import Judge
    >>> from slewctl.compare.seen_ladder import SeenRung, sparse
    >>> from slewctl.files import example_design, read_design
    >>> judge = Judge(read_design(example_design()).case)
    >>> rung = SeenRung(judge.judge(judge.own[1]), None)
    >>> len(sparse(100, lambda place, below: rung))
    11
    """

    def between(low: int, lower: SeenRung, high: int, upper: SeenRung) -> list[SeenRung]:
        if high - low == 1 or _alike(lower, upper):
            return []
        place = (low + high) // 2
        middle = seen(place, lower)
        below, above = between(low, lower, place, middle), between(place, middle, high, upper)
        return [*below, middle, *above]

    rungs, last = [seen(0, None)], 0
    for place in _places(size - 1):
        rung = seen(place, rungs[-1])
        rungs += [*between(last, rungs[-1], place, rung), rung]
        last = place
    return rungs


def _places(last: int) -> Iterator[int]:
    """Yield what is looked at in any case after the first: 1, 2, 4, 7, 11 … and the last."""
    place = 0
    while place < last:
        gap = 1 + place // 2
        place = place + gap if place + 1.5 * gap < last else last
        yield place


def _alike(lower: SeenRung, upper: SeenRung) -> bool:
    """Whether two rungs show the same, so that those between them do, too."""
    if lower.stable != upper.stable:
        return False
    return all(
        _near(lower.value(name), upper.value(name), part, least)
        for name, (part, least) in _SAME.items()
    )


def _near(first: float | None, second: float | None, part: float, least: float) -> bool:
    """Whether two values differ by no more than a part of the larger, or hardly at all."""
    if first is None or second is None or first == second:
        return first == second
    return abs(first - second) <= max(part * max(abs(first), abs(second)), least)


def _closed(step: Yardstick, controller: Controller, case: Case) -> Judgement:
    """Return the loop on a step; its slew is not asked for, and no shaper is made."""
    loop = replace(close(step.model, step.objective, controller), source=step)
    return Judgement(loop, step, case.slew)
