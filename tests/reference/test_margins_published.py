"""Margins that others have published or document, to every digit they print."""

from __future__ import annotations

import control
import numpy as np
import pytest

from slewctl.loop import Margins, peak_gain
from slewctl.loop.margin_functions import margins
from slewctl.numerics.frequency_response import FrequencyResponse

S = control.tf("s")
HZ = 2 * np.pi


def gain(m: Margins) -> tuple[float, float | None]:
    """Return the gain factor that is nearer to one, and its frequency in rad/s."""
    raised = m.gain_db.value <= m.gain_reduction_db.value
    nearer = m.gain_db if raised else m.gain_reduction_db
    factor = 10 ** ((1 if raised else -1) * nearer.value / 20)
    return factor, None if nearer.frequency_hz is None else HZ * nearer.frequency_hz


def test_seiler_packard_gahinet_example() -> None:
    """IEEE Control Systems Magazine 40(5), 2020: α = 0.46 at 1.94 rad/s, gains [0.63, 1.59].

    To more digits as recomputed: 0.458093, [0.627278, 1.594189] at 1.955 rad/s, 25.80°;
    classical margins 3.6 and 29.11°.  RobustAndOptimalControl.jl tests the printed figures,
    python-control documents 4.05 dB and 25.8° for its disk_margins.
    """
    m = margins(25 / (S**3 + 10 * S**2 + 10 * S + 10))
    assert m.disk.value == pytest.approx(0.458093, abs=6e-7)
    assert m.disk_gains == pytest.approx((0.627278, 1.594189), abs=6e-7)
    assert HZ * m.disk.frequency_hz == pytest.approx(1.955, abs=6e-4)
    assert m.disk_phase_deg == pytest.approx(25.80, abs=5e-3)
    assert 20 * np.log10(m.disk_gains[1]) == pytest.approx(4.05, abs=5e-3)
    assert gain(m)[0] == pytest.approx(3.6, rel=1e-12)
    assert m.phase_deg.value == pytest.approx(29.11, abs=5e-3)


def test_perfect_loop_at_a_time_of_the_spinning_satellite() -> None:
    """Its loops one at a time are 1/s: α = 2, all gains, 90° (RobustAndOptimalControl.jl's test)."""
    m = margins(1 / S)
    assert m.disk.value == pytest.approx(2, rel=1e-8)
    assert m.disk_gains[0] == pytest.approx(0, abs=1e-8)
    assert m.disk_gains[1] > 1e10
    assert m.disk_phase_deg == pytest.approx(90, abs=1e-5)


# As documented and tested by python-control: gain margin, phase margin, distance to −1, and
# the frequencies in rad/s of the three; None where it gives none.
PYTHON_CONTROL = {
    "third order": (1 / (S**3 + 2 * S**2 + 3 * S + 4), (2.0, None, 0.4170, 1.7321, None, 1.6620)),
    "two resonances": (
        (8.75 * (4 * S**2 + 0.4 * S + 1))
        / ((100 * S + 1) * (S**2 + 0.22 * S + 1))
        / (S**2 / 10.0**2 + 2 * 0.04 * S / 10.0 + 1),
        (2.2716, 97.5941, 0.5591, 10.0053, 0.0850, 9.9918),
    ),
    "zero on the right": (
        0.01 * (10 - S) / (2 + S) / (1 + S),
        (300.0, None, 0.9917, 5.6569, None, 2.3171),
    ),
    "triple lag": (2 / (S + 1) ** 3, (4.0, 67.6058, None, 1.7322, 0.7663, None)),
    "type 1": ((S + 0.1) / S / (S + 1), (None, 144.9032, None, None, 0.3162, None)),
    "type 2": ((S + 0.1) / S**2 / (S + 1), (None, 44.4594, None, None, 0.7907, None)),
    "type 3": (
        (S + 0.1) * (S + 0.1) / S**3 / (S + 1),
        (0.0626, 37.1748, None, 0.1119, 0.7951, None),
    ),
    "Bavafi-Toosi's example 2.1, K = 5000": (
        5000 * 0.002 * (S + 0.02) * (S + 0.05) * (S + 5) * (S + 10)
        / ((S - 0.0005) * (S + 0.0001) * (S + 0.01) * (S + 0.2) * (S + 1) * (S + 100) ** 2),
        (4.5596, 21.2101, None, 0.4385, 0.1868, None),
    ),
    "the same, K = 1000": (
        1000 * 0.002 * (S + 0.02) * (S + 0.05) * (S + 5) * (S + 10)
        / ((S - 0.0005) * (S + 0.0001) * (S + 0.01) * (S + 0.2) * (S + 1) * (S + 100) ** 2),
        (0.1793, 22.5215, None, 0.0243, 0.0630, None),
    ),
}  # fmt: skip
# Sampled with a zero-order hold, figures to six digits; sample time in s.
SAMPLED = {
    "integrator": (2 / (S**3 + 3 * S**2 + 2 * S), 1e-2,
                   (2.955761, 32.398492, 0.429535, 1.403725, 0.749367, 0.923898)),
    "triple lag": (2 / (S + 1) ** 3, 0.1, (3.4927, 65.4212, 0.5763, 1.6283, 0.76625, 1.2019)),
    "oscillator": (1.1 * 4 * np.pi**2 / (S**2 + 0.8 * np.pi * S + 4 * np.pi**2), 0.05,
                   (2.3842, 18.161, 0.26953, 11.712, 8.7478, 9.1504)),
    "fast and slow": (5e4 / (S**4 + 101 * S**3 + 10101 * S**2 + 10100 * S + 10000), 1e-3,
                      (18.8766, 26.3564, 0.406841, 9.76358, 2.32933, 2.55986)),
}  # fmt: skip


