"""Time of certified margins against margins from eigenvalues, on the same loops in one run.

Run as ``python tests/benchmarks/margins_speed.py [modes …]``: for each number of modes a few
random stable loops; medians of CPU time, of a new system each, with what is remembered of equal
numbers forgotten.
Both are timed turn by turn, several times each, and the ratio is that of the least times.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "loop"))
from eigenvalue_margins import eigenvalue_margins
from flexible_loops import FlexibleLoop, random_flexible_loop

from slewctl.errors import AccuracyError
from slewctl.loop.parts import paired
from slewctl.loop.single import factor
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.factored_loop import factored
from slewctl.loop.single.mode_names import modes_of_pair
from slewctl.numerics import modal_form
from slewctl.numerics.interconnect import series

LOOPS, TURNS = 5, 3
SEEDS = 400


def spent(what: Callable[[], object]) -> float:
    start = time.process_time()
    what()
    return time.process_time() - start


def times_of(loop: FlexibleLoop) -> tuple[float, float]:
    """Return the seconds of certified margins and of those from eigenvalues."""
    plant, controller = loop.plant, loop.controller
    pair = paired(plant, controller)
    L, named = series(pair.plant, pair.negative), modes_of_pair(pair)

    def certified() -> object:
        for remembered in (modal_form._modal_form, factor._of_form):
            remembered.cache_clear()
        fresh = paired(plant, controller)
        found = factored(fresh.plant, fresh.negative)
        return classical_margins(L, modes=named, factors=found)

    certified()
    turns = [
        (spent(certified), spent(lambda: eigenvalue_margins(L, modes=named))) for _ in range(TURNS)
    ]
    ours, others = np.min(np.array(turns), axis=0)
    return float(ours), float(others)


def loops_of(modes: int) -> list[FlexibleLoop]:
    """Return a few stable continuous loops of so many modes."""
    found: list[FlexibleLoop] = []
    for seed in range(SEEDS):
        try:
            loop = random_flexible_loop(np.random.default_rng(seed), modes)
        except AccuracyError:
            continue
        if not loop.step and loop.stable:
            found.append(loop)
        if len(found) == LOOPS:
            break
    return found


def main() -> None:
    """Print what was measured."""
    for modes in [int(argument) for argument in sys.argv[1:]] or [20, 60, 100]:
        times = np.array([times_of(loop) for loop in loops_of(modes)])
        ours, eigenvalues = 1e3 * np.median(times, axis=0)
        ratio = np.median(times[:, 1] / times[:, 0])
        print(
            f"{modes} modes: certified {ours:.1f} ms, from eigenvalues {eigenvalues:.1f} ms, "
            f"ratio {ratio:.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
