"""What a step on the way to the computer takes from a controller, on the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from slewctl._types import Array
from slewctl.compare.clock_loss import TOLD
from slewctl.compare.judgement import Judgement
from slewctl.compare.quantities import QUANTITIES, Reading
from slewctl.compare.reading import read
from slewctl.design import Controller
from slewctl.design.digital.fixed_point import LEAST_WORD, MOST_WORD, LoopSignals
from slewctl.design.digital.steps import check_sampled
from slewctl.errors import DesignError, SlewctlError, check_positive
from slewctl.loop.sampled import SampledLoop
from slewctl.loop.tracking import tracking_controller
from slewctl.numerics.interconnect import closed_matrix

# More samples of a slew say nothing new of how large its signals are.
_MOST_SAMPLES = 20_000
_COST = "h2_cost"


@dataclass(frozen=True)
class DigitalLoss:
    """Margins and cost on the truth of a controller, and of what was made of it.

    Attributes
    ----------
    before, after : mapping of str to Reading
        By the names of `slewctl.compare.QUANTITIES`; without values for an unstable loop.
    rounding : float
        Part of the later cost that the rounding of its signals adds at most; NaN without weights.
    blur : float
        Without weights: by how much of what they come to in the slew rounding moves readings and
        command, root mean square; NaN with weights, whose cost has it.
    """

    before: Mapping[str, Reading]
    after: Mapping[str, Reading]
    rounding: float
    blur: float = math.nan

    @property
    def margin(self) -> float:
        """Largest relative fall of a margin; one where the loop is lost."""
        return max(self._fall(name) for name in TOLD)

    @property
    def turned(self) -> float:
        """Largest relative change of a margin: a rise too makes another law of it."""
        rises = (DigitalLoss(self.after, self.before, 0.0)._fall(name) for name in TOLD)
        return max(self.margin, *rises)

    @property
    def cost(self) -> float:
        """Relative rise of the cost, rounding included; NaN without weights."""
        before, after = (readings[_COST].value for readings in (self.before, self.after))
        if math.isinf(before) and math.isinf(after):
            return 0.0
        return after / before - 1

    @property
    def stable(self) -> bool:
        """Whether the loop of the later controller is."""
        return not math.isnan(self.after[TOLD[0]].value)

    @property
    def worst(self) -> float:
        """The larger of both losses; infinite where the loop is lost.

        Where no cost says what a law is worth, no margin may change, and no signal blur.
        """
        if not self.stable:
            return math.inf
        if math.isnan(self.cost):
            return max(self.turned, 0.0 if math.isnan(self.blur) else self.blur)
        return max(self.margin, self.cost)

    def _fall(self, name: str) -> float:
        before, after = self.before[name].value, self.after[name].value
        if math.isnan(after):
            return 1.0
        # What is no part of an infinite margin the others tell.
        finite = before and math.isfinite(before) and math.isfinite(after)
        return max(1 - after / before, 0.0) if finite else 0.0

    def __str__(self) -> str:
        if not self.stable:
            return f"the loop is lost: {self.after[TOLD[0]].note}"
        parts = []
        for name in TOLD:
            words = name.removesuffix("_db").removesuffix("_deg").replace("_", " ")
            now, then = self.after[name].value, self.before[name].value
            parts.append(f"{words} {now:.3g} instead of {then:.3g} {QUANTITIES[name].unit}".strip())
        told = f"; cost {self.cost:+.2g} relative" if math.isfinite(self.cost) else ""
        if self.blur > 0:
            told += f"; rounding moves signals by {self.blur:.2g} of what they come to in the slew"
        return f"{', '.join(parts)}{told}"


def digital_loss(before: Judgement, after: Judgement) -> DigitalLoss:
    """Return what one controller has less of than another, on the same truth.

    Parameters
    ----------
    before, after : Judgement
        Of the controller, and of what was made of it.

    Returns
    -------
    DigitalLoss

    Raises
    ------
    UnstableLoopError
        If the loop is not stable to begin with.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.compare import digital_loss
    >>> digital_loss(problem.judge(K), problem.judge(K.in_float32())).worst < 1e-4
    True
    """
    before.loop.require_stable("anything to lose")
    names = (*TOLD, _COST)
    return DigitalLoss(
        {name: read(before, name) for name in names},
        {name: read(after, name) for name in names},
        _rounding(after),
        _blur(before, after),
    )


def _rounding(judgement: Judgement) -> float:
    """Return what rounded signals add to the H2 cost."""
    loop = judgement.loop
    if not loop.objective.weighted or not judgement.stable:
        return math.nan
    if not isinstance(loop, SampledLoop) or loop.rounding is None:
        return 0.0
    return loop.closed.cost_of_rounding(*loop.rounding)


def _blur(before: Judgement, after: Judgement) -> float:
    """Return by how much of their size rounding moves the signals of a loop without weights."""
    loop = after.loop
    if loop.objective.weighted or not after.stable:
        return math.nan
    if not isinstance(loop, SampledLoop) or loop.rounding is None:
        return 0.0
    seen = _kept_signals(before if before.controller.sample_time else after)
    peaks = {
        name: float(np.abs(column).max())
        for name, column in zip(loop.objective.sensors, seen.readings.T, strict=True)
    }
    peaks[loop.objective.actuator] = float(np.abs(seen.command).max())
    limits = {name: peak for name, peak in peaks.items() if peak > 0}
    if len(limits) < 2 or loop.objective.actuator not in limits:
        return 0.0  # nothing moves in this slew
    sizes = replace(loop.objective, limits=limits, weighted=True)
    sized = replace(loop, objective=sizes, source=None)
    return math.sqrt(sized.closed.cost_of_rounding(*loop.rounding))


def loop_signals(judgement: Judgement) -> LoopSignals:
    """Return what a sampled controller's signals come to in its slew, and under the noise.

    Parameters
    ----------
    judgement : Judgement
        Of a stable loop.

    Returns
    -------
    LoopSignals

    Raises
    ------
    InputError
        For a continuous controller.
    UnstableLoopError
        If the loop is unstable.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.compare import loop_signals
    >>> loop_signals(problem.judge(K)).readings.shape
    (301, 1)
    """
    loop = judgement.loop
    check_sampled(loop.controller, "controller")
    if not isinstance(loop, SampledLoop):
        raise TypeError("a sampled controller makes a sampled loop")
    loop.require_stable("signals of a size")
    T, slew, path = loop.sample_time, judgement.slew, loop.sampled.path
    steps = min(math.ceil(slew.end / T) + 1, _MOST_SAMPLES)
    turned = slew.reference(np.arange(steps, dtype=float) * float(T))[0]
    told = tracking_controller(loop.controller, loop.model)
    law = (told.A, told.B[:, :-1], told.C, told.D[:, :-1])
    A = closed_matrix(path.A, path.B, path.C, law)
    B = np.concatenate([(path.B @ told.D[:, -1:]).ravel(), told.B[:, -1]])
    seen = np.zeros((steps, len(A)))
    for k in range(steps - 1):
        seen[k + 1] = A @ seen[k] + B * turned[k]
    n = path.nstates
    readings, states = seen[:, :n] @ path.C.T, seen[:, n:]
    command = readings @ told.D[0, :-1] + states @ told.C[0] + told.D[0, -1] * turned
    limit = loop.model.arm.command_limit(loop.objective.actuator)
    return LoopSignals(
        readings, states, command, float(np.abs(turned).max()), *_covariances(loop, n), limit
    )


# Of the same controller while its words are tried.
_kept_signals = lru_cache(maxsize=2)(loop_signals)


def _covariances(loop: SampledLoop, n: int) -> tuple[Array, Array, float]:
    """Return those of readings and states, and the command's variance, under the noise."""
    path, controller = loop.sampled.path, loop.controller.linear
    if not loop.objective.weighted:
        m = path.noutputs
        return np.zeros((m, m)), np.zeros((controller.nstates,) * 2), 0.0
    P, noise = loop.closed.covariance, loop.sampled.sensor_noise
    row = np.hstack([controller.D @ path.C, controller.C])
    commanded = row @ P @ row.T + controller.D @ noise @ controller.D.T
    return path.C @ P[:n, :n] @ path.C.T + noise, P[n:, n:], float(commanded[0, 0])


