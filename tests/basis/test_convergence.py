"""Ritz frequencies come from above, as fast as theory says, in every basis.

The error of a frequency goes like Σ_{k>n} c_k² with the mode's curvature expanded in those of
the basis, c_k.  Where both are smooth and differ at an end of the beam first in derivative d,
c_k ~ k^(−1−d) and the error falls like n^(−1−2d).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from slewctl import Arm, Beam, Hub, Payload, Stations, assemble, truth
from slewctl.basis import (
    ArmMatched,
    Basis,
    ClampedFree,
    HubMatched,
    Polynomial,
    Slewing,
    WithStatic,
)

Make = Callable[[Arm, int], Basis]

STEP = Stations((0.0, 0.4, 0.4, 1.0), (3.0, 3.0, 1.0, 1.0))
ARMS = {
    "uniform, free": Arm(Beam(1.0, 1.0, 1.0)),
    "uniform, hub": Arm(Beam(1.0, 1.0, 1.0), Hub(0.1)),
    "taper, free": Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.5))),
    "taper, hub, payload": Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.5)), Hub(0.1), Payload(0.2)),
    "step, hub": Arm(Beam(1.0, STEP, STEP), Hub(0.1)),
}
MAKERS: dict[str, Make] = {
    "clamped-free": lambda arm, n: ClampedFree(n),
    "slewing": lambda arm, n: Slewing(n),
    "polynomial": lambda arm, n: Polynomial(n, arm.beam.breakpoints),
    "hub-matched": lambda arm, n: HubMatched(n),
    "static": lambda arm, n: WithStatic(ClampedFree(n - 1)) if n > 1 else ClampedFree(1),
    "one step": lambda arm, n: ArmMatched(n, 1),
    "arm-matched": lambda arm, n: ArmMatched(n),
}

# (arm, basis, rate, reason)
RATES = [
    ("uniform, free", "clamped-free", 7, "φ''''' = ω²θ at the root, the functions have none"),
    ("uniform, hub", "clamped-free", 7, "the same"),
    ("uniform, hub", "slewing", 1, "the hub's moment: φ'' ≠ 0 at the root"),
    ("taper, hub, payload", "slewing", 1, "the same"),
    ("taper, hub, payload", "clamped-free", 3, "the payload's force: φ''' ≠ 0 at the tip"),
    ("taper, hub, payload", "hub-matched", 5, "moment and force are met, (EI φ'')'' is not"),
    ("taper, free", "slewing", 5, "the same"),
    ("step, hub", "clamped-free", 1, "φ'' jumps at the step"),
    ("step, hub", "hub-matched", 1, "the same"),
    ("step, hub", "static", 3, "the static shape jumps as the modes do; φ''' is left"),
    ("step, hub", "one step", 9, "1, and the step divides c_k by ω_k² ~ k⁴"),
]


def errors(arm: Arm, make: Make, orders: tuple[int, ...], mode: int) -> np.ndarray:
    exact = truth(arm, 8).omega[mode - 1]
    return np.array([assemble(arm, make(arm, n)).omega[mode - 1] / exact - 1 for n in orders])


@pytest.mark.parametrize(("arm", "basis", "rate", "reason"), RATES)
def test_observed_rate_is_the_declared_one(arm: str, basis: str, rate: int, reason: str) -> None:
    """Mode 3, n = 6 to 24 or, where that is at rounding already, to 12: within 0.7 of the rate.

    At a step the remainder depends on its phase in the shapes, so that doubling n once would
    not do.
    """
    orders = (6, 12) if rate > 5 else (6, 24)
    error = errors(ARMS[arm], MAKERS[basis], orders, 3)
    assert np.all(error > 1e-12), "errors at rounding level have no rate"
    observed = np.log(error[0] / error[1]) / np.log(orders[1] / orders[0])
    assert observed == pytest.approx(rate, abs=0.7), reason


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("basis", ["polynomial", "arm-matched"])
def test_these_converge_faster_than_any_power_that_matters(arm: str, basis: str) -> None:
    error = errors(ARMS[arm], MAKERS[basis], (12, 24), 1)
    assert np.all(error <= [1e-10, 1e-13])


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("basis", MAKERS)
@pytest.mark.parametrize("n", [1, 2, 4, 9])
def test_frequencies_come_from_above_and_the_mass_is_positive(arm: str, basis: str, n: int) -> None:
    model = assemble(ARMS[arm], MAKERS[basis](ARMS[arm], n))
    exact = truth(ARMS[arm], 12)
    assert np.all(np.linalg.eigvalsh(model.mass) > 0)
    allowed = 1 - exact.frequency_errors[:n] - 1e-13
    assert np.all(model.omega / exact.omega[:n] >= allowed)


@pytest.mark.parametrize("ratio", [0.0, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("payload", [0.0, 0.1, 10.0])
def test_hub_matched_functions_are_exact_on_a_uniform_arm(ratio: float, payload: float) -> None:
    """Every Ritz frequency is a natural frequency, so the highest function is no false mode."""
    arm = Arm(Beam(2.0, 3.0, 5.0), Hub(8.0 * ratio, 0.2), Payload(6.0 * payload, payload))
    exact = truth(arm, 6)
    omega = assemble(arm, HubMatched(6)).omega
    assert omega == pytest.approx(exact.omega, rel=1e-12 + exact.tolerance)
