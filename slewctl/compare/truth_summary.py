"""What the truth of a case is worth, and the optimum on it."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

from slewctl.arm import Arm, ModalData
from slewctl.compare.evaluation import Evaluation, Judge
from slewctl.design.result import Controller
from slewctl.errors import AccuracyError
from slewctl.model import Truth, beam_inertia


@dataclass(frozen=True)
class TruthSummary:
    """What the truth of a case is worth.

    Attributes
    ----------
    modes, functions : int
        Flexible modes kept, polynomial functions they were computed with.
    tolerance : float
        Largest estimated relative error of the kept frequencies.
    frequencies_hz : tuple of float
    optimal_cost : float or None
        Smallest squared H2 norm that any controller achieves on it with the case's clock; None
        without limits and noise, as the drift, or where it is not known.
    optimal_verified : bool
    optimum_drift : float or None
        Relative change of the optimal cost on a truth of twice the modes; NaN where there is
        none, or where no optimum of it is known.
    hub_ratio : float
        Hub inertia (with the motor's rotor) over that of the beam about the axis; of an arm
        from modal data the inertia that no mode moves over that which they do.
    optimum_doubt : str
        Why the optimal cost is not known.
    """

    modes: int
    functions: int
    tolerance: float
    frequencies_hz: tuple[float, ...]
    optimal_cost: float | None
    optimal_verified: bool
    optimum_drift: float | None
    hub_ratio: float
    optimum_doubt: str = ""


def summary_of(judge: Judge, chosen: Evaluation) -> TruthSummary:
    """Return what the truth of a judged design is worth, its optimum and that of finer ones."""
    judged = chosen.judgement
    if not judge.case.objective.weighted:
        return truth_summary(judge.truth)
    try:
        optimum = judged.optimum
    except AccuracyError as error:
        return truth_summary(judge.truth, doubt=str(error))
    drift = math.nan
    if judged.finer:
        with suppress(AccuracyError):  # what its design is compared with says so
            drift = judged.finer.optimum.h2_cost / optimum.h2_cost - 1
    return truth_summary(judge.truth, optimum, drift)


def truth_summary(
    model: Truth, optimum: Controller | None = None, drift: float = math.nan, doubt: str = ""
) -> TruthSummary:
    """Return what a truth is worth, and the optimum on it where it is known, or why not."""
    return TruthSummary(
        modes=model.modes,
        functions=model.functions,
        tolerance=model.tolerance,
        frequencies_hz=tuple(float(f) for f in model.frequencies_hz),
        optimal_cost=optimum.h2_cost if optimum else None,
        optimal_verified=optimum is not None and optimum.certificate.verified,
        optimum_drift=drift if optimum else None,
        hub_ratio=_hub_ratio(model.arm),
        optimum_doubt=doubt,
    )


def _hub_ratio(arm: Arm) -> float:
    """Return the hub's inertia over the beam's; of modal data what no mode moves over the rest."""
    if isinstance(arm.beam, ModalData):
        rigid = arm.beam.rigid_remainder(arm.hub_inertia)
        return rigid / (arm.beam.inertia + arm.hub_inertia - rigid)
    return arm.hub_inertia / beam_inertia(arm)
