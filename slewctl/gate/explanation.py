"""What limits a design, and what to change first, in a few sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from slewctl.check import Finding
from slewctl.check.words import sentence, title, value_text
from slewctl.compare import Judgement, evaluate, on_other_arm, sampling_loss
from slewctl.compare.reading import read
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.files import DesignFile
from slewctl.gate.changes import Change, slower, small_changes
from slewctl.gate.run import verdicts
from slewctl.loop import Margins
from slewctl.loop.robust.destabilised_mode import destabilised_mode

# What is held to where a design file requires stability alone.
_ALONE = {"disk_margin": 0.4}
# How often what fails is made slower.
_MOST_SLOWED = 8
# Less room gained is no help: a person would not see it.
_SEEN = 0.02


@dataclass(frozen=True)
class Trial:
    """A small change of the design, and what becomes of its tightest requirement.

    Attributes
    ----------
    change : Change
    tightest : Finding or None
        None where the changed design is refused.
    refusal : str
        Why it is.
    """

    change: Change
    tightest: Finding | None
    refusal: str = ""

    @property
    def room(self) -> float:
        """How far the tightest requirement is kept, relative to its limit; see `Verdict.slack`."""
        return -math.inf if self.tightest is None else _room(self.tightest)


@dataclass(frozen=True)
class Explanation:
    """What limits a design, and what to change first.

    Attributes
    ----------
    name : str
    sentences : tuple of str
    tightest : Finding
        The requirement with the least room.
    trials : tuple of Trial
        The changes tried, the one that helps most first.
    """

    name: str
    sentences: tuple[str, ...]
    tightest: Finding
    trials: tuple[Trial, ...]

    def __str__(self) -> str:
        return "\n".join(self.sentences)


def explain(design: DesignFile, progress: Callable[[str], None] | None = None) -> Explanation:
    """Return what limits a design, and which of a few changes helps most.

    Each change is made and judged as the gate judges the design: on its own arm, on the
    variations and on the measured response, but not on a box.  What counts is the requirement
    with the least room.

    Parameters
    ----------
    design : DesignFile
    progress : callable, optional
        Called with what is judged next.

    Returns
    -------
    Explanation

    Raises
    ------
    SlewctlError
        If the design cannot be judged.

    Examples
    --------
    >>> from slewctl.files import example_design, read_design
    >>> from slewctl.gate import explain
    >>> found = explain(read_design(example_design()))
    >>> print(found.sentences[0])
    arm: lqg on clamped-free, n = 1, keeps both of its requirements.
    """
    if not set(design.requirements) - {"stable"}:
        design = replace(design, requirements={**design.requirements, **_ALONE})
    if progress:
        progress("as it is")
    judged, findings = _judged(design)
    tightest = min(findings, key=_room)
    trials = []
    for change in small_changes(design.case):
        if progress:
            progress(change.words)
        trials.append(_tried(design, change))
    if all(room < 0 for room in (_room(tightest), *(trial.room for trial in trials))):
        trials += _slowed(design, progress)
    trials.sort(key=lambda trial: -trial.room)
    sentences = (
        *_verdict(design, findings, tightest),
        *_limits(design, *_where(design, judged, tightest)),
        *_advice(tightest, trials),
    )
    return Explanation(design.case.name, sentences, tightest, tuple(trials))


def _judged(design: DesignFile) -> tuple[Judgement, tuple[Finding, ...]]:
    with design.source.computing():
        judged = evaluate(design.case).judgement
        return judged, verdicts(design, judged)


def _where(design: DesignFile, judged: Judgement, tightest: Finding) -> tuple[str, Judgement]:
    """Return the arm on which least room is left, in words, and what is achieved there.

    A measured response tells too little of a loop: its own arm stands for it.
    """
    for other in design.variations:
        if other.name == tightest.arm:
            there = on_other_arm(design.case, other.arm, judged.controller, judged.slew)
            return other.name, there
    return "its own arm", judged


def _slowed(design: DesignFile, progress: Callable[[str], None] | None) -> list[Trial]:
    """Return the design made so slow that it fails nothing, or the best on the way there."""
    case, found = design.case, []
    for _ in range(_MOST_SLOWED):
        change = slower(case)
        if change is None:
            break
        if progress:
            progress(change.words)
        found.append(_tried(design, change))
        if found[-1].room >= 0:
            break
        case = change.case
    return sorted(found, key=lambda trial: -trial.room)[:1]


def _tried(design: DesignFile, change: Change) -> Trial:
    try:
        _, findings = _judged(replace(design, case=change.case))
    except SlewctlError as error:
        return Trial(change, None, error.what)
    return Trial(change, min(findings, key=_room))


def _room(finding: Finding) -> float:
    """Return the slack of a requirement; being stable has none, and being unstable all of it."""
    verdict = finding.verdict
    if verdict.requirement == "stable":
        return math.inf if verdict.passed else -math.inf
    return verdict.slack if verdict.passed else min(verdict.slack, 0.0)


def _verdict(design: DesignFile, findings: Sequence[Finding], tightest: Finding) -> Iterator[str]:
    count, failed = len(findings), sum(not found.verdict.passed for found in findings)
    kept = {1: "its one requirement", 2: "both of its requirements"}.get(
        count, f"all {count} of its requirements"
    )
    verdict = f"keeps {kept}" if not failed else f"fails {failed} of its {count} requirements"
    case = design.case
    law = "a given law" if case.is_given else f"{case.method} on {case.origin}"
    yield f"{case.name}: {law}, {verdict}."
    yield f"The one with the least room is {sentence(tightest)}."


def _limits(design: DesignFile, where: str, judged: Judgement) -> Iterator[str]:
    if not judged.stable:
        yield _unstable(judged, where, design)
        return
    try:
        margins = judged.margins
    except AccuracyError as error:
        yield f"On {where} {error.what}: {error.remedy}."
        return
    near = margins.modulus
    at = "at infinite frequency" if near.frequency_hz is None else f"at {near.frequency_hz:.4g} Hz"
    who = f", {near.mode}," if near.mode else ""
    yield (
        f"On {where} the Nyquist curve comes nearest to -1 {at}{who} where the sensitivity peaks "
        f"at {1 / near.value:.3g}."
    )
    yield from _delay(judged, margins)
    loss = sampling_loss(judged)
    if loss is not None:
        yield f"The clock leaves {loss}."
    if design.case.objective.weighted:
        yield _cost(judged)
    if "slew" in design.source.content and judged.moved and judged.saturation:
        yield f"Not all of it can be done: {judged.saturation}."


def _delay(judged: Judgement, margins: Margins) -> Iterator[str]:
    late, clock = margins.delay_s, judged.controller.sample_time
    if math.isfinite(late.value):
        samples = f", {late.value / clock:.2g} samples" if clock else ""
        mode = f", {late.mode}" if late.mode else ""
        at = (
            "" if late.frequency_hz is None else f", lost first at {late.frequency_hz:.4g} Hz{mode}"
        )
        yield f"It stands {1e3 * late.value:.3g} ms of delay beyond its own{samples}{at}."


def _cost(judged: Judgement) -> str:
    dearer = read(judged, "h2_loss")
    if math.isnan(dearer.value):
        return f"Of its H2 cost nothing is known: {dearer.note}."
    return (
        f"Its H2 cost is {100 * dearer.value:.3g} % above that of the best controller for that "
        "arm, these sensors and weights: no other controller gains more than that."
    )


def _unstable(judged: Judgement, where: str, design: DesignFile) -> str:
    hertz = ", ".join(f"{f:.4g}" for f in judged.unstable_hz)
    if judged.loop.undecided:
        return f"On {where} the loop is {judged.loop.fault}."
    said = f"On {where} the loop is unstable, at {hertz} Hz"
    if judged.controller.sample_time:
        return f"{said}."
    lost = destabilised_mode(judged.loop, design.case.n)
    # Of a given law nobody knows which modes its designer kept.
    return f"{said}: {lost if design.case.origin.basis or lost is None else lost.place}."


def _advice(tightest: Finding, trials: list[Trial]) -> Iterator[str]:
    """Say which change helps most, and what the others do."""
    if not trials:
        yield "There is nothing here that could be changed by a step: the law is given as it is."
        return
    now, best = _room(tightest), trials[0]
    if best.room <= now + _SEEN or best.tightest is None:
        yield (
            f"None of {len(trials)} changes gives that requirement much more room: ask for less, "
            "measure more signals, or take another method."
        )
    else:
        passing = "" if now >= 0 or best.room < 0 else ", and every requirement is kept"
        yield f"Change first: {best.change.words}.  It leaves {_left(best)}{passing}."
    rest = trials if best.room <= now + _SEEN else trials[1:]
    told = "; ".join(f"{trial.change.words} leaves {_left(trial)}" for trial in rest)
    if told:
        yield f"Of the other changes tried, {told}."


def _left(trial: Trial) -> str:
    if trial.tightest is None:
        return f"no design: {trial.refusal}"
    what, verdict = title(trial.tightest), trial.tightest.verdict
    if verdict.requirement == "stable":
        return f"{what} kept alone" if verdict.passed else "no stable loop"
    return f"{what} at {value_text(verdict)}"
