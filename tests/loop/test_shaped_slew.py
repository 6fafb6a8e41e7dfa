"""Shaped and other commands of a loop: what they leave on the truth, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loop_examples import OBJECTIVE, loop_on, uniform_arm

import slewctl as sc
from slewctl.files import read_design
from slewctl.loop.motion.feasible import least_duration, require_feasible
from slewctl.loop.motion.shaped_slew import ringing_modes, shaped
from slewctl.trajectory.shapers import SHAPERS

PID = {"kp": 20.0, "kd": 9.0, "filter_hz": 20.0}


def given_loop(damping_ratio: float = 0.005, T: float = 0.0, limit: float | None = None) -> sc.Loop:
    arm = uniform_arm(damping_ratio=damping_ratio)
    if limit:
        arm = replace(arm, actuator=sc.Actuator(torque_limit=limit))
    clock = {"sample_time": T, "discretise": "tustin"} if T else {}
    return sc.close(sc.truth(arm, 3), OBJECTIVE, sc.given(pid=PID, **clock))


def left(loop: sc.Loop, slew: sc.Slew) -> np.ndarray:
    """Amplitude of each ringing pole in the tip after a slew, slowest first, by least squares."""
    found = sc.simulate(loop, slew)
    after = found.t > slew.duration_s + 1e-9
    t = found.t[after] - slew.duration_s
    poles = loop.poles[loop.poles.imag >= 0]
    waves = np.exp(np.outer(t, poles))
    columns = np.hstack([waves.real, waves.imag[:, poles.imag > 0]])
    error = (found.tip - found.tip_reference)[after]
    parts = np.linalg.lstsq(columns, error, rcond=1e-12)[0]
    sines = np.zeros(len(poles))
    sines[poles.imag > 0] = parts[len(poles) :]
    sizes = np.hypot(parts[: len(poles)], sines)
    ringing = (poles.imag > 0) & (-poles.real < 0.5 * np.abs(poles))
    return sizes[ringing][np.argsort(np.abs(poles[ringing]))]


@pytest.mark.parametrize("damping_ratio", [0.002, 0.05])
@pytest.mark.parametrize("profile", ["minimum-jerk", "trapezoid", "rigid-time-optimal"])
def test_a_shaper_leaves_none_of_the_modes_it_is_made_for(profile, damping_ratio) -> None:
    loop = given_loop(damping_ratio)
    slew = sc.Slew(30.0, 3.0, 6.0, profile=profile)
    plain = left(loop, slew)
    modes = ringing_modes(loop, 2)
    which = [np.abs([abs(p) - m.frequency for p in _ringing(loop)]).argmin() for m in modes]
    for kind in ("zv", "zvd"):
        kept = left(loop, replace(slew, shaper=kind, modes=2))
        assert np.all(kept[which] < 2e-6 * plain.max() + 1e-4 * plain[which])


def _ringing(loop: sc.Loop) -> np.ndarray:
    poles = loop.poles
    poles = poles[(poles.imag > 0) & (-poles.real < 0.5 * np.abs(poles))]
    return poles[np.argsort(np.abs(poles))]


def test_modes_are_the_loops_own() -> None:
    loop = given_loop()
    for mode in ringing_modes(loop, 2):
        pole = -mode.ratio * mode.frequency + 1j * mode.damped
        assert np.abs(loop.poles - pole).min() < 1e-9 * mode.frequency
    sampled = given_loop(T=0.002)
    for mode, other in zip(ringing_modes(loop, 2), ringing_modes(sampled, 2), strict=True):
        assert other.frequency == pytest.approx(mode.frequency, rel=0.02)


def test_a_robust_shaper_is_made_for_the_error_that_is_asked() -> None:
    loop = given_loop(T=0.02)
    (mode,) = ringing_modes(loop, 1)
    off = mode.frequency * np.linspace(0.7, 1.3, 301)
    made = shaped(sc.Slew(30.0, 4.0, shaper="robust", frequency_error=0.3), loop).shaper
    assert made.residual(off, mode.ratio).max() <= 0.05
    less = shaped(sc.Slew(30.0, 4.0, shaper="robust"), loop).shaper
    assert less.duration < made.duration
    assert less.residual(off[100:201], mode.ratio).max() <= 0.05


def test_the_shaper_belongs_to_the_time_of_the_slew() -> None:
    made = shaped(sc.Slew(30.0, 2.0, shaper="zvd"), given_loop())
    t = np.array([0.0, 1.0, 2.0, 2.5])
    angle, rate, _ = made.reference(t)
    assert angle[2:] == pytest.approx(np.radians(30.0), rel=1e-12)
    assert rate[2:] == pytest.approx(0.0, abs=1e-12)
    assert made.turn.duration == pytest.approx(2.0 - made.shaper.duration)
    assert shaped(made, given_loop()) is made


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"shaper": "ei3", "duration_s": 0.5}, "give more than"),
        ({"shaper": "zzv"}, "zv"),
        ({"shaper": 3}, "slewctl.Shaper"),
        ({"modes": 2}, "modes of no shaper"),
        ({"shaper": "zv", "frequency_error": 0.1}, 'shaper = "robust"'),
        ({"shaper": "robust", "frequency_error": 1.5}, "0 < error < 1"),
        ({"shaper": "zv", "modes": 9}, "of the loop"),
        ({"shaper": "sampled"}, "no clock"),
        ({"profile": "s-curv"}, "s-curve"),
        ({"conditions": {}}, "slewctl.Conditions"),
    ],
)
def test_what_cannot_be_commanded_is_refused(change: dict[str, object], told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        shaped(sc.Slew(**{"angle_deg": 30.0, "duration_s": 2.0, **change}), given_loop())


def test_a_clock_too_slow_for_a_mode_is_refused_with_one_that_is_not() -> None:
    soft = {"kp": 0.5, "kd": 0.5, "filter_hz": 0.5}
    law = sc.given(pid=soft, sample_time=0.1, discretise="tustin")
    loop = sc.close(sc.truth(uniform_arm(), 3), OBJECTIVE, law)
    modes = ringing_modes(loop, 4)
    # The fastest is above half the sampling frequency, and no alias.
    assert modes[-1].frequency == pytest.approx(loop.model.omega[2], rel=1e-3)
    with pytest.raises(sc.InputError, match="sample every") as caught:
        shaped(sc.Slew(30.0, 9.0, shaper="zv", modes=4), loop)
    named = float(str(caught.value).split("sample every ")[1].split()[0])
    assert named <= modes[-1].half_period / 2


@pytest.mark.parametrize("profile", ["minimum-jerk", "s-curve", "rigid-time-optimal"])
def test_a_slew_that_is_too_fast_is_refused_with_the_time_that_works(profile: str) -> None:
    loop = given_loop(limit=2.0)
    slew = sc.Slew(90.0, 0.6, profile=profile)
    with pytest.raises(sc.InputError, match=r"needs .* N·m, the actuator has 2; take at least"
                       ) as caught:  # fmt: skip
        require_feasible(loop, slew)
    named = float(str(caught.value).split("at least ")[1].split()[0])
    require_feasible(loop, replace(slew, duration_s=named))
    with pytest.raises(sc.InputError):
        require_feasible(loop, replace(slew, duration_s=0.99 * named))
    assert least_duration(loop, slew) == pytest.approx(named, rel=5e-3)
    judged = sc.Problem(loop.model.arm, OBJECTIVE.limits, OBJECTIVE.noise, slew, truth_modes=3)
    told = judged.judge(loop.controller).saturation
    assert f"at least {named:.3g} s" in told


@pytest.mark.slow
def test_commands_side_by_side() -> None:
    loop = given_loop(T=0.02, limit=20.0)
    found = sc.compare_commands(loop, sc.Slew(30.0, 3.0), modes=2, error=0.15)
    by = {command.name: command for command in found.commands}
    assert by["none"].residual == 1
    assert by["zv"].residual < 1e-12 < by["zv"].residual_off
    assert by["zvd"].residual_off < by["zv"].residual_off
    assert by["robust"].residual_off <= 0.05
    assert by["zvd"].tip_m < by["none"].tip_m
    off, left_over = found.sensitivity("robust")
    assert left_over[np.abs(off) <= 0.15].max() <= 0.05
    assert all(row["shaper"] for row in found.rows())
    rigid = {need.name: need for need in found.profiles}
    # By hand: 4 Jα/T² of a bang-bang, 10/√3 of minimum jerk.
    inertia = float(loop.model.mass[0, 0])
    wanted = 4 * inertia * np.radians(30) / 3.0**2
    assert rigid["rigid-time-optimal"].torque == pytest.approx(wanted, rel=1e-9)
    wanted *= 10 / np.sqrt(3) / 4
    assert rigid["minimum-jerk"].torque == pytest.approx(wanted, rel=1e-5)
    least = 3.0 * np.sqrt(wanted / 20.0)
    assert rigid["minimum-jerk"].least_s == pytest.approx(least, rel=1e-3)


def test_an_exact_slew_alone_is_exact() -> None:
    loop = loop_on(uniform_arm())
    with pytest.raises(sc.InputError, match=r"problem\.simulate"):
        sc.simulate_slew(loop, sc.Slew(30.0, 2.0, profile="versine"))


def test_a_slew_is_written_and_read_again(tmp_path: Path) -> None:
    slew = sc.Slew(
        30.0, 2.0, 5.0, profile="s-curve", shaper="robust", modes=2, frequency_error=0.2,
        conditions=sc.Conditions(
            saturate=True, coulomb_friction=0.1, noise=True, seed=3,
            loads=[sc.Load(1.0, torque=0.2), sc.Load(2.0, tip_force=0.1, until_s=2.5)],
        ),
    )  # fmt: skip
    arm = given_loop(limit=2.0).model.arm
    problem = sc.Problem(arm, OBJECTIVE.limits, OBJECTIVE.noise, slew)
    path = tmp_path / "written.toml"
    path.write_text(problem.to_toml("lqg", sample_time=0.01))
    assert read_design(path).case.slew == slew
    with pytest.raises(sc.InputError, match="its name"):
        replace(
            slew, shaper=sc.shaper("zv", sc.Mode(9.0)), modes=None, frequency_error=None
        ).table()


def test_a_shaper_that_a_damped_mode_has_not_got_is_told_and_the_others_made() -> None:
    beam = sc.Beam.rectangular(
        0.6, width=0.03, thickness=0.0015, youngs_modulus=2.0e11, density=7850.0
    )
    arm = sc.Arm(beam, sc.Hub(0.01), sc.Payload(0.05), damping_ratio=0.01)
    noise = {"torque": 0.002, "theta": 2e-4, "theta_dot": 3e-3}
    problem = sc.Problem(arm, {"tip": 0.03, "torque": 0.07}, noise, truth_modes=6)
    loop = problem.judge(sc.lqg(problem.plant("arm-matched", n=2))).loop
    found = sc.compare_commands(loop, sc.Slew(30.0, 1.5))
    assert found.modes[0].ratio > 0.3
    assert "leaves less than" in found.left_out["ei3"]
    assert {*found.left_out, *(command.name for command in found.commands)} >= {*SHAPERS}
    assert len(found.commands) > 4
