"""Figures 2–7 and the simulation behind the last two."""

import control
import numpy as np
import pytest

from slewctl import ClampedFree, Slewing, assemble, state_space
from slewctl.arm.catalogue import paper_beam
from slewctl.paper import published
from slewctl.paper.figures import figures
from slewctl.paper.simulation import TIP_LIMIT, bang_bang, exact_map, run, taylor_map, times

STEP = published.SAMPLE_TIME
BASES = [ClampedFree(5), Slewing(5)]


@pytest.fixture(scope="module")
def drawn():
    return figures()


def test_admissible_functions_are_in_the_papers_normalisation(drawn):
    cantilever, slewing = drawn.functions
    assert (cantilever.number, slewing.number) == (2, 3)
    assert cantilever.shapes.shape == slewing.shapes.shape == (len(slewing.x), 5)
    np.testing.assert_allclose(slewing.shapes[-1], 1.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(cantilever.shapes[-1, 2:]), 2.0, atol=2e-3)
    for figure in (cantilever, slewing):
        np.testing.assert_allclose(figure.shapes[0], 0.0, atol=1e-15)


def test_only_the_fifth_flexible_mode_is_visibly_wrong(drawn):
    """This is what the reading of Figures 4 and 5 rests on."""
    assert [figure.mode for figure in drawn.modes] == [4, 5]
    deviations = drawn.deviations
    assert [row.column for row in deviations] == [2, 3, 4, 5, 6]
    for row in deviations[:4]:
        assert max(row.clamped_free_shape, row.slewing_shape) < 0.03
        assert row.clamped_free_frequency < 0.005
    fifth = deviations[4]
    assert fifth.clamped_free_shape > 0.5
    assert fifth.slewing_shape < 0.07
    assert fifth.clamped_free_frequency > 0.6
    assert fifth.slewing_frequency < 0.0011


def test_mode_figures_carry_one_sign(drawn):
    for figure in drawn.modes:
        assert figure.x.shape == figure.truth.shape == figure.slewing.shape
        for shape in (figure.clamped_free, figure.slewing):
            assert shape @ figure.truth > 0


def test_bang_bang_torque_of_eq_51():
    torque = bang_bang(times(5.0)[:-1])
    assert torque.tolist() == [1.0] * 200 + [-1.0] * 200 + [0.0] * 100


@pytest.mark.parametrize("basis", BASES, ids=lambda basis: basis.name)
def test_exact_run_agrees_with_a_sampled_state_space_model(basis):
    model = assemble(paper_beam(), basis)
    ours = run(model, exact_map(model, STEP), 5.0)
    sampled = state_space(model, ["tip"], sample_time=STEP)
    inputs = np.append(bang_bang(ours.t[:-1]), 0.0)
    theirs = control.forced_response(sampled, ours.t, inputs).outputs
    np.testing.assert_allclose(ours.tip, theirs, atol=1e-7)
    assert ours.left_range_s is None
    assert ours.overflow_s is None


@pytest.mark.parametrize("basis", BASES, ids=lambda basis: basis.name)
def test_taylor_map_is_a_runge_kutta_step(basis):
    model = assemble(paper_beam(), basis)
    plant = state_space(model, ["tip"], coordinates="modal")
    A, B = np.asarray(plant.A), np.asarray(plant.B)[:, 0]
    random = np.random.default_rng(3)
    state, torque = random.standard_normal((model.n + 1, 2)), 0.7

    def rate(x):
        return A @ x + B * torque

    x = state.T.ravel()
    k1 = rate(x)
    k2 = rate(x + STEP / 2 * k1)
    k3 = rate(x + STEP / 2 * k2)
    k4 = rate(x + STEP * k3)
    expected = (x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)).reshape(2, -1).T
    steps = taylor_map(model, STEP)
    ours = np.einsum("mij,mj->mi", steps.transition, state) + steps.input * torque
    np.testing.assert_allclose(ours, expected, rtol=1e-11, atol=1e-11)


def test_tip_comes_to_rest_where_a_rigid_arm_would(drawn):
    """The impulse of eq. 51 is zero, so the mean tip stays at L τ T²/J, T = 2 s."""
    inertia = 7 / 36
    for figure in drawn.tip:
        resting = figure.truth.tip[figure.truth.t > 4.5]
        assert resting.mean() == pytest.approx(4 / inertia, abs=0.02)


def test_tip_figures_show_noise_when_sampled_exactly_and_overflow_when_not(drawn):
    cantilever, slewing = drawn.tip
    assert (cantilever.number, slewing.number) == (6, 7)
    assert slewing.exact_deviation_m < 0.015 < 0.03 < cantilever.exact_deviation_m < 0.04
    assert slewing.taylor.left_range_s is None
    assert slewing.taylor_deviation_m is not None
    assert slewing.taylor_deviation_m < 0.04
    assert cantilever.taylor_deviation_m is None
    assert cantilever.taylor.left_range_s is not None
    assert cantilever.taylor.left_range_s < 0.1
    assert cantilever.taylor.overflow_s is not None
    assert cantilever.taylor.overflow_s < 3
    assert abs(cantilever.taylor.tip[-1]) > TIP_LIMIT
    assert np.all(np.abs(cantilever.taylor.tip[:-1]) <= TIP_LIMIT)
    assert cantilever.taylor.t[-1] == cantilever.taylor.left_range_s
