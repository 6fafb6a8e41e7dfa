"""Responses from logs: scipy's numbers, the exact response, and bands that hold what they say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import slewctl as sc
from slewctl.measured.rig_model import Modes, equations, response_of

T = 0.01
ARM = sc.Arm(sc.Beam(0.5, 0.3, 0.15), sc.Hub(0.003, friction=0.02), damping_ratio=0.03)
U = sc.prbs(12_000, amplitude=0.3, hold=2, seed=5)
LAW = ([4.0, -3.6], [1.0, -0.6])


def exact(frequencies_hz: np.ndarray, delay: float = 0.0, sensor: str = "theta") -> np.ndarray:
    system = equations(ARM, "torque", sensor, Modes(20))
    return response_of(system, 2 * np.pi * frequencies_hz, T, delay)


def test_the_exact_response_is_that_of_the_sampled_system() -> None:
    hz = np.linspace(0.3, 49, 40)
    model = sc.truth(ARM, 20)
    for delay, late in ((0.0, 0), (3 * T, 3)):
        sampled = sc.state_space(model, ["theta"], coordinates="modal", sample_time=T)
        z = np.exp(2j * np.pi * hz * T)
        expected = np.array([sampled(point) for point in z]) * z**-late
        np.testing.assert_allclose(exact(hz, delay), expected, rtol=1e-7)
    # A part of a sample: the same system sampled twice as fast, its input held twice as long.
    fast = sc.state_space(model, ["theta"], coordinates="modal", sample_time=T / 2)
    A, B, C = (np.asarray(m) for m in (fast.A, fast.B, fast.C))
    step, held = A @ A, A @ B  # the second half of a period holds the new input
    found = [
        (C @ np.linalg.solve(point * np.eye(len(A)) - step, B + held / point)).item() for point in z
    ]
    np.testing.assert_allclose(exact(hz, T / 2), found, rtol=1e-7)


def test_one_simulated_rig_follows_the_exact_response() -> None:
    pulse = np.zeros(4097)
    pulse[0] = 1.0
    hz = np.fft.rfftfreq(4096, T)[1:-1]
    z = np.exp(2j * np.pi * hz * T)
    for delay in (0.0, 0.4 * T, 2.7 * T):
        log = sc.simulated_log(ARM, pulse, T, delay=delay, gain=2.0)
        rates = np.fft.rfft(np.diff(log.output))[1:-1]
        np.testing.assert_allclose(rates / (z - 1), 2 * exact(hz, delay), rtol=1e-6)


def test_open_loop_estimates_are_scipys() -> None:
    log = sc.simulated_log(ARM, U, T, noise=1e-2, sensor="theta_dot")
    found = sc.estimate_response(log, segment_s=5.0)
    options = {"fs": 1 / T, "nperseg": 500, "noverlap": 250, "detrend": "constant"}
    _, S_uy = signal.csd(log.input, log.output, **options)
    _, S_uu = signal.welch(log.input, **options)
    _, S_yy = signal.welch(log.output, **options)
    _, coherence = signal.coherence(log.input, log.output, **options)
    np.testing.assert_allclose(found.values, (S_uy / S_uu)[2:-2], rtol=1e-9)
    np.testing.assert_allclose(found.coherence, coherence[2:-2], rtol=1e-9)
    other = sc.estimate_response(log, segment_s=5.0, method="H2")
    np.testing.assert_allclose(other.values, (S_yy / S_uy.conj())[2:-2], rtol=1e-9)


@pytest.mark.parametrize("closed", [False, True])
def test_the_band_holds_the_truth_as_often_as_it_says(closed: bool) -> None:
    feedback = LAW if closed else None
    inside, total = 0, 0
    for seed in range(2):
        log = sc.simulated_log(ARM, U, T, noise=5e-3, seed=seed, feedback=feedback)
        found = sc.estimate_response(log, segment_s=10.0)
        # Where a resonance is narrower than the resolution there is a bias beside the noise.
        far = np.abs(found.frequencies_hz[:, None] - sc.truth(ARM, 8).frequencies_hz).min(1) > 2
        far &= (found.frequencies_hz > 3) & (found.coherence > 0.3)
        off = np.abs(found.values - exact(found.frequencies_hz)) <= found.radius(0.95)
        inside, total = inside + np.count_nonzero(off & far), total + np.count_nonzero(far)
    assert total > 60
    assert 0.90 < inside / total <= 0.985


def test_in_closed_loop_the_reference_is_right_where_h1_is_not() -> None:
    log = sc.simulated_log(ARM, 0.02 * U, T, noise=5e-3, seed=1, feedback=LAW)
    assert log.closed_loop
    plain = sc.estimate_response(log, segment_s=6.0, method="H1")
    by_reference = sc.estimate_response(log, segment_s=6.0)
    band = (plain.frequencies_hz > 8) & (plain.frequencies_hz < 12)
    truth = exact(plain.frequencies_hz[band])
    off = [np.abs(np.mean(r.values[band] / truth) - 1) for r in (plain, by_reference)]
    assert off[0] > 3 * off[1]


def test_what_a_log_cannot_give_is_refused() -> None:
    log = sc.simulated_log(ARM, U[:500], T)
    for options, expected in (
        ({"segment_s": 4.0}, "400 samples of 500"),
        ({"method": "reference"}, "the log has no reference"),
        ({"method": "H3"}, "unknown name"),
    ):
        with pytest.raises(sc.InputError, match=expected):
            sc.estimate_response(log, **options)
