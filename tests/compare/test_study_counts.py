"""What a study counts by column is what one counts row by row; its slices, by axis and value."""

from __future__ import annotations

import math
from collections import Counter
from itertools import combinations, product
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest

import slewctl as sc
from slewctl.compare import MEDIANS, Grid, Study, StudyResult
from slewctl.compare.study.answer import along, answer, duel, share
from slewctl.compare.study.designs import OTHER_AXES, Designs
from slewctl.compare.study.results_file import Rows
from slewctl.errors import InputError
from slewctl.report import write_study
from slewctl.report.study import MOST_MAPS

BASES = ("clamped-free", "slewing", "arm-matched", "modal-truncation")
AXES = {
    "hub_ratio": [0.0, 0.3, 3.0],
    "payload_ratio": [0.0, 1.0],
    "damping_ratio": [0.01],
    "bandwidth": [0.1, 0.3],
    "sensors": ["theta", "theta+theta_dot"],
    "method": ["lqg", "pd-notch"],
    "n": [1, 2, 4],
}
Row = dict[str, Any]


def random_rows(seed: int, axes: dict[str, list[Any]] = AXES, share_kept: float = 0.8) -> list[Row]:
    """Return rows of a study in which everything occurs, in no order."""
    random = np.random.default_rng(seed)
    rows: list[Row] = []
    for *at, basis in product(*axes.values(), BASES):
        if random.random() > share_kept:
            continue
        outcome = str(random.choice(["stable", "stable", "stable", "unstable", "no design"]))
        made, holds = outcome != "no design", outcome == "stable"
        draw = float(random.choice([0.02, 0.0201, 0.3, 5.0]))
        rows.append(
            dict(zip(axes, at, strict=True))
            | {
                "basis": basis, "outcome": outcome,
                "stable_on_twice": bool(random.random() < 0.9) if holds else None,
                "h2_loss": draw if holds else None,
                "unstable_mode": None if holds or not made else int(random.integers(0, 8)),
                "worst_frequency_error": float(random.random()) if made else None,
                "condition": float(random.random()) if made and basis != BASES[-1] else None,
                "nu_gap": float(random.random()) if made and random.random() < 0.7 else None,
                "generalised_margin": float(random.random()) if made else None,
                "optimum_drift": 0.0, "reason": None,
                **{name: float(random.random()) if holds else None for name in MEDIANS},
            }
        )  # fmt: skip
    random.shuffle(rows)  # type: ignore[arg-type]
    return rows


def stable(row: Row) -> bool:
    return row["outcome"] == "stable" and bool(row["stable_on_twice"])


def outcomes(rows: list[Row], first: str, second: str) -> list[tuple[Row, int]]:
    """Return each pair's first row and who wins, from all couples of rows."""
    found = []
    made = [row for row in rows if row["outcome"] != "no design"]
    for a, b in product(made, made):
        if (a["basis"], b["basis"]) != (first, second) or any(a[k] != b[k] for k in AXES):
            continue
        x, y = (1 + r["h2_loss"] if stable(r) else math.inf for r in (a, b))
        draw = x == y or abs(x - y) <= 0.01 * min(x, y)
        found.append((a, 0 if draw else 1 if x < y else -1))
    return found


@pytest.mark.parametrize("seed", [1, 2])
def test_pairs_and_shares_are_those_counted_one_by_one(seed: int) -> None:
    rows = random_rows(seed)
    table = Rows(tuple(rows[0]), [tuple(row.values()) for row in rows])
    designs = Designs(table)
    for first, second in combinations(BASES, 2):
        one_by_one = outcomes(rows, first, second)
        wins = Counter(won for _, won in one_by_one)
        found = duel(designs, first, second)
        assert (found.first_wins, found.second_wins, found.draws) == (wins[1], wins[-1], wins[0])
        for axis in ("hub_ratio", *OTHER_AXES):
            by_value = Counter((row[axis], won) for row, won in one_by_one)
            for each in along(designs, first, second, axis):
                counts = (each.first_wins, each.second_wins, each.draws)
                assert counts == tuple(by_value[each.value, won] for won in (1, -1, 0))
    for basis in BASES:
        own = [r for r in rows if r["basis"] == basis and r["outcome"] != "no design"]
        found_share = share(designs, designs.made, basis)
        holding = [r for r in own if stable(r)]
        assert (found_share.designs, found_share.stable) == (len(own), len(holding))
        assert found_share.good == sum(r["h2_loss"] <= 0.05 for r in holding)
        for name in MEDIANS:
            assert found_share.medians[name] == median(r[name] for r in holding)
        known = [r["condition"] for r in own if r["condition"] is not None]
        assert found_share.condition == (max(known) if known else None)
    # Rows and mappings give the same answer.
    assert answer(designs) == answer(Designs(rows))


def result_of(rows: list[Row]) -> StudyResult:
    study = Study("random", "", sc.arms.paper_beam(), (Grid(),), truth_modes=20)
    return StudyResult(study, Rows(tuple(rows[0]), [tuple(row.values()) for row in rows]))


def test_slices_hold_every_design_of_their_axes_and_are_found_by_them() -> None:
    rows = random_rows(3)
    result = result_of(rows)
    assert len(result.slices) == 16  # payloads, bandwidths, sensors, methods
    assert sum(len(part.rows) for part in result.slices) == len(rows)
    for part in result.slices:
        for axis in ("payload_ratio", "bandwidth", "sensors", "method"):
            assert len({row[axis] for row in part.rows}) == 1
    some = result.sliced({"bandwidth": "0.30", "sensors": "theta, theta_dot"})
    assert len(some) == 4
    assert {(r["bandwidth"], r["sensors"]) for part in some for r in part.rows} == {
        (0.3, "theta+theta_dot")
    }
    assert result.sliced({}) == result.slices
    with pytest.raises(
        InputError, match=r"slice: no slice has bandwidth = '0.7'; there are 0.1; 0.3"
    ):
        result.sliced({"bandwidth": "0.7"})
    with pytest.raises(InputError, match="slice: unknown name 'n'"):
        result.sliced({"n": "2"})


@pytest.mark.slow
def test_a_page_holds_so_many_maps_however_large_the_study(tmp_path: Path) -> None:
    sizes = []
    for bandwidths in (8, 24):
        axes = AXES | {"bandwidth": [0.01 * (k + 1) for k in range(bandwidths)], "n": [1, 2]}
        result = result_of(random_rows(4, axes, share_kept=1.0))
        page = write_study(result, tmp_path / str(bandwidths))
        text = page.read_text(encoding="utf-8")
        assert text.count('<figure class="map">') == MOST_MAPS
        left = len(result.slices) - MOST_MAPS
        assert f"{left} more maps are not drawn here" in text
        assert f"{left} more maps" in page.with_name("index.md").read_text(encoding="utf-8")
        sizes.append(len(text))
    assert sizes[1] < 1.2 * sizes[0]
    page = write_study(result, tmp_path / "one", wanted={"bandwidth": "0.05", "method": "lqg"})
    assert page.read_text(encoding="utf-8").count('<figure class="map">') == 4
    assert "more maps" not in page.read_text(encoding="utf-8")
