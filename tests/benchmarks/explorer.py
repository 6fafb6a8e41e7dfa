"""How long a moved slider takes to be seen: verdicts and every figure, and then the ladder.

Run as ``python tests/benchmarks/explorer.py [designs …]``: each slider of each design is moved by
one and by five places, away from what was seen before.  Told are seconds by the clock on the wall,
with the ladder drawn in a process beside this one, as for the page; and those of this process.
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
from slewctl.explore.app import Shared
from slewctl.explore.result import before, set_as
from slewctl.files import find_designs, read_design
from slewctl.report.explorer import with_ladder

DESIGNS = Path(__file__).parents[2] / "designs"


# In s: what an eye takes for at once.
AT_ONCE = 0.3


@single_threaded
def times_of(path: Path) -> Array:
    """Return the seconds of every move: on the wall without and with ladder, and of this process,
    shape (moves, 3)."""
    design = read_design(path)
    beside = before(design)
    knobs = knobs_of(design, Judge(design.case).truth)
    moves = [
        (knob.key, knob.values[(knob.values.index(knob.value) + step) % len(knob.values)])
        for knob in knobs
        for step in (1, 5)
    ]
    found = []
    with Shared(design, knobs, beside) as shared:
        shared.climb(design.source.text).result()  # it has loaded then
        for key, value in moves:
            start, own = time.perf_counter(), time.process_time()
            try:
                changed = set_as(design, {key: value})
                ladder = shared.climb(changed.source.text)
                body = explored(changed, beside=beside, confirm=False, ladder=False).body()
            except SlewctlError:
                continue  # told in less time
            seen, own = time.perf_counter() - start, time.process_time() - own
            with_ladder(body, ladder.result())
            found.append((seen, time.perf_counter() - start, own))
    return np.array(found)


def main() -> None:
    """Print what was measured."""
    paths = [Path(name) for name in sys.argv[1:]] or find_designs([DESIGNS, DESIGNS / "rigs"])
    every = []
    print("median and worst, s:             on the wall    with ladder    of processor")
    for path in paths:
        found = times_of(path)
        every.append(found)
        told = [f"{m:.3f} {w:6.3f}" for m, w in zip(np.median(found, 0), found.max(0), strict=True)]
        print(f"{path.stem:32} {'   '.join(told)}", flush=True)
    whole = np.concatenate(every)
    kinds = ("on the wall", "with ladder", "of processor")
    for kind, times in zip(kinds, whole.T, strict=True):
        within = np.mean(times <= AT_ONCE)
        print(
            f"{len(times)} moves, {kind}: median {np.median(times):.3f} s, "
            f"{within:.1%} within {AT_ONCE} s"
        )


if __name__ == "__main__":
    main()
