"""Certified margins of loops that are not modal, against exact arithmetic.

Run as ``python tests/benchmarks/margins_evidence.py [loops] [seed]`` for each of three sets:

* poles spread over 1e-6 … 1e6 rad/s;
* PID controllers with notches and lags up to 1e6 times as fast, in companion form;
* dead time: the number of unstable poles follows exactly from the crossings of |L| = 1 and
  their directions (Walton and Marshall 1987), at any gain.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "loop"))
from delayed_loops import DelayedLoop, random_delayed_loops
from margins import excess, factors
from mixed_loops import MixedLoop, random_mixed_loop

from slewctl.errors import AccuracyError
from slewctl.loop import Margins, UnstableLoopError
from slewctl.loop.margin_functions import margins
from slewctl.loop.single.axis_ends import WIDEST

EXACT = 1e-9


def note(loop: MixedLoop | DelayedLoop, label: str, count: Counter[str], sign: int) -> None:
    """Compare one loop's margins with what is exact."""
    stable = loop.stable
    count["stable" if stable else "unstable"] += 1
    delay = loop.delay if isinstance(loop, DelayedLoop) else 0.0
    try:
        found = margins(loop.plant, loop.controller, sign=sign, delay=delay)
    except UnstableLoopError:
        count["stable loops refused"] += stable
        return
    except AccuracyError as error:
        count["undecided"] += 1
        print(f"  {label}: {error}")
        return
    if not stable:
        count["unstable loops given margins"] += 1
        print(f"  {label}: unstable, given margins")
        return
    wrong, worst, optimistic = loop_errors(loop, found)
    count["wrong"] += wrong
    count["proved beyond the truth"] += proved_too_much(loop, found)
    count["optimistic"] += optimistic
    count["unconfirmed"] += not found.confirmed
    count["wrong and confirmed"] += wrong and found.confirmed
    count["a pair wider than 1e-9"] += any(
        c.at_least is not None and c.at_least < c.value * (1 - EXACT)
        for c in (found.phase_deg, found.delay_s, found.modulus, found.disk)
    )
    if wrong or not found.confirmed:
        print(f"  {label}: error {worst:.1e}, {found.intervals} intervals, {found.doubts}")


def loop_errors(loop: MixedLoop | DelayedLoop, found: Margins) -> tuple[bool, float, bool]:
    """Return whether anything is wrong, the worst error, and whether too much is promised."""
    turn, late = loop.phase_and_delay
    pairs = [(found.phase_deg.value, math.degrees(turn)), (found.delay_s.value, late)]
    if isinstance(loop, DelayedLoop):
        false = [not loop.is_limit(f) for f in gain_factors(found)]
    else:
        (down, up), ours = loop.gain_limits, factors(found)
        limits = {"up": up, "down": 1 / down if down else math.inf}
        # A limit beyond the widest gain that is asked about is none.
        pairs += [(ours[way], far if far < WIDEST else math.inf) for way, far in limits.items()]
        false = []
    errors = [excess(ours, exact) for ours, exact in pairs]
    false.append(len(found.gain_crossings_hz) != len(loop.gain_crossings))
    worst = max(map(abs, errors))
    return worst > EXACT or any(false), worst, max(errors) > EXACT


def proved_too_much(loop: MixedLoop | DelayedLoop, found: Margins) -> bool:
    """Return whether a margin is said to be proved that is larger than the exact one."""
    turn, late = loop.phase_and_delay
    pairs = [(found.phase_deg.at_least, math.degrees(turn)), (found.delay_s.at_least, late)]
    if isinstance(loop, MixedLoop):
        down, up = loop.gain_limits
        pairs += [
            (found.gain_db.at_least, 20 * math.log10(up)),
            (found.gain_reduction_db.at_least, -20 * math.log10(down) if down else math.inf),
        ]
    return any(excess(least, exact) > 4e-15 for least, exact in pairs if least is not None)


def gain_factors(found: Margins) -> list[float]:
    return [10 ** (found.gain_db.value / 20), 10 ** (-found.gain_reduction_db.value / 20)]


def main() -> None:
    """Print what was found."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    for kind in ("decades", "pid"):
        rng, count, start = np.random.default_rng(seed), Counter[str](), time.process_time()
        for index in range(number):
            loop = random_mixed_loop(rng, kind)
            note(loop, f"{kind} {index}", count, loop.sign)
        told(kind, number, count, start)
    count, start = Counter[str](), time.process_time()
    for index, late in enumerate(random_delayed_loops(seed, number)):
        note(late, f"dead time {index}", count, -1)
    told("dead time", number, count, start)


def told(kind: str, number: int, count: Counter[str], start: float) -> None:
    print(f"{kind}: {number} loops, {time.process_time() - start:.0f} s")
    for name, times in sorted(count.items()):
        print(f"  {name:40}{times:8}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
