"""The spillover ladder as it is seen at once: no margin is proved, no optimum confirmed."""

from __future__ import annotations

import math
from collections.abc import Sequence
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


@dataclass(frozen=True, eq=False)
class SeenRung(Rung):
    """A rung whose stability is told by poles, and its disk margin by a curve.

    With dead time the poles are those of an approximation.  `value` knows what a ladder's
    figure shows; all else is that of the judgement.

    Attributes
    ----------
    below : Yardstick or None
        Of the rung below.
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
        loop, controller = self.judgement.loop, self.judgement.controller
        if not (self.stable and loop.objective.weighted):
            return None
        if math.isinf(loop.h2_by_poles.value):
            return math.inf
        clock, own = controller.sample_time, self.judgement.yardstick
        try:
            least = own.least_cost(clock, controller.delay if clock else 0.0, self.below)
        except SlewctlError:  # it is told when the ladder is climbed
            return None
        return loop.h2_by_poles.value / least - 1


def climb_at_once(
    steps: Sequence[Yardstick], case: Case, origin: Origin, judgement: Judgement
) -> Ladder:
    """Return a ladder as `climb` does, in a fifth of the time, for a first look.

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
    >>> abs(seen.rungs[0].value("disk_margin") / proved.rungs[0].value("disk_margin") - 1) < 1e-3
    True
    """
    controller = judgement.controller
    judged = (*(_closed(step, controller, case) for step in steps[:-1]), judgement)
    seen = (
        SeenRung(each, None, below) for each, below in zip(judged, (None, *steps), strict=False)
    )
    return Ladder(
        name=case.name,
        origin=origin,
        method=case.method,
        controller=controller,
        rungs=tuple(seen),
        truth_tolerance=judgement.yardstick.model.tolerance,
    )


def _closed(step: Yardstick, controller: Controller, case: Case) -> Judgement:
    """Return the loop on a step; its slew is not asked for, and no shaper is made."""
    loop = replace(close(step.model, step.objective, controller), source=step)
    return Judgement(loop, step, case.slew)
