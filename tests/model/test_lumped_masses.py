"""Masses along the beam: exact determinants, own integrals, and what they must be the same as."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from exact_beam import encloses, series_determinant
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.linalg import eigh

import slewctl as sc
from slewctl import Arm, Beam, Hub, LumpedMass, Payload
from slewctl.basis import BASES
from slewctl.model import frequencies
from slewctl.model.assembly import factors
from slewctl.model.ritz import ritz_modes
from slewctl.model.spin import spin_frequencies_hz
from slewctl.model.subspace import lowest_modes

TAPERED = Arm(
    Beam(1.5, (1.0, -0.3), (2.0, -0.5, 0.1)),
    Hub(0.3, 0.1),
    Payload(0.2, 0.01),
    masses=(LumpedMass(0.375, 0.5, 0.02), LumpedMass(1.25, 0.1, 0.005)),
    damping_ratio=0.01,
)
UNIFORM = Arm(Beam(1.0, 1.0, 1.0), masses=(LumpedMass(0.5, 1.0),))


def test_own_finite_elements_of_a_beam_with_its_own_mass_at_mid_span() -> None:
    held = 2 * np.pi * frequencies(UNIFORM, 3).hz
    np.testing.assert_allclose(held, [2.8912384, 14.2254283, 61.6810588], rtol=2e-9)
    free = 2 * np.pi * sc.truth(UNIFORM, 2).frequencies_hz
    np.testing.assert_allclose(free, [11.489535, 47.710468], rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("arm", [UNIFORM, TAPERED], ids=["uniform", "tapered"])
def test_the_truth_converges_to_the_exact_determinant(arm: Arm) -> None:
    """As fast as without the masses: some ten functions a panel give eleven digits."""
    found = sc.truth(arm, 4)
    assert found.tolerance < 1e-11
    assert found.functions <= 20 * (len(arm.masses) + 1)
    with mp.workdps(30):
        for omega in found.omega:
            assert encloses(lambda w: series_determinant(arm, w), omega, 1e-11)


def test_bases_that_know_the_arm_bend_at_the_masses() -> None:
    exact = sc.truth(TAPERED, 6).omega
    for name in BASES:
        found = sc.assemble(TAPERED, name, n=6).omega
        assert np.all(found >= exact * (1 - 1e-12)), name
    bent = sc.assemble(TAPERED, "arm-matched", n=6).omega
    np.testing.assert_allclose(bent[:4], exact[:4], rtol=1e-6)


@pytest.mark.parametrize("name", ["clamped-free", "hub-matched"])
def test_the_static_shape_is_the_deflection_under_constant_acceleration(name: str) -> None:
    """v(L) = ∫ M(x)(L − x)/EI dx for M of unit angular acceleration, by other integrals."""
    arm, L, r = TAPERED, TAPERED.beam.length, TAPERED.hub.radius
    bodies = [*arm.masses, LumpedMass(L, arm.payload.mass, arm.payload.inertia)]

    def moment(x: float) -> float:
        spread = quad(lambda s: (1 - 0.3 * s / L) * (r + s) * (s - x), x, L)[0]
        beyond = [b for b in bodies if b.x > x]
        return spread + sum(b.mass * (r + b.x) * (b.x - x) + b.inertia for b in beyond)

    def bent(x: float) -> float:
        return moment(x) * (L - x) / (2.0 - 0.5 * x / L + 0.1 * (x / L) ** 2)

    tip = sum(quad(bent, a, b)[0] for a, b in pairwise([0.0, 0.375, 1.25, L]))
    model = sc.assemble(arm, sc.WithStatic(BASES[name](2)))
    q = np.linalg.solve(model.stiffness[1:, 1:], model.mass[1:, 0])
    deflection = model.displacement(np.array([L]))[0, 1:] @ q
    assert deflection == pytest.approx(tip, rel=1e-10)


@pytest.mark.parametrize("name", ["clamped-free", "slewing", "polynomial"])
def test_a_mass_at_an_end_belongs_to_what_is_there(name: str) -> None:
    bare = replace(TAPERED, masses=())
    at_tip = replace(bare, masses=(LumpedMass(1.5, 0.3, 0.02),))
    heavier = replace(bare, payload=Payload(0.5, 0.03))
    at_clamp = replace(bare, masses=(LumpedMass(0.0, 2.0, 0.5),))
    larger = replace(bare, hub=Hub(0.3 + 2.0 * 0.1**2 + 0.5, 0.1))
    for one, other in ((at_tip, heavier), (at_clamp, larger)):
        models = [sc.assemble(arm, name, n=3) for arm in (one, other)]
        np.testing.assert_allclose(models[0].mass, models[1].mass, rtol=1e-13, atol=1e-15)
        truths = [sc.truth(arm, 3).omega for arm in (one, other)]
        np.testing.assert_allclose(*truths, rtol=1e-12)


@settings(max_examples=10, deadline=None)
@given(st.floats(1e-2, 1e2), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_units_change_nothing(metre: float, kilogram: float, second: float) -> None:
    force = kilogram * metre / second**2

    def scaled(body: LumpedMass) -> LumpedMass:
        mass, inertia = kilogram * body.mass, kilogram * metre**2 * body.inertia
        return LumpedMass(metre * body.x, mass, inertia)

    arm, masses = TAPERED, tuple(map(scaled, TAPERED.masses))
    beam = Beam(
        metre * arm.beam.length,
        tuple(kilogram / metre * c for c in arm.beam.mass_per_length),
        tuple(force * metre**2 * c for c in arm.beam.bending_stiffness),
    )
    hub = Hub(kilogram * metre**2 * arm.hub.inertia, metre * arm.hub.radius)
    payload = Payload(kilogram * arm.payload.mass, kilogram * metre**2 * arm.payload.inertia)
    found = sc.truth(Arm(beam, hub, payload, masses=masses), 3).omega * second
    np.testing.assert_allclose(found, sc.truth(arm, 3).omega, rtol=1e-11)


@pytest.mark.parametrize("boundary", ["free", "hub-locked"])
def test_panel_by_panel_the_modes_are_those_of_the_matrices(boundary: str) -> None:
    basis = sc.Polynomial(3 * 12, TAPERED.breakpoints)
    whole = ritz_modes(factors(TAPERED, basis), boundary).omega[:4]
    np.testing.assert_allclose(
        lowest_modes(TAPERED, basis, 4, boundary).omega[:4], whole, rtol=1e-11
    )


def test_a_mass_pulls_on_the_beam_within_it_alone() -> None:
    """Its share of K_g is m(r + x_i)∫Φ'ᵀΦ' dx up to x_i, and of M_s that of a point."""
    basis, L, r = sc.ClampedFree(3), TAPERED.beam.length, TAPERED.hub.radius
    body = TAPERED.masses[0]
    arms = (TAPERED, replace(TAPERED, masses=TAPERED.masses[1:]))
    with_it, without = (sc.large_slew(sc.assemble(arm, basis)) for arm in arms)

    def slopes(x: float, i: int, j: int) -> float:
        row = basis.evaluate(np.array([x / L]), 1)[0] / L
        return row[i] * row[j]

    tension = [[quad(slopes, 0, body.x, (i, j))[0] for i in range(3)] for j in range(3)]
    share = body.mass * (r + body.x) * np.array(tension)
    added = with_it.geometric_stiffness - without.geometric_stiffness
    np.testing.assert_allclose(added, share, rtol=1e-9, atol=1e-12)
    shape = basis.evaluate(np.array([body.x / L]))[0]
    carried = with_it.carried_mass - without.carried_mass
    np.testing.assert_allclose(carried, body.mass * np.outer(shape, shape), rtol=1e-9, atol=1e-12)
    model, spin = with_it.linear, 3.0
    stiffness = model.stiffness[1:, 1:] - spin**2 * with_it.softening
    squared = eigh(stiffness, model.mass[1:, 1:], eigvals_only=True)
    found = 2 * np.pi * spin_frequencies_hz(model, spin)
    np.testing.assert_allclose(found**2, squared, rtol=1e-9)


def test_a_factor_on_the_masses_leaves_the_rest() -> None:
    heavier = sc.vary(TAPERED, lumped_mass_factor=2.0)
    assert heavier.masses == (LumpedMass(0.375, 1.0, 0.04), LumpedMass(1.25, 0.2, 0.01))
    assert replace(heavier, masses=TAPERED.masses) == TAPERED
    with pytest.raises(sc.InputError, match="no lumped mass to multiply"):
        sc.vary(sc.arms.paper_beam(), lumped_mass_factor=2.0)
