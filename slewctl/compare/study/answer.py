"""What a study says: which basis wins where, counted over pairs of designs alike but for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from statistics import median
from typing import Any

import numpy as np

from slewctl.basis import NAMES
from slewctl.compare.design_basis import REDUCTIONS
from slewctl.compare.study.area_under_curve import area_under_curve
from slewctl.compare.study.words import hubs, joined

# Costs that differ by less than a percent are a draw.
DRAW = 0.01
# A design is good when it loses no more than this of the optimal cost.
GOOD = 0.05
# The methods that minimise the cost by which they are judged; of others, less is expected.
OPTIMAL = ("lqg", "h2-lmi")
# Bases that are good as often as the best, to this share, are named beside it.
_AS_OFTEN = 0.02
# What a user of the controller feels, told as medians.
MEDIANS = (
    "phase_margin_deg", "disk_margin", "settling_time", "residual_vibration", "torque_peak",
)  # fmt: skip
# The paper's comparison, and the axes along which it is counted beside the hub's inertia.
PAPERS = ("clamped-free", "slewing")
HUB = "hub_ratio"
OTHER_AXES = ("payload_ratio", "damping_ratio", "bandwidth", "sensors", "method", "n")
# An axis that not every study has.
VARIATION = "variation"

Row = Mapping[str, Any]


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


def answer(rows: Sequence[Row]) -> Answer:
    """Return the answer that the rows of a study give (see `slewctl.compare.run_study`)."""
    rows = [row for row in rows if row["outcome"] != "no design"]
    tried = {row["basis"] for row in rows}
    bases = [basis for basis in NAMES if basis in tried]
    reductions = [name for name in REDUCTIONS if name in tried]
    pairs = list(combinations(bases, 2))
    duels = tuple(d for a, b in pairs for d in along(rows, a, b, HUB))
    optimal = [row for row in rows if row["method"] in OPTIMAL]
    judged = {row["basis"] for row in optimal}
    shares = tuple(share(optimal, basis) for basis in bases if basis in judged)
    papers = PAPERS if pairs_of(rows, *PAPERS) else None
    axes = (*OTHER_AXES, VARIATION) if rows and VARIATION in rows[0] else OTHER_AXES
    elsewhere = [along(rows, *PAPERS, axis) for axis in axes]
    return Answer(
        sentences=tuple(_sentences(rows, papers, shares)),
        duels=duels,
        elsewhere=tuple(d for duels in elsewhere if len(duels) > 1 for d in duels),
        reductions=tuple(d for a, b in product(bases, reductions) for d in along(rows, a, b, "n")),
        shares=shares,
        lost=tuple(_lost(rows, basis) for basis in (*bases, *reductions)),
        gap=_gap_score(rows),
        told_by_frequencies=_told_by_frequencies(rows),
    )


def percent(share: float) -> str:
    """Return a share for a sentence, in whole percent, number and sign on one line."""
    return f"{100 * share:.0f}\N{NO-BREAK SPACE}%"


def stable(row: Row) -> bool:
    """Whether a design is stable on the truth and on one with twice the modes."""
    return row["outcome"] == "stable" and bool(row["stable_on_twice"])


def good(row: Row) -> bool:
    """Whether a design is stable and loses at most 5 % of the optimal cost."""
    return stable(row) and row["h2_loss"] <= GOOD


def duel(rows: Iterable[Row], first: str, second: str) -> Duel:
    """Return how two bases compare over all pairs."""
    return _counted(pairs_of(rows, first, second), None, None, first, second)


def along(rows: Iterable[Row], first: str, second: str, axis: str) -> list[Duel]:
    """Return the duels at each value of an axis at which there are pairs."""
    groups: dict[Any, list[tuple[Row, Row]]] = {}
    for pair in pairs_of(rows, first, second):
        groups.setdefault(pair[0][axis], []).append(pair)
    return [_counted(groups[value], axis, value, first, second) for value in sorted(groups)]


def _counted(
    pairs: Iterable[tuple[Row, Row]], axis: str | None, value: Any, first: str, second: str
) -> Duel:
    results = [_compare(*pair) for pair in pairs]
    return Duel(first, second, axis, value, results.count(1), results.count(-1), results.count(0))


def pairs_of(rows: Iterable[Row], first: str, second: str) -> list[tuple[Row, Row]]:
    """Return the designs on two bases that are alike in everything else, side by side."""
    sides: dict[tuple[Any, ...], dict[str, Row]] = {}
    for row in rows:
        if row["basis"] in (first, second):
            sides.setdefault(_alike(row), {})[row["basis"]] = row
    return [(side[first], side[second]) for side in sides.values() if len(side) == 2]


def _alike(row: Row) -> tuple[Any, ...]:
    return (*(row[axis] for axis in (HUB, *OTHER_AXES)), row.get(VARIATION))


def _compare(a: Row, b: Row) -> int:
    """Return 1 where a is better, −1 where b is, 0 for a draw."""
    # Costs over the optimum.
    first, second = (1 + row["h2_loss"] if stable(row) else math.inf for row in (a, b))
    if first == second or abs(first - second) <= DRAW * min(first, second):
        return 0
    return 1 if first < second else -1


def share(rows: Iterable[Row], basis: str) -> Share:
    """Return how often the designs on a basis are stable and good, and how good the stable are."""
    own = [row for row in rows if row["basis"] == basis]
    holding = [row for row in own if stable(row)]
    return Share(
        basis=basis,
        designs=len(own),
        stable=len(holding),
        good=sum(map(good, own)),
        medians=_medians(holding),
        condition=max((r["condition"] for r in own if r["condition"] is not None), default=None),
    )


def _medians(rows: Sequence[Row]) -> dict[str, float]:
    """Return the medians of what the rows have a value of."""
    values = {key: [row[key] for row in rows if row[key] is not None] for key in MEDIANS}
    return {key: median(found) for key, found in values.items() if found}


def _lost(rows: Iterable[Row], basis: str) -> Lost:
    """Count the modes that unstable designs on a basis have lost, by their place behind n."""
    places = [
        (row["unstable_mode"], row["n"])
        for row in rows
        if row["basis"] == basis and row["unstable_mode"] is not None
    ]
    return Lost(
        basis,
        rigid=sum(mode == 0 for mode, _ in places),
        kept=sum(0 < mode <= n for mode, n in places),
        next=sum(mode == n + 1 for mode, n in places),
        higher=sum(mode > n + 1 for mode, n in places),
    )


def _gap_score(rows: Iterable[Row]) -> GapScore | None:
    known = [row for row in rows if row["nu_gap"] is not None]
    if not known:
        return None
    # The gap is to the truth itself; of one with twice the modes the theorem says nothing.
    holds = np.array([row["outcome"] == "stable" for row in known])
    gap = np.array([row["nu_gap"] for row in known])
    margin = np.array([row["generalised_margin"] for row in known])
    # A design that is unstable on its own model has no margin at all.
    ratio = gap / np.maximum(margin, np.finfo(float).tiny)
    certified = margin > gap
    mixed = holds.any() and not holds.all()
    return GapScore(
        designs=len(known),
        stable=int(holds.sum()),
        certified=int(certified.sum()),
        refuted=int((certified & ~holds).sum()),
        auc=area_under_curve(ratio, ~holds) if mixed else math.nan,
    )


def _told_by_frequencies(rows: Iterable[Row]) -> tuple[int, int]:
    decided = told = 0
    for a, b in pairs_of(rows, *PAPERS):
        winner = _compare(a, b)
        decided += winner != 0
        smaller = a["worst_frequency_error"] < b["worst_frequency_error"]
        told += winner == (1 if smaller else -1)
    return told, decided


def _sentences(
    rows: Sequence[Row], papers: tuple[str, str] | None, shares: Sequence[Share]
) -> Iterable[str]:
    if papers:
        yield _does_it_matter(duel(rows, *papers))
        yield _where(along(rows, *papers, HUB)) + _neither(rows, papers)
    if shares:
        yield _pick(shares)
    if not rows:
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


def _neither(rows: Sequence[Row], papers: tuple[str, str]) -> str:
    """Say at which hub ratios none of the two has a good design by an optimal method."""
    tried = [row for row in rows if row["method"] in OPTIMAL and row["basis"] in papers]
    ratios = sorted({row[HUB] for row in tried})
    hopeless = [r for r in ratios if not any(good(row) for row in tried if row[HUB] == r)]
    if not hopeless:
        return ""
    at = hubs(hopeless)
    return (
        f" {at[0].upper()}{at[1:]} neither has a design that loses at most {percent(GOOD)} of the "
        "optimal cost."
    )
