"""The forms of a given law against python-control, and what is no law."""

from __future__ import annotations

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.design.discretise import discretised
from slewctl.design.zeros_poles import polynomials
from slewctl.errors import InputError
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.linear_system import LinearSystem

OMEGA = np.geomspace(1e-2, 1e3, 40)
gains = st.floats(-50.0, 50.0).filter(lambda x: abs(x) > 1e-3)
seeds = st.integers(0, 10_000)


def response(controller: sc.Controller) -> np.ndarray:
    return FrequencyResponse(controller.linear)(OMEGA).ravel()


def agree(one: np.ndarray, other: np.ndarray, tolerance: float = 1e-9) -> None:
    assert np.abs(one - other).max() <= tolerance * np.abs(other).max()


@given(gains, gains, gains, st.floats(0.1, 100.0))
def test_a_pid_is_that_of_control_tf(kp: float, ki: float, kd: float, hertz: float) -> None:
    s, omega = ct.tf("s"), 2 * np.pi * hertz
    wanted = kp + ki / s + kd * s / (1 + s / omega)
    K = sc.given(pid={"kp": kp, "ki": ki, "kd": kd, "filter_hz": hertz})
    agree(-response(K), wanted(1j * OMEGA))  # the minus is inside
    assert K.linear.nstates == 2


