"""A study: its speed and numbers against a loop over python-control, and its memory.

Run as ``python tests/benchmarks/study.py [cases]`` with OMP_NUM_THREADS=1 for a random sample
of 300 cases and the memory, or with ``--whole`` for 10,000 cases on two cores.  The peer is
what one writes with python-control and scipy alone: lqr and lqe, the loop on the truth and on
twice the modes, margins, H2 norm and a slew.  Both get the matrices from slewctl's models and
keep them for each setting.  The peer's margins are once those of its state space, as the
manual has it, and once those of a thousand frequencies.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import lru_cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import control
import numpy as np
from threadpoolctl import threadpool_limits

from slewctl import Arm, GeneralisedPlant, Model, arms, assemble, generalised_plant, truth
from slewctl.basis import create
from slewctl.compare import (
    Grid,
    Piece,
    Point,
    Setting,
    Study,
    Work,
    dask_cluster,
    evaluate_point,
    run_study,
)
from slewctl.compare.study.grid import arm_of, objective_of, slew_of
from slewctl.compare.study.results_file import rows
from slewctl.compare.study.sweep import Groups, sweep
from slewctl.plant import state_space

ARM, TRUTH_MODES = arms.paper_beam(), 20
HUBS, PAYLOADS = (0.0, 0.03, 0.3, 1.0, 10.0), (0.0, 1.0)
BASES = ("clamped-free", "slewing", "hub-matched", "arm-matched")
SAMPLED = Grid(BASES, hub_ratios=HUBS, payload_ratios=PAYLOADS, bandwidths=(0.1, 0.3))
# 4 bases × 5 orders at 500 settings.
WHOLE = Grid(
    BASES,
    orders=(1, 2, 4, 6, 8),
    hub_ratios=(0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0),
    payload_ratios=(0.0, 0.1, 0.3, 1.0, 3.0),
    damping_ratios=(0.002, 0.01),
    bandwidths=(0.05, 0.1, 0.2, 0.3, 0.5),
)
FREQUENCIES, TIMES = 1000, 801
# Numbers that differ by less agree, and losses by less than this part of the optimal cost.
NEAR, LEAST_LOSS = 0.01, 1e-6
MORE_IS_BETTER = ("gain_margin_db", "phase_margin_deg", "disk_margin")
LESS_IS_BETTER = ("h2_loss", "settling_time", "torque_peak")
Row = dict[str, Any]
Margins = Callable[[control.StateSpace, np.ndarray], Row]


def by_state_space(what: object, omega: np.ndarray) -> Row:
    """Return the classical margins as the manual has it."""
    gain, phase = control.stability_margins(what)[:2]
    return {"gain_margin_db": abs(20 * np.log10(gain)), "phase_margin_deg": abs(phase)}


def by_frequencies(loop: control.StateSpace, omega: np.ndarray) -> Row:
    """Return the same from a frequency response, interpolated between its points."""
    return by_state_space(control.frd(loop, omega, smooth=True), omega)


class Place:
    """What the peer's cases at one setting share."""

    def __init__(self, setting: Setting) -> None:
        self.arm = arm_of(ARM, setting)
        self.objective = objective_of(self.arm, setting.bandwidth, setting.sensors)
        model = truth(self.arm, TRUTH_MODES)
        self.plant = generalised_plant(model, self.objective)
        self.finer = generalised_plant(truth(self.arm, 2 * TRUTH_MODES), self.objective)
        self.optimum = gains(self.plant)[2]
        self.drift = gains(self.finer)[2] / self.optimum - 1
        self.period = 2 * np.pi / model.omega[0]
        self.omega = np.geomspace(model.omega[0] / 100, 10 * model.omega[-1], FREQUENCIES)
        self.slew = slew_of(self.arm, setting.bandwidth)
        self.inertia, self.drag = model.mass[0, 0], model.damping[0, 0]
        # From the sensors' references, the feedforward and the controller's torque to the tip,
        # the whole torque and what the controller reads.
        G = state_space(model, ("tip", *setting.sensors), coordinates="modal")
        ny = len(setting.sensors)
        D = np.zeros((2 + ny, ny + 2))
        D[1, ny:], D[2:, :ny] = 1.0, -np.eye(ny)
        B = np.hstack([np.zeros((G.nstates, ny)), G.B, G.B])
        C = np.vstack([G.C[:1], np.zeros((1, G.nstates)), G.C[1:]])
        self.tracking = control.ss(G.A, B, C, D)


