"""Plant and controller are connected as their names and the sign say, everywhere alike."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_examples import TWO_SENSORS, loop_on, stable_loop, uniform_arm
from random_multiloops import flexible_plant, lqg_controller
from strategies import deterministic

from slewctl import (
    ClampedFree,
    Controller,
    InputError,
    Loop,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    state_space,
)
from slewctl.loop.margin_functions import hybrid_delay_margin, margins
from slewctl.loop.robust.multiloop import multiloop_margins
from slewctl.loop.robust.ncf_margin import best_output_scale, ncf_margin
from slewctl.loop.robust.nu_gap import gap_between, nu_gap, plant_graph
from slewctl.loop.robust.return_ratios import input_loop, input_output_loop, output_loop
from slewctl.numerics.given_system import static
from slewctl.testing import assert_margins

LOOP = loop_on(uniform_arm(), TWO_SENSORS, modes=5, n=2)
PHASE = LOOP.margins.phase_deg.value
S = control.tf("s")


def named(
    system: control.StateSpace, inputs: list[str] | None = None, outputs: list[str] | None = None
) -> control.StateSpace:
    """The same system, of python-control's own names where none are given."""
    return control.StateSpace(
        system.A, system.B, system.C, system.D, system.dt, inputs=inputs, outputs=outputs
    )


def turned(system: control.StateSpace) -> control.StateSpace:
    """The same plant with its outputs in reverse order, named."""
    return control.StateSpace(
        system.A, system.B, system.C[::-1], system.D[::-1], system.dt,
        inputs=system.input_labels, outputs=system.output_labels[::-1],
    )  # fmt: skip


def sampled_loop() -> Loop:
    plant = generalised_plant(assemble(uniform_arm(), ClampedFree(2)), TWO_SENSORS)
    return close(assemble(uniform_arm(), ClampedFree(4)), TWO_SENSORS, lqg(plant, sample_time=0.05))


def difference(L: control.StateSpace) -> float:
    """|det(I + L)| at a point: one number of a loop, whatever the order of its channels."""
    return float(abs(np.linalg.det(np.eye(L.ninputs) + np.atleast_2d(L(0.3 + 1.3j)))))


Asked = Callable[[control.StateSpace, object, int | None], object]
ASKED: dict[str, Asked] = {
    "margins": lambda P, K, sign: margins(P, K, sign=sign).phase_deg.value,
    "assert_margins": lambda P, K, sign: (
        assert_margins(P, K, sign=sign, phase_margin_deg=0.999 * PHASE) is None
    ),
    "ncf_margin": lambda P, K, sign: ncf_margin(P, K, sign=sign).value,
    "best_output_scale": lambda P, K, sign: np.sort(best_output_scale(P, K, sign=sign)).tolist(),
    "input_loop": lambda P, K, sign: difference(input_loop(P, K, sign=sign)),
    "output_loop": lambda P, K, sign: difference(output_loop(P, K, sign=sign)),
    "input_output_loop": lambda P, K, sign: difference(input_output_loop(P, K, sign=sign)),
}
ALL = pytest.mark.parametrize("name", list(ASKED))


@pytest.mark.slow
@ALL
def test_signals_are_matched_by_name_and_only_nameless_ones_by_position(name: str) -> None:
    ask, path, K = ASKED[name], LOOP.plant.control_path, LOOP.controller.system
    assert path.output_labels == ["theta", "theta_dot"]
    expected = ask(path, LOOP.controller, None)
    assert ask(turned(path), LOOP.controller, None) == pytest.approx(expected, rel=1e-6)
    assert ask(turned(path), K, 1) == pytest.approx(expected, rel=1e-6)
    assert ask(named(path), K, 1) == pytest.approx(expected, rel=1e-6)
    assert ask(path, named(K), 1) == pytest.approx(expected, rel=1e-6)
    half_named = named(K, inputs=["theta", "theta_dot"])
    assert ask(turned(path), half_named, 1) == pytest.approx(expected, rel=1e-6)


