"""The delay margin of a sampled loop, against poles with whole samples added to it."""

from __future__ import annotations

import control
import numpy as np
import pytest
from flexible_loops import random_flexible_loops
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl.loop import UnstableLoopError
from slewctl.loop.margin_functions import margins

T = 0.1
MOST = 60


def radius(loop: control.StateSpace, samples: int = 0) -> float:
    """Return the largest |z| of the poles of z^(−samples)·L when closed."""
    A, B, C, D = (np.asarray(getattr(loop, name)) for name in "ABCD")
    n = len(A)
    late = np.zeros((n + samples, n + samples))
    late[:n, :n] = A
    if samples:
        late[:n, n : n + 1] = B
        late[n:-1, n + 1 :] = np.eye(samples - 1)
        B = np.eye(n + samples)[:, -1:]
        C, D = np.hstack([C, D, np.zeros((1, samples - 1))]), 0 * D
    closed = late - B @ C / (1 + D)
    return float(np.abs(np.linalg.eigvals(closed)).max(initial=0.0))


def stable_with(loop: control.StateSpace, samples: int) -> bool:
    return radius(loop, samples) < 1


def check(loop: control.StateSpace) -> None:
    """Every whole number of samples below the margin is stood; with a margin of 0 none is."""
    m = margins(loop).delay_s
    step = float(loop.dt)
    stood = np.ceil(m.value / step - 1e-9) if np.isfinite(m.value) else MOST
    for k in range(1, int(min(stood, MOST))):
        assert stable_with(loop, k), (m, k)
    if m.value == 0:
        assert "not one whole sample" in m.note
        assert not stable_with(loop, 1)
    elif np.isfinite(m.value):
        assert abs(complex(loop(np.exp(1j * np.pi)))) < 1 + 1e-6
        # Turned by as much at the crossing, L is −1: no later sample could have been promised.
        z = np.exp(2j * np.pi * m.frequency_hz * step)
        assert abs(1 + complex(loop(z)) * z ** (-m.value / step)) < 1e-6
    else:
        assert all(stable_with(loop, k) for k in (1, 2, 5, 20))


def test_a_pole_at_minus_one_stands_no_sample() -> None:
    """−0.1/(z + 1): z = −0.9 closed; with a sample z² + z − 0.1 = 0, a root at −1.09."""
    loop = control.tf([-0.1], [1, 1], T)
    m = margins(loop)
    assert m.delay_s.value == 0
    assert m.delay_s.frequency_hz == pytest.approx(0.5 / T)
    assert "not one whole sample" in m.delay_s.note
    assert np.abs(np.roots([1, 1, -0.1])).max() > 1
    assert m.confirmed


parts = st.floats(-1, 1).map(lambda x: round(x, 3))


@pytest.mark.slow
@given(
    st.lists(parts.map(lambda x: 0.95 * x), min_size=0, max_size=2),
    st.lists(parts, min_size=1, max_size=3),
    st.sampled_from([-1.0, -1.0 + 1e-12, -0.9999999, -0.99, -1.01, 0.5]),
    st.floats(0.01, 3.0),
)
@deterministic(60)
def test_poles_at_and_near_half_the_sampling_frequency(
    poles: list[float], numerator: list[float], last: float, gain: float
) -> None:
    if not numerator[0] or len(numerator) > len(poles) + 1:
        return
    loop = control.tf2ss(control.tf(gain * np.array(numerator), np.poly([*poles, last]), T))
    try:
        check(loop)
    except UnstableLoopError:
        assert radius(loop) > 1 - 1e-9


@pytest.mark.slow
@given(st.floats(-0.99, 3.0), st.floats(-0.9, 0.9))
@deterministic(40)
def test_feedthrough(gain: float, pole: float) -> None:
    """D + 0.3/(z − p): |D| ≥ 1 loses the first sample, whichever its sign."""
    for D in (gain, -2.5):
        loop = control.StateSpace(pole, 1.0, 0.3, D, T)
        if abs(pole - 0.3 / (1 + D)) < 1 - 1e-6 and abs(complex(loop(-1.0)) + 1) > 1e-6:
            check(loop)


def test_random_flexible_loops() -> None:
    tried = 0
    for loop in random_flexible_loops(50, 12, 10):
        if loop.step and loop.stable:
            tried += 1
            check(loop.loop)
    assert tried >= 2
