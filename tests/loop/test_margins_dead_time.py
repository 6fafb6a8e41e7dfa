"""Loops with dead time: exact, without an approximation of e^(−sτ)."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_examples import stable_loop
from scipy.optimize import brentq

from slewctl.errors import InputError
from slewctl.loop import UnstableLoopError
from slewctl.loop.margin_functions import margins

S = control.tf("s")


@pytest.mark.parametrize("delay", [0.1, 1.0, 1.5])
def test_an_integrator_with_dead_time(delay: float) -> None:
    """L = e^(−sτ)/s: phase π/2 − τ at ω = 1, gain π/(2τ) at ω = π/(2τ)."""
    found = margins(1 / S, 1.0, delay=delay)
    assert math.radians(found.phase_deg.value) == pytest.approx(math.pi / 2 - delay, rel=1e-12)
    assert 10 ** (found.gain_db.value / 20) == pytest.approx(math.pi / 2 / delay, rel=1e-12)
    assert found.delay_s.value == pytest.approx(math.pi / 2 - delay, rel=1e-12)
    assert found.confirmed
    assert found.intervals > 0


def test_the_limit_of_an_integrator_is_half_a_turn_of_the_quarter() -> None:
    assert margins(1 / S, 1.0, delay=math.pi / 2 - 1e-6).phase_deg.value < 1e-4
    with pytest.raises(UnstableLoopError, match="2 unstable poles"):
        margins(1 / S, 1.0, delay=math.pi / 2 + 1e-6)


def test_a_light_resonance_with_one_second_of_dead_time_is_unstable() -> None:
    """Its peak stands above one at a phase that the dead time turns beyond −180°."""
    with pytest.raises(UnstableLoopError, match="dead time of 1 s"):
        margins(0.9 / (S**2 + 0.01 * S + 1), 1.0, delay=1.0)


@pytest.mark.slow
@settings(deadline=None, max_examples=15, derandomize=True)
@given(st.floats(0.05, 3.0), st.floats(0.2, 0.9))
def test_the_delay_margin_is_what_the_loop_stands(lag: float, part: float) -> None:
    """A part of the delay margin leaves the rest of it; a little more than it is unstable."""
    L = 2 / (S * (lag * S + 1))
    whole = margins(L).delay_s.value
    assert margins(L, delay=part * whole).delay_s.value == pytest.approx((1 - part) * whole)
    with pytest.raises(UnstableLoopError):
        margins(L, delay=1.001 * whole)


def test_gain_margin_is_the_first_turn_of_many() -> None:
    """L = k e^(−s)/(s + 1): −1 is met where ω + atan ω = π, and again for each further turn."""
    omega = brentq(lambda w: w + math.atan(w) - math.pi, 1.0, 3.0)
    found = margins(1.5 / (S + 1), 1.0, delay=1.0)
    assert 10 ** (found.gain_db.value / 20) == pytest.approx(math.hypot(1, omega) / 1.5, rel=1e-11)
    grid = np.linspace(1e-3, 60, 400_001)
    distance = np.abs(1 + 1.5 * np.exp(-1j * grid) / (1 + 1j * grid))
    assert found.modulus.value == pytest.approx(distance.min(), rel=1e-7)
    assert found.modulus.value <= distance.min()


def test_dead_time_with_feedthrough() -> None:
    """|L(∞)| is a circle: no phase of it is safe once it is one."""
    with pytest.raises(UnstableLoopError, match="infinitely many"):
        margins((S + 1) / (S + 3), 1.0, delay=1.0)
    found = margins((S + 1) / (S + 3), 0.5, delay=1.0)
    assert 10 ** (found.gain_db.value / 20) == pytest.approx(2, rel=1e-3)
    assert found.modulus.value == pytest.approx(0.5, rel=1e-3)
    assert (found.gain_db.at_least or 0) <= 20 * math.log10(2)


def test_a_closed_loop_is_judged_with_more_dead_time() -> None:
    loop = stable_loop()
    whole = loop.margins.delay_s.value
    half = margins(loop, delay=whole / 2)
    assert half.delay_s.value == pytest.approx(whole / 2, rel=1e-6)
    assert half.delay_s.mode == loop.margins.delay_s.mode
    with pytest.raises(UnstableLoopError):
        margins(loop, delay=1.01 * whole)


def test_a_sampled_loop_has_no_dead_time_of_its_own() -> None:
    with pytest.raises(InputError, match="whole samples"):
        margins(control.tf([0.1], [1, -1], 0.1), 1.0, delay=0.05)
