"""H2 control with its poles in a region: they are, and wishing for more never costs less."""

from __future__ import annotations

import numpy as np
import pytest
from constrained_problems import OMEGA, in_units, plant
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import Controller, DesignError, InputError, lqg
from slewctl.design.lmi.blocks import largest
from slewctl.design.lmi.h2_region import h2_region
from slewctl.design.lmi.region import Region
from slewctl.design.lmi.separation_principle import innovations
from slewctl.design.lmi.state_feedback import Dynamics, Regulator, covariance, solve_regulator


def guarantee(controller: Controller, name: str) -> tuple[float, float]:
    found = next(g for g in controller.guarantees if g.name == name)
    return found.bound, found.achieved


@given(st.floats(0.0, 0.08), st.floats(0.0, 0.01), st.sampled_from([None, 1.2, 1.6]))
@deterministic(6)
def test_closed_loop_poles_lie_in_the_region(
    decay: float, damping: float, factor: float | None
) -> None:
    problem = plant(2)
    radius = None if factor is None else factor * problem.model.omega[-1]
    controller = h2_region(
        problem, decay_rate_min=decay * OMEGA, damping_ratio_min=damping, radius_max=radius
    )
    poles = np.linalg.eigvals(problem.close(controller.system).A)
    assert controller.certificate.verified, controller.certificate
    assert poles.real.max() <= -decay * OMEGA * (1 - 1e-6)
    assert (-poles.real / np.abs(poles)).min() >= damping * (1 - 1e-6)
    assert radius is None or np.abs(poles).max() <= radius * (1 + 1e-6)
    bound, achieved = guarantee(controller, "H2 cost")
    assert lqg(problem).h2_cost * (1 - 1e-9) <= achieved <= bound * (1 + 1e-9)


@pytest.mark.parametrize("damping", [1e-38, 1e-9, 2e-6, 1e-5, 1e-4])
def test_tiny_damping_wishes_are_no_trouble(damping: float) -> None:
    controller = h2_region(plant(2), decay_rate_min=0.0625 * OMEGA, damping_ratio_min=damping)
    assert controller.certificate.verified, controller.certificate


def test_a_wish_that_the_optimum_fulfils_leaves_it_alone() -> None:
    problem = plant(3)
    best = lqg(problem)
    slowest = -best.poles.real.max()
    controller = h2_region(problem, decay_rate_min=0.9 * slowest)
    assert controller.h2_cost == pytest.approx(best.h2_cost, rel=1e-9)
    for name, gain in best.gains.items():
        np.testing.assert_allclose(controller.gains[name], gain, rtol=1e-6, atol=1e-9)


def test_without_constraints_the_inequalities_give_the_riccati_optimum() -> None:
    for n in (1, 3):
        for half in (innovations(plant(n)).regulator, innovations(plant(n)).observer):
            start = half.optimal + 0.1 * np.sign(half.optimal) * np.abs(half.optimal).max()
            A, B = half.dynamics.A, half.dynamics.B
            if np.linalg.eigvals(A - B @ start).real.max() >= 0:
                start = 1.5 * half.optimal
            found = solve_regulator(Regulator((half.dynamics,), half.C), start)
            assert found.sound
            C = np.vstack([half.C, found.K])
            P = covariance(Dynamics(A, B, half.dynamics.N), found.K, 0.0)
            assert np.trace(C @ P @ C.T) == pytest.approx(half.optimum, rel=1e-7)


@pytest.mark.parametrize(
    "wishes",
    [
        [{"decay_rate_min": value * OMEGA} for value in (0.01, 0.03, 0.06, 0.1)],
        [{"damping_ratio_min": value} for value in (0.001, 0.006, 0.01, 0.02)],
        [{"radius_max": value * OMEGA} for value in (20.0, 5.5, 5.2, 5.0)],
    ],
)
def test_tightening_never_lowers_the_promised_cost(wishes: list[dict[str, float]]) -> None:
    problem = plant(2)
    for which in ("regulator", "observer"):
        costs = []
        for wish in wishes:
            options = {
                "decay_rate_min": 0.0,
                "damping_ratio_min": 0.0,
                "radius_max": 1e6,
                "observer_decay_rate_min": 0.0,
                "observer_damping_ratio_min": 0.0,
                "observer_radius_max": 1e6,
            }
            prefix = "" if which == "regulator" else "observer_"
            for key, value in wish.items():
                options[prefix + key] = value
            costs.append(guarantee(h2_region(problem, **options), "H2 cost")[0])
        assert np.all(np.diff(costs) >= -1e-6 * np.array(costs[1:]))


