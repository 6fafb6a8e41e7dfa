"""Damping as data give it: ratios of the arm with its hub held, and drag along the beam."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigvals

import slewctl as sc
from slewctl import Arm, Beam, Drag, Hub, Payload
from slewctl.files import read_arm
from slewctl.model import Model

BEAM = Beam(1.0, (1.0, -0.3), (1.0, -0.5))
HELD = Arm(BEAM, Hub(0.1, 0.05), Payload(0.2, 0.01), (0.03, 0.01), damping_modes="hub-locked")
BASES = (
    sc.ClampedFree(5),
    sc.HubMatched(5),
    sc.ArmMatched(5),
    sc.Polynomial(8),
    sc.WithStatic(sc.Slewing(4)),
)


def poles(M: np.ndarray, D: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return s with det(Ms² + Ds + K) = 0 and Im s >= 0, slowest first, from the pencil."""
    n = len(M)
    left = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -D]])
    found = eigvals(left, np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), M]]))
    found = found[found.imag >= 0]
    return found[np.argsort(np.abs(found))]


def whole(model: Model) -> np.ndarray:
    return poles(model.mass, model.damping, model.stiffness)


def test_poles_of_a_satellite_whose_panels_alone_have_drag() -> None:
    """Two equal panels, each EI = L = 1, m̄ = 2 and drag 2, on a hub of inertia 1."""
    arm = Arm(Beam(1.0, 4.0, 2.0), Hub(1.0), damping=Drag(4.0))
    expected = [0.0, -0.580964, -0.229381 + 3.686044j]
    for model in (sc.truth(arm, 12), sc.assemble(arm, "arm-matched", n=4)):
        np.testing.assert_allclose(whole(model)[:3], expected, atol=2e-6)


def test_drag_is_in_proportion_to_a_uniform_beams_mass_and_to_nothing_else() -> None:
    uniform = Arm(Beam(1.5, 2.0, 3.0), Hub(0.0, 0.2), damping=Drag(0.7))
    model = sc.assemble(uniform, "clamped-free", n=4)
    np.testing.assert_allclose(model.damping, 0.35 * model.mass, rtol=1e-12, atol=1e-15)
    loaded = replace(uniform, hub=Hub(5.0, 0.2), payload=Payload(1.0, 0.1))
    np.testing.assert_allclose(
        sc.assemble(loaded, "clamped-free", n=4).damping, model.damping, rtol=1e-12
    )
    sampled = replace(uniform, beam=Beam(1.5, lambda x: 2.0 + 0 * x, 3.0))
    np.testing.assert_allclose(
        sc.assemble(sampled, "clamped-free", n=4).damping, model.damping, rtol=1e-11, atol=1e-15
    )


@pytest.mark.parametrize("basis", BASES, ids=lambda basis: basis.name)
def test_with_the_hub_held_the_modes_have_the_ratios_given(basis: sc.Polynomial) -> None:
    """Those of the zeros of the hub's response to a torque, which feedback leaves where they are."""
    model = sc.assemble(HELD, basis)
    assert not model.damping[0].any()
    held = poles(model.mass[1:, 1:], model.damping[1:, 1:], model.stiffness[1:, 1:])
    expected = [0.03, *[0.01] * (model.n - 1)]
    np.testing.assert_allclose(-held.real / np.abs(held), expected, rtol=1e-7)
    assert "ζ = 0.03, 0.01 of the first hub-locked modes, 0.01 of all beyond" in str(model)


def test_bases_and_truth_agree_on_the_free_arm() -> None:
    fine = whole(sc.assemble(HELD, sc.Polynomial(30)))[2:5]
    free = -fine.real / np.abs(fine)
    assert np.all(free > [0.03, 0.01, 0.01])
    for model in (sc.truth(HELD, 10), *(sc.assemble(HELD, basis) for basis in BASES[2:4])):
        np.testing.assert_allclose(whole(model)[2:4], fine[:2], rtol=5e-3)
    np.testing.assert_allclose(whole(sc.truth(HELD, 10))[2:5], fine, rtol=2e-4)


def test_a_truth_without_hub_inertia_is_damped_by_all_its_modes() -> None:
    """Its own five free modes do not bend at the clamp: by them alone it is 4 % off."""
    arm = Arm(Beam(1.0, 1.0, 1.0), damping_ratio=0.0166, damping_modes="hub-locked")
    fine = whole(sc.assemble(arm, sc.Polynomial(80)))[2]
    for modes, error in ((5, 2e-3), (20, 1e-3)):
        first = whole(sc.truth(arm, modes))[2]
        assert abs(first.real / abs(first) / (fine.real / abs(fine)) - 1) < error
    assert np.linalg.eigvalsh(sc.truth(arm, 20).damping).min() >= -1e-12


def test_factors_multiply_what_damps() -> None:
    assert sc.vary(HELD, damping_factor=2.0).damping_ratio == (0.06, 0.02)
    dragged = Arm(BEAM, damping=Drag(0.5))
    assert sc.vary(dragged, damping_factor=2.0).damping == Drag(1.0)


def test_files_say_whose_ratios_they_are(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    for arm in (HELD, replace(HELD, damping=Drag(0.5))):
        path.write_text(arm.to_toml(), encoding="utf-8")
        assert read_arm(path) == arm
    path.write_text('[arm]\ncatalogue = "paper-beam"\ndamping_modes = "hub-locked"')
    with pytest.raises(sc.InputError, match=r"arm.damping_ratio: missing; add it"):
        read_arm(path)
    path.write_text('[arm]\ncatalogue = "paper-beam"\ndamping_ratio = 0.1\ndamping_modes = "held"')
    with pytest.raises(sc.InputError, match=r"arm.toml:4: arm.damping_modes: unknown name 'held'"):
        read_arm(path)
