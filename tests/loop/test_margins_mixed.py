"""Margins of loops that are not modal, against exact arithmetic (see `mixed_loops`)."""

from __future__ import annotations

import control
import numpy as np
import pytest
from mixed_loops import MixedLoop, random_mixed_loop, random_mixed_loops

from slewctl import Arm, Beam, Hub, state_space, truth
from slewctl.loop import Margins, UnstableLoopError
from slewctl.loop.margin_functions import margins

EXACT = 1e-9


def check(loop: MixedLoop, label: str) -> bool:
    """Fail on any margin that is wrong; return whether the loop is stable."""
    if not loop.stable:
        with pytest.raises(UnstableLoopError):
            margins(loop.plant, loop.controller, sign=loop.sign)
        return False
    m = margins(loop.plant, loop.controller, sign=loop.sign)
    pairs = zip(found(m), (*loop.gain_limits, *loop.phase_and_delay), strict=True)
    for ours, exact in pairs:
        assert ours == pytest.approx(exact, rel=EXACT), label
    crossings = 2 * np.pi * np.array(m.gain_crossings_hz)
    assert crossings == pytest.approx(loop.gain_crossings, rel=EXACT), label
    assert m.confirmed, (label, m.doubts)
    return True


def found(m: Margins) -> tuple[float, float, float, float]:
    down, up = 10 ** (-m.gain_reduction_db.value / 20), 10 ** (m.gain_db.value / 20)
    return down, up, np.radians(m.phase_deg.value), m.delay_s.value


def test_a_few_dozen_loops() -> None:
    loops = random_mixed_loops(1, 20)
    assert sum(check(loop, f"loop {i}, {loop.kind}") for i, loop in enumerate(loops)) >= 6


@pytest.mark.slow
def test_fifty_loops() -> None:
    loops = random_mixed_loops(2, 50)
    assert sum(check(loop, f"loop {i}, {loop.kind}") for i, loop in enumerate(loops)) >= 25


def test_a_pid_with_two_fast_lags_around_an_arm_is_stable() -> None:
    """In companion form ‖BC‖ is 1e9 times as large as any pole; no pole is hidden."""
    model = truth(Arm(Beam(1.0, 1.0, 1.0), hub=Hub(1e3), damping_ratio=0.003))
    J, wb = 1e3 + 1 / 3, 0.05 * float(model.omega[0])
    s = control.tf("s")
    lag = 1e-5
    K = control.tf([1.4 * J * wb, J * wb**2, 0.3 * J * wb**3], [1, 0])
    K = K * control.tf([1], [lag, 1]) * control.tf([1], [lag / 3, 1])
    m = margins(state_space(model, ["theta"]), K)
    # Far below the first mode the arm is rigid: the gain may fall to where k²·1.4 = 0.3 k.
    rigid = margins(K / (J * s**2))
    assert m.gain_reduction_db.value == pytest.approx(rigid.gain_reduction_db.value, rel=1e-2)
    assert 10 ** (-rigid.gain_reduction_db.value / 20) == pytest.approx(0.3 / 1.4, rel=1e-3)
    assert m.phase_deg.value == pytest.approx(rigid.phase_deg.value, rel=1e-2)
    assert m.confirmed


def test_a_gain_limit_over_eight_decades_of_time_scales_is_found() -> None:
    """Poles from 1e-7 to 8e3 rad/s: the closed loop is unstable with an eighth of the gain."""
    loop = eight_decades()
    m = margins(loop)
    factor = 10 ** (-m.gain_reduction_db.value / 20)
    assert 1 / 8 < factor < 1 / 7.9
    for side, stable in ((1 + 1e-3, True), (1 - 1e-3, False)):
        growth = np.linalg.eigvals(loop.A - side * factor * loop.B @ loop.C).real.max()
        assert (growth < 0) == stable
    assert m.confirmed


def eight_decades() -> control.StateSpace:
    """A slow motor, a lag and three modes of a compound, as they came from a random trial."""
    A = np.zeros((8, 8))
    A[0, 0] = -2.3059249094150554e-3
    A[1, :2] = 810.5291745587472, -810.5291745587472
    A[2, 3] = 0.003653922586690813
    A[3, 1:4] = 1, -0.003653922586690813, -1.858909495936367e-05
    A[4, 5] = 7845.3897879667165
    A[5, 1:6] = (1, 0.00021201814325753777, 0.000665834318444144, -7845.3897879667165,
                 -1419.767239812028)  # fmt: skip
    A[6, 7] = 0.000132432839446163
    A[7, 1:] = (1, 0.00021201814325753777, 0.000665834318444144, 4164.058997331365,
                278.0698259533042, -0.000132432839446163, -8.332559682089552e-07)  # fmt: skip
    B = 0.03443102470934779 * np.eye(8)[:, :1]
    C = np.array([[0, 1, 0.00021201814325753777, 0.000665834318444144, 4164.058997331365,
                   278.0698259533042, 0.00016744533337402457, 1.0101265660019896e-06]])  # fmt: skip
    return control.StateSpace(A, B, C, 0)


def test_zeros_that_rounding_splits_beside_an_integrator() -> None:
    """Two poles at the origin show as ±8e-5 beside 3e5 rad/s, a third one integrates them."""
    rng = np.random.default_rng(1)
    loop = [random_mixed_loop(rng, "decades") for _ in range(431)][-1]
    assert loop.stable
    told = found(margins(loop.plant, loop.controller, sign=loop.sign))
    assert told[2:] == pytest.approx(loop.phase_and_delay, rel=EXACT)