@pytest.mark.parametrize("value", [0.028, 0.043, 0.06, 0.097])
def test_a_wish_that_is_kept_anyway_does_not_stop_the_solver(value: float) -> None:
    """A radius of 1e6 rad/s binds nothing: the same gain as without it."""
    alone = h2_region(plant(2), observer_decay_rate_min=value * OMEGA)
    beside = h2_region(
        plant(2), observer_decay_rate_min=value * OMEGA, radius_max=1e6, observer_radius_max=1e6
    )
    assert beside.h2_cost == pytest.approx(alone.h2_cost, rel=1e-9)


def test_units_do_not_matter() -> None:
    first = plant(2)
    second = in_units(first, 1e3, 10.0, 1e3)
    wish = {"decay_rate_min": 0.05 * OMEGA, "damping_ratio_min": 0.006}
    one = h2_region(first, **wish)
    other = h2_region(second, **{**wish, "decay_rate_min": wish["decay_rate_min"] / 1e3})
    assert other.certificate.verified
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-4)


def test_the_observer_may_have_a_region_of_its_own() -> None:
    problem = plant(2)
    controller = h2_region(
        problem, decay_rate_min=0.1 * OMEGA, observer_decay_rate_min=0.02 * OMEGA
    )
    names = [g.name for g in controller.guarantees]
    assert "decay rate of the regulator" in names
    assert "decay rate of the observer" in names
    assert controller.certificate.verified


@pytest.mark.slow
def test_an_impossible_region_says_what_to_relax() -> None:
    problem = plant(1)
    radius = 0.05 * OMEGA
    with pytest.raises(DesignError) as caught:
        h2_region(problem, decay_rate_min=0.1 * OMEGA, radius_max=radius)
    text = str(caught.value)
    assert "possible with the others kept" in text
    advised = dict(
        part.split(" = ") for part in text.split("kept: ")[1].split(", or ") if " = " in part
    )
    assert advised
    for key, value in advised.items():
        wish = {"decay_rate_min": 0.1 * OMEGA, "radius_max": radius}
        name = key.removeprefix("observer_")
        assert name in wish
        relaxed = h2_region(problem, **{**wish, name: float(value)})
        assert relaxed.certificate.verified


@pytest.mark.parametrize(
    ("option", "value"),
    [("decay_rate_min", -1.0), ("damping_ratio_min", 1.0), ("radius_max", 0.0),
     ("observer_radius_max", float("nan")), ("decay_rate_min", "fast")],
)  # fmt: skip
def test_impossible_wishes_are_refused(option: str, value: object) -> None:
    with pytest.raises(InputError) as caught:
        h2_region(plant(1), **{option: value})
    assert caught.value.where == option


@given(st.floats(0.01, 0.9), st.floats(-3.0, -1e-3), st.floats(0.0, 3.0))
@deterministic(50)
def test_promises_agree_with_the_inequalities(damping: float, real: float, imag: float) -> None:
    """The sector's matrix for one pole pair is definite exactly if the pair is in the sector."""
    F = np.array([[real, imag], [-imag, real]])
    slope = np.sqrt(1 - damping**2) / damping
    H, S = slope * (F + F.T), F - F.T
    worst = np.linalg.eigvalsh(np.block([[H, S], [S.T, H]])).max()
    poles = np.array([complex(real, imag), complex(real, -imag)])
    if abs(worst) > 1e-4:
        assert Region(damping=damping).holds(poles) == (worst < 0)


def test_largest_finds_the_edge_from_the_possible_side() -> None:
    for edge in (0.3, 7.0):
        found = largest(lambda value, edge=edge: value <= edge, 0.1, 10.0, rounds=20)
        assert found == pytest.approx(edge, rel=1e-4)
        assert found <= edge


@pytest.mark.slow
def test_five_functions() -> None:
    problem = plant(5)
    omega = problem.model.omega
    controller = h2_region(
        problem,
        decay_rate_min=0.05 * OMEGA,
        damping_ratio_min=0.02,
        radius_max=1.3 * omega[-1],
        observer_damping_ratio_min=0.0,
        observer_radius_max=3 * omega[-1],
    )
    assert controller.certificate.verified, controller.certificate
    bound, achieved = guarantee(controller, "H2 cost")
    assert achieved <= bound
