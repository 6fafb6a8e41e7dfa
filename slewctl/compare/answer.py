"""What a study says: which basis wins where, counted over pairs of designs alike but for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

# Costs that differ by less than a percent are a draw.
DRAW = 0.01
# A design is good when it loses no more than this of the optimal cost.
GOOD = 0.05
# The methods that minimise the cost by which they are judged; of others, less is expected.
OPTIMAL = ("lqg", "h2-lmi")
SIMPLEST_FIRST = ("clamped-free", "slewing", "hub-matched", "arm-matched")

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Duel:
    """Two bases over all pairs of designs that differ in nothing else.

    Attributes
    ----------
    first, second : str
    hub_ratio : float or None
        None when all hubs are counted together.
    first_wins, second_wins, draws : int
        A stable design beats an unstable one, a smaller cost one that is more than a percent
        larger.
    """

    first: str
    second: str
    hub_ratio: float | None
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
    """

    basis: str
    designs: int
    stable: int
    good: int


@dataclass(frozen=True)
class Answer:
    """The answer of a study.

    Attributes
    ----------
    sentences : tuple of str
        Three of them, with numbers.
    duels : tuple of Duel
        Every pair of bases, over all hubs and at each hub ratio.
    shares : tuple of Share
        Of the methods that minimise the cost; empty if there are none.
    """

    sentences: tuple[str, ...]
    duels: tuple[Duel, ...]
    shares: tuple[Share, ...]


def answer(rows: Sequence[Row]) -> Answer:
    """Return the answer that the rows of a study give (see `slewctl.compare.run_study`)."""
    rows = [row for row in rows if row["outcome"] != "no design"]
    bases = [b for b in SIMPLEST_FIRST if any(row["basis"] == b for row in rows)]
    ratios = sorted({row["hub_ratio"] for row in rows})
    duels = tuple(
        duel(rows, first, second, ratio)
        for first, second in combinations(bases, 2)
        for ratio in (None, *ratios)
    )
    optimal = [row for row in rows if row["method"] in OPTIMAL]
    shares = tuple(share(optimal, basis) for basis in bases) if optimal else ()
    return Answer(tuple(_sentences(duels, shares, ratios)), duels, shares)


def stable(row: Row) -> bool:
    """Whether a design is stable on the truth and on one with twice the modes."""
    return row["outcome"] == "stable" and bool(row["stable_on_twice"])


def good(row: Row) -> bool:
    """Whether a design is stable and loses at most 5 % of the optimal cost."""
    return stable(row) and row["loss"] <= GOOD


def duel(rows: Iterable[Row], first: str, second: str, hub_ratio: float | None) -> Duel:
    """Return how two bases compare, at one hub ratio or at all."""
    sides: dict[tuple[Any, ...], dict[str, Row]] = {}
    for row in rows:
        if row["basis"] in (first, second) and hub_ratio in (None, row["hub_ratio"]):
            sides.setdefault(_alike(row), {})[row["basis"]] = row
    results = [_compare(side[first], side[second]) for side in sides.values() if len(side) == 2]
    return Duel(first, second, hub_ratio, results.count(1), results.count(-1), results.count(0))


def _alike(row: Row) -> tuple[Any, ...]:
    axes = ("hub_ratio", "payload_ratio", "damping_ratio", "bandwidth", "sensors", "method", "n")
    return tuple(row[axis] for axis in axes)


def _compare(a: Row, b: Row) -> int:
    """Return 1 where a is better, −1 where b is, 0 for a draw."""
    # Costs over the optimum.
    first, second = (1 + row["loss"] if stable(row) else math.inf for row in (a, b))
    if first == second or abs(first - second) <= DRAW * min(first, second):
        return 0
    return 1 if first < second else -1


def share(rows: Iterable[Row], basis: str) -> Share:
    """Return how often the designs on a basis are stable and good."""
    own = [row for row in rows if row["basis"] == basis]
    return Share(basis, len(own), sum(map(stable, own)), sum(map(good, own)))


def _sentences(
    duels: Sequence[Duel], shares: Sequence[Share], ratios: Sequence[float]
) -> Iterable[str]:
    papers = [d for d in duels if {d.first, d.second} == {"clamped-free", "slewing"}]
    if papers:
        yield _does_it_matter(papers[0])
        yield _where(papers[1:], ratios)
    if not shares:
        return
    best = max(shares, key=lambda share: share.good / share.designs)
    others = ", ".join(f"{s.basis} {s.good / s.designs:.0%}" for s in shares if s is not best)
    beside = f" ({others})" if others else ""
    yield (
        f"For an arm of your own take the {best.basis} basis: {best.good / best.designs:.0%} of "
        f"its {best.designs} LQG and H2 designs are stable and lose at most {GOOD:.0%} of the "
        f"optimal cost{beside}."
    )


def _does_it_matter(total: Duel) -> str:
    differ = total.first_wins + total.second_wins
    return (
        f"The basis matters in {differ} of {total.pairs} pairs of designs alike but for it "
        f"({differ / max(total.pairs, 1):.0%}): they differ in stability or by more than a "
        f"percent of the cost; the {total.first} basis is better in "
        f"{total.first_wins} of them, the {total.second} basis in {total.second_wins}."
    )


def _where(by_ratio: Sequence[Duel], ratios: Sequence[float]) -> str:
    """Say at which hub ratios which of the two wins more pairs."""
    first, second = by_ratio[0].first, by_ratio[0].second
    winners = {
        ratio: first if d.first_wins > d.second_wins else second if d.second_wins > d.first_wins
        else ""
        for ratio, d in zip(ratios, by_ratio, strict=True)
    }  # fmt: skip
    parts = []
    for basis in (second, first):
        won = [d for d in by_ratio if winners[d.hub_ratio or 0.0] == basis]
        if won:
            at = ", ".join(f"{d.hub_ratio:g}" for d in won)
            mine = sum(d.first_wins if basis == first else d.second_wins for d in won)
            theirs = sum(d.second_wins if basis == first else d.first_wins for d in won)
            parts.append(
                f"at hub inertias of {at} times the beam's the {basis} basis is ahead, "
                f"{mine} to {theirs}"
            )
    text = "; ".join(parts) or "at no hub inertia is either ahead"
    return text[0].upper() + text[1:] + "."
