"""What is shipped commands what was simulated, at its limit too."""

from __future__ import annotations

import numpy as np
import pytest
from programs import WITH_COMPILER

import slewctl as sc
from slewctl.embedded import CodeOptions, compile_program, program_of
from slewctl.loop.motion.conditions import Conditions
from slewctl.loop.motion.sampled_motion import sampled_inputs

T, LIMIT = 0.02, 0.4
PID = {"kp": 1.0, "ki": 0.4, "kd": 1.0, "filter_hz": 8.0}


def problem() -> sc.Problem:
    arm = sc.Arm(
        sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01,
        actuator=sc.Actuator(torque_limit=LIMIT),
    )  # fmt: skip
    slew = sc.Slew(40.0, 1.2, conditions=Conditions(saturate=True))
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    return sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, noise, slew=slew, truth_modes=5)


def controller(kind: str, asked: sc.Problem) -> sc.Controller:
    if kind == "PID":
        return sc.given(
            pid=PID, inputs=["theta"], output="torque", sample_time=T, discretise="tustin"
        )
    more = {"integral_limit": 0.5} if kind == "with integral" else {}
    return sc.lqg(asked.plant("clamped-free", n=2), sample_time=T, **more)


@WITH_COMPILER
@pytest.mark.parametrize("kind", ["observer", "with integral", "PID"])
def test_compiled_code_commands_what_the_simulated_slew_did(kind: str) -> None:
    asked = problem()
    K = controller(kind, asked)
    simulated, judged = asked.simulate(K), asked.judge(K)
    given = sampled_inputs(judged.loop, asked.slew)
    code = compile_program(program_of(judged, CodeOptions(stuck_s=0.0), "arm"))
    code.init(0.0)
    samples = np.searchsorted(simulated.t, np.arange(int(simulated.t[-1] / T)) * T - 1e-9)
    cut = 0
    for k, at in enumerate(samples):
        row = given[min(k, len(given) - 1)]
        readings = np.array([simulated.signals[name][at] for name in K.sensors]) - row[:-1]
        command = simulated.signals["command"][at]
        cut += abs(command) > LIMIT
        shipped = code.step(readings.tolist(), 0.0, float(row[-1]))
        assert shipped == pytest.approx(np.clip(command, -LIMIT, LIMIT), abs=1e-9 * LIMIT)
    assert cut > 20
