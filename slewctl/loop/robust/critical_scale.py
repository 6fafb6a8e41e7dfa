"""The share of a part of a loop at which the loop becomes unstable."""

from __future__ import annotations

import numpy as np

from slewctl.errors import AccuracyError
from slewctl.loop.realisation import Realisation
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.margin_results import Crossing
from slewctl.numerics.linear_system import LinearSystem

# A share is confirmed this far inside and outside; one above a thousand counts as infinite.
_STEP, _LARGE = 1e-6, 1e3


def critical_scale(seen: Realisation) -> tuple[float, float | None]:
    """Return the smallest t > 0 for which 1 − t·seen has a zero on the axis, and where.

    A stable loop of gain below one has a gain margin, and that is t.
    """
    size = seen.peak().value
    if size * _LARGE < 1:
        return np.inf, None
    tame = 0.5 / size
    loop = LinearSystem(seen.A, -tame * seen.B, seen.C, -tame * seen.D)
    up = classical_margins(loop, within=_STEP, most_gain=_LARGE / tame).gain_db
    share = float(tame * 10 ** (up.value / 20))
    if share > _LARGE:
        share, up = np.inf, Crossing(np.inf, None)
    _confirm(seen, share)
    return share, up.frequency_hz


def _confirm(seen: Realisation, share: float) -> None:
    """Check by closed-loop poles that a share is the first at which stability is lost."""
    last = share if np.isfinite(share) else _LARGE
    inside = [closed_stable(seen, t) for t in last * (1 - _STEP) * np.linspace(1 / 8, 1, 8)]
    outside = np.isfinite(share) and closed_stable(seen, share * (1 + _STEP))
    if outside or not all(inside):
        raise AccuracyError(
            "the critical share of the left-out modes is not confirmed by closed-loop poles",
            where="spillover",
            remedy="use `small_gain` and the poles of the loop",
        )


def closed_stable(seen: Realisation, share: float) -> bool:
    """Whether 1 − share·seen has all its zeros left of the axis."""
    return bool(np.linalg.eigvals(seen.A + share * seen.B @ seen.C).real.max() < 0)
