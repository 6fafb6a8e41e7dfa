"""The delay margin of a sampled loop around an arm: that of the torque on its way there."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import slewctl as sc
from slewctl.errors import SlewctlError
from slewctl.loop import SampledLoop
from slewctl.loop.single.hybrid_delay import delayed_loop, smallest_delay
from slewctl.loop.single.return_ratio import BrokenLoop


def slow_clock(delay: float = 0.0) -> sc.Problem:
    """An arm whose first mode is above half the sampling frequency of 3.3 Hz."""
    arm = sc.Arm(
        sc.Beam(1.0, 1.0, 6.0),
        sc.Hub(0.3),
        damping_ratio=0.002,
        actuator=sc.Actuator(delay=delay),
    )
    noise = {"torque": 0.05, "theta": 1e-3, "theta_dot": 1e-2}
    return sc.Problem(arm, {"tip": 0.05, "torque": 0.5}, noise, truth_modes=8)


def radius(loop: SampledLoop, delay: float) -> float:
    """Return the spectral radius with a delay of less than a sample, by a hold of its own."""
    A, B, T = loop.plant.path.A, loop.plant.path.B[:, 0], loop.sample_time
    C, law, n = loop.plant.path.C, loop.controller.linear, len(loop.plant.path.A)

    def held(h: float) -> tuple[np.ndarray, np.ndarray]:
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n] = A, B
        found = expm(whole * h)
        return found[:n, :n], found[:n, n]

    (F1, G1), (F2, G2) = held(delay), held(T - delay)
    size = n + 1 + law.nstates  # the arm, the torque of the last sample, the law
    X, command = np.zeros((size, size)), np.zeros(size)
    command[:n], command[n + 1 :] = law.D[0] @ C, law.C[0]
    X[:n, :n], X[:n, n] = F2 @ F1, F2 @ G1
    X[:n] += np.outer(G2, command)
    X[n], X[n + 1 :, :n], X[n + 1 :, n + 1 :] = command, law.B @ C, law.A
    return float(np.abs(np.linalg.eigvals(X)).max())


def test_it_is_the_dead_time_that_the_drive_may_have() -> None:
    """By whole samples alone the loop stands 0.148 s; of the drive's own delay 0.0907 s."""
    K = sc.lqg(slow_clock().plant("arm-matched", 1), sample_time=0.3)
    loop = slow_clock().judge(K).loop
    assert isinstance(loop, SampledLoop)
    margin = loop.margins.delay_s
    assert loop.margins.confirmed
    assert margin.value < 0.7 * sc.margins(loop.return_ratio).delay_s.value
    assert radius(loop, margin.value * (1 - 1e-4)) < 1 < radius(loop, margin.value * (1 + 1e-4))
    for part, stable in ((0.999, True), (1.001, False)):
        assert slow_clock(part * margin.value).judge(K).stable is stable
    assert sc.hybrid_delay_margin(loop).seconds == pytest.approx(margin.value, rel=1e-9)


@pytest.mark.slow
@given(
    st.floats(-1.0, 2.0), st.floats(-2.0, 0.5), st.floats(-3.0, -1.3),
    st.floats(0.02, 0.6), st.sampled_from([0.0, 0.5, 1.0]), st.floats(-1.0, 2.0),
)  # fmt: skip
@settings(deadline=None, max_examples=25, derandomize=True)
def test_poles_are_stable_at_every_smaller_delay(
    stiffness: float, hub: float, damping: float, clock: float, late: float, torque: float
) -> None:
    arm = sc.Arm(sc.Beam(1.0, 1.0, 10**stiffness), sc.Hub(10**hub), damping_ratio=10**damping)
    limits, noise = {"tip": 0.05, "torque": 10**torque}, {"torque": 0.05, "theta": 1e-3}
    problem = sc.Problem(arm, limits, noise, truth_modes=6)
    T = clock / problem.truth.frequencies_hz[0]
    try:
        K = sc.lqg(problem.plant("arm-matched", 1), sample_time=T, delay=late * T)
        loop = problem.judge(K).loop
    except SlewctlError:
        assume(False)
    assume(loop.stable)
    told = loop.margins.delay_s.value
    with_delay = delayed_loop(loop.plant.path, sc.loop.parts.negated(K.linear), loop.late)
    most = told if np.isfinite(told) else 20 * T
    for part in (*np.linspace(0.02, 0.98, 25), 1 - 1e-5):
        assert not BrokenLoop(with_delay(part * most)).unstable(1.0)[1]
    if np.isfinite(told):
        assert BrokenLoop(with_delay(told * (1 + 1e-5))).unstable(1.0)[1]
    assert smallest_delay(with_delay, T).seconds == pytest.approx(told, rel=1e-8)
