"""Which number, known before the truth's poles are, tells that a design will spill over?

Each predictor is large where trouble is expected.  Those that are theorems call a loop safe
below one and are never wrong then; what they cost is false alarms.  The others order
designs, and have no threshold of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import control
import numpy as np

from slewctl._types import Array, BoolArray
from slewctl.compare.study.area_under_curve import area_under_curve
from slewctl.errors import InputError
from slewctl.loop import FrequencyResponse, Loop, close
from slewctl.loop.robust.ncf_margin import best_output_scale, ncf_margin
from slewctl.loop.robust.nu_gap import nu_gap
from slewctl.loop.robust.small_gain import LeftOut
from slewctl.model import Model
from slewctl.plant import generalised_plant

# Units of the sensors, over those with the largest b, that are tried for the ν-gap.
_UNITS = (1.0, 10.0)
_GRID = 1000


@dataclass(frozen=True)
class Predictors:
    """What can be known of a design before its loop on the truth is closed.

    Attributes
    ----------
    small_gain : float
        ‖KSΔ‖∞: below one the loop is stable.
    small_gain_on_a_grid : float
        The same, on a thousand frequencies: not a theorem.
    gap_in_si : float
        ν-gap over b(P, C), in rad, m and N·m: below one the loop is stable.
    gap_best_margin : float
        The same in the units in which b is largest.
    gap_best_units : float
        The smallest ratio over these units and larger ones; still a theorem.
    modal : float
        Largest first-order growth of a left-out mode over its own decay: above one the mode
        is expected to be unstable.  No theorem.
    frequency_error : float
        Largest relative error of the frequencies of the modes that were kept.
    crossover : float
        Highest crossover frequency of the design loop over the first left-out frequency.
    inverse_disk_margin : float
        1/α on the design model.
    """

    small_gain: float
    small_gain_on_a_grid: float
    gap_in_si: float
    gap_best_margin: float
    gap_best_units: float
    modal: float
    frequency_error: float
    crossover: float
    inverse_disk_margin: float


# Below one these are theorems: the loop on the truth is stable.
THEOREMS = ("small_gain", "gap_in_si", "gap_best_margin", "gap_best_units")
# These have a threshold of their own, at one.
WITH_THRESHOLD = (*THEOREMS, "small_gain_on_a_grid", "modal")


@dataclass(frozen=True)
class Score:
    """How well a predictor tells unstable loops from stable ones.

    Attributes
    ----------
    predictor : str
    auc : float
        Probability that of an unstable and a stable loop the unstable one has the larger
        value; one half is worth nothing.
    threshold : float
        At one where the predictor has a threshold of its own, else where hits over the
        unstable less false alarms over the stable are largest.
    hits, misses : int
        Unstable loops at or above the threshold, and below it.
    false_alarms, passed : int
        Stable loops at or above the threshold, and below it.
    """

    predictor: str
    auc: float
    threshold: float
    hits: int
    misses: int
    false_alarms: int
    passed: int


def predictors(loop: Loop, design: Model) -> Predictors:
    """Return what can be known of a design before its loop on the truth is closed.

    Parameters
    ----------
    loop : Loop
        The controller closed around the truth; its own poles are not looked at.
    design : Model
        The model that the controller was designed on, with fewer modes.

    Raises
    ------
    InputError, UnstableLoopError, AccuracyError
        As `slewctl.loop.small_gain` and `slewctl.loop.nu_gap`.
    """
    left_out = LeftOut.of(loop, design)
    seen = left_out.seen(left_out.difference)
    kept = min(design.n, loop.model.n)
    margins = close(design, loop.objective, loop.controller).margins
    crossings = margins.gain_crossings_hz
    first = loop.model.frequencies_hz[min(design.n, loop.model.n - 1)]
    ratios = _gap_ratios(loop, design)
    return Predictors(
        small_gain=seen.peak().value,
        small_gain_on_a_grid=_on_a_grid(seen.system, loop),
        gap_in_si=ratios[0],
        gap_best_margin=ratios[1],
        gap_best_units=min(ratios),
        modal=_first_order(left_out, design.n),
        frequency_error=float(np.abs(design.omega[:kept] / loop.model.omega[:kept] - 1).max()),
        crossover=float(max(crossings, default=0.0) / first),
        inverse_disk_margin=1 / margins.disk.value,
    )


def _gap_ratios(loop: Loop, design: Model) -> list[float]:
    """Return ν/b in SI units, then in the units of the largest b and in larger ones."""
    P = generalised_plant(design, loop.objective).control_path
    truth, C = loop.plant.control_path, loop.controller
    best = best_output_scale(P, C)
    found = []
    for units in (np.ones(len(best)), *(factor * best for factor in _UNITS)):
        margin = ncf_margin(P, C, output_scale=units.tolist())
        gap = nu_gap(P, truth, output_scale=units.tolist())
        found.append(gap.value / margin.value)
    return found


def _on_a_grid(system: control.StateSpace, loop: Loop) -> float:
    omega = np.geomspace(loop.model.omega[0] / 100, loop.model.omega[-1] * 10, _GRID)
    return float(np.abs(FrequencyResponse(system)(omega)).max())


def _first_order(left_out: LeftOut, kept: int) -> float:
    """Return the largest growth that feedback gives a left-out mode, over its decay.

    A pole λ of a mode with residue c bᵀ moves by bᵀ·KS(λ)·c, to first order in the residue.
    """
    K, growth = left_out.control, 0.0
    for mode in left_out.truth[kept:]:
        values, right = np.linalg.eig(mode.A)
        entry, shape = np.linalg.solve(right, mode.B), mode.C @ right
        for k in np.flatnonzero(values.imag >= 0):
            around = K.C @ np.linalg.solve(values[k] * np.eye(K.states) - K.A, K.B) + K.D
            shift = (entry[k] @ around @ shape[:, k]).real
            growth = max(growth, float(shift / abs(values[k].real)))
    return growth


def score(found: Sequence[Predictors], unstable: Sequence[bool]) -> tuple[Score, ...]:
    """Return how well each predictor did over many designs, the best first.

    Parameters
    ----------
    found : sequence of Predictors
    unstable : sequence of bool
        Whether the loop on the truth of each is unstable.

    Raises
    ------
    InputError
        If they differ in number, or not both kinds of loop occur.
    """
    bad = np.array(unstable, dtype=bool)
    if len(found) != len(bad) or bad.all() or not bad.any():
        raise InputError(
            f"{len(found)} designs with {int(bad.sum())} of {len(bad)} unstable",
            where="score",
            remedy="give as many verdicts as designs, some stable and some unstable",
        )
    scores = []
    for item in fields(Predictors):
        values = np.array([getattr(one, item.name) for one in found], dtype=float)
        threshold = 1.0 if item.name in WITH_THRESHOLD else _best_threshold(values, bad)
        alarm = values >= threshold
        scores.append(
            Score(
                item.name,
                area_under_curve(values, bad),
                threshold,
                int(np.sum(alarm & bad)),
                int(np.sum(~alarm & bad)),
                int(np.sum(alarm & ~bad)),
                int(np.sum(~alarm & ~bad)),
            )
        )
    return tuple(sorted(scores, key=lambda one: -one.auc))


def _best_threshold(values: Array, bad: BoolArray) -> float:
    """Return the threshold with the largest hit rate less rate of false alarms."""
    candidates = np.unique(values)
    gain = [np.mean(values[bad] >= t) - np.mean(values[~bad] >= t) for t in candidates]
    return float(candidates[int(np.argmax(gain))])
