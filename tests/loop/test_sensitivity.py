"""Peaks of S and T and the bandwidth: textbook loops, and dense frequencies on flexible arms."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl import Arm, Beam, Hub, Objective, assemble, close, generalised_plant, lqg, truth
from slewctl.basis import ClampedFree
from slewctl.loop import Loop
from slewctl.loop.single.sensitivity import (
    BANDWIDTH_LEVEL,
    bandwidth,
    complementary_sensitivity_peak,
    sensitivity,
    sensitivity_peak,
)


@given(st.floats(1e-3, 1e3))
def test_integrator(k: float) -> None:
    """L = k/s: S = s/(s + k) rises through 1/√2 at k, both peaks are one."""
    L = control.ss([[0.0]], [[1.0]], [[k]], 0)
    assert bandwidth(L) == pytest.approx(k, rel=1e-9)
    assert sensitivity_peak(L).value == pytest.approx(1, rel=1e-7)
    assert complementary_sensitivity_peak(L).value == pytest.approx(1, rel=1e-7)


@given(st.floats(0.05, 0.6), st.floats(0.1, 10.0))
def test_second_order_loop(zeta: float, omega: float) -> None:
    """L = ω²/(s² + 2ζωs): Mt = 1/(2ζ√(1 − ζ²)) at ω√(1 − 2ζ²), in any textbook."""
    L = control.ss([[0, 1], [0, -2 * zeta * omega]], [[0], [1]], [[omega**2, 0]], 0)
    peak = complementary_sensitivity_peak(L)
    assert peak.value == pytest.approx(1 / (2 * zeta * math.sqrt(1 - zeta**2)), rel=1e-7)
    assert peak.omega == pytest.approx(omega * math.sqrt(1 - 2 * zeta**2), rel=1e-3)


def test_loops_without_a_crossing() -> None:
    half, large = (control.ss([], [], [], [[d]]) for d in (0.3, 9.0))
    assert bandwidth(half) == 0.0  # |S| is 0.77 everywhere
    assert bandwidth(large) == math.inf  # |S| is 0.1 everywhere


def flexible(**clock: float) -> Loop:
    arm = Arm(Beam(1.0, 1.0, 1.0), hub=Hub(0.2), damping_ratio=0.002)
    objective = Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 1e-2})
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(3)), objective), **clock)
    return close(truth(arm, 8), objective, controller)


@pytest.mark.parametrize("clock", [{}, {"sample_time": 0.02, "delay": 0.01}])
def test_no_frequency_is_higher_and_none_crosses_before(clock: dict[str, float]) -> None:
    loop = flexible(**clock)
    assert loop.stable
    L = loop.return_ratio
    last = min(loop.nyquist_rad_s, 1e4)
    omega = np.concatenate([np.geomspace(1e-3, last, 40001), np.abs(loop.poles.imag)])
    S = 1 / (1 + loop.response(np.sort(omega[omega <= last])))
    for peak, values in (
        (sensitivity_peak(L), np.abs(S)), (complementary_sensitivity_peak(L), np.abs(1 - S))
    ):  # fmt: skip
        assert values.max() <= peak.value * (1 + 1e-7)
        assert values.max() >= peak.value * (1 - 1e-3)
    found = bandwidth(L)
    assert abs(1 / (1 + loop.response(np.array([found]))[0])) == pytest.approx(
        BANDWIDTH_LEVEL, rel=1e-6
    )
    before = np.linspace(found / 1e4, found * (1 - 1e-6), 20001)
    assert np.abs(1 / (1 + loop.response(before))).max() < BANDWIDTH_LEVEL
    assert sensitivity_peak(L).value == pytest.approx(1 / loop.margins.modulus.value, rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-4, 1e4))
def test_time_scales(scale: float) -> None:
    """In another unit of time only the frequencies change."""
    A = np.array([[0, 1, 0], [0, -0.2, 1], [0, 0, -3.0]])
    L = control.ss(A, [[0], [0], [1]], [[1, 0, 0]], 0)
    fast = control.ss(scale * A, [[0], [0], [scale]], [[1, 0, 0]], 0)
    assert bandwidth(fast) == pytest.approx(scale * bandwidth(L), rel=1e-7)
    assert sensitivity_peak(fast).value == pytest.approx(sensitivity_peak(L).value, rel=1e-7)
    assert np.allclose(
        sensitivity(L).poles(), np.linalg.eigvals(A - [[0], [0], [1]] @ np.array([[1, 0, 0]]))
    )
