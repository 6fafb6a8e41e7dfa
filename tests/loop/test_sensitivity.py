"""Peaks of S and T and the bandwidth: textbooks, dense frequencies on flexible arms, level sets."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sensitivity_level_sets import (
    BANDWIDTH_LEVEL,
    bandwidth,
    complementary_sensitivity_peak,
    sensitivity_peak,
)

from slewctl import Arm, Beam, Hub, Objective, assemble, close, generalised_plant, lqg, truth
from slewctl.basis import ClampedFree
from slewctl.loop import Loop, Margins
from slewctl.loop.margin_functions import margins


def of(L: control.StateSpace) -> tuple[float, float, float, float]:
    """Return Ms, Mt, ω of Mt, and the bandwidth in rad/s."""
    return told(margins(L))


def told(m: Margins) -> tuple[float, float, float, float]:
    assert m.complementary.at_least is not None
    assert m.complementary.at_least >= m.complementary.value * (1 - 1e-8)
    at = m.complementary.frequency_hz
    omega = math.inf if at is None else 2 * math.pi * at
    return 1 / m.modulus.value, 1 / m.complementary.value, omega, 2 * math.pi * m.bandwidth_hz


@settings(max_examples=20)
@given(st.floats(1e-3, 1e3))
def test_integrator_behind_a_lag(k: float) -> None:
    """L = k/(s(1 + s/6k)): T = 6k²/(s² + 6ks + 6k²) has no peak, S passes 1/√2 once."""
    L = control.ss([[0.0, k], [0, -6 * k]], [[0.0], [6 * k]], [[1.0, 0]], 0)
    _, Mt, _, found = of(L)
    assert Mt == pytest.approx(1, rel=2e-8)
    S = 1 / (1 + control.evalfr(L, 1j * found))
    assert abs(S) == pytest.approx(BANDWIDTH_LEVEL, rel=1e-9)


@pytest.mark.slow
@given(st.floats(0.05, 0.6), st.floats(0.1, 10.0))
def test_second_order_loop(zeta: float, omega: float) -> None:
    """L = ω²/(s² + 2ζωs): Mt = 1/(2ζ√(1 − ζ²)) at ω√(1 − 2ζ²), in any textbook."""
    L = control.ss([[0, 1], [0, -2 * zeta * omega]], [[0], [1]], [[omega**2, 0]], 0)
    _, Mt, at, _ = of(L)
    assert Mt == pytest.approx(1 / (2 * zeta * math.sqrt(1 - zeta**2)), rel=1e-8)
    assert at == pytest.approx(omega * math.sqrt(1 - 2 * zeta**2), rel=1e-3)


def test_loops_without_a_crossing() -> None:
    half, large = (control.ss([], [], [], [[d]]) for d in (0.3, 9.0))
    assert of(half)[3] == 0.0  # |S| is 0.77 everywhere
    assert of(large)[3] == math.inf  # |S| is 0.1 everywhere


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
    Ms, Mt, _, found = told(loop.margins)
    for peak, values in ((Ms, np.abs(S)), (Mt, np.abs(1 - S))):
        assert values.max() <= peak * (1 + 1e-7)
        assert values.max() >= peak * (1 - 1e-3)
    assert abs(1 / (1 + loop.response(np.array([found]))[0])) == pytest.approx(
        BANDWIDTH_LEVEL, rel=1e-6
    )
    before = np.linspace(found / 1e4, found * (1 - 1e-6), 20001)
    assert np.abs(1 / (1 + loop.response(before))).max() < BANDWIDTH_LEVEL
    # Level sets say the same.
    assert sensitivity_peak(L).value == pytest.approx(Ms, rel=1e-6)
    assert complementary_sensitivity_peak(L).value == pytest.approx(Mt, rel=1e-6)
    assert bandwidth(L) == pytest.approx(found, rel=1e-7)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.floats(1e-4, 1e4))
def test_time_scales(scale: float) -> None:
    """In another unit of time only the frequencies change."""
    A = np.array([[0, 1, 0], [0, -0.2, 1], [0, 0, -3.0]])
    L = control.ss(A, [[0], [0], [1]], [[1, 0, 0]], 0)
    fast = control.ss(scale * A, [[0], [0], [scale]], [[1, 0, 0]], 0)
    (Ms, Mt, at, found), (Ms2, Mt2, at2, found2) = of(L), of(fast)
    assert (Ms2, Mt2) == pytest.approx((Ms, Mt), rel=1e-8)
    assert at2 == pytest.approx(scale * at, rel=1e-3)
    assert found2 == pytest.approx(scale * found, rel=1e-9)
