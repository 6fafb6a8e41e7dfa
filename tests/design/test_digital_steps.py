"""A controller discretised, reduced and rounded keeps what it did in its loop."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.compare import Judgement, digital_loss, evaluate, least_word, loop_signals, read
from slewctl.design.anti_windup import anti_windup
from slewctl.design.digital.sections import in_sections
from slewctl.embedded import CodeOptions, program_of
from slewctl.files import design_of_text
from slewctl.numerics.discrete_equations import solve_discrete_lyapunov
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.rounding_errors import white_cost


@cache
def problem() -> sc.Problem:
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    return sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, noise, truth_modes=5)


@cache
def design(n: int = 2, **options: float) -> sc.Controller:
    return sc.lqg(problem().plant("clamped-free", n=n), **options)


@cache
def sampled() -> sc.Controller:
    return design(2, sample_time=0.02)


def answer(system: LinearSystem, z: complex) -> np.ndarray:
    A, B, C, D = system.matrices
    return (C @ np.linalg.solve(z * np.eye(len(A)) - A, B) + D).ravel()


POLES = st.lists(
    st.sampled_from([1.0, 0.9, 0.9, -0.3, 0.0, 0.8 + 0.5j, 0.1 + 0.2j, 0.95 + 0.01j]),
    min_size=1,
    max_size=5,
)


@settings(max_examples=25, deadline=None)
@given(POLES, st.integers(0, 2**16))
def test_sections_are_the_same_system(poles: list[complex], seed: int) -> None:
    rng = np.random.default_rng(seed)
    whole = LinearSystem(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), 1.0, 0.1)
    for pole in poles:  # poles that come twice have one eigenvector
        A = np.array([[pole.real]])
        if pole.imag:
            A = np.array([[pole.real, pole.imag], [-pole.imag, pole.real]])
        n = len(A)
        B, C = rng.standard_normal((n, 1)), rng.standard_normal((1, n))
        whole = series(whole, LinearSystem(A, B, C, 1.0, 0.1))
    found = in_sections(whole)
    assert sum(found.sizes) == whole.nstates
    for z in (1.3 + 0.2j, -2.0, 0.3 + 1.5j):
        assert answer(found.system, z) == pytest.approx(answer(whole, z), rel=1e-6)
    start = 0
    for size in found.sizes:
        own = slice(start, start + size)
        rest = np.delete(found.system.A[own], np.arange(start, start + size), axis=1)
        assert not rest.any()
        start += size


def test_a_pair_of_poles_turns_without_being_stretched() -> None:
    for k, size in enumerate(in_sections(sampled().linear).sizes):
        if size == 2:
            labels = in_sections(sampled().linear).system.state_labels
            at = [i for i, label in enumerate(labels) if label.startswith(f"section_{k + 1}_")]
            block = in_sections(sampled().linear).system.A[np.ix_(at, at)]
            assert block[0, 0] == block[1, 1]
            assert block[0, 1] == -block[1, 0]


def test_an_integrator_stays_one_to_the_last_digit() -> None:
    law = design(2, sample_time=0.02, integral_limit=0.5)
    A = in_sections(law.linear).system.A
    assert 1.0 in np.diagonal(A)


def test_discretised_is_what_a_method_with_a_clock_returns() -> None:
    plant = problem().plant("clamped-free", n=2)
    ours = sc.pd_notch(plant, bandwidth_hz=0.3).discretised(0.02, 0.01)
    theirs = sc.pd_notch(plant, bandwidth_hz=0.3, sample_time=0.02, delay=0.01)
    for z in (1.1 + 0.2j, -0.7 + 1j):
        assert answer(ours.linear, z) == pytest.approx(answer(theirs.linear, z), rel=1e-9)
    assert ours.delay == theirs.delay == 0.01
    assert ours.reference is not None
    assert theirs.reference is not None
    assert pytest.approx(theirs.reference.D) == ours.reference.D
    assert ours.continuous is not None
    with pytest.raises(sc.InputError, match="sampled already"):
        ours.discretised(0.02)


@pytest.mark.parametrize("clock", [{}, {"sample_time": 0.02, "delay": 0.01}])
def test_what_no_loop_needs_is_what_is_left_out(clock: dict[str, float]) -> None:
    plant = problem().plant("clamped-free", n=1)
    K = sc.lqg(plant, **clock)
    n, dt = K.linear.nstates, K.linear.dt
    # Two states that nothing moves, and two that nothing sees.
    rng = np.random.default_rng(0)
    stable = 0.5 * np.eye(2) if dt else -np.eye(2)
    A = np.block([
        [K.linear.A, rng.standard_normal((n, 2)), np.zeros((n, 2))],
        [np.zeros((2, n)), stable, np.zeros((2, 2))],
        [rng.standard_normal((2, n)), np.zeros((2, 2)), 0.5 * stable],
    ])  # fmt: skip
    B = np.vstack([K.linear.B, np.zeros((2, 2)), rng.standard_normal((2, 2))])
    C = np.hstack([K.linear.C, rng.standard_normal((1, 2)), np.zeros((1, 2))])
    wide = sc.given(
        LinearSystem(A, B, C, K.linear.D, dt).to_control(), inputs=K.sensors, feedback="positive",
        delay=K.delay,
    )  # fmt: skip
    small = wide.reduced(n, plant)
    for z in (1.2 + 0.3j, -0.5 + 2j, 0.1 + 1j):
        assert answer(small.linear, z) == pytest.approx(answer(K.linear, z), rel=1e-6)
    assert small.h2_cost == pytest.approx(K.h2_cost, rel=1e-7)


def test_an_order_that_loses_the_loop_is_refused_with_the_least_that_keeps_it() -> None:
    plant, K = problem().plant("clamped-free", n=2), design(2, integral_limit=0.5)
    with pytest.raises(sc.DesignError, match=r"1 states .*give at least (\d)") as error:
        K.reduced(1, plant)
    least = int(error.value.remedy.split()[-1])
    for order in range(1, least):
        with pytest.raises(sc.DesignError):
            K.reduced(order, plant)
    small = K.reduced(least, plant)
    assert small.linear.nstates == least
    assert problem().judge(small).stable
    assert np.abs(small.linear.poles()).min() < 1e-9  # the integrator
    assert np.isfinite(small.h2_cost)


@pytest.mark.parametrize(
    ("order", "match"), [(6, "give less than 6"), (-1, "order"), (2.5, "order")]
)
def test_orders_that_are_none(order: float, match: str) -> None:
    with pytest.raises(sc.InputError, match=match):
        design(2).reduced(order, problem().plant("clamped-free", n=2))  # type: ignore[arg-type]


def test_single_precision_holds_every_coefficient() -> None:
    made = sampled().in_float32()
    eye = np.eye(made.linear.nstates)
    for matrix in (made.linear.A - eye, made.linear.B, made.linear.C, made.linear.D):
        assert matrix == pytest.approx(matrix.astype(np.float32), rel=1e-7, abs=0.0)
    assert (made.linear.B.astype(np.float32) == made.linear.B).all()
    loss = problem().digital_loss(sampled(), made)
    assert 0 <= loss.worst < 1e-5
    with pytest.raises(sc.InputError, match="discretised"):
        design(2).in_float32()


def test_words_hold_whole_numbers_whose_sums_fit_two_of_them() -> None:
    signals = problem().loop_signals(sampled())
    made = sampled().in_fixed_point(14, None, signals)
    words, system = made.arithmetic, made.linear
    assert words is not None
    n = system.nstates
    real = np.block([[system.A - np.eye(n), system.B], [system.C, system.D]])
    columns, rows = np.array([*words.states, *words.readings]), [*words.states, words.command]
    for row, bits, shift in zip(real, rows, words.shifts, strict=True):
        whole = np.ldexp(row, bits - columns + shift)
        assert (whole == np.rint(whole)).all()
        assert np.abs(whole).sum() * words.largest < 2 ** (2 * 14 - 2)
        assert shift <= 2 or np.abs(whole).sum() > words.largest / 4  # and none is wasted
    # Every signal of the loop has its word, and the largest uses it.
    reached = np.ldexp(signals.largest, [*words.readings, words.command, words.angle])
    assert (reached <= words.largest + 1).all()
    assert (reached > words.largest / 2.1).all()


@pytest.mark.parametrize("word", [10, 16])
def test_a_fraction_that_overflows_is_refused_with_those_that_fit(word: int) -> None:
    signals = problem().loop_signals(sampled())
    with pytest.raises(sc.InputError, match="overflow") as error:
        sampled().in_fixed_point(word, word - 1, signals)
    numbers = [int(text) for text in error.value.remedy.replace(",", " ").split() if text.isdigit()]
    most, longer = numbers
    assert sampled().in_fixed_point(word, most, signals).arithmetic is not None
    assert sampled().in_fixed_point(longer, word - 1, signals).arithmetic is not None
    with pytest.raises(sc.InputError, match="overflow"):
        sampled().in_fixed_point(word, most + 1, signals)


@pytest.mark.parametrize("word", [3, 33, 0, 2.0])
def test_words_that_nothing_runs(word: int) -> None:
    with pytest.raises(sc.InputError, match="word"):
        sampled().in_fixed_point(word, None, problem().loop_signals(sampled()))


def test_the_least_word_loses_no_more_than_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    made, loss = problem().least_word(sampled(), 0.003)
    assert made.arithmetic is not None
    assert loss.worst <= 0.003
    assert loss.rounding > 0
    signals = problem().loop_signals(sampled())
    for word in range(4, made.arithmetic.word):
        try:
            shorter = sampled().in_fixed_point(word, None, signals)
        except sc.SlewctlError:
            continue
        assert problem().digital_loss(sampled(), shorter).worst > 0.003
    monkeypatch.setattr("slewctl.compare.loss_of_digits.MOST_WORD", 8)
    with pytest.raises(sc.DesignError, match="words of up to 8 bits"):
        problem().least_word(sampled(), 0.003)


def test_rounding_costs_what_the_noise_of_it_costs() -> None:
    made = sampled().in_fixed_point(10, None, problem().loop_signals(sampled()))
    assert made.arithmetic is not None
    assert made.arithmetic.noise is not None
    readings, states, command = made.arithmetic.noise
    closed = problem().judge(made).loop.closed  # type: ignore[attr-defined]
    p, (_, Bk, _, Dk) = closed.plant, made.linear.matrices
    n, size = len(p.A), len(closed.A)
    # By the covariance that the noise leads to, instead of by what a state costs.
    noise = np.zeros((size, size))
    entering = np.vstack([p.B @ Dk, Bk])
    noise += entering @ np.diag(readings) @ entering.T
    noise[n:, n:] += np.diag(states)
    noise[:n, :n] += command * p.B @ p.B.T
    spread = solve_discrete_lyapunov(closed.A, noise)
    row = np.block([[np.eye(n), np.zeros((n, size - n))], [Dk @ p.C, made.linear.C]])
    at_once = float((Dk**2 @ readings)[0])
    expected = np.sum((row.T @ p.cost @ row) * spread) + p.cost[-1, -1] * (command + at_once)
    found = white_cost(closed, readings, states, command)
    assert found == pytest.approx(expected / p.sample_time, rel=1e-9)
    assert found > 0


@pytest.mark.parametrize("word", [8, 12, 16])
def test_what_is_judged_of_words_has_their_rounding_in_it(word: int) -> None:
    """Cost, loss and levels of what runs, not of its coefficients alone."""
    asked, exact = problem(), problem().judge(sampled())
    made = sampled().in_fixed_point(word, None, asked.loop_signals(sampled()))
    judged = asked.judge(made)
    bare = asked.judge(replace(made, arithmetic=None))
    lost = digital_loss(exact, judged)
    assert lost.rounding > 0
    assert judged.cost == pytest.approx(bare.cost + lost.rounding, rel=1e-12)
    assert lost.cost == pytest.approx(judged.cost / exact.cost - 1, rel=1e-9)
    assert read(judged, "h2_loss").value == pytest.approx(
        judged.cost / judged.optimum.h2_cost - 1, rel=1e-12
    )
    assert judged.noise.torque > bare.noise.torque
    # The cost is that of weighted levels, tip and torque over their limits, but that errors
    # which stand still may not all be at their worst for both.
    assert judged.noise.tip is not None
    limits = judged.loop.objective.limits
    weighted = (judged.noise.tip / limits["tip"]) ** 2
    weighted += (judged.noise.torque / limits["torque"]) ** 2
    assert bare.cost < weighted <= judged.cost * (1 + 1e-9)


def test_an_integrator_that_words_hold_still_is_no_controller() -> None:
    """Between ± half a step over its gain its reading moves nothing: the arm stays off by that."""
    law = sc.given(
        pid={"kp": 1.0, "ki": 0.1, "kd": 1.0, "filter_hz": 8.0}, inputs=["theta"],
        output="torque", sample_time=0.02, discretise="tustin",
    )  # fmt: skip
    asked = problem()
    judged = asked.judge(law)
    made = law.in_fixed_point(11, None, asked.loop_signals(law))
    words = asked.judge(made)
    assert made.arithmetic is not None
    A, B, _, _ = made.linear.matrices
    (slow,) = np.flatnonzero(np.isclose(np.diag(A), 1.0))
    off = 0.5 * 2.0 ** -made.arithmetic.states[slow] / abs(B[slow, 0])
    assert off > 0.05
    # At rest the hub is off by so much, the tip by it times the arm's length, for ever.
    reach = asked.arm.hub.radius + asked.arm.beam.length
    standing = (off * reach / asked.limits["tip"]) ** 2
    coefficients = asked.judge(replace(made, arithmetic=None)).cost
    assert words.cost > coefficients + 0.999 * standing
    assert words.cost == pytest.approx(coefficients + standing, rel=0.01)  # it is all there is
    assert digital_loss(judged, words).cost > 0.5
    shortest, lost = asked.least_word(law)
    assert shortest.arithmetic is not None
    assert shortest.arithmetic.word > 11
    assert lost.worst <= 0.01


def test_a_signals_sizes_are_those_of_the_slew() -> None:
    judged = problem().judge(sampled())
    signals = loop_signals(judged)
    turn = np.radians(judged.slew.angle_deg)
    assert signals.angle == pytest.approx(turn)
    assert signals.readings[-1, 0] == pytest.approx(turn, rel=0.02)  # it arrives
    assert signals.command[-1] == pytest.approx(0.0, abs=0.02 * np.abs(signals.command).max())
    assert (signals.largest[:2] > np.abs(signals.readings).max(axis=0)).all()


def test_an_observer_in_sections_is_driven_by_the_command_that_was_cut_off() -> None:
    """In whatever states, and in words: what is added moves the estimates as the input does."""
    K = sampled()
    assert K.entry is not None
    column = anti_windup(K)[0]
    assert column == pytest.approx(K.entry[:, 0])
    words = K.in_fixed_point(24, None, problem().loop_signals(K))
    for made in (K.in_sections(), K.in_float32(), words):
        moved = [
            np.linalg.matrix_power(law.A, k) @ entry
            for k in (0, 1, 3)
            for law, entry in ((K.linear, column), (made.linear, anti_windup(made)[0]))
        ]
        seen = [
            float((law.C @ m)[0]) for law, m in zip([K.linear, made.linear] * 3, moved, strict=True)
        ]
        np.testing.assert_allclose(seen[1::2], seen[::2], rtol=2e-3)
    small = design(3).reduced(6, problem().plant("clamped-free", n=3))
    assert small.entry is None


def test_a_loop_that_is_lost_is_said_and_is_no_small_loss() -> None:
    lost = design(2).discretised(2.0)
    loss = problem().digital_loss(design(2), lost)
    assert not loss.stable
    assert (loss.margin, loss.worst) == (1.0, np.inf)
    assert str(loss).startswith("the loop is lost: unstable at ")
    with pytest.raises(sc.UnstableLoopError):
        problem().digital_loss(lost, design(2))


@pytest.mark.parametrize("rule", ["tustin", "zoh"])
def test_a_law_is_told_of_its_limited_command_alike_however_it_came_to_its_clock(rule: str) -> None:
    """Designed with a clock, or discretised afterwards: the same answer to what was cut off."""
    plant = problem().plant("clamped-free", n=1)
    designed = sc.h2_lmi(plant, sample_time=0.02, discretise=rule)
    later = sc.h2_lmi(plant).discretised(0.02, method=rule)
    answers = []
    for law in (designed, later):
        assert law.entry is not None
        A, _, C, _ = law.linear.matrices
        moved = [C @ np.linalg.matrix_power(A, k) @ law.entry for k in range(6)]
        answers.append(np.ravel(moved))
    assert answers[0] == pytest.approx(answers[1], rel=1e-9)
    assert sc.h2_lmi(plant).reduced(3, plant).entry is None


def unweighted(law: str, limit: str = "") -> Judgement:
    """A law that was made elsewhere: no limits, no noise, and a slew."""
    arm = f'arm = {{ catalogue = "quanser-flexible-link", damping_ratio = 0.01{limit} }}'
    rest = "slew = { angle_deg = 30.0, duration_s = 1.0 }\ntruth = { modes = 5 }"
    text = f"{arm}\ncontroller = {{ method = 'given', output = 'torque', sample_time = 0.002, {law} }}\n{rest}\n"
    return evaluate(design_of_text(text, Path("law.toml")).case).judgement


def test_words_of_a_law_without_weights_still_move_the_arm() -> None:
    """No cost tells what rounding does: a law in 4 bits had kept its margins, and gave nothing."""
    law = "A = [[0.9]], B = [[0.01]], C = [[-0.1]], D = [[-0.05]], inputs = ['tip'], feedback = 'positive'"
    judged = unweighted(law, ", actuator = { torque_limit = 0.5 }")
    words, lost = least_word(judged)
    assert words.arithmetic is not None
    assert 0 < lost.blur <= lost.worst <= 0.01
    signals = loop_signals(judged)
    assert 2.0**-words.arithmetic.command < 0.05 * np.abs(signals.command).max()
    short = judged.controller.in_fixed_point(words.arithmetic.word - 3, None, signals)
    assert digital_loss(judged, judged.yardstick.judge(short, judged.slew)).worst > 0.01


def test_a_rise_of_a_margin_is_a_change_where_there_is_no_cost() -> None:
    few, more = (problem().judge(design(n)) for n in (1, 2))
    found = digital_loss(few, more)
    unknown = {**found.before, "h2_cost": found.before["h2_cost"]._replace(value=np.nan)}
    free = replace(found, before=unknown)
    back = replace(free, before=found.after, after=unknown)
    assert free.worst >= free.margin
    assert min(free.worst, back.worst) > 0
    assert min(free.margin, back.margin) == 0  # one of them has more of every margin


def test_where_nothing_limits_the_command_its_words_end_and_the_head_says_where() -> None:
    pid = "pid = { kp = 0.6, ki = 1.0, kd = 0.05, filter_hz = 30.0 }, discretise = 'tustin'"
    judged = unweighted(pid)
    made = program_of(judged, CodeOptions("fixed", word=16))
    words = made.words
    assert words is not None
    assert made.limit == words.largest * 2.0**-words.command
    assert made.limit > 2 * np.abs(loop_signals(judged).command).max()
    told = f"where its words end the command is cut off at {made.limit:g}"
    assert any(told in note for note in made.notes)
    assert made.windup.any()  # its integral is told