def least_word(judgement: Judgement, loss: float = 0.01) -> tuple[Controller, DigitalLoss]:
    """Return a controller in the shortest words that lose no more than a part of it.

    Parameters
    ----------
    judgement : Judgement
        Of a sampled controller whose loop is stable.
    loss : float
        Largest relative fall of gain, phase, modulus and disk margin, and rise of the cost;
        without weights largest change of these margins, and share of readings and command in
        the slew that rounding moves them by.

    Returns
    -------
    tuple of Controller and DigitalLoss
        Its `arithmetic` tells the words; and what it loses.

    Raises
    ------
    DesignError
        If words of 32 bits lose more.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.compare import least_word
    >>> words, lost = least_word(problem.judge(K))
    >>> str(words.arithmetic), lost.worst < 0.01
    ('words of 13 bits', True)
    """
    check_positive(loss, "loss")
    signals = _kept_signals(judgement)
    best = math.inf
    for word in range(LEAST_WORD, MOST_WORD + 1):
        try:
            made = judgement.controller.in_fixed_point(word, None, signals)
            found = digital_loss(judgement, judgement.yardstick.judge(made, judgement.slew))
        except SlewctlError:
            continue  # too short to hold it
        if found.worst <= loss:
            return made, found
        best = min(best, found.worst)
    raise DesignError(
        f"words of up to {MOST_WORD} bits lose {best:.2g} of it, {loss:g} is allowed",
        where="loss",
        remedy="sample more slowly, or run it in double precision",
    )