place_of = lru_cache(maxsize=8)(Place)


@lru_cache(maxsize=64)
def design_model(arm: Arm, basis: str, n: int) -> Model:
    """Return the model of n functions, kept as slewctl's study keeps it."""
    return assemble(arm, create(basis, n))


def gains(plant: GeneralisedPlant) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the gains of regulator and filter and the optimal cost."""
    B1, R = plant.B1[:, :1], plant.D12.T @ plant.D12
    K, X, _ = control.lqr(plant.A, plant.B2, plant.C1.T @ plant.C1, R)
    L, Y, _ = control.lqe(plant.A, B1, plant.C2, np.eye(1), plant.D21 @ plant.D21.T)
    return K, L, float(np.trace(B1.T @ X @ B1) + np.trace(R @ K @ Y @ K.T))


def controller_of(point: Point) -> control.StateSpace:
    """Return the peer's LQG controller, for positive feedback."""
    place = place_of(point.setting)
    plant = generalised_plant(design_model(place.arm, point.basis, point.n), place.objective)
    K, L, _ = gains(plant)
    return control.ss(plant.A - plant.B2 @ K - L @ plant.C2, L, -K, np.zeros((1, len(plant.C2))))


def peer(point: Point, margins: Margins) -> Row:
    """Return the row of a case with python-control; a number that it failed to give is missing."""
    row: Row = {"stable": False, "stable_on_twice": False, "crashed": []}
    part = "design"
    try:
        place, K = place_of(point.setting), controller_of(point)
        closed, finer = place.plant.system.lft(K), place.finer.system.lft(K)
        row["stable"], row["stable_on_twice"] = (
            bool(loop.poles().real.max() < 0) for loop in (closed, finer)
        )
        loop = -K * place.plant.control_path
        parts: dict[str, Callable[[], Row]] = {
            "norm": lambda: {"h2_loss": control.norm(closed, 2) ** 2 / place.optimum - 1},
            "forced_response": lambda: slewed(place, K),
            "disk_margins": lambda: {"disk_margin": control.disk_margins(loop, place.omega)[0]},
            "stability_margins": lambda: margins(loop, place.omega),
        }
        for part in parts if row["stable"] else ():  # an unstable loop has no margins
            row |= parts[part]()
    except Exception as error:  # noqa: BLE001 - whatever a peer dies of is counted
        row["crashed"].append(f"{part}, {type(error).__name__}")
    return row


def slewed(place: Place, K: control.StateSpace) -> Row:
    """Return settling time and peak torque of the slew."""
    slew, turn = place.slew, np.radians(place.slew.angle_deg)
    t = np.linspace(0, slew.end, TIMES)
    angle, rate, acceleration = slew.reference(t)
    forward = place.inertia * acceleration + place.drag * rate
    tip, torque = control.forced_response(
        place.tracking.lft(K), t, np.array([angle, rate, forward])
    ).outputs
    travel = turn * (place.arm.hub.radius + place.arm.beam.length)
    outside = np.flatnonzero(np.abs(tip - travel) > 0.02 * travel)[-1]
    rigid = place.inertia * 10 / math.sqrt(3) * turn / slew.duration_s**2
    return {
        "settling_time": [*t[1:], math.inf][outside] / place.period,
        "torque_peak": np.abs(torque).max() / rigid,
    }


def own(point: Point) -> Row:
    """Return slewctl's row of a case, with verdicts named as the peer's."""
    row = dict(evaluate_point(Work(ARM, TRUTH_MODES, point))[0])
    return row | {"stable": row["outcome"] == "stable", "crashed": []}


