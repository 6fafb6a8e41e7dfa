"""Margins of hundreds of flexible loops against a brute-force truth."""

from __future__ import annotations

import numpy as np
import pytest
from brute_force import BruteMargins, brute_margins, loop_function
from modal_loops import ModalLoop
from random_loops import stable_loops

from slewctl import ClampedFree, Loop, Objective, assemble, close, generalised_plant, lqg
from slewctl import arms as catalogue
from slewctl.loop import Margins, classical_margins

_BEYOND = 1 / np.finfo(float).eps


def compare(margins: Margins, truth: BruteMargins, label: str) -> None:
    """Fail when a margin differs by more than 1e-7 relative, or a crossing is missing."""
    pairs = {
        # A limit beyond 1/ε is one of the rounded matrices; the modal sums have none.
        "gain": (min(10 ** (margins.gain_db.value / 20), _BEYOND), min(truth.up, _BEYOND)),
        "gain reduction": (10 ** (-margins.gain_reduction_db.value / 20), truth.down),
        "phase": (margins.phase_deg.value, truth.phase_deg),
        "delay": (margins.delay_s.value, truth.delay_s),
    }
    for name, (ours, theirs) in pairs.items():
        # A Schur form places a resonance to ε‖A‖; relative to a half-width that is below 1e-7.
        assert ours == pytest.approx(theirs, rel=1e-7), f"{label}: {name}"
    assert len(margins.gain_crossings_hz) == len(truth.gain_crossings), label


def check_loop(loop: Loop, label: str, points: int = 100) -> None:
    poles = np.concatenate([np.linalg.eigvals(loop.return_ratio.A), loop.poles])
    compare(loop.margins, brute_margins(loop_function(loop), poles, points), label)
    assert loop.margins.confirmed, label


def test_a_few_random_loops() -> None:
    for i, loop in enumerate(stable_loops(seed=1, count=3)):
        check_loop(loop, f"loop {i}")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 11))
def test_ten_random_loops(seed: int) -> None:
    for i, loop in enumerate(stable_loops(seed=seed, count=10)):
        check_loop(loop, f"seed {seed}, loop {i}", points=100)


@pytest.mark.slow
@pytest.mark.parametrize("objective_torque", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("n", [4, 7])
def test_undamped_paper_beam(n: int, objective_torque: float) -> None:
    """No damping at all: every open-loop pole lies on the axis."""
    objective = Objective(
        {"tip": 0.1, "torque": objective_torque},
        {"torque": 0.1, "theta": 1e-2, "theta_dot": 1e-2},
    )
    model = assemble(catalogue.get("paper-beam"), ClampedFree(n))
    loop = close(model, objective, lqg(generalised_plant(model, objective)))
    check_loop(loop, f"{n} functions")


# Loops on which an eigenvalue method can go wrong; each is stable, with figures of two digits.
HARD = {
    "infinite zeros of L(s) − L(−s) come out finite at 1e12 rad/s": ModalLoop(
        omega=(1.2, 63.0, 9500.0),
        zeta=(1e-4, 1e-4, 1e-4),
        residues=(0.49, 750.0, 75e6),
        zeros=(0.24, 0.71),
        lags=(170.0, 4.7, 5.8),
        gain=3.5e-9,
    ),
    "the same with a resonance at 17 rad/s that decides": ModalLoop(
        omega=(1.1, 3.7, 17.0, 34.0, 4900.0),
        zeta=(1e-4,) * 5,
        residues=(0.22, 0.8, 25.0, 14.0, 3.3e6),
        zeros=(0.11,),
        lags=(30.0, 29.0),
        gain=4.1e-6,
    ),
    "L crosses the real axis in an antiresonance, where rounding is relatively large": ModalLoop(
        omega=(0.0, 1.0),
        zeta=(0.0, 0.005),
        residues=(0.041, 0.041),
        zeros=(6.0, 0.054),
        lags=(5000.0, 140.0, 1.0, 39.0),
        gain=0.0062,
    ),
    "the same with three modes": ModalLoop(
        omega=(0.0, 5.0, 29.0, 390.0),
        zeta=(0.0, 1e-4, 1e-4, 1e-4),
        residues=(5500.0, 6.0, 27.0, 5500.0),
        zeros=(0.18, 7.4),
        lags=(16.0, 260.0, 1.2, 1.8),
        gain=1.1e-5,
    ),
}


@pytest.mark.parametrize("name", HARD)
def test_hard_loops(name: str) -> None:
    loop = HARD[name]
    margins = classical_margins(loop.system)
    compare(margins, brute_margins(loop.function, loop.poles), name)
    assert margins.confirmed


def test_modal_loop_helper_evaluates_its_own_state_space() -> None:
    loop = HARD["the same with three modes"]
    omega = np.geomspace(0.1, 1000, 50)
    eye = np.eye(loop.system.nstates)
    direct = [
        (loop.system.C @ np.linalg.solve(1j * w * eye - loop.system.A, loop.system.B))[0, 0]
        for w in omega
    ]
    np.testing.assert_allclose(direct, loop.function(omega), rtol=1e-9)


@pytest.mark.slow
def test_margins_do_not_depend_on_the_last_digits() -> None:
    """Fifteen designs that differ by parts per million have the same margins to as many."""
    model = assemble(catalogue.get("paper-beam"), ClampedFree(4))
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.01}
    for k in range(0, 60, 4):
        objective = Objective({"tip": 0.1, "torque": 1.0 + k * 1e-6}, noise)
        loop = close(model, objective, lqg(generalised_plant(model, objective)))
        assert loop.margins.gain_reduction_db.value == pytest.approx(20.9135, abs=2e-3), k
        assert loop.margins.gain_db.value == np.inf, k
        assert loop.margins.confirmed, k
