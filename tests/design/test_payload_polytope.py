"""One gain for a range of payloads: the vertices are exact, and every arm between is stable."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from constrained_problems import OBJECTIVE, OMEGA, arm, in_units, plant
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    DesignError,
    Hub,
    InputError,
    KelvinVoigt,
    Payload,
    Rayleigh,
    Slewing,
    assemble,
    close,
    generalised_plant,
    lqr,
    state_space,
)
from slewctl.arm import vary
from slewctl.design.lmi.payload import Range, changed_dynamics, payload_lmi
from slewctl.design.lmi.payload_loop import changed_plant, worst_of

LAWS = [KelvinVoigt(1e-4), Rayleigh(0.1, 1e-4), None]


def tapered(law: KelvinVoigt | Rayleigh | None) -> Arm:
    beam = Beam(1.0, (1.0, -0.4), (1.0, -0.4))
    return Arm(beam, Hub(0.3, 0.1, 0.02), Payload(0.3, 0.01), damping=law)


@given(st.floats(0.0, 5.0), st.floats(0.3, 3.0), st.sampled_from(LAWS))
@deterministic(20)
def test_changed_dynamics_are_those_of_the_assembled_arm(
    mass: float, factor: float, law: KelvinVoigt | Rayleigh | None
) -> None:
    model = assemble(tapered(law), ClampedFree(4))
    A, B = changed_dynamics(model, "torque", mass, factor)
    exact = state_space(
        assemble(vary(model.arm, payload_mass=mass, stiffness_factor=factor), model.basis)
    )
    np.testing.assert_allclose(A, exact.A, atol=1e-12 * np.abs(exact.A).max())
    np.testing.assert_allclose(B, exact.B, atol=1e-12 * np.abs(exact.B).max())


@given(st.floats(0.0, 1.0), st.sampled_from(LAWS), st.sampled_from([ClampedFree(3), Slewing(3)]))
@deterministic(20)
def test_assembled_arms_lie_on_the_line_between_the_vertices(
    share: float, law: KelvinVoigt | Rayleigh | None, basis: ClampedFree | Slewing
) -> None:
    """A and B of directly assembled arms are affine in δ = μ/(1 + μc), not in the mass."""
    of = tapered(law)
    nominal = assemble(of, basis)
    tip = nominal.displacement(np.array([1.0]))[0]
    compliance = tip @ np.linalg.solve(nominal.mass, tip)
    own, low, high = of.payload.mass, 0.0, 2.0

    def delta(mass: float) -> float:
        return (mass - own) / (1 + (mass - own) * compliance)

    def system(mass: float) -> np.ndarray:
        found = state_space(assemble(vary(of, payload_mass=mass), basis))
        return np.hstack([found.A, found.B])

    mass = low + share * (high - low)
    weight = (delta(mass) - delta(low)) / (delta(high) - delta(low))
    mixed = (1 - weight) * system(low) + weight * system(high)
    np.testing.assert_allclose(mixed, system(mass), atol=1e-11 * np.abs(mixed).max())


@pytest.mark.slow
@pytest.mark.parametrize("wish", [{}, {"decay_rate_min": 0.05 * OMEGA}, {"stiffness": [0.9, 1.1]}])
def test_the_loop_is_stable_at_fifty_masses(wish: dict[str, object]) -> None:
    problem = plant(2)
    controller = payload_lmi(problem, payload_mass=[0.0, 0.3], **wish)
    assert controller.certificate.verified, controller.certificate
    for mass in np.linspace(0.0, 0.3, 50):
        changed = assemble(vary(arm(), payload_mass=float(mass)), ClampedFree(2))
        assert close(changed, OBJECTIVE, controller).stable


@pytest.mark.slow
def test_state_feedback_is_stable_and_as_fast_as_asked_everywhere_inside() -> None:
    problem = plant(3)
    assert problem.model is not None
    wish = 0.1 * OMEGA
    controller = payload_lmi(
        problem, payload_mass=[0.0, 0.2], stiffness=[0.8, 1.25], decay_rate_min=wish
    )
    back = np.linalg.inv(np.kron(np.eye(2), problem.model.mode_shapes))
    K = controller.gains["state_feedback"] @ back
    for mass in np.linspace(0.0, 0.2, 11):
        for factor in np.linspace(0.8, 1.25, 5):
            A, B = changed_dynamics(problem.model, "torque", float(mass), float(factor))
            assert np.linalg.eigvals(A - B @ K).real.max() <= -wish * (1 - 1e-6)


@pytest.mark.slow
def test_a_nominal_regulator_is_lost_to_a_tip_mass_that_this_one_carries() -> None:
    """On an undamped arm with five functions 1 % of the beam's mass is enough; damped, 10 %."""
    for damping_ratio, mass in ((0.0, 0.01), (0.005, 0.1)):
        problem = plant(5, of=arm(damping_ratio))
        assert problem.model is not None
        back = np.linalg.inv(np.kron(np.eye(2), problem.model.mode_shapes))
        A, B = changed_dynamics(problem.model, "torque", mass, 1.0)
        nominal = lqr(problem).gain @ back
        assert np.linalg.eigvals(A - B @ nominal).real.max() > 0
        controller = payload_lmi(problem, payload_mass=[0.0, mass])
        K = controller.gains["state_feedback"] @ back
        assert np.linalg.eigvals(A - B @ K).real.max() < 0


