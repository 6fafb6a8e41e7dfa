"""Judgements with one finding put in the place of what was computed."""

from __future__ import annotations

from copy import copy
from typing import Any

from slewctl.compare import Judgement

# What a loop knows of itself; the rest belongs to the judgement.
_OF_THE_LOOP = ("margins", "h2", "stable")


def changed(judgement: Judgement, **findings: Any) -> Judgement:
    """Return a copy on which these cached properties have other values.

    ``finer=None`` ends the ladder; by default the changed judgement is its own finer one, of
    twice the modes, so that what was put in converges at once.
    """
    twin, loop = copy(judgement), copy(judgement.loop)
    twin.__dict__.update(loop=loop, _read={})  # what was read of the other is not so here
    for name, value in findings.items():
        (loop if name in _OF_THE_LOOP else twin).__dict__[name] = value
    twin.__dict__.setdefault("finer", None)
    if "finer" not in findings:
        again = copy(twin)
        again.__dict__.update(finer=None, _read={})
        twin.__dict__["finer"] = again
    return twin
