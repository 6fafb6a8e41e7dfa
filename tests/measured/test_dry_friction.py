"""Dry friction of a rig: what its signs, read from a noisy log, do to the intervals of a fit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import slewctl as sc
from slewctl.measured.noise_spectrum import drawn
from slewctl.measured.record_data import RecordData
from slewctl.measured.redrawn import widened
from slewctl.measured.rig_model import modes_for
from slewctl.measured.rig_parameters import Rig

T, DRY = 0.005, 0.15
BEAM = sc.Beam(0.6, 0.3, 1.2)
RIG = sc.Arm(BEAM, sc.Hub(0.02, friction=0.02), damping_ratio=(0.012, 0.01))
GUESSED = sc.Arm(sc.Beam(0.6, 0.3, 1.0), sc.Hub(0.024, friction=0.03), damping_ratio=0.01)
TRUE = {"beam.stiffness": 1.2, "hub.inertia": 0.02, "hub.friction": 0.02, "delay": 0.006,
        "damping.1": 0.012}  # fmt: skip


def log_of(seed: int, samples: int = 2000) -> sc.Log:
    return sc.simulated_log(
        RIG, sc.prbs(samples, hold=2, seed=seed), T, delay=0.006, dry_friction=DRY,
        counts_per_turn=4096,
    )  # fmt: skip


@pytest.mark.slow
def test_intervals_hold_what_is_true_in_spite_of_dry_friction() -> None:
    """Those of least squares alone hold half of it: wrong signs are no noise that they know."""
    off, inside = [], 0
    for seed in range(2):
        found = sc.fit(GUESSED, log_of(seed), list(TRUE))
        for name, value in TRUE.items():
            low, high = found.interval(name)
            inside += low <= value <= high
            off.append((found[name].value - value) / found[name].standard_deviation)
        assert any("widened by what wrong signs do" in remark for remark in found.remarks)
    assert inside >= 9
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5


def test_a_log_is_drawn_of_the_rig_that_was_fitted() -> None:
    """Its readings are those of the simulated log, which another integrator makes, and its
    noise has the spectrum that was read."""
    log = log_of(1)
    exact = sc.simulated_log(
        RIG, sc.prbs(2000, hold=2, seed=1), T, delay=0.006, dry_friction=DRY
    ).output  # fmt: skip
    data = RecordData(log, modes_for(RIG, 40.0))
    data.weight = np.full(len(data.omega), 1e7)
    (once,) = data.drawn_anew(Rig(RIG, 1.0, 0.006), DRY, np.random.default_rng(1), 1)
    # They hold friction in steps of their own, where the hub comes to rest.
    np.testing.assert_allclose(once._log.output, exact, atol=4e-3 * np.ptp(exact))
    assert once.dry_friction(once.state_part(Rig(RIG, 1.0, 0.006)))[0] == pytest.approx(
        DRY, rel=1e-3
    )


def test_drawn_noise_has_the_spectrum_that_was_asked_for() -> None:
    bins, count = np.arange(1, 400), 800
    weight = 1 + np.arange(399) / 50
    rng = np.random.default_rng(2)
    power = np.mean(
        [
            np.abs(np.fft.rfft(drawn(rng, weight, bins, count))[bins]) ** 2 / count
            for _ in range(400)
        ],
        axis=0,
    )
    np.testing.assert_allclose(power * weight**2, 1.0, atol=0.3)
    assert np.mean(power * weight**2) == pytest.approx(1.0, abs=0.02)


@given(st.integers(0, 10_000), st.integers(1, 5), st.floats(0, 100))
def test_a_covariance_is_widened_and_never_narrowed(seed: int, n: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((n, n))
    covariance = root @ root.T
    moves = size * rng.standard_normal((6, n))
    found = widened(covariance, moves)
    assert (np.diag(found) >= np.diag(covariance) * (1 - 1e-12)).all()
    assert (np.diag(found) >= np.mean(moves**2, axis=0) * (1 - 1e-12)).all()
    assert np.linalg.eigvalsh(found).min() >= -1e-9 * np.trace(found)
    np.testing.assert_array_equal(widened(covariance, 0 * moves), covariance)
