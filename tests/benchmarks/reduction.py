"""Is a good basis before modelling as good as a balanced truncation of the truth after it?

Run as ``python tests/benchmarks/reduction.py``: the tapered beam over hub inertias, payloads,
two sets of sensors and two bandwidths, designs of 1, 2 and 4 flexible modes by LQG, each
judged on the truth.  A model counts as being as good as balanced truncation where both are
unstable, or where it is stable and its loss is at most 1.1 times the other's, or at most
0.01 % (a second count: 1 %) of the optimal cost above it.
"""

from __future__ import annotations

import itertools
import time

import numpy as np

from slewctl import Arm, Beam, Hub, Objective, Payload, Polynomial, arms, assemble, truth
from slewctl.compare import Case, ReductionRow, Reductions, compare_reductions

HUBS = (0.01, 0.1, 1.0, 10.0)
PAYLOADS = (0.0, 0.1, 1.0)
ORDERS = (1, 2, 4)
SENSORS: dict[str, tuple[str, ...]] = {"angle and rate": ("theta", "theta_dot"), "tip": ("tip",)}
# Largest acceptable tip movement over the beam's length: the smaller, the faster the loop.
SPEEDS = {"gentle": 0.3, "fast": 0.03}
DAMPING = 0.005


def arm_of(hub: float, payload: float) -> Arm:
    """Return the tapered beam with hub inertia and payload mass relative to the beam's."""
    beam: Beam = arms.paper_beam().beam
    bare = assemble(Arm(beam), Polynomial(1)).mass[0, 0]
    mass = 1 - 5 / 24  # ∫ m̄ dx
    return Arm(beam, Hub(hub * bare), Payload(payload * mass), damping_ratio=DAMPING)


def objective_of(arm: Arm, sensors: tuple[str, ...], tip: float) -> Objective:
    """Return limits and noises of the arm's own size and speed."""
    omega = truth(arm, 1).omega[0]
    torque = 0.1 * assemble(arm, Polynomial(1)).mass[0, 0] * omega**2
    noise = {"theta": 3e-3, "tip": 3e-3 * arm.beam.length, "theta_dot": 1e-2 * omega}
    return Objective(
        {"tip": tip * arm.beam.length, "torque": torque},
        {"torque": 0.1 * torque / np.sqrt(omega)}
        | {name: noise[name] / np.sqrt(omega) for name in sensors},
    )


def as_good(row: ReductionRow, other: ReductionRow, slack: float) -> bool:
    """Return whether a design is as good as another (see the module's docstring)."""
    if row.loss is None or other.loss is None:
        return other.loss is None
    return row.loss <= max(1.1 * other.loss, other.loss + slack)


def shown(row: ReductionRow) -> str:
    """Return the loss in percent, or that the loop is unstable or there is no design."""
    if row.refused:
        return "refused"
    return "unstable" if row.loss is None else f"{100 * row.loss:.3g}"


def main() -> None:
    """Print the losses in percent case by case, then how often each model is as good."""
    start = time.perf_counter()
    found: dict[int, list[Reductions]] = {order: [] for order in ORDERS}
    titles: tuple[str, ...] = ()
    for sensors, speed in itertools.product(SENSORS, SPEEDS):
        for hub, payload in itertools.product(HUBS, PAYLOADS):
            arm = arm_of(hub, payload)
            case = Case("case", arm, objective_of(arm, SENSORS[sensors], SPEEDS[speed]))
            for order in ORDERS:
                result = compare_reductions(case, order)
                found[order].append(result)
                if not titles:
                    titles = tuple(row.name for row in result.rows)
                    print(f"{'sensors':16}{'loop':8}{'hub':>6}{'load':>6}{'n':>3}  " + "".join(
                        f"{name.replace('truncation', 'tr')[:19]:>20}" for name in titles))  # fmt: skip
                print(
                    f"{sensors:16}{speed:8}{hub:6g}{payload:6g}{order:3}  "
                    + "".join(f"{shown(row):>20}" for row in result.rows),
                    flush=True,
                )
    print(
        "\nstable | as good as balanced truncation to 0.01 %, to 1 % | median loss in % where all are stable"
    )
    for order, results in found.items():
        print(f"n = {order}, {len(results)} cases")
        both = [r for r in results if all(row.stable for row in r.rows if row.name != "slewing")]
        for name in titles:
            stable = sum(r[name].stable for r in results)
            close, near = (
                sum(as_good(r[name], r["balanced-truncation"], slack) for r in results)
                for slack in (1e-4, 1e-2)
            )
            losses = [r[name].loss for r in both]
            known = [loss for loss in losses if loss is not None]
            median = (
                100 * float(np.median(known)) if len(known) == len(losses) and known else np.nan
            )
            print(f"  {name:38}{stable:4}{close:6}{near:6}{median:12.3g}")
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
