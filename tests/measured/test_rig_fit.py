"""Fits to responses and logs: what they find, how well, and what they say of it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from inspect import signature
from pathlib import Path

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

import slewctl as sc
from slewctl.files import read_arm, read_design
from slewctl.measured import rig_problem
from slewctl.measured.dry_friction import Rubbing, mean_sign
from slewctl.measured.ellipsoid import ellipsoid_ends
from slewctl.measured.noise_spectrum import smooth
from slewctl.measured.record_data import RecordData
from slewctl.measured.record_descent import descend_record, without_state
from slewctl.measured.response_data import ResponseData, highest_seen, rig_response, thinned
from slewctl.measured.rig_fit_result import _KEYS
from slewctl.measured.rig_model import Channel, Modes, equations, modes_for
from slewctl.measured.rig_parameters import NAMES, Rig, parameters, with_dead_time
from slewctl.measured.rig_problem import RigProblem

T = 0.01
NOMINAL = sc.Arm(sc.Beam(0.6, 0.4, 0.5), sc.Hub(0.01, friction=0.01), damping_ratio=0.01)
TRUE = sc.vary(
    NOMINAL,
    stiffness_factor=1.35,
    hub_inertia=0.014,
    hub_friction=0.02,
    damping_ratio=[0.006, 0.01],
)
RIG = Rig(TRUE, 0.85, 0.017)
FREE = ["beam.stiffness", "hub.inertia", "hub.friction", "damping.1", "delay", "gain"]
EXPECTED = dict(zip(FREE, (1.35, 0.014, 0.02, 0.006, 0.017, 0.85), strict=True))


def exact(sample_time: float, sensor: str = "theta") -> sc.Response:
    hz = np.linspace(0.3, 40, 150)
    values = rig_response(
        RIG, Channel("torque", sensor, sample_time), modes_for(NOMINAL, 40.0), 2 * np.pi * hz
    )
    return sc.Response(hz, values, sample_time=sample_time, sensor=sensor)


MEASURED = exact(T)


def record(seed: int = 1, samples: int = 3000, **options: object) -> sc.Log:
    u = sc.prbs(samples, amplitude=0.2, hold=2, seed=seed)
    return sc.simulated_log(TRUE, u, T, gain=RIG.gain, delay=RIG.delay, seed=seed, **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_an_exact_response_gives_the_rig_back() -> None:
    measured = exact(T, "tip")
    found = sc.fit(NOMINAL, measured, FREE)
    for name, value in EXPECTED.items():
        assert found[name].value == pytest.approx(value, rel=1e-5), name
    assert found.undetermined == ()
    np.testing.assert_allclose(found.computed(), measured.values, rtol=1e-4)
    for root in found.roots:
        if root.frequency_hz < 20 and np.isfinite(root.measured_hz):
            assert root.measured_hz == pytest.approx(root.frequency_hz, rel=2e-2)


def test_a_record_is_explained_to_rounding_by_the_rig_that_made_it() -> None:
    for options in ({}, {"sensor": "root_moment"}, {"feedback": ([0.5, -0.45], [1.0, -0.5])}):
        data = RecordData(record(samples=1500, **options), Modes(20))
        data.weight = np.ones(len(data.omega))  # there is no noise to be read
        whole = np.linalg.norm(data.Y)
        assert np.linalg.norm(data.errors(RIG)) > 1e-3 * whole  # the state's part leaks
        assert np.linalg.norm(data.state_part(RIG).left) < 1e-7 * whole
        wrong = replace(RIG, delay=RIG.delay + 0.1 * T)
        assert np.linalg.norm(data.state_part(wrong).left) > 1e-4 * whole


def test_the_gradient_is_that_of_what_is_left_with_the_state_eliminated() -> None:
    data = RecordData(record(samples=1500, noise=2e-3), modes_for(NOMINAL, 40.0))
    free = parameters(NOMINAL, FREE, data.channel, 40.0)
    problem = RigProblem(Rig(NOMINAL), free)
    values = np.array([value * 1.02 for value in EXPECTED.values()])
    scales = np.array([each.scale for each in free])
    here = np.where(problem.logarithmic, np.log(values), values / scales)

    def cost(x: np.ndarray) -> float:
        vector = data.state_part(problem.rig_at(x)).vector
        return 0.5 * float(vector @ vector)

    remainder = data.state_part(problem.rig_at(here))
    slopes = problem.differences(partial(without_state, data, remainder), here)
    gradient = slopes.T @ remainder.vector
    steps = 1e-5 * np.eye(len(here))
    expected = np.array([(cost(here + h) - cost(here - h)) / 2e-5 for h in steps])
    np.testing.assert_allclose(gradient, expected, rtol=2e-3, atol=1e-4 * abs(expected).max())


def test_the_spectrum_of_noise_is_found_steep_or_flat() -> None:
    rng = np.random.default_rng(1)
    shape = 1e3 / np.arange(1, 3001) ** 2.0 + 1e-3
    power = shape * rng.exponential(size=3000)
    found = smooth(power)
    assert np.mean(np.log(found / shape)[20:]) == pytest.approx(0, abs=0.05)
    assert np.std(np.log(found / shape)[200:]) < 0.25


@pytest.mark.parametrize("power", [-2.0, 0.0, 1.0])
def test_the_noise_of_the_lowest_bins_is_not_that_of_the_next(power: float) -> None:
    """They have neighbours on one side alone; a mean over them would be e^-3 of drifting noise."""
    rng, shape = np.random.default_rng(3), np.arange(1, 1001) ** power
    found = [np.log(smooth(shape * rng.exponential(size=1000)) / shape) for _ in range(200)]
    assert np.abs(np.mean(found, axis=0)).max() < 0.5


def test_what_a_fit_has_taken_of_the_noise_is_no_lack_of_it() -> None:
    rng = np.random.default_rng(2)
    free = np.ones(400)
    free[:40], free[200:210] = 0.25, 0.1  # as where a state, and where a light mode, is fitted
    # So many of two squares are left at each bin, in the mean.
    found = np.array([smooth(rng.gamma(free), free) for _ in range(600)])
    assert np.mean(np.log(found[:, :40])) == pytest.approx(0, abs=0.05)
    assert np.mean(np.log(found[:, 190:220])) == pytest.approx(0, abs=0.05)


def quiet_light_rig() -> tuple[RecordData, RigProblem, np.ndarray]:
    """Return the record of a mode far above the noise, what is free, and the true coordinates."""
    light = sc.vary(TRUE, damping_ratio=[0.002, 0.01])
    u = sc.prbs(3000, amplitude=0.2, hold=2, seed=3)
    log = sc.simulated_log(light, u, T, gain=RIG.gain, delay=RIG.delay, noise=2e-4, seed=3)
    data = RecordData(log, modes_for(NOMINAL, 40.0))
    data.weight = np.full(len(data.omega), 1 / 2e-4)
    free = parameters(NOMINAL, FREE, data.channel, 40.0)
    problem = RigProblem(Rig(replace(light, damping_ratio=(0.01, 0.01))), free)
    values = np.array([{**EXPECTED, "damping.1": 0.002}[each.name] for each in free])
    values[0] = 1.0  # a factor on the stiffness that `light` has
    scales = np.array([each.scale for each in free])
    return data, problem, np.where(problem.logarithmic, np.log(values), values / scales)


def test_a_descent_ends_where_the_squares_are_least() -> None:
    data, problem, true = quiet_light_rig()
    data.expect(problem.rig_at(true))
    start = true + 1e-3 * np.array([0.3, 1.0, -1.0, 5.0, 0.0, 1.0])
    found = descend_record(problem, data, start, fine=True)
    remainder = data.state_part(problem.rig_at(found))
    slopes = problem.differences(partial(without_state, data, remainder), found)
    Q, R = np.linalg.qr(slopes)
    # What one more step would be, in deviations, and how far the truth is.
    assert np.linalg.norm(Q.T @ remainder.vector) < 0.1
    assert np.sum((R @ (true - found)) ** 2) < chi2.ppf(0.999, len(true))


def test_a_mode_that_the_input_hardly_moves_is_no_free_vibration() -> None:
    data, problem, true = quiet_light_rig()
    rig = problem.rig_at(true)
    data.expect(rig)
    u = np.concatenate([np.zeros(2), sc.prbs(3000, amplitude=0.2, hold=2, seed=3)]) * RIG.gain
    system, held = data._held(rig)
    x, states = np.zeros(len(held.transition)), []
    for now, before in zip(u[1:], u[:-1], strict=True):
        states.append(x)
        x = held.transition @ x + held.now * now + held.before * before
    moved = np.sqrt(2 * np.mean(np.square(states), axis=0) / data.count)
    assert data._pull[0] == 0.0  # where an angle is counted from
    assert system.A[:, 0].any() == 0
    np.testing.assert_allclose(1 / data._pull[1:], moved[1:], rtol=0.35)


def test_dry_friction_stops_a_hub_and_does_no_more() -> None:
    step, rate = 0.3, 1.0
    assert mean_sign(rate, rate + 0.1, step) == 1.0
    assert mean_sign(-rate, -rate - 0.1, step) == -1.0
    assert mean_sign(0.0, 0.2, step) == pytest.approx(0.2 / 0.3)  # it stays
    assert mean_sign(0.2, 0.1, step) == pytest.approx(0.5 + 0.5 * -0.1 / 0.3)  # it stops half-way
    for before in np.linspace(-1, 1, 21):
        for free in np.linspace(-1, 1, 21):
            found = mean_sign(before, free, step)
            assert -1 <= found <= 1
            assert mean_sign(-before, -free, step) == pytest.approx(-found)
            after = free - step * found
            # What it stopped moves on only as far as the input turns it back.
            assert after * before > -1e-12 or abs(free - before) > step


@pytest.mark.slow
def test_dry_friction_has_the_sign_of_a_rate_that_nobody_measured() -> None:
    """Counts of half a degree, so that differences of the angle miss where the hub turns."""
    F = 0.03
    u = sc.prbs(2000, amplitude=0.2, hold=2, seed=5)
    options = {"gain": RIG.gain, "delay": RIG.delay, "dry_friction": F}
    log = sc.simulated_log(TRUE, u, T, noise=2e-3, counts_per_turn=1024, seed=5, **options)  # type: ignore[arg-type]
    system = equations(TRUE, "torque", "theta", Modes(8), beside=("theta_dot",))
    exact = sc.simulated_log(TRUE, u, T, sensor="theta_dot", **options)  # type: ignore[arg-type]
    model = Rubbing.of(system, system.B[:, 0], T, RIG.delay, F, 2e-3)
    found = model.signs(RIG.gain * log.input, log.output, F)[:, 0]
    read = np.sign(np.diff(log.output, append=log.output[-1]))
    wrong = [np.mean(np.abs(np.sign(exact.output) - signs) > 1) for signs in (found, read)]
    assert wrong[0] < 0.02 < wrong[1]
    fitted = sc.fit(TRUE, log, ["hub.friction", "delay", "gain"])
    assert fitted["hub.friction"].value == pytest.approx(0.02, rel=0.1)
    assert any("dry friction of about 0.03 N·m" in remark for remark in fitted.remarks)


@pytest.fixture(scope="module")
def fitted() -> sc.RigFit:
    log = record(noise=2e-3, counts_per_turn=4096)
    found = sc.fit(NOMINAL, log, FREE)
    assert isinstance(found, sc.RigFit)
    return found


@pytest.mark.slow
def test_a_log_gives_the_rig_within_its_intervals(fitted: sc.RigFit) -> None:
    for name, value in EXPECTED.items():
        low, high = fitted.interval(name, 0.999)
        assert low <= value <= high, name
    assert fitted["damping.1"].standard_deviation < 0.1 * 0.006
    assert fitted["beam.stiffness"].standard_deviation < 2e-3
    assert fitted.scatter == pytest.approx(1, abs=0.05)
    # The window of the estimate is wider than the resonance, and the log's fit is not misled.
    first = fitted.roots[0]
    assert first.kind == "pole"
    assert first.frequency_hz == pytest.approx(sc.truth(TRUE, 1).frequencies_hz[0], rel=2e-3)
    assert "with 95 %" in str(fitted)


@pytest.mark.slow
def test_what_was_found_becomes_a_design_file(fitted: sc.RigFit, tmp_path: Path) -> None:
    variations = fitted.variations()
    assert len(variations) == 2 * 5  # the gain is not the arm's
    late = [keys["actuator_delay"] for keys in variations.values()]
    assert min(late) < fitted.arm.drive.delay < max(late)
    path = tmp_path / "fitted.toml"
    text = fitted.to_toml(
        model={"basis": "arm-matched", "n": 2},
        controller={"method": "given", "pid": {"kp": 1.0, "kd": 0.2, "filter_hz": 20.0}},
        requirements={"gain_margin_db": 3.0},
        variations=variations,
    )
    path.write_text(text, encoding="utf-8")
    design = read_design(path)
    assert design.case.arm == fitted.arm
    for name, keys in variations.items():
        (found,) = [each for each in design.variations if each.name == name]
        assert found.arm == sc.vary(fitted.arm, **keys)
    stiffness = [keys["stiffness_factor"] for keys in variations.values()]
    assert min(stiffness) < 1 < max(stiffness)


def test_all_that_a_fit_adjusts_of_an_arm_can_be_varied() -> None:
    assert {*NAMES} - {"gain", "damping.1"} == _KEYS.keys()
    assert {*_KEYS.values()} <= signature(sc.vary).parameters.keys()


@given(st.integers(0, 10**6), st.integers(1, 5))
@settings(max_examples=20)
def test_the_ends_lie_on_the_ellipsoid_in_any_unit(seed: int, p: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(p, p))
    covariance, values = root @ root.T + 0.1 * np.eye(p), 1e3 + np.zeros(p)
    log = np.zeros(p, dtype=bool)
    ends = ellipsoid_ends(values, covariance, log, 0.95) - values
    assert ends.shape == (2 * p, p)
    distance = np.einsum("ij,jk,ik->i", ends, np.linalg.inv(covariance), ends)
    np.testing.assert_allclose(distance, chi2.ppf(0.95, p), rtol=1e-6)
    unit = np.exp(rng.normal(size=p))
    scaled = ellipsoid_ends(values * unit, covariance * np.outer(unit, unit), log, 0.95)
    np.testing.assert_allclose(scaled, (ends + values) * unit, rtol=1e-9)


@given(st.lists(st.floats(-0.5, 0.5), min_size=5, max_size=5))
@settings(max_examples=10)
def test_units_of_torque_change_nothing(turns: list[float]) -> None:
    in_milli = sc.Arm(sc.Beam(0.6, 400.0, 500.0), sc.Hub(10.0, friction=10.0), damping_ratio=0.01)
    names = [name for name in FREE if name != "delay"]
    vectors, starts = [], []
    for arm, unit in ((NOMINAL, 1.0), (in_milli, 1e-3)):
        measured = replace(MEASURED, values=MEASURED.values * unit)
        data = ResponseData(measured, modes_for(arm, 40.0))
        problem = RigProblem(Rig(arm), parameters(arm, names, data.channel, 40.0))
        own = problem.start()
        starts.append(np.exp(own) / problem.values(own))
        vectors.append(data.residual(problem.rig_at(own + turns)))
    np.testing.assert_allclose(starts[0], starts[1])
    np.testing.assert_allclose(vectors[0], vectors[1], rtol=1e-6, atol=1e-6)


@pytest.mark.slow
def test_what_cannot_be_told_apart_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rig_problem, "_STARTS", 1)  # it starts where it should end
    measured = MEASURED
    scaled = ["beam.stiffness", "beam.mass", "hub.inertia", "hub.friction", "gain"]
    both = sc.fit(TRUE, measured, [*scaled, "delay"])
    assert both.undetermined == (tuple(scaled),)
    assert both.delay == pytest.approx(RIG.delay, rel=1e-4)
    assert "cannot be told apart" in str(both)
    with pytest.raises(sc.InputError, match="is not determined"):
        both.variations()


def test_wrong_fits_are_refused() -> None:
    measured = MEASURED
    for free, expected in (
        (["beam.stiffnes"], "did you mean 'beam.stiffness'"),
        ([], "is not a list of properties"),
        (["gain", "gain"], "names one twice"),
        (["damping", "damping.2"], "as a whole and mode by mode"),
    ):
        with pytest.raises(sc.InputError, match=expected):
            sc.fit(NOMINAL, measured, free)
    with pytest.raises(sc.InputError, match="the opposite sign"):
        sc.fit(TRUE, replace(measured, values=-measured.values), ["gain", "delay"])
    with pytest.raises(sc.InputError, match="20 samples make no spectrum"):
        sc.fit(NOMINAL, sc.Log(T, [0.0, 1.0] * 10, np.arange(20.0)), ["gain"])
    undamped = replace(NOMINAL, damping_ratio=0.0)
    with pytest.raises(sc.InputError, match="no damping to multiply"):
        sc.fit(undamped, measured, ["damping"])
    with pytest.raises(sc.InputError, match="those of measured frequencies"):
        sc.fit(NOMINAL, measured, ["gain"], boundary="free")  # type: ignore[call-overload]
    with pytest.raises(sc.InputError, match="has no motor"):
        sc.fit(NOMINAL, replace(measured, actuator="voltage"), ["gain"])


def test_degrees_are_asked_about() -> None:
    found = sc.fit(TRUE, replace(MEASURED, values=MEASURED.values * 180 / np.pi), ["gain", "delay"])
    assert any("is theta in degrees? Then call it theta_deg" in each for each in found.remarks)


def test_python_controls_data_are_fitted() -> None:
    measured = exact(0.0)
    frd = ct.FrequencyResponseData(measured.values, measured.omega)
    found = sc.fit(TRUE, frd, ["gain", "delay"])
    assert found.gain == pytest.approx(0.85, rel=1e-6)
    assert found.delay == pytest.approx(0.017, rel=1e-5)


def test_dead_times_and_lags_are_the_arms_own(tmp_path: Path) -> None:
    slow = sc.Sensor(lag=0.003, delay=0.002)
    arm = replace(TRUE, sensors={"theta": slow})
    late = replace(arm, actuator=sc.Actuator(delay=0.015))
    u = sc.prbs(300, seed=1)
    beside = sc.simulated_log(arm, u, T, delay=0.015)
    np.testing.assert_array_equal(sc.simulated_log(late, u, T).output, beside.output)
    hz, channel = np.linspace(0.3, 40, 40), Channel("torque", "theta")
    modes = Modes(12)
    values = rig_response(Rig(late, 0.85, 0.02), channel, modes, 2 * np.pi * hz)
    bare = rig_response(Rig(TRUE), channel, modes, 2 * np.pi * hz)
    turned = 0.85 * np.exp(-2j * np.pi * hz * 0.02) / (1 + 2j * np.pi * hz * slow.lag)
    np.testing.assert_allclose(values, bare * turned, rtol=1e-9)
    found = sc.fit(late, sc.Response(hz, values), ["gain", "delay"])
    assert found.delay == pytest.approx(0.02, rel=1e-5)
    assert found.arm.drive.delay == pytest.approx(0.018, rel=1e-5)
    assert found.arm.sensor("theta") == slow
    (tmp_path / "arm.toml").write_text(found.to_toml(), encoding="utf-8")
    assert read_arm(tmp_path / "arm.toml") == found.arm
    # What was not freed is known, and the same response then only lacks 3 ms.
    known = sc.fit(late, sc.Response(hz, values * np.exp(2j * np.pi * hz * 0.003)), ["gain"])
    assert known.arm == late
    assert known.gain == pytest.approx(0.85, rel=1e-5)
    sooner = with_dead_time(late, "theta", 0.001)
    assert (sooner.drive.delay, sooner.sensor("theta").delay) == (0.0, 0.001)


@pytest.mark.slow
def test_a_short_sweep_in_closed_loop_begins_from_the_arm_itself() -> None:
    """Segments of half a second do not resolve the first mode: their response leads astray."""
    step = 0.002
    true = sc.Arm(
        sc.Beam(0.45, 0.118, 0.1305), sc.Hub(0.00217, friction=0.08), damping_ratio=(0.025, 0.033)
    )
    t = step * np.arange(2000)
    log = sc.simulated_log(
        true, 0.35 * np.sin(2.5 * np.pi * t**2), step, gain=0.6, delay=0.0026,
        counts_per_turn=1024, noise=0.002, feedback=([3.039, -2.961], [1.02, -0.98]), seed=1,
    )  # fmt: skip
    guessed = sc.Arm(sc.Beam(0.45, 0.118, 0.09), sc.Hub(0.001, friction=0.02), damping_ratio=0.01)
    found = sc.fit(guessed, log, [*FREE[:4], "damping.2", *FREE[4:]])
    assert found["beam.stiffness"].value == pytest.approx(1.45, rel=0.01)
    assert found["hub.inertia"].value == pytest.approx(0.00217, rel=0.02)
    assert found["delay"].value == pytest.approx(0.0026, abs=0.1 * step)
    assert found.explained > 0.95
    assert f"through it the input makes {found.explained:.1%} of the output" in str(found)


@pytest.mark.slow
@pytest.mark.parametrize("size", [1.0, 1e-6, 1e9])
def test_a_rig_of_any_size_is_found_where_the_search_begins(size: float) -> None:
    """All masses, stiffnesses, frictions and torques times one factor: the same motion."""
    hub = sc.Hub(3e-3 * size, friction=2e-3 * size)
    true = sc.Arm(sc.Beam(0.4, 0.1 * size, 0.5 * size), hub, damping_ratio=0.01)
    u = sc.prbs(1500, amplitude=0.05 * size, hold=2, seed=1)
    log = sc.simulated_log(true, u, T, counts_per_turn=4096)
    found = sc.fit(sc.vary(true, hub_inertia=2.4e-3 * size), log, ["hub.inertia"])
    low, high = found.interval("hub.inertia")
    assert 0.99 * low < 3e-3 * size < 1.01 * high
    assert not found["hub.inertia"].at_limit


def test_what_is_at_a_limit_says_so() -> None:
    free = parameters(NOMINAL, FREE, Channel("torque", "theta", T), 20.0)
    problem = RigProblem(Rig(NOMINAL), free).no_later_than(0.3)
    lower, upper = problem.bounds
    assert not problem.at_bounds(problem.start()).any()
    largest = problem.values(upper)
    assert largest[FREE.index("damping.1")] == pytest.approx(0.999)
    assert largest[FREE.index("delay")] == pytest.approx(0.3)
    assert largest[FREE.index("hub.inertia")] > 1e5 * NOMINAL.hub.inertia
    assert largest[FREE.index("gain")] > 1e20
    assert problem.at_bounds(upper).all()
    assert problem.at_bounds(lower).all()


@pytest.mark.slow
def test_an_arm_that_does_not_move_like_the_log_is_doubted() -> None:
    soft = sc.vary(NOMINAL, stiffness_factor=0.05, hub_inertia=0.2)
    log = record(samples=1500, sensor="tip_deflection")
    found = sc.fit(soft, log, ["gain"])
    assert found.explained < 0.5
    assert any("through this arm the input makes" in remark for remark in found.remarks)
    # Neither the state at the beginning nor the sign of dry friction makes an arm of nothing.
    theta = record(samples=1500)
    data = RecordData(theta, Modes(6))
    nothing = data.state_part(replace(RIG, gain=1e-12))
    assert data.explained(nothing) == pytest.approx(0, abs=1e-6)
    drift = np.cumsum(np.random.default_rng(0).normal(size=1500)) * 0.01
    unrelated = sc.Log(T, theta.input, drift, None, "torque", "theta")
    assert sc.fit(NOMINAL, unrelated, ["gain"]).explained < 0.2
    right = sc.fit(TRUE, log, ["gain", "delay"])
    assert right.explained > 0.9
    assert not any("through this arm the input makes" in remark for remark in right.remarks)


def test_points_that_noise_makes_are_not_where_a_search_begins() -> None:
    """A sweep to 6 Hz at 200 Hz: nothing above it is seen, however many points there are."""
    t = 0.005 * np.arange(4000)
    sweep = 0.2 * np.sin(2 * np.pi * 6 / 40 * t**2)
    log = sc.simulated_log(TRUE, sweep, 0.005, noise=1e-4, seed=2)
    response = sc.estimate_response(log)
    assert highest_seen(response) < 9.0
    kept = thinned(response)
    assert kept.frequencies_hz[-1] < 9.0
    assert len(kept.frequencies_hz) > 10


@pytest.mark.slow
def test_a_coarse_encoder_makes_no_dry_friction_that_drives() -> None:
    """Where it moves by half a step a sample, the sign of its steps is the output once more."""
    arm = sc.Arm(
        sc.Beam(0.776, 0.218, 0.87), sc.Hub(0.0173, friction=0.116), sc.Payload(0.0539),
        damping_ratio=0.01, motor=sc.Motor(1.0, 0.136, 0.136),
    )  # fmt: skip
    true = {"beam.stiffness": 0.928, "hub.inertia": 0.0164, "hub.friction": 0.0821,
            "delay": 0.006, "gain": 1.0}  # fmt: skip
    rig = sc.vary(arm, stiffness_factor=0.928, hub_inertia=0.0164, hub_friction=0.0821)
    log = sc.simulated_log(
        rig, sc.prbs(2000, amplitude=30.3, seed=1), 0.005, actuator="voltage", delay=0.006,
        counts_per_turn=78.0,
    )  # fmt: skip
    found = sc.fit(arm, log, list(true))
    for name, value in true.items():
        assert abs(found[name].value - value) < 3.5 * found[name].standard_deviation
