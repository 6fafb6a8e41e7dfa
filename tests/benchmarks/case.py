"""CPU of one LQG case of a study, in this tree and in another one, turn by turn in one run.

Run as ``python tests/benchmarks/case.py OTHER [modes …]`` with OMP_NUM_THREADS=1, where OTHER
is a checkout of another commit (``git worktree add OTHER COMMIT``): medians over the same cases,
the place of each known, as in a study that comes to its second design.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROUNDS, HERE = 5, Path(__file__).parents[2]
# What both trees run: a line of the CPU seconds of each case, after a round of other designs on
# the same place, so that nothing is remembered but the place.
CASES = """
import sys, time, warnings
warnings.simplefilter("ignore")
from slewctl import arms
from slewctl.compare import Grid, Study, Work, evaluate_point
modes = int(sys.argv[1])
bases = ("clamped-free", "slewing", "hub-matched", "arm-matched")
arm = arms.paper_beam()
for bandwidth in (0.2, 0.1):
    grid = Grid(bases, orders=(2, 4, 6), hub_ratios=(0.3,), payload_ratios=(0.0,),
                damping_ratios=(0.01,), bandwidths=(bandwidth,))
    study = Study("x", "", arm, (grid,), truth_modes=modes)
    works = [Work(arm, modes, point) for point in study.points()]
    spent = []
    for work in works:
        start = time.process_time()
        evaluate_point(work)
        spent.append(time.process_time() - start)
print(*spent)
"""


def spent(tree: Path, modes: int) -> np.ndarray:
    """Return the CPU seconds of every case in a tree."""
    command = [sys.executable, "-c", CASES, str(modes)]
    own = os.environ | {"PYTHONPATH": str(tree)}
    # Python looks into the working directory first.
    found = subprocess.check_output(command, env=own, text=True, cwd=tree)
    return np.array(found.split(), dtype=float)


def main() -> None:
    """Print what was measured."""
    other, *modes = sys.argv[1:]
    for number in [int(argument) for argument in modes] or [20]:
        rounds = [(spent(HERE, number), spent(Path(other), number)) for _ in range(ROUNDS)]
        own, before = np.min(np.array(rounds), axis=0)
        print(f"{number} modes: a case takes {1e3 * np.median(own):.1f} ms here, "
              f"{1e3 * np.median(before):.1f} ms there, ratio {np.median(before / own):.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
