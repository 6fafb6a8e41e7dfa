"""Measure what the project promises: costs as ratios against a peer in the same run.

Run as ``python tests/benchmarks/measure.py``.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import quad

from slewctl import ClampedFree, arms, assemble
from slewctl.compare import compare
from slewctl.files import find_designs, read_design

DESIGNS = Path(__file__).parents[2] / "designs"


def best_of(action: Callable[[], object], times: int = 5) -> float:
    """Return the shortest of several wall-clock times in seconds."""
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        action()
        spent.append(time.perf_counter() - start)
    return min(spent)


def import_time(module: str) -> float:
    """Return the shortest time in seconds in which a new interpreter imports `module`."""
    code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    command = [sys.executable, "-c", code]
    return min(float(subprocess.check_output(command, text=True)) for _ in range(7))


def quad_double_loop(n: int) -> np.ndarray:
    """Return the mass matrix M_e of the paper's beam by one adaptive integral an entry."""
    arm, basis = arms.paper_beam(), ClampedFree(n)

    def integrand(x: float, i: int, j: int) -> float:
        shapes = basis.evaluate(np.array([x]))[0]
        return float(arm.beam.mass_profile(np.array([x]))[0] * shapes[i] * shapes[j])

    mass = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            mass[i, j] = mass[j, i] = quad(integrand, 0.0, 1.0, args=(i, j), limit=200)[0]
    return mass


def main() -> None:
    """Print the measurements."""
    peer, own = import_time("control"), import_time("slewctl")
    print(f"import slewctl / import control: {own:.3f} s / {peer:.3f} s = {own / peer:.2f}")

    arm = arms.paper_beam()
    fifty = best_of(lambda: assemble(arm, ClampedFree(50)))
    print(f"assemble, n = 50: {1e3 * fifty:.1f} ms")
    small = 6
    start = time.perf_counter()
    reference = quad_double_loop(small)
    slow = time.perf_counter() - start
    quick = best_of(lambda: assemble(arm, ClampedFree(small)))
    error = np.abs(assemble(arm, ClampedFree(small)).mass[1:, 1:] - reference).max()
    print(
        f"assemble / quad double loop over M_e, n = {small}: {1e3 * quick:.2f} ms / "
        f"{1e3 * slow:.0f} ms = 1/{slow / quick:.0f}; entries agree to {error:.0e}"
    )
    start = time.perf_counter()
    quad_double_loop(50)
    slow = time.perf_counter() - start
    print(f"the same for n = 50: 1/{slow / fifty:.0f} ({slow:.0f} s)")

    before = resource.getrusage(resource.RUSAGE_SELF)
    compare(read_design(path).case for path in find_designs([DESIGNS]))
    after = resource.getrusage(resource.RUSAGE_SELF)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"comparison of designs/: {cpu:.1f} s of CPU, peak {after.ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