def roots(seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    rng = np.random.default_rng(seed)
    pairs = [-rng.uniform(0.01, 5) + 1j * rng.uniform(0.1, 50) for _ in range(rng.integers(0, 3))]
    zeros = [-rng.uniform(0.01, 5) + 1j * rng.uniform(0.1, 50) for _ in range(len(pairs))]
    single = -rng.uniform(0.1, 50, rng.integers(1, 3))
    both = [np.array([c for root in of for c in (root, root.conjugate())]) for of in (zeros, pairs)]
    return both[0], np.concatenate([both[1], single]), float(rng.uniform(0.1, 10))


@given(seeds)
def test_roots_are_their_polynomials_and_matrices(seed: int) -> None:
    zeros, poles, gain = roots(seed)
    wanted = gain * np.array([np.prod(1j * w - zeros) / np.prod(1j * w - poles) for w in OMEGA])
    by_roots = sc.given(zeros=zeros, poles=poles, gain=gain, feedback="positive")
    agree(response(by_roots), wanted)
    num, den = gain * np.atleast_1d(np.poly(zeros)).real, np.poly(poles).real
    agree(response(sc.given(num=num, den=den, feedback="positive")), wanted)
    agree(-response(sc.given(num=num, den=den, feedback="negative")), wanted)
    system = ct.ss(ct.tf(num, den))
    parts = {name: np.asarray(getattr(system, name)) for name in "ABCD"}
    agree(response(sc.given(**parts, feedback="positive")), wanted)
    agree(response(sc.given(ct.tf(num, den), feedback="positive")), wanted)


def test_pairs_stand_for_complex_roots() -> None:
    listed = sc.given(poles=[[-1.0, 2.0], [-1.0, -2.0]], gain=5.0, feedback="positive")
    agree(response(listed), ct.tf([5.0], [1.0, 2.0, 5.0])(1j * OMEGA))


def test_filters_stand_behind_the_law() -> None:
    K = sc.given(
        pid={"kp": 2.0},
        sections=[
            {"notch_hz": 4.0, "width": 0.5, "depth": 0.1},
            {"lowpass_hz": 20.0, "order": 3},
            {"lead_hz": 2.0, "lead_deg": 30.0},
        ],
    )
    at = FrequencyResponse(K.linear)
    rest, notched = (abs(at(np.array([w])).item()) for w in (1e-6, 8 * np.pi))
    assert rest == pytest.approx(2.0)
    free = sc.given(pid={"kp": 2.0}, sections=[{"lowpass_hz": 20.0, "order": 3},
                                               {"lead_hz": 2.0, "lead_deg": 30.0}])  # fmt: skip
    without = FrequencyResponse(free.linear)(np.array([8 * np.pi])).item()
    assert notched / abs(without) == pytest.approx(0.1)
    lead = sc.given(pid={"kp": 1.0}, sections=[{"lead_hz": 2.0, "lead_deg": 30.0}])
    phase = np.angle(-FrequencyResponse(lead.linear)(np.array([4 * np.pi])).item(), deg=True)
    assert phase == pytest.approx(30.0)


@pytest.mark.parametrize("order", range(1, 9))
def test_low_passes_are_butterworths(order: int) -> None:
    K = sc.given(pid={"kp": 1.0}, sections=[{"lowpass_hz": 5.0, "order": order}])
    wanted = 1 / np.sqrt(1 + (OMEGA / (10 * np.pi)) ** (2 * order))
    np.testing.assert_allclose(np.abs(response(K)), wanted, rtol=1e-8, atol=1e-12)


@given(seeds, st.floats(1e-3, 0.05), st.sampled_from([None, 1.0, 5.0]))
def test_a_law_is_discretised_as_by_control(seed: int, T: float, warp: float | None) -> None:
    zeros, poles, gain = roots(seed)
    num, den = gain * np.atleast_1d(np.poly(zeros)).real, np.poly(poles).real
    system = polynomials(num, den)
    points = np.exp(1j * np.geomspace(1e-2, 0.99 * np.pi, 30))
    for rule, oracle in (("tustin", "tustin"), ("zoh", "zoh")):
        hertz = warp if rule == "tustin" else None
        frequency = 2 * np.pi * warp if hertz and warp else None
        wanted = ct.c2d(ct.ss(ct.tf(num, den)), T, oracle, prewarp_frequency=frequency)
        found = discretised(system, T, rule, hertz).to_control()
        agree(found(points), wanted(points), 1e-7)


@given(seeds, st.floats(1e-3, 0.02))
def test_matched_maps_every_root(seed: int, T: float) -> None:
    zeros, poles, gain = roots(seed)
    system = polynomials(gain * np.atleast_1d(np.poly(zeros)).real, np.poly(poles).real)
    found = discretised(system, T, "matched")
    there = np.sort_complex(np.linalg.eigvals(found.A))
    np.testing.assert_allclose(there, np.sort_complex(np.exp(poles * T)), rtol=1e-6)
    z = found.to_control()(np.array([1.0]))
    agree(z, (system.to_control())(np.array([0.0])), 1e-6)
    extra = len(poles) - len(zeros)
    assert abs(found.to_control()(-1.0)) <= 1e-6 * abs(z[0]) or not extra


@pytest.mark.parametrize(("num", "den"), [([1.0], [1.0, 0.0]), ([1.0, 0.0], [1.0, 3.0])])
def test_matched_keeps_an_integrator_and_a_derivative(num: list[float], den: list[float]) -> None:
    found = discretised(polynomials(np.array(num), np.array(den)), 0.01, "matched").to_control()
    omega = 1e-3
    wanted = complex(ct.tf(num, den)(1j * omega))
    assert complex(found(np.exp(1j * omega * 0.01))) == pytest.approx(wanted, rel=1e-3)


def test_prewarping_keeps_the_frequency() -> None:
    law = {"num": [3.0, 1.0], "den": [1.0, 40.0, 900.0], "feedback": "positive"}
    hertz, T = 4.0, 0.02
    K = sc.given(**law, discretise="tustin", sample_time=T, prewarp_hz=hertz)
    at = np.array([2 * np.pi * hertz])
    agree(FrequencyResponse(K.linear)(at).ravel(), ct.tf([3.0, 1.0], [1.0, 40.0, 900.0])(1j * at))


def test_a_reference_of_its_own_is_kept() -> None:
    system = ct.ss([[-1.0]], [[2.0, 3.0]], [[1.0]], [[0.5, 0.25]],
                   inputs=["theta", "theta_ref"], outputs=["torque"])  # fmt: skip
    K = sc.given(system, feedback="negative")
    assert K.sensors == ("theta",)
    np.testing.assert_array_equal(K.tracking.B, [[-2.0, 3.0]])
    np.testing.assert_array_equal(K.tracking.D, [[-0.5, 0.25]])


def test_what_a_law_does_not_read_does_not_move_it() -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    noise = {"torque": 0.1, "theta_dot": 0.1, "theta": 0.01}
    problem = sc.Problem(arm, limits={"tip": 0.03, "torque": 1.0}, noise=noise)
    K = sc.given(pid={"kp": 5.0, "kd": 5.0, "filter_hz": 30.0})
    alone = sc.Problem(arm, limits=problem.limits, noise={"torque": 0.1, "theta": 0.01})
    both = [p.judge(K).margins.phase_deg.value for p in (problem, alone)]
    assert both[0] == pytest.approx(both[1], rel=1e-9)


def test_any_system_of_control_is_judged_closed_and_measured_alike() -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    problem = sc.Problem(arm, limits={"tip": 0.03, "torque": 1.0},
                         noise={"torque": 0.1, "theta": 0.01})  # fmt: skip
    law = ct.tf([200.0, 200.0], [1.0, 40.0])
    named = ct.ss(ct.tf2ss(law), inputs=["theta"], outputs=["torque"])
    plant = sc.state_space(problem.truth, outputs=["theta"])
    found = [
        problem.judge(law).margins.phase_deg.value,
        problem.judge(named).margins.phase_deg.value,
        problem.judge(sc.given(law, feedback="negative")).margins.phase_deg.value,
        sc.close(problem.truth, problem.objective, law).margins.phase_deg.value,
        sc.margins(plant, law).phase_deg.value,
        problem.judge(-law, sign=1).margins.phase_deg.value,
        sc.margins(plant, sc.given(-law, feedback="positive")).phase_deg.value,
    ]
    np.testing.assert_allclose(found, found[0], rtol=1e-8)


REFUSED = [
    ({"pid": {"kp": 1.0, "kd": 1.0}}, "the derivative needs filter_hz"),
    ({"pid": {"kp": 1.0, "kx": 1.0}}, "pid.kx: unknown key; known: "),
    ({"pid": {"kp": 0.0}}, "all gains are zero"),
    ({"pid": {"kp": 1.0}, "sample_time": 0.01}, "pid is continuous and a clock is given"),
    ({"pid": {"kp": 1.0}, "discretise": "tustin"}, "sample_time: missing"),
    ({"pid": {"kp": 1.0}, "delay": 0.1}, "no computational delay"),
    ({"pid": {"kp": 1.0}, "inputs": ["theata"]}, "did you mean 'theta'"),
    ({"pid": {"kp": 1.0}, "inputs": ["theta", "tip"]}, "2 names for 1 signals"),
    ({"pid": {"kp": 1.0}, "output": "volts"}, "output: unknown name 'volts'"),
    ({"pid": {"kp": 1.0}, "num": [1.0], "den": [1.0]}, "pid and num and den are given"),
    ({}, "pid: missing; give a control law"),
    ({"num": [1.0], "den": [1.0, 1.0]}, "feedback: missing: the sign"),
    ({"num": [1.0, 0.0], "den": [1.0], "feedback": "negative"}, "more zeros"),
    ({"num": [1.0], "feedback": "negative"}, "den: missing"),
    ({"num": ["a"], "den": [1.0], "feedback": "negative"}, "not a list of finite numbers"),
    ({"num": [1.0], "den": [0.0], "feedback": "negative"}, "den: it is zero"),
    ({"zeros": [1.0], "poles": [], "gain": 1.0, "feedback": "negative"}, "more zeros"),
    ({"poles": [1j], "gain": 1.0, "feedback": "negative"}, "without its conjugate"),
    ({"poles": [-1.0], "feedback": "negative"}, "gain: missing"),
    ({"A": [[1.0]], "B": [[1.0]], "feedback": "negative"}, "C: missing"),
    ({"A": [[1.0]], "B": [[1.0], [2.0]], "C": [[1.0]], "feedback": "negative"}, "its shape is"),
    ({"pid": {"kp": 1.0}, "sections": [{"notch": 1.0}]}, "is no filter; give one of notch_hz"),
    ({"pid": {"kp": 1.0}, "sections": [{"notch_hz": 1.0, "deep": 1.0}]}, "no such key"),
    ({"pid": {"kp": 1.0}, "sections": [{"lead_hz": 1.0, "lead_deg": 95.0}]}, "more than one lead"),
    ({"num": [1.0], "den": [1.0], "feedback": "negative", "sample_time": 0.1,
      "sections": [{"lowpass_hz": 1.0}]}, "the law is sampled"),
    ({"pid": {"kp": 1.0}, "sample_time": 0.1, "discretise": "euler"}, "discretise: unknown name"),
    ({"pid": {"kp": 1.0}, "sample_time": 0.1, "discretise": "zoh", "prewarp_hz": 1.0},
     "zoh has nothing to prewarp"),
    ({"pid": {"kp": 1.0}, "sample_time": 0.1, "discretise": "tustin", "prewarp_hz": 6.0},
     "not below half the sampling frequency"),
    ({"pid": {"kp": 1.0}, "prewarp_hz": 1.0}, "nothing is discretised"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "told"), REFUSED)
def test_what_is_no_law_is_told_in_one_line(options: dict[str, object], told: str) -> None:
    with pytest.raises(InputError) as refused:
        sc.given(**options)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_clocks_that_disagree_are_told() -> None:
    system = ct.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.01)
    with pytest.raises(InputError, match=r"has sample time 0.01 s, sample_time says 0.02 s"):
        sc.given(system, feedback="negative", sample_time=0.02)
    with pytest.raises(InputError, match="sampled already"):
        sc.given(system, feedback="negative", sample_time=0.02, discretise="zoh")


