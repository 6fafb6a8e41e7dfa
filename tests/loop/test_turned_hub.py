"""A hub that is turned as given: a published spin-up, and the torque that it takes."""

from __future__ import annotations

import math

import numpy as np
import pytest

import slewctl as sc
from slewctl import Arm, Beam, Hub, InputError, Payload


def spin_up(t: float) -> tuple[float, float, float]:
    """θ, θ̇ and θ̈ of Simo and Vu-Quoc, J. Appl. Mech. 53 (1986) 849–863: to 6 rad/s in 15 s."""
    if t >= 15:
        return 6 * t - 45, 6.0, 0.0
    w = 2 * math.pi / 15
    turned = t**2 / 2 + (math.cos(w * t) - 1) / w**2
    return 0.4 * turned, 0.4 * (t - math.sin(w * t) / w), 0.4 * (1 - math.cos(w * t))


def test_the_published_spin_up_of_a_beam() -> None:
    """−0.57437 m at 6.762 s, and ±3.6 mm left at full speed, with the tension of the beam."""
    equations = sc.large_slew(sc.assemble(Arm(Beam(10.0, 1.2, 1.4e4)), "clamped-free", n=6))
    t = np.unique([*np.linspace(0, 20, 1001), 6.762])
    turned = sc.simulate_turned_hub(equations, t, spin_up)
    lowest = int(np.argmin(turned.tip_deflection))
    assert t[lowest] == 6.762
    assert turned.tip_deflection[lowest] == pytest.approx(-0.57437, abs=1e-5)
    left = turned.tip_deflection[t >= 15]
    np.testing.assert_allclose([left.min(), left.max()], [-3.6e-3, 3.6e-3], rtol=0.02)
    assert turned.energy_error < 1e-10
    np.testing.assert_allclose(turned.theta, [spin_up(time)[0] for time in t])


def test_its_torque_turns_the_free_hub_in_the_same_way() -> None:
    arm = Arm(
        Beam(1.0, (1.0, -0.5), 1.0), Hub(0.3, 0.1, 0.2), Payload(0.1, 0.01), 0.02,
        damping=sc.Rayleigh(0.1, 1e-3),
    )  # fmt: skip
    equations = sc.large_slew(sc.assemble(arm, "arm-matched", n=3))
    t = np.linspace(0.0, 3.0, 3001)
    turned = sc.simulate_turned_hub(equations, t, sc.Slew(angle_deg=120.0, duration_s=2.0))
    free = sc.simulate_swing(equations, t, turned.torque)
    np.testing.assert_allclose(free.theta, turned.theta, atol=1e-5)
    np.testing.assert_allclose(free.tip_deflection, turned.tip_deflection, atol=1e-5)
    assert turned.energy_error < 1e-8


@pytest.mark.parametrize(
    ("angle", "words"),
    [
        (1.0, "angle: 1.0 is not a function of the time"),
        (lambda t: t, "is not three finite numbers"),
        (lambda t: (t, math.nan, 0.0), "is not three finite numbers"),
    ],
)
def test_an_impossible_motion_of_the_hub_is_refused(angle: object, words: str) -> None:
    equations = sc.large_slew(sc.assemble(Arm(Beam(1.0, 1.0, 1.0)), "clamped-free", n=1))
    with pytest.raises(InputError, match=words):
        sc.simulate_turned_hub(equations, np.linspace(0, 1, 3), angle)
