"""The second finding: which basis is better depends on the hub."""

import numpy as np
import pytest

from slewctl.paper import HubFinding, PaperReproduction

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]


@pytest.fixture
def hub(reproduction: PaperReproduction) -> HubFinding:
    return reproduction.findings.hub


def _at(hub, ratio):
    return next(point for point in hub.points if point.ratio == pytest.approx(ratio))


def test_sweep_covers_no_hub_to_a_heavy_one(hub):
    ratios = [point.ratio for point in hub.points]
    assert ratios[:2] == pytest.approx([0.0, 0.01])
    assert ratios[-1] == pytest.approx(100.0)
    assert hub.beam_inertia == pytest.approx(7 / 36)
    assert _at(hub, 1.0).hub_inertia == pytest.approx(7 / 36)


def test_without_a_hub_the_clamped_free_functions_are_poor(hub):
    assert hub.first_mode_errors_clamped_free[0] == pytest.approx(0.32, abs=0.005)
    assert hub.first_mode_errors_slewing[0] < 2e-4
    point = _at(hub, 0.0)
    assert point.slewing_error < point.clamped_free_error / 5


def test_with_a_hub_the_slewing_functions_are_poor(hub):
    """At J_h = J_beam: 13.9 % against 2.8e-4 over three modes with four functions."""
    point = _at(hub, 1.0)
    assert point.slewing_error == pytest.approx(0.14, abs=0.005)
    assert point.clamped_free_error == pytest.approx(2.8e-4, rel=0.02)
    for other in hub.points[1:]:
        assert other.slewing_error > 50 * other.clamped_free_error


def test_designs_on_clamped_free_functions_lose_little_from_a_tenth_on(hub):
    """And those on slewing functions lose more at every hub from 0.02 J_beam on."""
    heavy = [point for point in hub.points if point.ratio > 0.099]
    assert len(heavy) >= 3
    for point in heavy:
        assert point.clamped_free.usual.stable
        assert -1e-7 < point.clamped_free.usual.loss < 0.03
    some = [point for point in hub.points if point.ratio > 0.02]
    assert len(some) > len(heavy)
    for point in some:
        slewing = point.slewing.usual
        assert not slewing.stable or slewing.loss > 4 * point.clamped_free.usual.loss
    assert any(point.slewing.usual.stable for point in some)


def test_slewing_design_is_unstable_at_some_hubs(hub):
    unstable = [point for point in hub.points if not point.slewing.usual.stable]
    assert unstable
    for point in unstable:
        assert point.slewing.usual.loss is None
        assert min(point.slewing.usual.unstable_hz) > 0


def test_without_a_hub_the_optimum_has_not_converged(hub):
    """So no loss at J_h = 0 is a figure to compare with; at every other hub it is."""
    bare, *others = hub.points
    assert bare.cost_drift > 1e-3
    assert not bare.clamped_free.usual.stable
    assert bare.slewing.finer.loss > 2 * bare.slewing.usual.loss
    for point in others:
        assert abs(point.cost_drift) < 3e-6
        for design in (point.clamped_free, point.slewing):
            assert design.usual.stable == design.finer.stable
            if design.usual.stable:
                assert design.finer.loss == pytest.approx(design.usual.loss, rel=1e-4, abs=1e-8)


def test_every_design_and_no_loss_below_zero(hub):
    for point in hub.points:
        for design in (point.clamped_free, point.slewing):
            assert design.verified
            assert design.usual.truth_modes == hub.truth_modes
            assert design.finer.truth_modes == hub.finer_truth_modes
            if design.usual.stable:
                assert design.usual.loss > -1e-8
    assert np.all(np.diff([point.optimal_cost for point in hub.points]) < 0)
