"""The multiloop disk margin on random loops: how tight, how sound, how fast; and a peer.

Two-loop results are compared with μ in closed form on a grid refined at every pole.  The
peer is python-control's `disk_margins` on a thousand frequencies, which needs slycot for
several loops and is left out where that is not installed.

Run as ``python tests/benchmarks/multiloop.py [loops]``.
"""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path

import control
import numpy as np

from slewctl.loop.robust.multiloop import multiloop_disk_margin

sys.path.insert(0, str(Path(__file__).parents[1] / "loop"))
from random_multiloops import brute_force_mu, stable_multiloops


def against_the_grid(count: int) -> None:
    """Print how two-loop margins compare with a refined grid, continuous and sampled."""
    gaps, errors, seconds, doubtful, peer = [], [], [], 0, []
    for loop in stable_multiloops(11, count, modes=(2, 20)):
        start = time.perf_counter()
        found = multiloop_disk_margin(loop)
        seconds.append(time.perf_counter() - start)
        truth = 1 / brute_force_mu(loop)
        gaps.append(found.gap)
        errors.append(found.guaranteed / truth - 1)
        doubtful += not found.confirmed
        if importlib.util.find_spec("slycot"):
            omega = np.geomspace(1e-3, 1e3, 1000)
            peer.append(control.disk_margins(loop, omega)[0] / truth - 1)
    print(f"{count} two-loop margins, 2 to 19 modes:")
    print(f"  bracket at most {max(gaps):.1e}, not confirmed {doubtful}")
    print(f"  guaranteed over the grid's: {min(errors):.1e} … {max(errors):.1e} (never above 0)")
    print(f"  seconds: median {np.median(seconds):.3f}, longest {max(seconds):.2f}")
    if peer:
        wrong = np.array(peer)
        print(f"  peer on 1000 frequencies: {np.sum(np.abs(wrong) > 0.01)} wrong by > 1 %, "
              f"{np.sum(wrong > 0.01)} optimistic, up to {wrong.max() + 1:.1f}×")  # fmt: skip


def many_channels(count: int) -> None:
    """Print the bracket and the time for more channels."""
    for channels in (3, 4, 5):
        gaps, seconds = [], []
        for loop in stable_multiloops(12, count, channels, modes=(2, 10)):
            start = time.perf_counter()
            gaps.append(multiloop_disk_margin(loop).gap)
            seconds.append(time.perf_counter() - start)
        print(f"{count} loops of {channels} channels: bracket at most {max(gaps):.1e}, "
              f"median {np.median(seconds):.2f} s")  # fmt: skip


def large(modes: int) -> None:
    """Print the time for a large loop."""
    loop = next(stable_multiloops(13, 1, modes=(modes, modes + 1)))
    start = time.perf_counter()
    found = multiloop_disk_margin(loop)
    spent = time.perf_counter() - start
    print(f"{modes} modes, {loop.nstates} states: {spent:.2f} s, bracket {found.gap:.1e}")


def main(count: int) -> None:
    """Print all."""
    against_the_grid(count)
    many_channels(max(count // 10, 3))
    for modes in (20, 40, 60):
        large(modes)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
