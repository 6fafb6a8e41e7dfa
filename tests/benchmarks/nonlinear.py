"""Measure the simulation of a large slew: against real time, and against python-control.

Run as ``python tests/benchmarks/nonlinear.py``, with OMP_NUM_THREADS=1 for one core.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import control
import numpy as np
from scipy.integrate import solve_ivp

from slewctl import Arm, Beam, ClampedFree, Hub, assemble, truth
from slewctl.loop.motion.large_slew import simulate_swing
from slewctl.model import Model
from slewctl.model.nonlinear import large_slew
from slewctl.plant.nonlinear import nonlinear_system

ARM = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3, 0.1, friction=0.02), damping_ratio=0.005)
SPAN = 10.0
T = np.linspace(0.0, SPAN, 601)


def torque(t: float) -> float:
    """Half a turn and more: to 2 rad/s and back, 9.5 rad in all."""
    return 0.5 * float(np.sin(2 * np.pi * t / SPAN))


def timed(action: Callable[[], np.ndarray], times: int) -> tuple[float, np.ndarray]:
    """Return the shortest wall-clock time in seconds and the tip's motion."""
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        found = action()
        spent.append(time.perf_counter() - start)
    return min(spent), found


def report(name: str, spent: float, found: np.ndarray, reference: np.ndarray) -> None:
    error = np.abs(found - reference).max() / np.abs(reference).max()
    print(f"  {name:46s} {1e3 * spent:7.0f} ms, {SPAN / spent:6.1f} × real time, error {error:.0e}")


def explicit(model: Model, method: str, rtol: float) -> np.ndarray:
    """Tip deflection by scipy on the physical equations."""
    equations = large_slew(model)
    found = solve_ivp(
        lambda t, y: equations.derivative(y, torque(t)), (0.0, SPAN), np.zeros(2 * (model.n + 1)),
        method=method, t_eval=T, rtol=rtol, atol=1e-3 * rtol,
    )  # fmt: skip
    return model.basis.evaluate(np.ones(1))[0] @ found.y[1 : model.n + 1]


def by_control(model: Model, rtol: float) -> np.ndarray:
    """Tip deflection by control.input_output_response, torque as an array."""
    system = nonlinear_system(model, "tip_deflection")
    values = np.array([torque(t) for t in T])
    options = {"rtol": rtol, "atol": 1e-3 * rtol}
    return control.input_output_response(system, T, values, solve_ivp_kwargs=options).outputs


def main() -> None:
    """Print the measurements."""
    values = np.array([torque(t) for t in T])
    small, large = assemble(ARM, ClampedFree(5)), truth(ARM)
    for name, model in (("5 modes", small), ("20 modes (truth)", large)):
        equations = large_slew(model)
        exact = simulate_swing(equations, T, torque, rtol=1e-12).tip_deflection
        exact_array = simulate_swing(equations, T, values, rtol=1e-12).tip_deflection
        print(
            f"{name}, {model.frequencies_hz[-1]:.0f} Hz, slew of {SPAN:.0f} s, error of the tip deflection:"
        )
        for rtol in (1e-4, 1e-7, 1e-10):
            spent, found = timed(
                lambda r=rtol, e=equations: simulate_swing(e, T, torque, rtol=r).tip_deflection, 5
            )
            report(f"simulate_swing, rtol = {rtol:.0e}", spent, found, exact)
        spent, found = timed(lambda e=equations: simulate_swing(e, T, values).tip_deflection, 5)
        report("simulate_swing, torque as an array", spent, found, exact_array)
        if model is large:
            continue
        for method, rtol in (("DOP853", 1e-8), ("LSODA", 1e-9), ("Radau", 1e-7)):
            spent, found = timed(lambda m=method, r=rtol: explicit(small, m, r), 1)
            report(f"scipy {method}, rtol = {rtol:.0e}", spent, found, exact)
        spent, found = timed(lambda: by_control(small, 1e-8), 1)
        report("control.input_output_response, rtol = 1e-8", spent, found, exact_array)


if __name__ == "__main__":
    main()
