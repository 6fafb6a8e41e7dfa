"""H2 by matrix inequalities against Riccati equations: accuracy, time and iterations.

Run as ``python tests/benchmarks/h2.py [separated] [joint] [growth] [raw]``, all four without
arguments; ``--orders 1,2,4`` limits n.  Output feedback from hub angle and rate, on every
catalogue arm and three bases.  Gaps are J/J_Riccati − 1 with both costs recomputed from
Lyapunov equations in modal coordinates.  Build + solve is given in seconds, as a multiple of
the solver's own time, which is what modelling costs, and of Riccati's time: on plain H2 the
inequalities never win.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slewctl import (
    AccuracyError,
    Arm,
    GeneralisedPlant,
    Hub,
    Objective,
    Polynomial,
    arms,
    assemble,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.basis import create
from slewctl.design.lmi.h2_gains import build_state_feedback, solve_state_feedback
from slewctl.design.lmi.h2_joint import build_h2_joint, solve_h2_joint
from slewctl.design.lmi.h2_lmi import build_h2, solve_h2
from slewctl.design.result import Controller
from slewctl.paper.conditioning import conditioning

BASES = ("clamped-free", "slewing", "hub-matched")
ORDERS = (1, 2, 4, 8, 14, 20)
JOINT_ORDERS = (1, 2, 4, 8)


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


@dataclass(frozen=True)
class Line:
    """One solved problem."""

    gap: float
    verified: bool
    iterations: tuple[int, ...]
    seconds: float
    solver_seconds: float

    def __str__(self) -> str:
        return (
            f"{self.gap:9.0e}{'' if self.verified else ' (!)':4}"
            f"{'+'.join(map(str, self.iterations)):>7}{self.seconds:7.2f}"
            f"{self.seconds / self.solver_seconds:7.2f}"
        )


def timed_lqg(plant: GeneralisedPlant) -> tuple[Controller, float]:
    """Return the Riccati design and its time in seconds."""
    start = time.perf_counter()
    return lqg(plant), time.perf_counter() - start


def state_feedback(plant: GeneralisedPlant) -> Line:
    """Solve the state feedback alone."""
    problem = build_state_feedback(plant)
    found = solve_state_feedback(problem)
    spent = found.seconds["build"] + found.seconds["solve"]
    verified = found.certificate.verified
    return Line(abs(found.gap), verified, (found.iterations,), spent, found.seconds["solver"])


def output_feedback(plant: GeneralisedPlant, formulation: str, optimum: float) -> Line:
    """Solve the output feedback by one formulation."""
    if formulation == "separated":
        problem = build_h2(plant)
        found, problems = solve_h2(problem), (problem.regulator.problem, problem.filter.problem)
    else:
        joint = build_h2_joint(plant)
        found, problems = solve_h2_joint(joint), (joint.problem,)
    return Line(
        abs(found.h2_cost / optimum - 1),
        found.certificate.verified,
        tuple(p.solver_stats.num_iters for p in problems),
        found.seconds["build"] + found.seconds["solve"],
        found.seconds["solver"],
    )


def plants(orders: Sequence[int]) -> Iterable[tuple[str, str, int, str, GeneralisedPlant]]:
    """Yield arm, basis, n, coordinates and plant."""
    for name in arms.names():
        arm = replace(arms.get(name), damping_ratio=0.005, motor=None)
        objective = objective_for(arm)
        for basis in BASES:
            for n in orders:
                model = assemble(arm, create(basis, n))
                for coordinates in ("modal", "physical"):
                    plant = generalised_plant(model, objective, coordinates=coordinates)
                    yield name, basis, n, coordinates, plant


def accuracy(formulation: str, orders: Sequence[int]) -> None:
    """Print a line for each arm, basis, order and coordinates, and the worst by order."""
    print(
        f"\n{formulation} (gap, (!) if unverified, iterations, s, over the solver's own time)\n"
        f"{'arm':23}{'basis':14}{'n':>3} {'coordinates':12}"
        f"{'state feedback':>34}{'output feedback':>34}{'/ Riccati':>11}"
    )
    worst: dict[int, list[tuple[Line, Line]]] = {n: [] for n in orders}
    reference, riccati = None, np.nan
    for name, basis, n, coordinates, plant in plants(orders):
        if coordinates == "modal":  # the raw ones get the same reference
            reference, riccati = timed_lqg(plant)
        try:
            first = state_feedback(plant)
            second = output_feedback(plant, formulation, reference.h2_cost)
        except AccuracyError as error:
            print(f"{name:23}{basis:14}{n:3} {coordinates:12}  {error}", flush=True)
            continue
        worst[n].append((first, second))
        print(
            f"{name:23}{basis:14}{n:3} {coordinates:12}{first!s:>34}{second!s:>34}"
            f"{second.seconds / riccati:11.0f}",
            flush=True,
        )
    print("over all arms, bases and coordinates")
    for n, lines in worst.items():
        for k, what in enumerate(("state feedback", "output feedback")):
            found = [pair[k] for pair in lines]
            ratio = np.median([x.seconds / x.solver_seconds for x in found])
            print(
                f"n = {n:2} {what:16} gap at most {max(x.gap for x in found):.0e}, iterations "
                f"{np.mean([max(x.iterations) for x in found]):.0f} "
                f"(at most {max(max(x.iterations) for x in found)}), "
                f"{np.median([x.seconds for x in found]):.2f} s, {ratio:.2f} times the solver "
                f"(medians), {sum(not x.verified for x in found)} of {len(found)} unverified"
            )


def growth(orders: Sequence[int] = (5, 8, 12, 16, 20, 26, 35)) -> None:
    """Print time by number of states for the paper's beam, and its exponent."""
    print("\ntime of one iteration, paper's beam with a hub, clamped-free")
    arm = replace(arms.paper_beam(), hub=Hub(0.2), damping_ratio=0.005)
    objective = objective_for(arm)
    states, per_iteration = [], []
    for n in orders:
        plant = generalised_plant(assemble(arm, create("clamped-free", n)), objective)
        reference, riccati = timed_lqg(plant)
        line = output_feedback(plant, "separated", reference.h2_cost)
        states.append(len(plant.A))
        per_iteration.append(line.solver_seconds / sum(line.iterations))
        print(f"{states[-1]:3} states{line}  {1e3 * per_iteration[-1]:8.2f} ms per iteration, "
              f"Riccati {1e3 * riccati:.0f} ms", flush=True)  # fmt: skip
    exponent = np.polyfit(np.log(states), np.log(per_iteration), 1)[0]
    print(f"an iteration takes time like (states)^{exponent:.1f}")


def raw() -> None:
    """Print the textbook inequality in raw coordinates, and the same with scaling."""
    print("\ntextbook inequality in raw coordinates")
    for point in conditioning().points:
        print(point, flush=True)


def main() -> None:
    """Print the tables that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", default=["separated", "joint", "growth", "raw"])
    parser.add_argument("--orders", type=lambda text: [int(n) for n in text.split(",")])
    given = parser.parse_args()
    for table in given.tables:
        if table in ("separated", "joint"):
            accuracy(table, given.orders or (ORDERS if table == "separated" else JOINT_ORDERS))
        elif table == "growth":
            growth()
        elif table == "raw":
            raw()
        else:
            parser.error(f"unknown table {table}")


if __name__ == "__main__":
    main()
