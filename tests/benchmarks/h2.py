"""H2 by matrix inequalities against Riccati equations: accuracy, time and iterations by n.

Run as ``python tests/benchmarks/h2.py``.  Build + solve is given as a multiple of the
solver's own time, which is what modelling costs; Riccati's time stands beside it.
"""

from __future__ import annotations

import time
from dataclasses import replace

from slewctl import ClampedFree, Hub, Objective, Slewing, arms, assemble, generalised_plant, lqg
from slewctl.design import build_h2, solve_h2

OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2}
)


def main() -> None:
    """Print a line for each basis, hub and number of functions."""
    print(
        f"{'basis':14}{'hub':>6}{'n':>4}{'gap':>10}{'iterations':>12}{'s':>8}{'/ solver':>10}{'/ Riccati':>11}"
    )
    for hub in (0.0, 0.2, 20.0):
        arm = replace(arms.paper_beam(), hub=Hub(hub), damping_ratio=0.005)
        for basis in (ClampedFree, Slewing):
            for n in (1, 2, 4, 8, 14, 20):
                plant = generalised_plant(assemble(arm, basis(n)), OBJECTIVE)
                start = time.perf_counter()
                reference = lqg(plant)
                riccati = time.perf_counter() - start
                start = time.perf_counter()
                problem = build_h2(plant)
                controller = solve_h2(problem)
                spent = time.perf_counter() - start
                stats = [p.problem.solver_stats for p in (problem.regulator, problem.filter)]
                iterations = "+".join(str(s.num_iters) for s in stats)
                gap = controller.h2_cost / reference.h2_cost - 1
                print(
                    f"{basis.name:14}{hub:6g}{n:4}{gap:10.1e}{iterations:>12}{spent:8.2f}"
                    f"{spent / sum(s.solve_time for s in stats):10.2f}{spent / riccati:11.0f}"
                )


if __name__ == "__main__":
    main()
