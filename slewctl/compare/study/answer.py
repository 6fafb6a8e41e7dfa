"""What a study says: which basis wins where, counted over pairs of designs alike but for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np

from slewctl._types import Array, BoolArray, IntArray
from slewctl.basis import NAMES
from slewctl.compare.design_basis import REDUCTIONS
from slewctl.compare.study.area_under_curve import area_under_curve
from slewctl.compare.study.designs import GOOD, HUB, OTHER_AXES, VARIATION, Designs
from slewctl.compare.study.words import hubs, joined

# Bases that are good as often as the best, to this share, are named beside it.
_AS_OFTEN = 0.02
# What a user of the controller feels, told as medians.
MEDIANS = (
    "phase_margin_deg", "disk_margin", "settling_time", "residual_vibration", "torque_peak",
)  # fmt: skip
# The paper's comparison.
PAPERS = ("clamped-free", "slewing")


@dataclass(frozen=True)
class Duel:
    """Two bases, or a basis and a reduction, over all pairs of designs alike but for it.

    Attributes
    ----------
    first, second : str
    axis : str or None
        What all pairs have in common, such as ``hub_ratio``; None when all are counted.
    value : float, int, str or None
        Its value.
    first_wins, second_wins, draws : int
        A stable design beats an unstable one, a smaller cost one that is more than a percent
        larger; two unstable designs are a draw.
    """

    first: str
    second: str
    axis: str | None
    value: Any
    first_wins: int
    second_wins: int
    draws: int

    @property
    def pairs(self) -> int:
        """Number of pairs compared."""
        return self.first_wins + self.second_wins + self.draws


@dataclass(frozen=True)
class Share:
    """How often the designs on a basis are good.

    Attributes
    ----------
    basis : str
    designs, stable, good : int
        Good: stable on both truths with at most 5 % lost.
    medians : mapping of str to float
        Of `MEDIANS` over the stable designs; empty if there are none.
    condition : float or None
        Largest condition number of M_e; None for a reduction.
    """

    basis: str
    designs: int
    stable: int
    good: int
    medians: Mapping[str, float]
    condition: float | None

    @property
    def rate(self) -> float:
        """Share of the designs that are good."""
        return self.good / self.designs


@dataclass(frozen=True)
class Lost:
    """Which mode the unstable designs on one basis have lost.

    Attributes
    ----------
    basis : str
    rigid, kept, next, higher : int
        The rotation, a mode that the design knew, the first that it did not, and one above.
    """

    basis: str
    rigid: int
    kept: int
    next: int
    higher: int


@dataclass(frozen=True)
class GapScore:
    """What the ν-gap between design model and truth told of the loop on the truth.

    Attributes
    ----------
    designs, stable : int
        Stable: on the truth, to which the gap is measured.
    certified : int
        Designs whose margin b(P, C) is larger than the gap: stable for certain.
    refuted : int
        Those of them that are unstable; a theorem says none.
    auc : float
        Probability that of an unstable and a stable design the unstable one has the larger
        gap over margin; NaN where one kind does not occur.
    """

    designs: int
    stable: int
    certified: int
    refuted: int
    auc: float


@dataclass(frozen=True)
class Answer:
    """The answer of a study.

    Attributes
    ----------
    sentences : tuple of str
        Up to three, by what was tried.
    duels : tuple of Duel
        Every pair of bases, at each hub ratio.
    elsewhere : tuple of Duel
        The paper's two bases at each value of the other axes.
    reductions : tuple of Duel
        Every basis against every reduction of the truth, at each order.
    shares : tuple of Share
        Of the methods that minimise the cost; empty if there are none.
    lost : tuple of Lost
    gap : GapScore or None
        None if no gap is known.
    told_by_frequencies : tuple of int
        Of the pairs of the paper's bases that one of them wins: in how many it is the one
        with the smaller worst frequency error, and how many there are.
    """

    sentences: tuple[str, ...]
    duels: tuple[Duel, ...]
    elsewhere: tuple[Duel, ...]
    reductions: tuple[Duel, ...]
    shares: tuple[Share, ...]
    lost: tuple[Lost, ...]
    gap: GapScore | None
    told_by_frequencies: tuple[int, int]


def answer(designs: Designs) -> Answer:
    """Return the answer that the designs of a study give (see `slewctl.compare.run_study`)."""
    codes, known = designs.codes("basis")
    tried = {known[k] for k in np.unique(codes[designs.made])}
    bases = [basis for basis in NAMES if basis in tried]
    reductions = [name for name in REDUCTIONS if name in tried]
    duels = tuple(d for a, b in combinations(bases, 2) for d in along(designs, a, b, HUB))
    judged = {known[k] for k in np.unique(codes[designs.optimal])}
    shares = tuple(share(designs, designs.optimal, b) for b in bases if b in judged)
    axes = (*OTHER_AXES, VARIATION) if designs.has_variations else OTHER_AXES
    elsewhere = [along(designs, *PAPERS, axis) for axis in axes]
    return Answer(
        sentences=tuple(_sentences(designs, shares)),
        duels=duels,
        elsewhere=tuple(d for duels in elsewhere if len(duels) > 1 for d in duels),
        reductions=tuple(
            d for a, b in product(bases, reductions) for d in along(designs, a, b, "n")
        ),
        shares=shares,
        lost=tuple(_lost(designs, basis) for basis in (*bases, *reductions)),
        gap=_gap_score(designs),
        told_by_frequencies=_told_by_frequencies(designs),
    )


def percent(share: float) -> str:
    """Return a share for a sentence, in whole percent, number and sign on one line."""
    return f"{100 * share:.0f}\N{NO-BREAK SPACE}%"


def duel(designs: Designs, first: str, second: str) -> Duel:
    """Return how two bases compare over all pairs."""
    return _counted(designs.winners(*designs.pairs(first, second)), None, None, first, second)


def along(designs: Designs, first: str, second: str, axis: str) -> list[Duel]:
    """Return the duels at each value of an axis at which there are pairs."""
    pairs = designs.pairs(first, second)
    won = designs.winners(*pairs)
    codes, values = designs.codes(axis)
    here = codes[pairs[0]]
    there = sorted(values[k] for k in np.unique(here))
    return [
        _counted(won[here == values.index(value)], axis, value, first, second) for value in there
    ]


def _counted(won: IntArray, axis: str | None, value: Any, first: str, second: str) -> Duel:
    first_wins, second_wins = int((won == 1).sum()), int((won == -1).sum())
    return Duel(first, second, axis, value, first_wins, second_wins, int((won == 0).sum()))


def share(designs: Designs, among: BoolArray, basis: str) -> Share:
    """Return how often the designs on a basis are stable and good, and how good the stable are.

    Parameters
    ----------
    designs : Designs
    among : ndarray of bool
        Which of them are counted.
    basis : str
    """
    own = among & designs.equal("basis", basis)
    holding = own & designs.stable
    medians = {key: _known(designs, key, holding) for key in MEDIANS}
    condition = _known(designs, "condition", own)
    return Share(
        basis=basis,
        designs=int(own.sum()),
        stable=int(holding.sum()),
        good=int((own & designs.good).sum()),
        medians={key: float(np.median(found)) for key, found in medians.items() if len(found)},
        condition=float(condition.max()) if len(condition) else None,
    )


def _known(designs: Designs, name: str, among: BoolArray) -> Array:
    """Return what is known of a column among some designs."""
    numbers = designs.numbers(name)[among]
    return numbers[~np.isnan(numbers)]


def _lost(designs: Designs, basis: str) -> Lost:
    """Count the modes that unstable designs on a basis have lost, by their place behind n."""
    mode, n = designs.numbers("unstable_mode"), designs.numbers("n")
    own = designs.made & designs.equal("basis", basis) & ~np.isnan(mode)
    mode, n = mode[own], n[own]
    return Lost(
        basis,
        rigid=int((mode == 0).sum()),
        kept=int(((mode > 0) & (mode <= n)).sum()),
        next=int((mode == n + 1).sum()),
        higher=int((mode > n + 1).sum()),
    )


def _gap_score(designs: Designs) -> GapScore | None:
    gap = designs.numbers("nu_gap")
    known = designs.made & ~np.isnan(gap)
    if not known.any():
        return None
    # The gap is to the truth itself; of one with twice the modes the theorem says nothing.
    holds = designs.equal("outcome", "stable")[known]
    gap, margin = gap[known], designs.numbers("generalised_margin")[known]
    # A design that is unstable on its own model has no margin at all.
    ratio = gap / np.maximum(margin, np.finfo(float).tiny)
    certified = margin > gap
    mixed = holds.any() and not holds.all()
    return GapScore(
        designs=int(known.sum()),
        stable=int(holds.sum()),
        certified=int(certified.sum()),
        refuted=int((certified & ~holds).sum()),
        auc=area_under_curve(ratio, ~holds) if mixed else math.nan,
    )


def _told_by_frequencies(designs: Designs) -> tuple[int, int]:
    a, b = designs.pairs(*PAPERS)
    won, error = designs.winners(a, b), designs.numbers("worst_frequency_error")
    told = np.where(error[a] < error[b], 1, -1)
    return int((won == told).sum()), int((won != 0).sum())


def _sentences(designs: Designs, shares: Sequence[Share]) -> Iterable[str]:
    total = duel(designs, *PAPERS)
    if total.pairs:
        yield _does_it_matter(total)
        yield _where(along(designs, *PAPERS, HUB)) + _neither(designs)
    if shares:
        yield _pick(shares)
    if not designs.made.any():
        yield "No design could be made; the rows say why."


def _pick(shares: Sequence[Share]) -> str:
    """Say which basis to take, and which are good as often."""
    best = max(shares, key=lambda share: share.rate)
    what = f"stable and lose at most {percent(GOOD)} of the optimal cost"
    if not best.good:
        return f"Of {sum(s.designs for s in shares)} LQG and H2 designs none are {what}."
    equals = [s for s in shares if s is not best and best.rate - s.rate <= _AS_OFTEN]
    worse = [s for s in shares if s is not best and s not in equals]
    first = (
        f"{best.basis} ({percent(best.rate)} of its {best.designs} LQG and H2 designs are {what})"
    )
    taken = joined([first, *(f"{s.basis} ({percent(s.rate)})" for s in equals)], "or")
    worse.sort(key=lambda share: -share.rate)
    beside = joined([f"with {s.basis} {percent(s.rate)}" for s in worse])
    return f"For an arm of your own take {taken}{'; ' if beside else ''}{beside}."


def _does_it_matter(total: Duel) -> str:
    differ = total.first_wins + total.second_wins
    return (
        f"A pair is two designs that differ in nothing but the basis, {total.first} or "
        f"{total.second}. In {differ} of {total.pairs} pairs "
        f"({percent(differ / max(total.pairs, 1))}) the basis matters: one loop is unstable or "
        f"costs over a percent more. The {total.first} basis is better in "
        f"{total.first_wins} of them, the {total.second} basis in {total.second_wins}."
    )


def _where(duels: Sequence[Duel]) -> str:
    """Say at which hub ratios which of the two wins more pairs."""
    first, second = duels[0].first, duels[0].second
    leads = {
        second: [d for d in duels if d.second_wins > d.first_wins],
        first: [d for d in duels if d.first_wins > d.second_wins],
    }
    parts = []
    for basis, won in leads.items():
        if won:
            wins = sum(d.first_wins for d in won), sum(d.second_wins for d in won)
            mine, theirs = wins if basis == first else wins[::-1]
            at = hubs([d.value for d in won])
            parts.append(f"{at} the {basis} basis wins more pairs, {mine} to {theirs}")
    text = "; ".join(parts) or "with no hub does either win more pairs"
    return text[0].upper() + text[1:] + "."


def _neither(designs: Designs) -> str:
    """Say at which hub ratios none of the two has a good design by an optimal method."""
    tried = designs.optimal & designs.equal("basis", *PAPERS)
    codes, ratios = designs.codes(HUB)
    good = set(codes[tried & designs.good].tolist())
    hopeless = sorted(ratios[k] for k in np.unique(codes[tried]) if k not in good)
    if not hopeless:
        return ""
    at = hubs(hopeless)
    return (
        f" {at[0].upper()}{at[1:]} neither has a design that loses at most {percent(GOOD)} of the "
        "optimal cost."
    )
