"""How long a moved slider takes to be seen: verdicts and every figure, and then the ladder.

Run as ``python tests/benchmarks/explorer.py [designs …]``: each slider of each design is moved by
one and by five places, away from what was seen before.  Told are seconds by the clock on the wall,
and those of the processor, which a busy machine does not stretch as much.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.compare import Judge
from slewctl.errors import SlewctlError
from slewctl.explore import explored, knobs_of
from slewctl.explore.result import before
from slewctl.files import find_designs, read_design

DESIGNS = Path(__file__).parents[2] / "designs"


# In s: what an eye takes for at once.
AT_ONCE = 0.3


@single_threaded
def times_of(path: Path) -> Array:
    """Return the seconds of every move: on the wall without and with ladder, and the same of the
    processor, shape (moves, 4)."""
    design = read_design(path)
    beside = before(design)
    found = []
    for knob in knobs_of(design, Judge(design.case).truth):
        place = knob.values.index(knob.value)
        for step in (1, 5):
            value = knob.values[(place + step) % len(knob.values)]
            seen = [clocks()]
            try:
                result = explored(design, {knob.key: value}, beside=beside, confirm=False)
                body = result.body(ladder=False)
            except SlewctlError:
                continue  # told in less time
            seen.append(clocks())
            result.with_ladder(body)
            seen.append(clocks())
            (wall, processor) = (np.subtract(each[1:], each[0]) for each in zip(*seen, strict=True))
            found.append([*wall, *processor])
    return np.array(found)


def clocks() -> tuple[float, float]:
    """Return seconds on the wall and of this process."""
    return time.perf_counter(), time.process_time()


def main() -> None:
    """Print what was measured."""
    paths = [Path(name) for name in sys.argv[1:]] or find_designs([DESIGNS, DESIGNS / "rigs"])
    every = []
    print(
        "median and worst, s:             on the wall    with ladder    of processor   with ladder"
    )
    for path in paths:
        found = times_of(path)
        every.append(found)
        told = [f"{m:.3f} {w:6.3f}" for m, w in zip(np.median(found, 0), found.max(0), strict=True)]
        print(f"{path.stem:32} {'   '.join(told)}", flush=True)
    whole = np.concatenate(every)
    kinds = ("on the wall", "with ladder", "of processor", "with ladder")
    for kind, times in zip(kinds, whole.T, strict=True):
        within = np.mean(times <= AT_ONCE)
        print(
            f"{len(times)} moves, {kind}: median {np.median(times):.3f} s, "
            f"{within:.1%} within {AT_ONCE} s"
        )


if __name__ == "__main__":
    main()