def agrees(m: Margins, published: tuple[float | None, ...], rel: float) -> None:
    """Fail where a published figure, with its rounding, is another."""
    factor, at = gain(m)
    ours = (factor, m.phase_deg.value, m.modulus.value, at)
    where = [None if c.frequency_hz is None else HZ * c.frequency_hz
             for c in (m.phase_deg, m.modulus)]  # fmt: skip
    for found, known in zip((*ours, *where), published, strict=True):
        if known is not None:
            assert found == pytest.approx(known, rel=rel, abs=1.5e-4)
    if published[0] is None:
        assert m.gain_db.value == np.inf
    assert m.confirmed


@pytest.mark.parametrize("name", PYTHON_CONTROL)
def test_python_control_examples(name: str) -> None:
    loop, published = PYTHON_CONTROL[name]
    agrees(margins(loop), published, 2e-4)


@pytest.mark.parametrize("name", SAMPLED)
def test_python_control_sampled_examples(name: str) -> None:
    loop, step, published = SAMPLED[name]
    agrees(margins(loop, control.tf([1.0], [1.0], step)), published, 1e-4)


def test_loop_at_a_time_of_a_sampled_three_by_three_loop() -> None:
    """RobustAndOptimalControl.jl's test: α = 0.794418036911981 at 4.05 rad/s, first channel."""
    A = np.array(
        [
            [1.0, 0.0, 9.84, 0.0, 0.0],
            [0.0, 1.0, 0.01, 2.14634e-6, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, -1.73983959887],
            [0.0, 0.0, 0.0, 0.0, 0.56597684805],
        ]
    )
    B = np.array(
        [
            [0.0, 4.901416e-5, 0.00019883877999999998],
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 4.0414389999999996e-5],
            [0.0, -0.02004649371, 0.0],
            [0.0, -0.00490141631, 0.0],
        ]
    )
    C = np.array(
        [
            [0.0, -0.83516488404, 0.0, 0.0, 0.0],
            [186.74725411661, 0.0, 0.0, 0.0, 0.0],
            [-7.44299057498, 0.0, 7035.08410814126, 0.0, 0.0],
        ]
    )
    D = np.array([[0.0] * 3, [34875.36444283988, 0.0, 0.0], [48304.01940122544, 0.0, 0.0]])
    value = FrequencyResponse(control.StateSpace(A, B, C, D, 0.01))(np.array([4.05]))[0]
    # The first channel with the two others closed.
    others = value[0, 0] - value[0, 1:] @ np.linalg.solve(np.eye(2) + value[1:, 1:], value[1:, 0])
    assert 1 / abs(1 / (1 + others) - 0.5) == pytest.approx(0.794418036911981, rel=1e-3)


def test_l_infinity_norm_of_the_slicot_example() -> None:
    """SLICOT AB13DD's own example: 0.5000000001e6 at 1.414213562 rad/s."""
    peak = peak_gain(control.StateSpace([[0, 1], [-2, -2e-6]], [[0], [1]], [[0, 1]], 0))
    assert peak.value == pytest.approx(0.5000000001e6, rel=1e-8)
    assert peak.omega == pytest.approx(1.414213562, abs=5e-10)