@ALL
@pytest.mark.parametrize(
    "other",
    [
        {"outputs": ["voltage"], "inputs": ["theta", "theta_dot"]},
        {"outputs": ["torque"], "inputs": ["theta", "tip"]},
        {"outputs": ["torque"], "inputs": ["theta", "u[1]"]},
    ],
)
def test_a_name_that_is_missing_on_the_other_side_is_refused(
    name: str, other: dict[str, list[str]]
) -> None:
    wrong = named(LOOP.controller.system, **other)
    with pytest.raises(InputError, match="call the same signal by the same name"):
        ASKED[name](LOOP.plant.control_path, wrong, 1)


@ALL
def test_a_controller_knows_its_sign_and_a_bare_system_has_that_of_control(name: str) -> None:
    ask, path, controller = ASKED[name], LOOP.plant.control_path, LOOP.controller
    expected = ask(path, controller, None)
    assert ask(path, controller, 1) == expected
    minus = named(-controller.system, inputs=list(controller.sensors), outputs=["torque"])
    assert ask(path, minus, None) == pytest.approx(expected, rel=1e-6)
    assert ask(path, minus, -1) == pytest.approx(expected, rel=1e-6)
    with pytest.raises(InputError, match="connected with a plus sign"):
        ask(path, controller, -1)
    for wrong in (0, 2, -0.5, True, "-1", np.nan):
        with pytest.raises(InputError, match="no sign"):
            ask(path, minus, wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_sign_is_that_of_control_feedback(sign: int) -> None:
    """Poles from `control.feedback` leave the half plane where the gain margin says."""
    P, K = control.ss(1 / (S - 1)), control.ss(-sign * 3 / (0.05 * S + 1) ** 2)
    m = margins(P, K, sign=sign)
    for decibel, stable in ((m.gain_db.value, False), (-m.gain_reduction_db.value, False)):
        for part, expected in ((0.999, True), (1.001, stable)):
            factor = 10 ** (part * decibel / 20)
            poles = control.feedback(P, factor * K, sign).poles()
            assert (poles.real.max() < 0) == expected
    assert margins(P * K, sign=sign).phase_deg.value == pytest.approx(m.phase_deg.value)


def test_an_unstable_loop_says_when_only_its_sign_is_wrong() -> None:
    path, K = LOOP.plant.control_path, LOOP.controller.system
    says = "with the opposite sign of the feedback it is stable"
    with pytest.raises(UnstableLoopError, match=says):
        margins(path, K)
    with pytest.raises(AssertionError, match=says):
        assert_margins(path, K)
    with pytest.raises(UnstableLoopError, match=says):
        multiloop_margins(output_loop(path, K))
    loop = sampled_loop()
    for closed, system in ((LOOP, K), (loop, loop.controller.system)):
        minus = named(-system, inputs=system.input_labels, outputs=system.output_labels)
        with pytest.raises(UnstableLoopError, match=says):
            _ = close(closed.model, closed.objective, minus, sign=1).margins
    with pytest.raises(UnstableLoopError, match=says):
        hybrid_delay_margin(loop.plant, loop.controller.system)
    for either in (-1, 1):  # a pole at +1 that a gain of 1/2 does not reach
        with pytest.raises(UnstableLoopError) as caught:
            margins(0.5 / (S - 1), 1.0, sign=either)
        assert says not in str(caught.value)


def test_sampled_loops_are_matched_and_signed_alike() -> None:
    loop = sampled_loop()
    found = hybrid_delay_margin(loop).seconds
    G, K = loop.plant.control_path, loop.controller.system
    assert hybrid_delay_margin(turned(G), loop.controller).seconds == pytest.approx(found)
    assert hybrid_delay_margin(turned(G), K, sign=1).seconds == pytest.approx(found)
    assert hybrid_delay_margin(loop, sign=1).seconds == found
    for arguments in ((loop,), (G, loop.controller)):
        with pytest.raises(InputError, match="plus sign"):
            hybrid_delay_margin(*arguments, sign=-1)
    phase = loop.margins.phase_deg.value
    assert margins(turned(G), K, sign=1).phase_deg.value == pytest.approx(phase, rel=1e-9)


def test_an_option_that_means_nothing_is_refused() -> None:
    loop = stable_loop()
    L = loop.return_ratio
    for of in (loop, L, loop.plant.control_path):
        for delay in (-3.0, "x", np.nan):
            with pytest.raises(InputError, match="delay: "):
                margins(of, delay=delay)  # type: ignore[arg-type]
    for of in (loop, L):
        with pytest.raises(InputError, match="skew"):
            margins(of, skew="0")  # type: ignore[arg-type]
    for sign in (-1, 0):
        with pytest.raises(InputError, match="sign: "):
            margins(loop, sign=sign)
    with pytest.raises(InputError, match="already"):
        assert_margins(loop, loop.controller)
    sampled = sampled_loop()
    with pytest.raises(InputError, match="already"):
        hybrid_delay_margin(sampled, sampled.controller)
    for scale in ({"output_scale": -1.0}, {"input_scale": [1.0, 1.0]}):
        with pytest.raises(InputError, match="put_scale"):
            ncf_margin(static(1.0), static(-2.0), **scale)


@given(st.permutations(range(3)), st.permutations(range(2)))
@deterministic(10)
def test_the_gap_of_a_plant_and_itself_in_another_order_is_zero(
    rows: list[int], columns: list[int]
) -> None:
    plant = flexible_plant(np.random.default_rng(3), 3, 2, 3)
    inputs, outputs = np.array(["left", "right"]), np.array(["one", "two", "three"])
    first = named(plant, inputs.tolist(), outputs.tolist())
    second = control.StateSpace(
        plant.A, plant.B[:, columns], plant.C[rows], plant.D[np.ix_(rows, columns)],
        inputs=inputs[columns].tolist(), outputs=outputs[rows].tolist(),
    )  # fmt: skip
    scales = {"output_scale": [1.0, 20.0, 0.3], "input_scale": [1.0, 5.0]}
    assert nu_gap(first, second).value < 1e-7
    assert nu_gap(first, second, **scales).value < 1e-7
    controller = lqg_controller(np.random.default_rng(4), plant)
    K = named(controller, outputs.tolist(), inputs.tolist())
    b = ncf_margin(first, K, sign=1).value
    assert ncf_margin(second, K, sign=1).value == pytest.approx(b, rel=1e-6)
    L, other = (output_loop(P, K, sign=1) for P in (first, second))
    for i, name in enumerate(outputs[rows]):
        j = outputs.tolist().index(name)
        assert other(1.3j)[i, i] == pytest.approx(L(1.3j)[j, j], rel=1e-9)


def test_gaps_of_plants_that_are_called_otherwise_are_refused() -> None:
    path = LOOP.plant.control_path
    strange = named(path, ["torque"], ["theta", "tip"])
    with pytest.raises(InputError, match="call the same signal"):
        nu_gap(path, strange)
    assert nu_gap(path, turned(path)).value < 1e-7
    with pytest.raises(InputError, match="different orders"):
        gap_between(plant_graph(path), plant_graph(turned(path)))


def test_channels_of_a_loop_return_each_other() -> None:
    plant = flexible_plant(np.random.default_rng(2), 3, 2, 2)
    K = lqg_controller(np.random.default_rng(2), plant)
    L = output_loop(plant, K, sign=1)
    reached = multiloop_margins(L).disk.reached
    named_loop = named(L, ["a", "b"], ["returned_a", "b"])
    assert multiloop_margins(named_loop).disk.reached == pytest.approx(reached)
    exchanged = control.StateSpace(L.A, L.B, L.C[::-1], 0, inputs=["a", "b"], outputs=["b", "a"])
    assert multiloop_margins(exchanged).disk.reached == pytest.approx(reached)
    minus = named(-L, ["a", "b"], ["a", "b"])
    assert multiloop_margins(minus, sign=1).disk.reached == pytest.approx(reached)
    with pytest.raises(InputError, match="call the same signal"):
        multiloop_margins(named(L, ["a", "b"], ["a", "c"]))


def test_a_plain_controller_of_two_sensors_is_the_design_that_it_came_from() -> None:
    """What a script writes: the truth's sensors in one order, the controller's in the other."""
    controller = LOOP.controller
    assert isinstance(controller, Controller)
    plant = state_space(LOOP.model, ["theta_dot", "theta"])
    found = margins(plant, controller.system, sign=1)
    assert found.phase_deg.value == pytest.approx(PHASE, rel=1e-9)