def timed(case: Callable[[Point], Row], points: Sequence[Point]) -> tuple[list[Row], float]:
    """Return the rows of a plain loop and its CPU time in s, on one thread."""
    start = time.process_time()
    with warnings.catch_warnings(), np.errstate(all="ignore"), threadpool_limits(1):
        warnings.simplefilter("ignore")
        return [case(point) for point in points], time.process_time() - start


def alone(case: Callable[[Point], Row], points: Sequence[Point]) -> tuple[list[Row], float]:
    """Return the same from a new process, so that nobody finds another's truths in the cache."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(timed, case, points).result()


def right(point: Point, name: str, claim: float) -> bool:
    """Whether eigenvalues of the loop with changed gain or phase bear a margin out."""
    G, K = place_of(point.setting).plant.control_path, controller_of(point)
    gain = name == "gain_margin_db"
    size = claim if math.isfinite(claim) else 60.0 if gain else 180.0

    def stable(part: float) -> bool:
        """Whether the loop is with this part of the margin, of either sign, used up."""
        factor = 10 ** (part * size / 20) if gain else np.exp(1j * np.radians(part * size))
        whole = np.block([[G.A, factor * G.B @ K.C], [K.B @ G.C, K.A]])
        return bool(np.linalg.eigvals(whole).real.max() < 0)

    within = all(stable(part) for part in np.linspace(NEAR - 1, 1 - NEAR, 100))
    return within and (math.isinf(claim) or not (stable(1 + NEAR) and stable(-1 - NEAR)))


def verdict(point: Point, name: str, known: float, claim: float) -> tuple[str, ...]:
    """Return how the peer's number compares with slewctl's, and who is right about a margin."""
    if math.isnan(claim):
        return ("missing",)
    if math.isclose(claim, known, rel_tol=NEAR, abs_tol=LEAST_LOSS if name == "h2_loss" else 0.0):
        return ("agree",)
    kind = "optimistic" if (claim > known) == (name in MORE_IS_BETTER) else "pessimistic"
    if name not in ("gain_margin_db", "phase_margin_deg"):
        return (kind,)
    sides = {"slewctl right": known, "peer right": claim}
    return (kind, *(side for side, value in sides.items() if right(point, name, value)))


def against(points: Sequence[Point], ours: Sequence[Row], theirs: Sequence[Row]) -> None:
    """Print how often the peer's numbers agree."""
    made = [trio for trio in zip(points, ours, theirs, strict=True) if trio[1]["reason"] == ""]
    for name in ("stable", "stable_on_twice"):
        more = [int(b[name]) - int(a[name]) for _, a, b in made]
        print(f"    {name:17}{more.count(0):4} of {len(more)} agree, {more.count(1)} optimistic")
    both = [trio for trio in made if trio[1]["stable"] and trio[2]["stable"]]
    for name in MORE_IS_BETTER + LESS_IS_BETTER:
        count: Counter[str] = Counter(agree=0, optimistic=0)
        for point, a, b in both:
            count.update(verdict(point, name, a[name], b.get(name, math.nan)))
        told = ", ".join(f"{times} {word}" for word, times in count.items() if word != "agree")
        print(f"    {name:17}{count['agree']:4} of {len(both)} agree, {told}")
    for reason, times in Counter(reason for b in theirs for reason in b["crashed"]).items():
        print(f"    crashed in {times}: {reason}")


def sample(number: int) -> None:
    """Print speed and numbers over a random sample, in the order of a study."""
    everything = list(SAMPLED.points())
    chosen = np.sort(np.random.default_rng(1).permutation(len(everything))[:number])
    points = [everything[k] for k in chosen]
    ours, seconds = alone(own, points)
    print(f"{number} LQG cases, {sum(r['stable'] for r in ours)} stable, "
          f"{sum(r['outcome'] == 'no design' for r in ours)} without a design; the peer leaves out "
          "the ν-gap, b(P, C), the delay margin, the mode lost and every check\n"
          f"  slewctl: {number / seconds:.1f} cases per CPU second")  # fmt: skip
    for margins in (by_state_space, by_frequencies):
        theirs, spent = alone(partial(peer, margins=margins), points)
        print(f"  peer, margins {margins.__name__}: {number / spent:.1f} cases per CPU second; "
              f"slewctl has {spent / seconds:.2f} times its rate")  # fmt: skip
        against(points, ours, theirs)


