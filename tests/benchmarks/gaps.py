"""The ν-gap and b(P, C) by intervals: against two Riccati equations and level sets, and a grid.

Run as ``python tests/benchmarks/gaps.py [cases] [modes …]`` with OMP_NUM_THREADS=1: how many of
120 random cases a maximum over a thousand frequencies misses, and the CPU time of both ways on
truths of so many modes, medians over new systems each, so that nothing is remembered.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from slewctl import Arm, Hub, arms, assemble, generalised_plant, lqg, truth
from slewctl.basis import create
from slewctl.compare.study.grid import objective_of, omega_of, reading_units
from slewctl.design import Controller
from slewctl.errors import SlewctlError
from slewctl.loop.parts import paired
from slewctl.loop.realisation import realisation
from slewctl.loop.robust.coprime_factors import left_graph, right_graph, winding
from slewctl.loop.robust.ncf_margin import ncf_margin
from slewctl.loop.robust.nu_gap import nu_gap, signal_units
from slewctl.model import total_inertia
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.linear_system import LinearSystem

SENSORS = ("theta", "theta_dot")
BASES = ("clamped-free", "slewing", "hub-matched", "arm-matched")
SAMPLES, REPEATED = 1000, 5


@dataclass(frozen=True, eq=False)
class GapCase:
    """A design model, a truth, a controller, and the units of the rigid arm's swing."""

    model: LinearSystem
    truth: LinearSystem
    controller: Controller
    units: dict[str, list[float]]


def cases(seed: int, modes: int | None = None) -> Iterator[GapCase]:
    """Yield random arms with designs on a few functions of a basis."""
    rng = np.random.default_rng(seed)
    while True:
        arm = Arm(arms.paper_beam().beam, Hub(10 ** rng.uniform(-1.5, 0.5)),
                  damping_ratio=10 ** rng.uniform(-3, -1.7))  # fmt: skip
        bandwidth = 10 ** rng.uniform(-1.3, -0.2)
        objective = objective_of(arm, bandwidth, SENSORS)
        model = assemble(arm, create(str(rng.choice(BASES)), int(rng.integers(1, 7))))
        plant = generalised_plant(model, objective)
        true = generalised_plant(truth(arm, modes or int(rng.integers(8, 30))), objective)
        omega = omega_of(arm, bandwidth)
        units = {
            "output_scale": list(reading_units(arm, omega, SENSORS).values()),
            "input_scale": [total_inertia(arm) * omega**2],
        }
        try:
            yield GapCase(fresh(plant.path), fresh(true.path), lqg(plant), units)
        except SlewctlError:
            continue


def fresh(system: LinearSystem) -> LinearSystem:
    """Return a copy of which nothing is remembered."""
    names = {"inputs": list(system.input_labels), "outputs": list(system.output_labels)}
    return LinearSystem(*system.matrices, system.dt, **names)


def by_riccati(case: GapCase) -> tuple[float, float]:
    """Return the gap and the margin from Riccati equations, level sets and eigenvalues."""
    units = signal_units(case.model, **case.units)
    p = case.model.noutputs
    one, two = (
        realisation(fresh(system), "plant").scaled(1 / units[:p], units[p:]).balanced
        for system in (case.model, case.truth)
    )
    right = right_graph(one)
    distance = left_graph(two).after(right).peak().value
    gap = distance if winding(right_graph(two), right) else 1.0
    pair = paired(case.model, case.controller)
    closed = realisation(pair.plant, "plant").closed(realisation(pair.positive, "controller"))
    margin = 1 / closed.scaled(1 / units, units).peak().value if closed.stable else 0.0
    return gap, margin


def by_intervals(case: GapCase) -> tuple[float, float]:
    """Return the gap and the margin that are proved."""
    gap = nu_gap(fresh(case.model), fresh(case.truth), **case.units)
    model = fresh(case.model)
    return gap.value, ncf_margin(model, replace(case.controller), **case.units).value


def by_samples(case: GapCase) -> tuple[float, float]:
    """Return the distance and the margin over a thousand frequencies."""
    units = signal_units(case.model, **case.units)
    scale = units[-1] / units[:-1]
    poles = np.abs(np.linalg.eigvals(case.truth.A))
    slow, fast = poles[poles > 1e-6 * poles.max()].min(), poles.max()
    omega = np.geomspace(slow / 100, 10 * fast, SAMPLES)
    A, B, C = (
        FrequencyResponse(system)(omega).reshape(SAMPLES, -1)
        for system in (case.model, case.truth, case.controller.linear)
    )
    A, B, C = A * scale, B * scale, C / scale
    lengths = [np.sqrt(1 + (np.abs(x) ** 2).sum(1)) for x in (A, B, C)]
    i, j = np.triu_indices(A.shape[1], 1)
    apart = (np.abs(A - B) ** 2).sum(1) + (np.abs(A[:, i] * B[:, j] - A[:, j] * B[:, i]) ** 2).sum(
        1
    )
    distance = np.sqrt(apart) / (lengths[0] * lengths[1])
    kept = np.abs(1 - (A * C).sum(1)) / (lengths[0] * lengths[2])
    return float(distance.max()), float(kept.min())


def spent(what: Callable[[], object]) -> float:
    """Return the CPU seconds of a call."""
    start = time.process_time()
    what()
    return time.process_time() - start


def main() -> None:
    """Print what was measured."""
    count, *modes = [int(argument) for argument in sys.argv[1:]] or [120, 10, 20, 40]
    off, wide, differs = [], 0, 0.0
    for _, case in zip(range(count), cases(1), strict=False):
        gap = nu_gap(case.model, case.truth, **case.units)
        margin = ncf_margin(case.model, case.controller, **case.units)
        distance, kept = by_samples(case)
        off.append((1 - distance / gap.largest_distance, kept / margin.value - 1,
                    gap.largest_distance - distance, kept - margin.value))  # fmt: skip
        wide += bool(gap.doubt) + bool(margin.doubt)
        riccati = by_riccati(case)
        differs = max(differs, abs(riccati[0] - gap.value), abs(riccati[1] - margin.value))
    if off:
        for k, name in enumerate(("gap", "margin")):
            part, size = np.array(off)[:, k], np.array(off)[:, k + 2]
            print(f"{name}: {SAMPLES} frequencies miss the extreme by more than 1 % in "
                  f"{int(np.sum(part > 0.01))} of {count} cases, by more than 1e-6 in "
                  f"{int(np.sum(size > 1e-6))}, by {size.max():.3g} at most")  # fmt: skip
        print(f"wider than 1e-9: {wide}; Riccati equations differ by {differs:.1e} at most")
    for number in modes:
        found = [case for _, case in zip(range(REPEATED), cases(2, number), strict=False)]
        by_intervals(found[0])
        ours, riccati = (
            np.median([spent(lambda case=case, way=way: way(case)) for case in found])
            for way in (by_intervals, by_riccati)
        )
        print(f"{number} modes: gap and b by intervals {1e3 * ours:.1f} ms, by Riccati equations "
              f"{1e3 * riccati:.1f} ms, ratio {riccati / ours:.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
