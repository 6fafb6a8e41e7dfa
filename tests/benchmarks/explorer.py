"""How long a moved slider takes to be seen: verdicts on the truth, and every figure but the ladder.

Run as ``python tests/benchmarks/explorer.py [designs …]``: each slider of each design is moved by
one and by five places, away from what was seen before.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from slewctl._threads import single_threaded
from slewctl.compare import Judge
from slewctl.errors import SlewctlError
from slewctl.explore import explored, knobs_of
from slewctl.explore.result import before
from slewctl.files import find_designs, read_design

DESIGNS = Path(__file__).parents[2] / "designs"


@single_threaded
def times_of(path: Path) -> list[float]:
    """Return the seconds of every move, by the clock on the wall."""
    design = read_design(path)
    beside = before(design)
    found = []
    for knob in knobs_of(design, Judge(design.case).truth):
        place = knob.values.index(knob.value)
        for step in (1, 5):
            value = knob.values[(place + step) % len(knob.values)]
            start = time.perf_counter()
            try:
                explored(design, {knob.key: value}, beside=beside, confirm=False).body()
            except SlewctlError:
                continue  # told in less time
            found.append(time.perf_counter() - start)
    return found


def main() -> None:
    """Print what was measured."""
    paths = [Path(name) for name in sys.argv[1:]] or find_designs([DESIGNS, DESIGNS / "rigs"])
    every = []
    for path in paths:
        found = times_of(path)
        every += found
        print(
            f"{path.stem:32} median {np.median(found):.3f} s, worst {max(found):.3f} s", flush=True
        )
    within = np.mean(np.array(every) <= 0.3)
    print(f"{len(every)} moves: median {np.median(every):.3f} s, {within:.1%} within 0.3 s")


if __name__ == "__main__":
    main()
