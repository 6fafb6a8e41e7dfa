"""Time of certified margins against margins from eigenvalues, on the same loops in one run.

Run as ``python tests/benchmarks/margins_speed.py [modes …]``: for each number of modes a few
random stable loops; medians of CPU time, of a new system each, so that nothing is remembered.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "loop"))
from eigenvalue_margins import eigenvalue_margins
from flexible_loops import FlexibleLoop, random_flexible_loops

from slewctl.loop.parts import paired
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.factored_loop import factored
from slewctl.loop.single.mode_names import modes_of_pair
from slewctl.numerics.interconnect import series

LOOPS = 7


def spent(what: Callable[[], object]) -> float:
    start = time.process_time()
    what()
    return time.process_time() - start


def times_of(loop: FlexibleLoop) -> tuple[float, float]:
    """Return the seconds of certified margins and of those from eigenvalues."""
    pair = paired(loop.plant, loop.controller)
    L, named = series(pair.plant, pair.negative), modes_of_pair(pair)

    def certified() -> object:
        fresh = paired(loop.plant, loop.controller)
        found = factored(fresh.plant, fresh.negative)
        return classical_margins(L, modes=named, factors=found)

    certified()
    return spent(certified), spent(lambda: eigenvalue_margins(L, modes=named))


def main() -> None:
    """Print what was measured."""
    wanted = [int(argument) for argument in sys.argv[1:]] or [20, 60]
    loops = [loop for loop in random_flexible_loops(3, 150) if not loop.step and loop.stable]
    for modes in wanted:
        near = sorted(loops, key=lambda loop: abs(len(loop.omega) - 1 - modes))[:LOOPS]
        ours, eigenvalues = np.median(np.array([times_of(loop) for loop in near]), axis=0)
        sizes = sorted(len(loop.omega) - 1 for loop in near)
        print(
            f"{sizes[0]}…{sizes[-1]} modes: certified {1e3 * ours:.1f} ms, from eigenvalues "
            f"{1e3 * eigenvalues:.1f} ms, ratio {eigenvalues / ours:.1f}"
        )


if __name__ == "__main__":
    main()