def whole() -> None:
    """Print the time of a whole study on two cores."""
    study = Study("whole", "10,000 cases", ARM, (WHOLE,), TRUTH_MODES)
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        found = run_study(study, Path(folder) / "rows.jsonl", stamp={}, workers=2).rows
    minutes = (time.perf_counter() - start) / 60
    print(f"{len(found)} cases in {minutes:.1f} min on two cores: "
          f"{len(found) / minutes / 60:.1f} cases/s")  # fmt: skip


def trivial(number: int) -> list[Row]:
    """Return a row as large as that of a study."""
    return [{f"column_{k:02}": number / (k + 1) for k in range(31)}]


def waiting(seconds: float) -> list[Row]:
    """Do as a worker elsewhere does: take its time."""
    time.sleep(seconds)
    return [{"seconds": seconds}]


def busy(executor: Executor, slots: int, places: int = 200, points: int = 19) -> None:
    """Print which share of the time the slots of an executor work, point by point and by place."""
    seconds = np.random.default_rng(1).uniform(0.03, 0.09, (places, points))
    for groups in (None, Groups(places, points)):
        pieces = [
            Piece(f"{k:04}-{i:02}", float(seconds[k, i]), group=str(k))
            for k in range(places)
            for i in range(points)
        ]
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            sweep(waiting, pieces, Path(folder) / "rows.jsonl", stamp={}, executor=executor,
                  workers=slots, groups=groups)  # fmt: skip
        share = seconds.sum() / slots / (time.perf_counter() - start)
        print(f"{slots} slots, {places} places of {points} points, "
              f"{'by place' if groups else 'one by one'}: {share:.0%} busy")  # fmt: skip


def on_dask(processes: int) -> None:
    """Print the same of a cluster on this machine."""
    from distributed import LocalCluster

    with (
        LocalCluster(n_workers=processes, threads_per_worker=1, dashboard_address=None) as cluster,
        dask_cluster(cluster.scheduler_address) as executor,
    ):
        busy(executor, processes, places=20)


def peak() -> float:
    """Return the peak memory of this process in MB.

    Not by getrusage, whose figure a new process inherits from the one that started it.
    """
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def sweep_alone(number: int) -> None:
    """Print the growth of the peak by a sweep, and by reading its rows after it."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "rows.jsonl"
        before = peak()
        pieces = (Piece(f"{k:06}", k) for k in range(number))
        sweep(trivial, pieces, results, stamp={}, workers=2)
        swept = peak()
        assert len(rows(results)) == number
        print(f"  {number:7} pieces: sweep {swept - before:6.1f} MB, "
              f"with reading {peak() - before:6.1f} MB")  # fmt: skip


def main() -> None:
    """Print what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="?", type=int, default=300)
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--sweep", type=int, help="one line of the memory table, used by itself")
    parser.add_argument("--slots", type=int, help="how busy a simulated cluster is kept")
    parser.add_argument("--dask", type=int, help="the same of so many processes of Dask here")
    given = parser.parse_args()
    if given.slots:
        with ThreadPoolExecutor(given.slots) as threads:
            busy(threads, given.slots)
    elif given.dask:
        on_dask(given.dask)
    elif given.sweep:
        sweep_alone(given.sweep)
    elif given.whole:
        whole()
    else:
        sample(given.cases)
        print("growth of the parent's peak memory", flush=True)
        for number in (1_000, 10_000, 100_000):
            subprocess.run([sys.executable, __file__, "--sweep", str(number)], check=True)


if __name__ == "__main__":
    main()
