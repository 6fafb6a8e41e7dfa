"""The fastest turn on a clock, within limits of torque, its rate, and the voltage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import slewctl as sc

MODES = [sc.Mode(2**0.5)]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ratio", [0.0, 0.03])
def test_with_a_torque_limit_alone_it_is_the_switching_turn(order: int, ratio: float) -> None:
    modes, T = [sc.Mode(2**0.5, ratio)], 0.05
    exact = sc.rest_to_rest(1.0, 1.0, 2.0, modes, order=order)
    found = sc.limited_turn(1.0, sc.Drive(torque=1.0), 2.0, modes, T, order=order)
    assert exact.duration - 1e-9 <= found.duration < exact.duration + 2 * T
    assert np.abs(found.torques).max() <= 1 + 1e-9
    assert found.residual < 1e-9


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_limits_of_rate_and_voltage_hold_and_cost_time(friction: float) -> None:
    inertia, T, gain, emf = 2.0, 0.05, 0.5, 1.0
    drives = [
        sc.Drive(torque=1.0),
        sc.Drive(torque=1.0, torque_rate=2.0),
        sc.Drive(torque=1.0, voltage=2.0, torque_per_volt=gain, volts_per_rate=emf),
    ]
    free, slow, fed = (
        sc.limited_turn(-1.0, drive, inertia, MODES, T, friction=friction) for drive in drives
    )
    assert min(slow.duration, fed.duration) > free.duration
    steps = np.diff(slow.torques, prepend=0, append=0)
    assert np.abs(steps).max() <= 2.0 * T * (1 + 1e-6)
    # The rigid arm's rate by its own equation.
    a = np.exp(-friction / inertia * T)
    b = (1 - a) / friction if friction else T / inertia
    rate = [0.0]
    for torque in fed.torques:
        rate.append(a * rate[-1] + b * torque)
    for ends in (rate[:-1], rate[1:]):
        volts = fed.torques / gain + emf * np.array(ends)
        assert np.abs(volts).max() <= 2.0 * (1 + 1e-6)
    assert rate[-1] == pytest.approx(0, abs=1e-9)


def test_the_projects_own_truth_comes_to_rest() -> None:
    arm = sc.Arm(sc.Beam(1.0, 1.0, 1.0), sc.Hub(0.3, 0.1), damping_ratio=0.01)
    model = sc.truth(arm, 3)
    modes = [sc.Mode(w, 0.01) for w in model.omega]
    T = 0.02
    turn = sc.limited_turn(0.5, sc.Drive(torque=1.0), model.mass[0, 0], modes, T)
    zero, n = np.zeros_like(model.mass), len(model.mass)
    back = np.linalg.inv(model.mass)
    A = np.block([[zero, np.eye(n)], [-back @ model.stiffness, -back @ model.damping]])
    b = np.concatenate([np.zeros(n), back @ model.input])[:, None]
    step = expm(T * np.block([[A, b], [np.zeros((1, 2 * n + 1))]]))
    state = np.zeros(2 * n)
    for torque in turn.torques:
        state = step[:-1, :-1] @ state + step[:-1, -1] * torque
    assert state[0] == pytest.approx(0.5, abs=1e-8)
    assert np.abs(state[1:]).max() < 1e-8
    np.testing.assert_array_equal(turn.torque(np.array([-1.0, 0.0, 99.0])), [0, turn.torques[0], 0])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"angle": 0.0}, "give an angle"),
        ({"sample_time": 2.0}, "take at most 1.11"),
        ({"order": 3}, "1 or 2"),
        ({"drive": {}}, "largest torque"),
        ({"drive": {"voltage": 1.0}}, "torque_per_volt"),
        ({"drive": {"torque": -1.0}}, "torque"),
        ({"friction": -1.0}, "friction"),
    ],
)
def test_impossible_turns_are_refused(change: dict[str, object], told: str) -> None:
    asked = {"angle": 1.0, "drive": {"torque": 1.0}, "sample_time": 0.05, **change}

    def turn(angle: float, drive: dict[str, float], **rest: object) -> sc.HeldTurn:
        return sc.limited_turn(angle, sc.Drive(**drive), 2.0, MODES, **rest)

    with pytest.raises(sc.InputError, match=told):
        turn(**asked)


@pytest.mark.slow
@pytest.mark.parametrize("time", [1e-9, 1e-3, 1e9])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e7])
def test_units_change_nothing(time: float, size: float) -> None:
    """Seconds, and kilogrammes with newtons, by any factor: the same turn."""
    drives = [
        sc.Drive(torque=size / time**2),
        sc.Drive(torque=size / time**2, torque_rate=2 * size / time**3),
        sc.Drive(voltage=2.0, torque_per_volt=0.5 * size / time**2, volts_per_rate=1.0 * time),
    ]
    modes, T = [sc.Mode(2**0.5 / time)], 0.05 * time
    found = [sc.limited_turn(1.0, each, 2.0 * size, modes, T).duration / time for each in drives]
    assert found == pytest.approx([4.25, 4.8, 4.25], rel=1e-12)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"drive": None}, "drive: "),
        ({"drive": "strong"}, "drive: "),
        ({"modes": [12.0]}, "modes: "),
        ({"modes": sc.Mode(12.0)}, "modes: "),
        ({"modes": None}, "modes: "),
        ({"order": 1.0}, "order: 1.0 is no order"),
        ({"order": True}, "order: True is no order"),
    ],
    ids=str,
)
def test_what_is_no_turn_is_refused_in_one_line(wrong: dict[str, object], words: str) -> None:
    asked = {"drive": sc.Drive(torque=1.0), "modes": MODES, "order": 1} | wrong
    with pytest.raises(sc.InputError, match=words):
        sc.limited_turn(1.0, inertia=2.0, sample_time=0.05, **asked)  # type: ignore[arg-type]


def test_a_motor_without_a_limit_of_its_voltage_means_nothing() -> None:
    with pytest.raises(sc.InputError, match=r"drive\.torque_per_volt: is a motor's"):
        sc.Drive(torque=1.0, torque_per_volt=0.5)
    with pytest.raises(sc.InputError, match=r"drive\.torque_per_volt: -1 is negative"):
        sc.Drive(torque=1.0, torque_per_volt=-1.0)
