"""Each design judged by the package and by finite elements, side by side."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from finite_elements import Elements, elements
from own_figures import brute_margins, h2_cost
from own_loop import Law, OwnLoop, plant
from random_designs import Design

# Gains next to the one that puts a pole on the axis.
NEAR = (1e-3, 1e-5, 1e-7)
# Of margins and costs, relative; both models are converged to about 1e-10.
AGREE = 1e-6


@dataclass
class Tally:
    """What was found over many designs.

    Attributes
    ----------
    counts : Counter
    wrong : list of str
        Verdicts that differ on the same number of modes.
    unlike_the_arm : list of str
        Verdicts, the same on both truths, that the whole finite-element model contradicts.
    gaps : dict of str to list of float
        Relative differences of margins and costs, of the margins that are told as confirmed.
    wrong_figures : list of str
        Those larger than `AGREE`.
    """

    counts: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    unlike_the_arm: list[str] = field(default_factory=list)
    gaps: dict[str, list[float]] = field(default_factory=dict)
    wrong_figures: list[str] = field(default_factory=list)

    def judge(self, designs: Iterable[Design], figures: int = 0) -> Tally:
        """Judge designs; of the first `figures` stable ones margins and cost as well."""
        for design in designs:
            stable = self._verdicts(design)
            if stable and self.counts["with figures"] < figures:
                self._figures(design)
        return self

    def _verdicts(self, design: Design) -> bool:
        """Compare the verdicts on one design; return whether it is stable on both truths."""
        self.counts["designs"] += 1
        self.counts[f"of them {design.kind}"] += 1
        found, law = elements(design.arm, 2 * design.modes), design.law
        passed = True
        for modes in (design.modes, 2 * design.modes):
            loop = OwnLoop(plant(found, modes, law), law)
            passed &= self._compare(design, loop, modes, "")
        for gain in _gains_at_the_limit(OwnLoop(plant(found, design.modes, law), law)):
            turned = design.scaled(gain)
            loop = OwnLoop(plant(found, design.modes, turned.law), turned.law)
            self._compare(turned, loop, design.modes, "next to the axis, ")
        whole = OwnLoop(plant(found, None, law), law)
        if not passed and whole.verdict == "stable":
            self.counts["unstable on a truth, stable with all elements"] += 1
        self.counts["passed on both truths"] += passed
        if passed and whole.verdict != "stable":
            self.counts["passed on both truths, not with all elements"] += 1
            lost = _lost(found, law, 2 * design.modes)
            self.unlike_the_arm.append(
                f"{whole.verdict} ({whole.beyond():.1e}), first with {lost} modes: {design}"
            )
        return passed

    def _compare(self, design: Design, loop: OwnLoop, modes: int, which: str) -> bool:
        """Compare the package's verdict on a truth with the elements' own."""
        stable, verdict = design.stable(modes), loop.verdict
        self.counts[f"{which}{verdict}"] += 1
        if verdict == "on the axis":
            self.counts[f"{which}on the axis, {'passed' if stable else 'refused'}"] += 1
        elif stable != (verdict == "stable"):
            kind = "unstable, passed" if stable else "stable, refused"
            self.counts[f"{which}{kind}"] += 1
            self.wrong.append(f"{which}{kind} on {modes} modes ({loop.beyond():.1e}): {design}")
        return stable

    def _figures(self, design: Design) -> None:
        """Compare margins and cost of a stable loop."""
        self.counts["with figures"] += 1
        found, law, modes = elements(design.arm, design.modes), design.law, design.modes
        own = OwnLoop(plant(found, modes, law), law)
        brute, loop = brute_margins(own), design.loop(modes)
        told, pairs = loop.margins, {}
        self.counts["margins not confirmed"] += not told.confirmed
        if told.confirmed:
            # Beyond a factor of 1e9 the grid's own search ends.
            for name, db, known in (
                ("gain up", told.gain_db.value, brute.up),
                ("gain down", told.gain_reduction_db.value, brute.down),
            ):
                pairs[name] = (10 ** (db / 20) if db < 180 else math.inf), known
            pairs["phase"] = told.phase_deg.value, brute.phase_deg
        if law.sample_time or not law.D.any():  # else the cost is infinite
            cost = h2_cost(own, found, modes, design.objective.limits, design.objective.noise)
            pairs["H2 cost"] = (loop.h2.value, cost)
        for name, (claimed, right) in pairs.items():
            gap = 0.0 if claimed == right else abs(claimed / right - 1)
            self.gaps.setdefault(name, []).append(gap)
            if not gap <= AGREE:
                self.wrong_figures.append(f"{name} {claimed:.9g}, not {right:.9g}: {design}")


def _lost(found: Elements, law: Law, modes: int) -> int:
    """Return with how many modes a loop that is stable with `modes` is so no more."""
    count = modes
    while OwnLoop(plant(found, count, law), law).verdict == "stable":
        count += 1
    return count


def _gains_at_the_limit(loop: OwnLoop) -> list[float]:
    """Return gains on both sides of one that makes a stable loop unstable; none if none does."""
    if loop.verdict != "stable":
        return []
    low, high = 1.0, 2.0
    while loop.beyond(high) <= 0:
        low, high = high, 2 * high
        if high > 1e6:
            return []
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if loop.beyond(middle) <= 0 else (low, middle)
    return [low * (1 + sign * step) for step in NEAR for sign in (-1, 1)]
