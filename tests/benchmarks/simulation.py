"""Measure slews as they happen: against real time, and against python-control.

Run as ``python tests/benchmarks/simulation.py``, with OMP_NUM_THREADS=1 for one core.  Times
are those of the processor, without what is made once for a loop.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np

import slewctl as sc
from slewctl.design.anti_windup import anti_windup
from slewctl.loop.motion.slew_inputs import told

LIMIT, SPAN = 0.25, 10.0
ARM = replace(
    sc.arms.paper_beam(), hub=sc.Hub(0.2, friction=0.02), damping_ratio=0.01,
    actuator=sc.Actuator(torque_limit=LIMIT),
)  # fmt: skip
PROBLEM = sc.Problem(
    ARM, {"tip": 0.03, "torque": 1.0}, {"torque": 0.01, "theta": 0.001}, truth_modes=10
)
SLEW = sc.Slew(30.0, 2.0, SPAN)
CONDITIONS = {
    "linear, limited": {"saturate": True},
    "with encoder, jitter, misses, noise": {
        "saturate": True, "encoder_counts": 4096, "jitter": 2e-4, "missed": 0.01, "noise": True,
    },
    "with dry friction": {"saturate": True, "coulomb_friction": 0.02},
    "nonlinear": {"nonlinear": True},
    "nonlinear, limited, friction, encoder": {
        "nonlinear": True, "saturate": True, "coulomb_friction": 0.02, "encoder_counts": 4096,
    },
}  # fmt: skip


def timed(action: Callable[[], object], times: int = 3) -> tuple[float, object]:
    """Return the shortest processor time in seconds and the result."""
    spent = []
    for _ in range(times):
        start = time.process_time()
        found = action()
        spent.append(time.process_time() - start)
    return min(spent), found


def by_control(loop: sc.Loop, t: np.ndarray, rtol: float) -> np.ndarray:
    """Tip of the nonlinear arm under a limited continuous law, by python-control."""
    plant = sc.nonlinear_system(loop.model, ("theta", "tip"))
    A, B, C, D = loop.controller.linear.matrices
    entry, inputs, n = anti_windup(loop.controller)[0], told(loop), plant.nstates

    def law(time: float, x: np.ndarray) -> tuple[float, float, np.ndarray]:
        wanted = inputs @ np.array(SLEW.reference(np.array([time])))[:, 0]
        error = plant.output(time, x[:n], [0.0])[:1] - wanted[:-1]
        asked = float((C @ x[n:] + D @ error)[0] + wanted[-1])
        return asked, float(np.clip(asked, -LIMIT, LIMIT)), error

    def update(time, x, u, params):  # type: ignore[no-untyped-def]
        asked, held, error = law(time, x)
        moved = plant.dynamics(time, x[:n], [held])
        return np.concatenate([moved, A @ x[n:] + B @ error + entry * (held - asked)])

    closed = control.nlsys(
        update, lambda time, x, u, params: plant.output(time, x[:n], [0.0])[1:],
        inputs=0, outputs=1, states=n + len(A),
    )  # fmt: skip
    options = {"rtol": rtol, "atol": 1e-3 * rtol}
    return control.input_output_response(
        closed, t, solve_ivp_method="LSODA", solve_ivp_kwargs=options
    ).outputs


def main() -> None:
    """Print the measurements."""
    K = sc.lqg(PROBLEM.plant("clamped-free", n=2), sample_time=0.001)
    loop = sc.close(PROBLEM.truth, PROBLEM.objective, K)
    assert loop.stable
    print(f"10 modes, a clock of 1 kHz, {SPAN:g} s:")
    for name, met in CONDITIONS.items():
        slew = replace(SLEW, conditions=sc.Conditions(**met))
        spent, _ = timed(lambda slew=slew: sc.simulate(loop, slew))
        print(f"  {name:40s} {1e3 * spent:6.0f} ms, {SPAN / spent:6.1f} × real time")

    problem = replace(PROBLEM, truth_modes=3)
    K = sc.lqg(problem.plant("clamped-free", n=2))
    loop = sc.close(problem.truth, problem.objective, K)
    assert loop.stable
    slew = replace(SLEW, conditions=sc.Conditions(nonlinear=True, saturate=True))
    print("3 modes, a continuous law, nonlinear and limited:")
    spent, found = timed(lambda: sc.simulate(loop, slew, step=0.002))
    exact = sc.simulate(loop, slew, step=0.00025).tip[:: round(0.002 / 0.00025)]
    for rtol in (1e-6, 1e-9):
        took, tip = timed(lambda rtol=rtol: by_control(loop, found.t[::20], rtol), 1)
        error = np.abs(tip - exact[::20]).max() / np.abs(exact).max()
        print(f"  control.input_output_response, rtol {rtol:g}: {took:6.2f} s, error {error:.0e}")
    error = np.abs(found.tip - exact).max() / np.abs(exact).max()
    print(f"  simulate, steps of 2 ms: {spent:6.2f} s, error {error:.0e}")


if __name__ == "__main__":
    main()
