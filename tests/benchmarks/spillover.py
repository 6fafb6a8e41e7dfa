"""Which number predicts spillover, over random arms and LQG designs on a few of their modes.

Run as ``python tests/benchmarks/spillover.py [designs]``; 2,000 take about ten minutes.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

from slewctl import AccuracyError, Loop, Model
from slewctl.loop.robust.small_gain import spillover

sys.path.insert(0, str(Path(__file__).parents[1] / "compare"))
from random_spillover import random_design
from spillover_predictors import THEOREMS, Predictors, predictors, score

TRUTH_MODES = 20
NAMED_EVERY = 10


def main(count: int) -> None:
    """Print the table."""
    rng = np.random.default_rng(5)
    found: list[Predictors] = []
    unstable: list[bool] = []
    refused: Counter[str] = Counter()
    named, agreed = 0, 0
    start = time.perf_counter()
    while len(found) < count:
        loop, design = random_design(rng, TRUTH_MODES)
        try:
            found.append(predictors(loop, design))
        except AccuracyError as error:
            refused[error.what[:60]] += 1
            continue
        unstable.append(not loop.stable)
        if unstable[-1] and sum(unstable) % NAMED_EVERY == 0:
            named += 1
            agreed += _names_the_mode(loop, design)
    spent = time.perf_counter() - start
    bad = sum(unstable)
    print(f"{count} LQG designs on 1 to 5 modes, truth of {TRUTH_MODES}: {bad} unstable")
    print(f"{'predictor':22s}{'AUC':>7s}{'threshold':>11s}{'hits':>7s}{'misses':>8s}"
          f"{'false alarms':>14s}{'stable passed':>15s}")  # fmt: skip
    for one in score(found, unstable):
        share = one.passed / (one.passed + one.false_alarms)
        print(f"{one.predictor:22s}{one.auc:7.3f}{one.threshold:11.3g}{one.hits:7d}"
              f"{one.misses:8d}{one.false_alarms:14d}{100 * share:13.0f} %"
              f"{'  theorem' if one.predictor in THEOREMS else ''}")  # fmt: skip
    print(f"the mode named by the critical scale is one that is unstable: {agreed} of {named}")
    print(f"refused for accuracy: {dict(refused)}")
    print(f"{1e3 * spent / count:.0f} ms a design")


def _names_the_mode(loop: Loop, design: Model) -> bool:
    """Whether the first mode to go on the way to the truth is near an unstable pole."""
    first = spillover(loop, design).critical_hz
    known = loop.model.frequencies_hz

    def nearest(hertz: float) -> int:
        return int(np.argmin(np.abs(known - hertz)))

    poles = {nearest(hertz) for hertz in loop.unstable_hz}
    return first is not None and nearest(first) in poles


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
