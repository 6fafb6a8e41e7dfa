"""A sample time for a law that has none."""

from __future__ import annotations

import math

from slewctl.compare import Judgement, digital_loss, read
from slewctl.design.methods import GIVEN
from slewctl.errors import InputError

# Sample times that are tried, three in a decade, and what of a margin may be lost.
_MOST_TRIED, _KEPT = 12, 0.1


def check_sampled(judgement: Judgement) -> None:
    """Refuse a continuous controller, and tell a sample time at which it could run."""
    if judgement.controller.sample_time:
        return
    given = judgement.controller.method == GIVEN
    also = ' and discretise = "tustin"' if given else ""
    T = longest_sample_time(judgement)
    which = f", such as sample_time = {T:g}, which keeps nine tenths of its margins" if T else ""
    raise InputError(
        "the controller is continuous, and a computer runs samples",
        where="controller.sample_time",
        remedy=f"add sample_time{also} to [controller]{which}",
    )


def longest_sample_time(judgement: Judgement) -> float:
    """Return a sample time in s at which a continuous law keeps nine tenths of its margins.

    Zero where none is found: the law itself has no loop to keep.
    """
    if not judgement.stable:
        return 0.0
    longest = read(judgement, "delay_margin_s").value
    if not math.isfinite(longest):
        longest = 1.0
    digit = 10.0 ** math.floor(math.log10(longest))
    for step in range(_MOST_TRIED):
        T = digit * (5, 2, 1)[step % 3] / 10.0 ** (step // 3)
        if longest >= T:
            made = judgement.controller.discretised(T)
            found = digital_loss(judgement, judgement.yardstick.judge(made, judgement.slew))
            if found.margin <= _KEPT:
                return T
    return 0.0
