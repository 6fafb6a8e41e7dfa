"""Designs under constraints by number of functions: verified or not, cost, bound and time.

Run as ``python tests/benchmarks/constrained.py``: a uniform arm with a hub, clamped-free
functions.  J/J* is the cost achieved over the optimum without the constraint, the bound what
the matrix inequalities promise of it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Controller,
    GeneralisedPlant,
    Hub,
    Objective,
    SlewctlError,
    assemble,
    generalised_plant,
    lqg,
)
from slewctl.design.lmi.h2_hinf import h2_hinf
from slewctl.design.lmi.h2_region import h2_region
from slewctl.design.lmi.payload import payload_lmi
from slewctl.design.lmi.variance_bound import variance_bound

OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.6}, {"torque": 0.07, "theta": 1.3e-3, "theta_dot": 0.022}
)
FREE = {"observer_decay_rate_min": 0.0, "observer_damping_ratio_min": 0.0,
        "observer_radius_max": 1e4}  # fmt: skip


def designs(plant: GeneralisedPlant) -> dict[str, Callable[[], Controller]]:
    """Return the designs by name; speeds are those of the plant's first and last mode."""
    assert plant.model is not None
    first, last = plant.model.omega[0], plant.model.omega[-1]
    corner = 2 * first / (2 * math.pi)
    loose = h2_hinf(plant, hinf_max=1e9, weight_hz=corner).guarantees[0].achieved
    torque = variance_bound(plant, std_max={"torque": 1e9}).guarantees[0].achieved
    return {
        "decay rate": lambda: h2_region(plant, decay_rate_min=0.03 * first),
        "regulator: decay rate": lambda: h2_region(plant, decay_rate_min=0.1 * first, **FREE),
        "regulator: damping 0.02": lambda: h2_region(plant, damping_ratio_min=0.02, **FREE),
        "regulator: all three": lambda: h2_region(
            plant, decay_rate_min=0.05 * first, damping_ratio_min=0.02, radius_max=1.3 * last,
            **FREE),
        "gain x 0.7": lambda: h2_hinf(plant, hinf_max=0.7 * loose, weight_hz=corner),
        "gain x 0.3": lambda: h2_hinf(plant, hinf_max=0.3 * loose, weight_hz=corner),
        "payload 0 to 0.1 kg": lambda: payload_lmi(plant, payload_mass=[0.0, 0.1]),
        "payload, EI 0.9 to 1.1": lambda: payload_lmi(
            plant, payload_mass=[0.0, 0.1], stiffness=[0.9, 1.1]),
        "torque deviation x 0.7": lambda: variance_bound(plant, std_max={"torque": 0.7 * torque}),
        "the same, least tip": lambda: variance_bound(
            plant, std_max={"torque": 0.7 * torque}, minimise="tip"),
    }  # fmt: skip


def main() -> None:
    """Print a line for each design and number of functions."""
    print(f"{'design':26}{'n':>3}{'verified':>10}{'J/J*':>11}{'bound':>11}{'s':>8}{'solver s':>10}")
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3), damping_ratio=0.005)
    for n in (1, 2, 4, 6, 8):
        plant = generalised_plant(assemble(arm, ClampedFree(n)), OBJECTIVE)
        best = lqg(plant).h2_cost
        for name, design in designs(plant).items():
            start = time.perf_counter()
            try:
                found = design()
            except SlewctlError as error:
                print(f"{name:26}{n:3}  {error}", flush=True)
                continue
            spent = time.perf_counter() - start
            bounds = [g.bound / best for g in found.guarantees if g.name == "H2 cost"]
            bound = f"{bounds[0]:11.4g}" if bounds else f"{'':11}"
            print(
                f"{name:26}{n:3}{found.certificate.verified!s:>10}{found.h2_cost / best:11.5g}"
                f"{bound}{spent:8.2f}{found.seconds.get('solve', 0.0):10.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
