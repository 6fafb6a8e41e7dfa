"""Margins of random flexible loops, continuous and sampled, against a brute-force truth."""

from __future__ import annotations

import numpy as np
import pytest
from brute_force import BruteMargins
from flexible_loops import FlexibleLoop, random_flexible_loops

from slewctl.loop import Margins, UnstableLoopError
from slewctl.loop.margin_functions import margins

# A Schur form moves poles by ε‖A‖; beside a half-width of 1e-4 of a slow mode this is 1e-8.
EXACT = 1e-7


def check(loop: FlexibleLoop, label: str) -> bool:
    """Fail on any margin that is wrong; return whether the loop was stable."""
    if not loop.stable:
        with pytest.raises(UnstableLoopError):
            margins(loop.loop)
        return False
    compare(margins(loop.loop), loop.truth(), label)
    return True


def compare(m: Margins, truth: BruteMargins, label: str) -> None:
    pairs = {
        "gain": (10 ** (m.gain_db.value / 20), truth.up),
        "gain reduction": (10 ** (-m.gain_reduction_db.value / 20), truth.down),
        "phase": (m.phase_deg.value, truth.phase_deg),
        "delay": (m.delay_s.value, truth.delay_s),
    }
    for name, (ours, theirs) in pairs.items():
        assert ours == pytest.approx(theirs, rel=EXACT), f"{label}: {name}"
    assert len(m.gain_crossings_hz) == len(truth.gain_crossings), label
    for ours, grid in ((m.modulus.value, truth.modulus), (m.disk.value, truth.disk)):
        # The grid comes as near as its spacing, 1/25 of a half-width, and never nearer.
        assert grid * (1 - 1e-3) < ours <= grid * (1 + EXACT), label
    for crossing in (m.gain_db, m.gain_reduction_db, m.phase_deg, m.delay_s, m.modulus, m.disk):
        assert crossing.on_axis is None or crossing.on_axis < 1e-8, label
    assert m.confirmed, (label, m.doubts)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_few_flexible_loops(seed: int) -> None:
    loops = random_flexible_loops(seed, 9, 20)
    assert sum(check(loop, f"seed {seed}, loop {i}") for i, loop in enumerate(loops)) >= 2


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "number", "most"), [(20, 6, 60), (21, 12, 25)])
def test_many_flexible_loops(seed: int, number: int, most: int) -> None:
    loops = random_flexible_loops(seed, number, most)
    stable = sum(check(loop, f"seed {seed}, loop {i}") for i, loop in enumerate(loops))
    assert stable >= number // 4


def test_the_helper_evaluates_its_own_state_space() -> None:
    for loop in random_flexible_loops(3, 6, 20):
        top = np.pi / loop.step if loop.step else loop.omega[-1]
        omega = np.geomspace(loop.omega[1] / 30, top * 0.99, 40)
        s = np.exp(1j * omega * loop.step) if loop.step else 1j * omega
        L = loop.loop
        eye = np.eye(L.nstates)
        direct = np.array([(L.C @ np.linalg.solve(p * eye - L.A, L.B) + L.D)[0, 0] for p in s])
        near = np.abs(s[:, None] - np.linalg.eigvals(L.A)).min(axis=1)
        error = np.abs(direct / loop.function(omega) - 1)
        assert np.all(error < 1e-9 + 1e-12 * np.abs(L.A).max() / near)


def test_time_unit_does_not_matter() -> None:
    """With time in units of 1e-6 or 1e6 s the same loop has the same margins."""
    loop = next(loop for loop in random_flexible_loops(4, 30, 12) if not loop.step and loop.stable)
    plain = margins(loop.loop)
    for rate in (1e-6, 1e6):
        L = loop.loop
        m = margins(type(L)(L.A * rate, L.B * rate, L.C, L.D))
        assert m.phase_deg.value == pytest.approx(plain.phase_deg.value, rel=1e-9)
        assert m.delay_s.value * rate == pytest.approx(plain.delay_s.value, rel=1e-9)
        assert m.disk.value == pytest.approx(plain.disk.value, rel=1e-7)
        assert len(m.gain_crossings_hz) == len(plain.gain_crossings_hz)


def test_states_do_not_matter() -> None:
    """An orthogonal change of states costs digits, ε‖A‖ against the damping, and no crossing."""
    loop = next(lp for lp in random_flexible_loops(5, 40, 12) if lp.stable)
    L, plain = loop.loop, margins(loop.loop)
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal(L.A.shape))[0]
    m = margins(type(L)(Q.T @ L.A @ Q, Q.T @ L.B, L.C @ Q, L.D, L.dt))
    assert m.phase_deg.value == pytest.approx(plain.phase_deg.value, rel=1e-6)
    assert m.gain_db.value == pytest.approx(plain.gain_db.value, rel=1e-5)
    assert len(m.gain_crossings_hz) == len(plain.gain_crossings_hz)


def test_a_rigid_body_that_rounding_splits_is_at_the_end_of_the_circle() -> None:
    """Sampled, its two poles at z = 1 are 1 and 1 − 4e-16, in a matrix that couples no others."""
    loop = list(random_flexible_loops(11, 74))[73]
    assert loop.step
    assert check(loop, "loop 73")
    m = margins(loop.plant, loop.controller)
    assert m.confirmed
    compare(m, loop.truth(), "loop 73, in its factors")


@pytest.mark.parametrize(
    "number", [132, *(pytest.param(k, marks=pytest.mark.slow) for k in (471,))]
)
def test_three_integrals_in_one_matrix_are_at_the_origin(number: int) -> None:
    """A rigid body under integral action, multiplied out: the third pole was 2e-13 to 7e-12."""
    loop = list(random_flexible_loops(1, number + 1))[-1]
    assert check(loop, f"loop {number}")
