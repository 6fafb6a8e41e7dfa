"""An elastic joint beside held ratios, drag, lumped masses and modal data: one physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import slewctl as sc
from slewctl._types import Array
from slewctl.model import frequencies
from slewctl.plant.places import place_row

ARM = sc.Arm(
    sc.Beam(0.8, 1.5, 12.0),
    sc.Hub(0.05, radius=0.06, friction=0.02),
    sc.Payload(0.1, 0.002),
    joint=sc.Joint(40.0, damping=0.03, rotor_inertia=0.1, rotor_friction=0.04),
    masses=(sc.LumpedMass(0.3, 0.2, 1e-3),),
)


def poles(model: sc.Model) -> Array:
    """Return the poles of a model by increasing size."""
    n = model.n + 1
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:] = -np.linalg.solve(model.mass, np.hstack([model.stiffness, model.damping]))
    found = np.linalg.eigvals(A)
    return found[np.lexsort((found.imag, np.abs(found).round(9)))]


def held_model(model: sc.Model) -> tuple[Array, Array, Array]:
    """Return M, D, K where neither rotor nor hub turns: θ_m = 0 and twist = 0."""
    assert model.coordinates[:2] == ("theta_motor", "twist")
    return tuple(matrix[2:, 2:] for matrix in (model.mass, model.damping, model.stiffness))


def test_held_ratios_are_those_of_the_held_beam() -> None:
    """With the hub held each mode has its ratio; the joint and the rotor know nothing of them."""
    ratios = (0.01, 0.02, 0.05)
    arm = replace(ARM, damping_ratio=ratios, damping_modes="hub-locked")
    bare = replace(arm, damping_ratio=0.0)
    with_ratios, without = sc.assemble(arm, "clamped-free", n=3), sc.assemble(bare, "slewing", n=3)
    M, D, K = held_model(with_ratios)
    L = np.linalg.cholesky(M)
    inner = np.linalg.solve(L, np.linalg.solve(L, K).T)
    squares, V = np.linalg.eigh(inner)
    modes = np.linalg.solve(L.T, V)
    found = np.diag(modes.T @ D @ modes) / (2 * np.sqrt(squares))
    assert found == pytest.approx(ratios, rel=1e-9)
    beside = sc.assemble(bare, "clamped-free", n=3).damping
    assert np.array_equal(with_ratios.damping[:2], beside[:2])
    assert without.damping[2:, 2:] == pytest.approx(0.0, abs=0.0)


@pytest.mark.parametrize("law", [None, sc.Drag(0.3)])
def test_a_stiff_joint_is_none(law: sc.Drag | None) -> None:
    """With k_j → ∞ the poles below the joint's are those of the rigid connection, as 1/k_j."""
    arm = replace(ARM, damping_ratio=(0.01, 0.03), damping_modes="hub-locked", damping=law)
    joint = ARM.joint
    rigid = replace(
        arm, joint=None, hub=sc.Hub(0.05 + joint.rotor_inertia, 0.06, 0.02 + joint.rotor_friction)
    )
    wanted = poles(sc.assemble(rigid, "hub-matched", n=4))
    gaps = []
    for stiffness in (1e6, 1e8):
        stiff = replace(arm, joint=replace(joint, stiffness=stiffness))
        found = poles(sc.assemble(stiff, "hub-matched", n=4))
        gaps.append(np.abs(found[: len(wanted)] - wanted)[2:].max())
    assert gaps[1] < gaps[0] / 50


def test_the_truth_keeps_held_ratios_behind_a_joint() -> None:
    """Free damping of the truth converges with its modes, and agrees with many functions."""
    arm = replace(ARM, damping_ratio=(0.01, 0.03), damping_modes="hub-locked")
    wanted = poles(sc.assemble(arm, sc.Polynomial(24)))
    found = poles(sc.truth(arm, 20))
    first = [pole for pole in wanted if pole.imag > 0][:4]
    near = [found[np.abs(found - pole).argmin()] for pole in first]
    assert np.abs(np.array(near) / np.array(first) - 1).max() < 2e-3


def test_drag_takes_the_power_of_the_beam_alone() -> None:
    """ẋᵀDẋ = ∫ c_b ẏ² dx for any rates, θ_m, twist and q alike, besides hub, rotor and joint."""
    dragged = sc.assemble(replace(ARM, damping=sc.Drag(0.3)), "hub-matched", n=3)
    own = dragged.damping - sc.assemble(ARM, "hub-matched", n=3).damping
    x, weights = np.polynomial.legendre.leggauss(40)
    rates = np.random.default_rng(1).standard_normal(dragged.n + 1)
    moved = dragged.displacement(0.4 * (x + 1)) @ rates
    assert rates @ own @ rates == pytest.approx(0.3 * 0.4 * weights @ moved**2, rel=1e-10)


def test_modal_data_of_a_beam_behind_the_same_joint() -> None:
    """The data of many held modes turn behind a joint as the beam does."""
    held = replace(ARM, damping_ratio=0.01, damping_modes="hub-locked")
    data = sc.modal_data(held, 20)
    assert data.joint == held.joint
    beam, sheet = sc.truth(held, 6), sc.truth(data, 20)
    assert sheet.coordinates[0] == "theta_motor"
    ratio = sheet.frequencies_hz[:4] / beam.frequencies_hz[:4]
    assert np.all(ratio > 1 - 1e-9)  # fewer modes can only stiffen
    assert ratio == pytest.approx(np.ones(4), abs=2e-4)
    assert frequencies(data, 3, "hub-locked").hz == pytest.approx(
        frequencies(held, 3, "hub-locked").hz, rel=1e-9
    )
    assert frequencies(data, 2, "rotor-locked").hz == pytest.approx(
        frequencies(held, 2, "rotor-locked").hz, rel=2e-4
    )
    model = sc.assemble(data, "modal", n=5)
    row = place_row(model, data.beam, "tip", "displacement")
    assert row[:2] == pytest.approx(2 * [ARM.reach])
    assert data.reach == pytest.approx(ARM.reach)


def test_a_hub_behind_a_joint_is_not_turned_as_given() -> None:
    """What is prescribed is the rotor's angle then: refused, with the way out."""
    equations = sc.large_slew(sc.assemble(ARM, "clamped-free", n=2))
    with pytest.raises(sc.InputError, match="servo turns the rotor"):
        sc.simulate_turned_hub(equations, np.linspace(0, 1, 3), sc.Slew(10.0, 1.0))


def test_a_callable_profile_spins_behind_a_joint_as_its_table_does() -> None:
    """The twist leaves the profile's integrals alone: no relative change is asked of it."""
    at = np.linspace(0.0, 1.0, 41)
    smooth = sc.Beam(1.0, lambda x: 2 * np.exp(-x), lambda x: 40 * np.exp(-2 * x))
    table = sc.Beam(1.0, sc.Stations(at, 2 * np.exp(-at)), sc.Stations(at, 40 * np.exp(-2 * at)))
    joint = sc.Joint(200.0, rotor_inertia=0.3)
    found = [
        sc.spin_frequencies_hz(
            sc.assemble(sc.Arm(beam, sc.Hub(0.1), joint=joint), "hub-matched", 3), 3.0
        )
        for beam in (smooth, table)
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=2e-4)
