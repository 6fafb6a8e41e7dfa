"""H2 by matrix inequalities against Riccati equations: accuracy, time and iterations by n.

Run as ``python tests/benchmarks/h2.py``: every catalogue arm, three bases, output feedback
from hub angle and rate.  The gap is J/J_Riccati − 1 with both costs recomputed from Lyapunov
equations; build + solve is given as a multiple of the solver's own time, which is what
modelling costs, and of Riccati's time: on plain H2 the inequalities never win.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from slewctl import Arm, Objective, Polynomial, arms, assemble, generalised_plant, lqg, truth
from slewctl.basis import create
from slewctl.design import build_h2, solve_h2


def objective_for(arm: Arm) -> Objective:
    """Return limits and noises of the arm's own size and speed."""
    omega = truth(arm, 1).omega[0]
    torque = 0.1 * assemble(arm, Polynomial(1)).mass[0, 0] * omega**2
    return Objective(
        {"tip": 0.1 * arm.beam.length, "torque": torque},
        {
            "torque": 0.1 * torque / np.sqrt(omega),
            "theta": 3e-3 / np.sqrt(omega),
            "theta_dot": 1e-2 * np.sqrt(omega),
        },
    )


def main() -> None:
    """Print a line for each arm, basis and number of functions."""
    print(
        f"{'arm':23}{'basis':14}{'n':>3}{'gap':>9}{'verified':>10}{'iterations':>12}"
        f"{'s':>7}{'/ solver':>10}{'/ Riccati':>11}"
    )
    for name in arms.names():
        arm = replace(arms.get(name), damping_ratio=0.005, motor=None)
        objective = objective_for(arm)
        for basis in ("clamped-free", "slewing", "hub-matched"):
            for n in (1, 2, 4, 8, 14, 20):
                plant = generalised_plant(assemble(arm, create(basis, n, arm)), objective)
                start = time.perf_counter()
                reference = lqg(plant)
                riccati = time.perf_counter() - start
                start = time.perf_counter()
                problem = build_h2(plant)
                controller = solve_h2(problem)
                spent = time.perf_counter() - start
                stats = [p.problem.solver_stats for p in (problem.regulator, problem.filter)]
                gap = abs(controller.h2_cost / reference.h2_cost - 1)
                print(
                    f"{name:23}{basis:14}{n:3}{gap:9.0e}{controller.certificate.verified!s:>10}"
                    f"{'+'.join(str(s.num_iters) for s in stats):>12}{spent:7.2f}"
                    f"{spent / sum(s.solve_time for s in stats):10.2f}{spent / riccati:11.0f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
