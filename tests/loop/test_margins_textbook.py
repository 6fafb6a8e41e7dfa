"""Classical margins of loops whose margins follow by hand."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl.loop import Margins, classical_margins

S = control.tf("s")


def margins(loop: control.TransferFunction) -> Margins:
    return classical_margins(control.ss(loop))


def factor(decibel: float) -> float:
    return float(10 ** (decibel / 20))


def test_three_lags() -> None:
    """1/(s(s+1)(s+2)): Im L = 0 at ω = √2, where |L| = 1/6."""
    m = margins(1 / (S * (S + 1) * (S + 2)))
    assert factor(m.gain_db.value) == pytest.approx(6, rel=1e-12)
    assert m.gain_db.frequency_hz == pytest.approx(np.sqrt(2) / (2 * np.pi), rel=1e-12)
    assert m.gain_reduction_db.value == np.inf
    assert m.confirmed


@pytest.mark.slow
@given(st.floats(-6, 6), st.floats(-3, 3), st.floats(0.05, 20))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_double_integrator_with_pd(decade: float, stiffness: float, damping: float) -> None:
    """(c s + k)/s²: |L| = 1 at ω² = (c² + √(c⁴ + 4k²))/2, the phase margin is atan(cω/k)."""
    rate = 10**decade
    k, c = 10**stiffness * rate**2, damping * 10 ** (stiffness / 2) * rate
    loop = control.StateSpace([[0, 1], [0, 0]], [[0], [1]], [[k, c]], 0)
    m = classical_margins(loop)
    omega = np.sqrt((c**2 + np.sqrt(c**4 + 4 * k**2)) / 2)
    turn = np.arctan(c * omega / k)
    assert m.gain_db.value == np.inf
    assert m.gain_reduction_db.value == np.inf
    assert m.phase_deg.value == pytest.approx(np.degrees(turn), rel=1e-11)
    assert m.delay_s.value == pytest.approx(turn / omega, rel=1e-11)
    assert len(m.gain_crossings_hz) == 1
    assert m.confirmed


def test_conditionally_stable_loop_has_a_gain_reduction_margin() -> None:
    """k(s+1)²/s³ is stable for k > 1/2 (Routh: 2k² > k)."""
    m = margins(10 * (S + 1) ** 2 / S**3)
    assert m.gain_db.value == np.inf
    assert factor(m.gain_reduction_db.value) == pytest.approx(20, rel=1e-12)
    assert m.gain_reduction_db.frequency_hz == pytest.approx(1 / (2 * np.pi), rel=1e-12)
    assert m.confirmed


def test_both_gain_margins() -> None:
    """k(s+1)²/(s³(s/50+1)²): the two real roots of Im L = 0 bound k from both sides."""
    m = margins(10 * (S + 1) ** 2 / (S**3 * (S / 50 + 1) ** 2))
    A, B, C = (
        np.asarray(getattr(control.ss((S + 1) ** 2 / (S**3 * (S / 50 + 1) ** 2)), n)) for n in "ABC"
    )

    def growth(k: float) -> float:
        return float(np.linalg.eigvals(A - k * B @ C).real.max())

    for gain, outwards in (
        (10 * factor(m.gain_db.value), 1.0),
        (10 / factor(m.gain_reduction_db.value), -1.0),
    ):
        assert growth(gain * (1 - 1e-6 * outwards)) < 0 < growth(gain * (1 + 1e-6 * outwards))
    assert m.confirmed


def test_loop_below_one_everywhere_has_no_phase_or_delay_margin() -> None:
    m = margins(0.5 / (S + 1))
    assert (m.gain_db.value, m.gain_reduction_db.value) == (np.inf, np.inf)
    assert (m.phase_deg.value, m.delay_s.value) == (np.inf, np.inf)
    assert m.phase_deg.frequency_hz is None
    assert m.gain_crossings_hz == ()


def test_integrator() -> None:
    m = margins(1 / S)
    assert m.phase_deg.value == pytest.approx(90, rel=1e-13)
    assert m.delay_s.value == pytest.approx(np.pi / 2, rel=1e-13)


def test_undamped_pole_on_the_axis() -> None:
    """0.2/(s²+1) + 1/s with lag-free phase in (−180°, 0°) but for a jump: no gain margin."""
    loop = control.StateSpace(
        [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], [[0], [1], [1]], [[0, 0.2, 1.0]], 0
    )
    m = classical_margins(loop)  # 0.2 s/(s²+1) + 1/s, positive real
    assert (m.gain_db.value, m.gain_reduction_db.value) == (np.inf, np.inf)
    assert m.phase_deg.value > 0
    assert m.confirmed


@pytest.mark.parametrize(
    ("loop", "up", "down"),
    [
        (-0.5 / (S + 1), 2.0, np.inf),
        (-5 / ((S + 1) * (S + 10)), 2.0, np.inf),
        (2 / (S - 1), np.inf, 2.0),
    ],
)
def test_limit_of_stability_at_zero_frequency(
    loop: control.TransferFunction, up: float, down: float
) -> None:
    """L(0) is real: a pole may leave through the origin, 1 + kL(0) = 0."""
    m = margins(loop)
    assert factor(m.gain_db.value) == pytest.approx(up, rel=1e-12)
    assert factor(m.gain_reduction_db.value) == pytest.approx(down, rel=1e-12)


@pytest.mark.parametrize(
    "loop", [25 / (S**3 + 10 * S**2 + 10 * S + 10), 4 / (S + 1) ** 3, 30 / (S * (S + 3) * (S + 5))]
)
def test_agrees_with_python_control_on_textbook_loops(loop: control.TransferFunction) -> None:
    gain, phase, _, at_gain, at_phase, _ = control.stability_margins(loop)
    m = margins(loop)
    # python-control finds roots of a polynomial of twice the degree: about √ε.
    assert factor(m.gain_db.value) == pytest.approx(gain, rel=1e-7)
    assert m.phase_deg.value == pytest.approx(phase, rel=1e-7)
    assert m.gain_db.frequency_hz == pytest.approx(at_gain / (2 * np.pi), rel=1e-7)
    assert m.phase_deg.frequency_hz == pytest.approx(at_phase / (2 * np.pi), rel=1e-7)


@given(st.floats(-8, 8))
@settings(deadline=None, max_examples=25, derandomize=True)
def test_time_unit_does_not_matter(decade: float) -> None:
    a = 10**decade
    slow = control.ss(25 / (S**3 + 10 * S**2 + 10 * S + 10))
    m = classical_margins(control.StateSpace(slow.A * a, slow.B * a, slow.C, 0))
    assert factor(m.gain_db.value) == pytest.approx(3.6, rel=1e-10)
    assert m.delay_s.value * a == pytest.approx(classical_margins(slow).delay_s.value, rel=1e-10)


def test_all_crossings_with_the_sign_of_their_change() -> None:
    """k/(s³ + 2s² + s) with k = 1 stands twice the gain, a conditionally stable loop less too."""
    first, second = classical_margins(control.tf([1], [1, 2, 1, 0])).crossings
    assert first.frequency_hz < second.frequency_hz == pytest.approx(1 / (2 * np.pi))
    assert first.phase_deg == pytest.approx(-21.386, abs=1e-3)
    assert second.gain_db == pytest.approx(20 * np.log10(2))
    # 3(s + 1)²/s³: L = −3(1 − ω² + 2jω)/(jω³)… real where ω = 1, at −6: it may fall to 1/6.
    found = classical_margins(control.tf([3, 6, 3], [1, 0, 0, 0]))
    (real,) = [c for c in found.crossings if c.gain_db is not None]
    assert real.gain_db == pytest.approx(-20 * np.log10(6))
    assert real.gain_db == pytest.approx(-found.gain_reduction_db.value)
