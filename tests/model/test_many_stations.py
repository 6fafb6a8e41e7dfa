"""Profiles of thousands of stations: the same modes as by whole matrices, and as by few stations."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import (
    Arm,
    ArmMatched,
    Beam,
    ClampedFree,
    Hub,
    HubMatched,
    Payload,
    Stations,
    WithStatic,
    assemble,
    fit,
    state_space,
    truth,
    vary,
)
from slewctl.basis import Basis, Polynomial
from slewctl.model import frequencies
from slewctl.model.assembly import factors
from slewctl.model.ritz import Boundary, ritz_modes
from slewctl.model.subspace import lowest_modes

EPS = np.finfo(float).eps
HUBS = {"free": (Hub(), Payload()), "all parts": (Hub(0.3, 0.1), Payload(0.2, 0.01))}
every_hub = pytest.mark.parametrize("parts", HUBS.values(), ids=HUBS)


def ragged(stations: int) -> tuple[Stations, Stations]:
    """Mass and stiffness as a finite-element code may export them, with kinks and steps."""
    rng = np.random.default_rng(stations)
    x = np.sort(np.concatenate([[0.0, 1.3], rng.uniform(0.0, 1.3, stations - 3), [0.5]]))
    x = np.sort(np.append(x, 0.5))  # a step
    noise = rng.uniform(0.8, 1.2, (2, len(x)))
    taper = 1 - 0.6 * x / 1.3
    return Stations(x, 2 * taper * noise[0]), Stations(x, 30 * taper**3 * noise[1])


def straight(stations: int, root: float, tip: float) -> Stations:
    """A straight line, which two stations tell already."""
    x = np.linspace(0.0, 1.3, stations)
    return Stations(x, root + (tip - root) * x / 1.3)


@every_hub
@pytest.mark.parametrize("boundary", ["free", "hub-locked"])
def test_modes_are_those_of_the_whole_matrices(
    parts: tuple[Hub, Payload], boundary: Boundary
) -> None:
    arm = Arm(Beam(1.3, *ragged(60)), *parts)
    edges = arm.beam.breakpoints
    basis = Polynomial(5 * (len(edges) + 1), edges)
    whole = ritz_modes(factors(arm, basis), boundary)
    found = lowest_modes(arm, basis, 12, boundary)
    error = 100 * EPS * whole.omega[:12] / whole.omega[0]
    assert np.all(np.abs(found.omega[:12] / whole.omega[:12] - 1) <= error)
    # Unit modal mass, and the same shapes up to their signs.
    root = factors(arm, basis).mass[:, 1:]
    overlap = np.linalg.lstsq(root @ whole.shapes[:, :12], root @ found.shapes[:, :12], rcond=None)
    assert_allclose(np.abs(overlap[0]), np.eye(12), rtol=0, atol=1e-9)


def test_a_start_from_fewer_functions_ends_at_the_same_modes() -> None:
    arm = Arm(Beam(1.3, *ragged(60)), Hub(0.1))
    edges = arm.beam.breakpoints
    few, many = (Polynomial(terms * (len(edges) + 1), edges) for terms in (3, 5))
    coarse = lowest_modes(arm, few, 6, "free")
    warm = lowest_modes(arm, many, 6, "free", coarse.shapes)
    cold = lowest_modes(arm, many, 6, "free")
    assert_allclose(warm.omega[:6], cold.omega[:6], rtol=1e-12)
    assert np.all(warm.omega[:6] <= coarse.omega[:6] * (1 + 1e-12))


BASES = [ClampedFree(4), HubMatched(4), ArmMatched(4), WithStatic(ClampedFree(3))]


@pytest.mark.slow
@every_hub
def test_stations_on_a_straight_line_change_nothing(parts: tuple[Hub, Payload]) -> None:
    """2,001 stations of a linear taper are the linear taper."""
    many, few = (
        Arm(Beam(1.3, straight(n, 2.0, 0.7), straight(n, 30.0, 4.0)), *parts, damping_ratio=0.01)
        for n in (2001, 2)
    )
    exact, found = truth(few), truth(many)
    assert_allclose(found.omega, exact.omega, rtol=1e-11)
    assert found.tolerance < 1e-11
    assert_allclose(frequencies(many, 5).hz, frequencies(few, 5).hz, rtol=1e-11)
    for basis in BASES:
        assert_allclose(assemble(many, basis).omega, assemble(few, basis).omega, rtol=1e-10)
    outputs = ["theta", "tip", "moment@641mm", "deflection@700mm"]
    here, there = (state_space(model, outputs=outputs) for model in (found, exact))
    size = np.abs(there.C).max(axis=1, keepdims=True)
    assert np.all(np.abs(here.C - there.C) <= 1e-8 * size)


@pytest.mark.slow
@pytest.mark.parametrize("basis", [ArmMatched(4), WithStatic(ClampedFree(3))])
def test_ragged_profiles_have_modes_from_above(basis: Basis) -> None:
    """Rayleigh–Ritz: no basis comes below the truth, and arm-matched functions come close."""
    arm = Arm(Beam(1.3, *ragged(2000)), Hub(0.3, 0.1), Payload(0.2, 0.01))
    exact, model = truth(arm), assemble(arm, basis)
    assert np.all(model.omega >= exact.omega[:4] * (1 - 1e-11))
    assert_allclose(
        model.omega[:2], exact.omega[:2], rtol=1e-7 if basis.name == "arm-matched" else 1
    )
    # Few functions would do for smooth profiles only: the ragged ones need their panels.
    coarse = ritz_modes(factors(arm, Polynomial(12)), "free")
    assert coarse.omega[0] > exact.omega[0] * (1 + 1e-6)


def test_an_arm_of_many_stations_is_fitted() -> None:
    """The stiffness that makes the frequencies measured is found again: 1.1 of that given."""
    arm = Arm(Beam(1.3, *ragged(300)), Hub(0.3))
    stiffer = vary(arm, stiffness_factor=1.1)
    measured = dict(enumerate(frequencies(stiffer, 2).hz, start=1))
    found = fit(arm, measured, free=["beam.stiffness"])
    assert_allclose(frequencies(found.arm, 4).hz, frequencies(stiffer, 4).hz, rtol=1e-7)