def test_a_range_of_one_payload_gives_the_optimum() -> None:
    problem = plant(2)
    controller = payload_lmi(problem, payload_mass=[0.0, 0.0])
    nominal = lqr(problem).gain
    np.testing.assert_allclose(
        controller.gains["state_feedback"], nominal, rtol=0, atol=2e-3 * np.abs(nominal).max()
    )


@pytest.mark.slow
def test_widening_the_range_never_lowers_the_promised_cost() -> None:
    problem = plant(2)
    bounds = [
        payload_lmi(problem, payload_mass=[0.0, high]).guarantees[0].bound
        for high in (0.0, 0.1, 0.5)
    ]
    assert np.all(np.diff(bounds) >= 0)


def test_units_do_not_matter() -> None:
    first = plant(2)
    second = in_units(first, 1e3, 10.0, 1e2)
    one = payload_lmi(first, payload_mass=[0.0, 0.2])
    other = payload_lmi(second, payload_mass=[0.0, 2.0])
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-4)
    assert other.guarantees[0].bound == pytest.approx(one.guarantees[0].bound, rel=1e-4)


@pytest.mark.slow
def test_an_impossible_range_says_what_is_possible() -> None:
    problem = plant(2)
    with pytest.raises(DesignError, match="possible with the others kept") as caught:
        payload_lmi(problem, payload_mass=[0.0, 50.0], stiffness=[0.02, 50.0])
    share = caught.value.remedy.split("payload_mass = [0, ")[1]
    possible = float(share.split("]")[0])
    assert 0 < possible < 50
    factors = [float(value) for value in share.split("stiffness = [")[1].rstrip("]").split(", ")]
    relaxed = payload_lmi(problem, payload_mass=[0.0, possible], stiffness=factors)
    promised = [check for check in relaxed.certificate.checks if "block" in check.name]
    assert all(check.passed for check in promised)


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"payload_mass": [0.2, 0.1]}, "payload_mass"),
        ({"payload_mass": [-0.1, 0.1]}, "payload_mass"),
        ({"payload_mass": 0.1}, "payload_mass"),
        ({"payload_mass": [0.1]}, "payload_mass"),
        ({"payload_mass": [0.0, 0.1], "stiffness": [0.0, 1.0]}, "stiffness"),
        ({"payload_mass": [0.0, 0.1], "decay_rate_min": -1.0}, "decay_rate_min"),
    ],
)
def test_impossible_options_are_refused(options: dict[str, object], where: str) -> None:
    with pytest.raises(InputError) as caught:
        payload_lmi(plant(1), **options)
    assert caught.value.where == where


def test_a_plant_without_model_is_refused() -> None:
    with pytest.raises(InputError, match="arm"):
        payload_lmi(replace(plant(1), model=None), payload_mass=[0.0, 0.1])


def test_vertices_of_a_range() -> None:
    assert Range((0.0, 0.1)).vertices == [(0.0, 1.0), (0.1, 1.0)]
    assert len(Range((0.0, 0.1), (0.9, 1.1)).vertices) == 4
    assert Range((0.0, 0.0)).vertices == [(0.0, 1.0)]


@pytest.mark.slow
def test_eight_functions() -> None:
    problem = generalised_plant(assemble(arm(), ClampedFree(8)), OBJECTIVE)
    controller = payload_lmi(problem, payload_mass=[0.0, 0.1], decay_rate_min=0.02 * OMEGA)
    assert controller.certificate.verified, controller.certificate


def test_an_unstable_arm_is_named_with_what_to_relax() -> None:
    """A weak controller for a light tip, closed around arms that a heavy one turns unstable."""
    nominal = plant(1)
    changed = {(m, 1.0): changed_plant(nominal, m, 1.0) for m in (0.0, 1.0, 4.0)}
    s = nominal.control_path
    destabilising = control.ss(-1.0, np.eye(1, 2), 5.0, np.zeros((1, 2)),
                               inputs=list(s.output_labels), outputs=["torque"])  # fmt: skip
    worst = worst_of(destabilising, changed)
    real = {at: np.linalg.eigvals(p.close(destabilising).A).real.max() for at, p in changed.items()}
    assert worst.at == max(real, key=lambda at: real[at])
    assert worst.real == pytest.approx(max(real.values()), rel=1e-9)
    assert worst.cost == np.inf
    told = str(worst.check(3))
    assert f"payload of {worst.at[0]:.4g} kg, the worst of 3 changed arms FAILED" in told
    assert told.endswith("narrow payload_mass or stiffness, or lower decay_rate_min")


def test_a_plant_that_is_not_its_arms_is_not_verified() -> None:
    whole = plant(1)
    D = np.array(whole.system.D)
    D[whole.performance :, -1] = -0.01  # a sensor that reads the actuator
    system = control.StateSpace(
        whole.A, whole.system.B, whole.system.C, D,
        inputs=whole.system.input_labels, outputs=whole.system.output_labels,
    )  # fmt: skip
    found = payload_lmi(replace(whole, system=system), payload_mass=[0.0, 0.1])
    assert not found.certificate.verified
    assert "on the plant as given" in str(found.certificate)
