"""Margins of thousands of flexible loops against brute force, and a peer on the same loops.

Run as ``python tests/benchmarks/margins.py [loops] [seed]``: loops of 5 to 60 modes, damped
by 1e-4 to 0.02, continuous and sampled, under LQG and PD with notches, stable and unstable.
The truth is a grid with 25 points in each half-width of every open- and closed-loop pole,
evaluated in closed form and polished by a root finder.  The peer is python-control, given
the state space (``stability_margins``), a thousand frequencies of it, and for its
``disk_margins`` two thousand; every tenth stable loop goes there.
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path

import control
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "loop"))
from brute_force import BruteMargins
from flexible_loops import FlexibleLoop, random_flexible_loops
from mixed_loops import random_mixed_loops

from slewctl.loop import Margins, UnstableLoopError
from slewctl.loop.margin_functions import margins

EXACT, PEER = 1e-7, 1e-2
# Beside lags 1e6 times as fast as a mode, ε‖A‖ against its half-width.
MIXED = 1e-5
EVERY = 10


def factors(m: Margins) -> dict[str, float]:
    """Return margins as the brute-force truth has them."""
    return {
        "up": 10 ** (m.gain_db.value / 20),
        "down": 10 ** (m.gain_reduction_db.value / 20),
        "phase": m.phase_deg.value,
        "delay": m.delay_s.value,
    }


def truth_of(brute: BruteMargins) -> dict[str, float]:
    """Return the same names; the reduction as a factor above one."""
    down = 1 / brute.down if brute.down > 0 else math.inf
    return {"up": brute.up, "down": down, "phase": brute.phase_deg, "delay": brute.delay_s}


def excess(claimed: float, true: float) -> float:
    """Return claimed/true − 1: positive where too much is promised."""
    if claimed == true:
        return 0.0
    if not math.isfinite(claimed) or not math.isfinite(true) or true == 0:
        return math.inf if claimed > true else -math.inf
    return claimed / true - 1


def own(loop: FlexibleLoop, brute: BruteMargins, count: Counter[str]) -> float:
    """Compare our margins of a stable loop with the truth; return the seconds they took."""
    system = loop.loop
    start = time.process_time()
    m = margins(system)
    spent = time.process_time() - start
    found, true = factors(m), truth_of(brute)
    errors = {name: excess(found[name], true[name]) for name in found}
    bad = [abs(e) > EXACT for e in errors.values()]
    bad.append(len(m.gain_crossings_hz) != len(brute.gain_crossings))
    grid = [excess(m.modulus.value, brute.modulus), excess(m.disk.value, brute.disk)]
    bad += [not -1e-3 < e < 1e-7 for e in grid]
    count["wrong"] += any(bad)
    count["optimistic"] += any(e > EXACT for e in [*errors.values(), *grid])
    count["unconfirmed"] += not m.confirmed
    for name, e in errors.items():
        key = f"worst {name}"
        if math.isfinite(e):
            WORST[key] = max(WORST[key], abs(e))
    axis = [c.on_axis for c in (m.gain_db, m.gain_reduction_db, m.phase_deg, m.delay_s)]
    axis += [m.modulus.on_axis, m.disk.on_axis]
    WORST["pole off the limit"] = max(WORST["pole off the limit"], *(a or 0.0 for a in axis))
    return spent


WORST: dict[str, float] = defaultdict(float)


def peer(
    name: str, ask: Callable[[], dict[str, float]], true: dict[str, float], count: Counter[str]
) -> float:
    """Ask the peer and count what became of it; return the seconds it took."""
    start = time.process_time()
    count[f"{name}: asked"] += 1
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found = ask()
    except (ValueError, np.linalg.LinAlgError, ArithmeticError, IndexError, RuntimeError):
        count[f"{name}: crashed"] += 1
        return time.process_time() - start
    spent = time.process_time() - start
    errors = [
        (excess(abs(found[k]) if math.isfinite(found[k]) else math.inf, true[k])) for k in found
    ]
    count[f"{name}: wrong > 1 %"] += any(abs(e) > PEER for e in errors)
    count[f"{name}: optimistic > 1 %"] += any(e > PEER for e in errors)
    finite = [e for e in errors if math.isfinite(e)]
    WORST[f"{name}: optimistic, times"] = max(
        WORST[f"{name}: optimistic, times"], *(1 + e for e in finite), 0.0
    )
    return spent


def peers(loop: FlexibleLoop, brute: BruteMargins, count: Counter[str]) -> tuple[float, float]:
    """Ask python-control for the same margins; return the seconds of the first and of disks."""
    system, omega = loop.loop, loop.omega
    top = min(100 * omega[-1], np.pi / loop.step if loop.step else np.inf)
    down = 1 / brute.down if brute.down > 0 else math.inf
    nearer = min(brute.up, down)
    true = {"gain": nearer, "phase": brute.phase_deg, "modulus": brute.modulus}

    def classical(what: object, **options: object) -> dict[str, float]:
        gm, pm, sm = control.stability_margins(what, **options)[:3]
        gm = max(gm, 1 / gm) if gm > 0 else math.inf
        return {"gain": gm, "phase": pm, "modulus": sm}

    grid = np.geomspace(omega[1] / 100, top, 1000)
    finer = np.geomspace(omega[1] / 100, top, 2000)
    spent = peer("stability_margins", lambda: classical(system), true, count)
    peer(
        "on 1000 frequencies",
        lambda: classical(control.frd(system, grid, smooth=True)),
        true,
        count,
    )
    disk = {"disk": brute.disk}
    return spent, peer(
        "disk_margins", lambda: {"disk": control.disk_margins(system, finer)[0]}, disk, count
    )


def mixed(number: int, seed: int) -> None:
    """Print what becomes of loops that are not modal, against exact arithmetic."""
    count: Counter[str] = Counter()
    worst = 0.0
    for loop in random_mixed_loops(seed, number):
        count[f"{loop.kind}, {'stable' if loop.stable else 'unstable'}"] += 1
        try:
            m = margins(loop.plant, loop.controller, sign=loop.sign)
        except UnstableLoopError:
            count["stable loops refused"] += loop.stable
            continue
        if not loop.stable:
            count["unstable loops given margins"] += 1
            continue
        (down, up), (turn, late) = loop.gain_limits, loop.phase_and_delay
        exact = {"up": up, "down": 1 / down if down else math.inf}
        exact |= {"phase": math.degrees(turn), "delay": late}
        errors = [abs(excess(value, exact[name])) for name, value in factors(m).items()]
        wrong = max(errors) > MIXED or len(m.gain_crossings_hz) != len(loop.gain_crossings)
        count["wrong"] += wrong
        count["wrong and confirmed"] += wrong and m.confirmed
        count["unconfirmed"] += not m.confirmed
        worst = max([worst, *(e for e in errors if math.isfinite(e))])
    print(f"{number} loops that are not modal from seed {seed}, exact to {MIXED:g}")
    for name, times in sorted(count.items()):
        print(f"  {name:40}{times:8}")
    print(f"  {'worst error':40}{worst:12.2e}")


def main() -> None:
    """Print what was found."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    count: Counter[str] = Counter()
    ours: dict[str, list[float]] = defaultdict(list)
    ratio: dict[str, list[float]] = defaultdict(list)
    for index, loop in enumerate(random_flexible_loops(seed, number)):
        kind = "sampled" if loop.step else "continuous"
        count[f"{kind} loops"] += 1
        stable = loop.stable
        if not stable:
            try:
                margins(loop.loop)
                count["unstable loops given margins"] += 1
            except UnstableLoopError:
                count["unstable, refused"] += 1
            continue
        count[f"stable, {kind}"] += 1
        brute = loop.truth()
        try:
            spent = own(loop, brute, count)
        except UnstableLoopError:
            count["stable loops refused"] += 1
            continue
        modes = len(loop.omega) - 1
        ours["5-10 modes" if modes <= 10 else "11-50" if modes <= 50 else "51-60"].append(spent)
        if index % EVERY == 0:
            first, disk = peers(loop, brute, count)
            ratio["stability_margins / ours"].append(first / spent)
            ratio["disk_margins / ours"].append(disk / spent)
    print(f"{number} loops from seed {seed}")
    for name in ("wrong", "optimistic", "unconfirmed"):
        print(f"  ours: {name:34}{count.pop(name, 0):8}")
    for name in sorted(count):
        print(f"  {name:40}{count[name]:8}")
    for name, value in sorted(WORST.items()):
        print(f"  {name:40}{value:12.2e}")
    for name, values in ours.items():
        print(f"  CPU seconds, {name:27}median {np.median(values):.3f}, most {max(values):.3f}")
    for name, values in ratio.items():
        print(f"  {name:40}{np.median(values):8.1f} (median CPU time)")
    mixed(3 * number, seed)


if __name__ == "__main__":
    main()
