"""Verdicts on hundreds of random designs against finite elements and their own eigenvalues.

Run as ``python tests/benchmarks/judge.py [designs] [seed]``.  The arms have any taper or step,
hub, payload, friction, damping law and motor; the controllers are LQG (continuous, sampled with
any delay, with integral action), pole placement, PD with notches, lead, positive position
feedback, and PID with two lags in companion form, designed on 1 to 4 functions of every basis
or on a reduction.  Each is judged on a truth of 6 to 12 modes, on one of twice as many, and
with gains on both sides of the one that puts a pole on the axis.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "judge"))
from judging import Tally
from random_designs import random_designs

FIGURES = 50
MODES = 12


def main() -> None:
    """Print what was found."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    refused: Counter[str] = Counter()
    start = time.process_time()
    tally = Tally()
    for place, design in enumerate(random_designs(seed, number, MODES, refused), start=1):
        tally.judge([design], FIGURES)
        if place % 100 == 0:
            print(f"{place} judged, {len(tally.wrong)} wrong", file=sys.stderr, flush=True)
    print(f"{number} designs from seed {seed}, {time.process_time() - start:.0f} s of CPU")
    for name, count in sorted(tally.counts.items()):
        print(f"  {name:60}{count:8}")
    for name, count in sorted(refused.items()):
        print(f"  {'not designed, ' + name:60}{count:8}")
    for name, gaps in tally.gaps.items():
        print(f"  {name + ', relative gap':46}median {np.median(gaps):.1e}, most {max(gaps):.1e}")
    lists = {
        "wrong verdicts": tally.wrong,
        "verdicts that the arm's higher modes contradict": tally.unlike_the_arm,
        "wrong margins, told as confirmed, and wrong costs": tally.wrong_figures,
    }
    for title, lines in lists.items():
        print(f"{title}: {len(lines)}")
        for line in lines:
            print(f"  {line}")


if __name__ == "__main__":
    main()
