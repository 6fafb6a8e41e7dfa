"""What a continuous law loses of its margins where it runs on a clock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from slewctl.compare.judgement import Judgement
from slewctl.compare.quantities import QUANTITIES, Reading
from slewctl.compare.reading import read

# The margins that are told side by side.
TOLD = ("gain_margin_db", "phase_margin_deg", "modulus_margin", "disk_margin")


@dataclass(frozen=True)
class SamplingLoss:
    """Margins on the truth of a continuous law, and of the sampled one that it was made.

    Attributes
    ----------
    continuous, sampled : mapping of str to Reading
        By the names of `slewctl.compare.QUANTITIES`; without values for an unstable loop.
    """

    continuous: Mapping[str, Reading]
    sampled: Mapping[str, Reading]

    def __str__(self) -> str:
        first = next(iter(self.continuous.values()))
        if math.isnan(first.value):
            return f"the continuous law that it was made of is {first.note}"
        parts = []
        for name, before in self.continuous.items():
            unit = QUANTITIES[name].unit
            words = f"{name.removesuffix('_db').removesuffix('_deg').replace('_', ' ')} "
            after = self.sampled[name].value
            kept = "none" if math.isnan(after) else f"{after:.3g}"
            parts.append(f"{words}{kept} instead of {before.value:.3g} {unit}".rstrip())
        return f"{', '.join(parts)} of the continuous law"


def sampling_loss(judgement: Judgement) -> SamplingLoss | None:
    """Return what sampling takes from the margins of a law on the truth.

    Parameters
    ----------
    judgement : Judgement

    Returns
    -------
    SamplingLoss or None
        None for a controller that was not made of a continuous one.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.pd_notch(plant, bandwidth_hz=0.3, sample_time=0.05)
    >>> from slewctl.compare import sampling_loss
    >>> loss = sampling_loss(problem.judge(K))
    >>> loss.sampled["phase_margin_deg"].value < loss.continuous["phase_margin_deg"].value
    True
    """
    before = judgement.continuous
    if before is None:
        return None
    return SamplingLoss(*({name: read(j, name) for name in TOLD} for j in (before, judgement)))