@settings(max_examples=30)
@given(st.recursive(st.none() | st.floats() | st.text() | st.booleans(),
                    lambda x: st.lists(x, max_size=3) | st.dictionaries(st.text(), x, max_size=3),
                    max_leaves=6),
       st.sampled_from(["pid", "num", "den", "zeros", "poles", "gain", "A", "B", "C", "D",
                        "sections", "inputs", "output", "feedback", "sample_time", "delay",
                        "discretise", "prewarp_hz"]))  # fmt: skip
def test_nothing_but_refusals_comes_of_nonsense(value: object, key: str) -> None:
    whole: dict[str, object] = {"num": [1.0], "den": [1.0, 1.0], "feedback": "negative"}
    if key in "ABCD":
        whole = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "feedback": "negative"}
    elif key in ("zeros", "poles", "gain"):
        whole = {"poles": [-1.0], "gain": 1.0, "feedback": "negative"}
    elif key == "pid":
        whole = {}
    try:
        found = sc.given(**{**whole, key: value})
    except InputError:
        return
    assert isinstance(found.linear, LinearSystem)


@pytest.mark.parametrize("size", [1e-300, 1e-99, 1e99, 1e154, 1e300])
@pytest.mark.parametrize(
    "runs",
    [
        {},
        {"sections": [{"lowpass_hz": 3.0, "order": 2}]},
        *({"discretise": rule, "sample_time": 0.01} for rule in ("tustin", "zoh", "matched")),
    ],
    ids=str,
)
def test_numbers_of_any_size_make_a_finite_law_or_a_refusal(
    size: float, runs: dict[str, object]
) -> None:
    laws: list[dict[str, object]] = [
        {"num": [size], "den": [1.0, 1.0]},
        {"num": [1.0], "den": [size, 1.0]},
        {"num": [1.0], "den": [1.0, size]},
        {"A": [[-size]], "B": [[1.0]], "C": [[1.0]]},
        {"A": [[-1.0]], "B": [[size]], "C": [[size]]},
        {"poles": [size], "gain": 1.0},
        {"poles": [-1.0], "gain": size},
        {"pid": {"kp": 1.0, "ki": size, "kd": size, "filter_hz": 3.0}},
        {"pid": {"kp": 1.0, "kd": 1.0, "filter_hz": size}},
    ]
    for law in laws:
        try:
            found = sc.given(**law, feedback="negative", **runs)
        except InputError:
            continue
        assert found.linear.finite


def test_a_slow_root_keeps_its_digits_when_it_is_matched() -> None:
    law = {"zeros": [-2e-14], "poles": [-1e-14], "gain": 1.0, "feedback": "negative"}
    D = sc.given(**law, discretise="matched", sample_time=1.0).linear.D[0, 0]
    assert abs(D) == pytest.approx(1 - 0.5e-14, rel=1e-15)
