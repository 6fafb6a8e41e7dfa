"""What a controller is designed on: a basis or a reduction, the same plant to the method."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import slewctl as sc
from slewctl.basis import BASES, NAMES, Basis
from slewctl.compare import REDUCTIONS, SOURCES, design_model
from slewctl.files import read_design

OBJECTIVE = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "tip": 1e-3})


def truth_with(friction: float, modes: int = 12) -> sc.Truth:
    hub = sc.Hub(0.1944, friction=friction)
    return sc.truth(replace(sc.arms.paper_beam(), hub=hub, damping_ratio=0.005), modes)


def damped(truth: sc.Truth, friction: float) -> np.ndarray:
    """|λ| of the pairs of the arm's equation in modal coordinates, ẍ + 2ζωẋ + c rrᵀẋ + ω²x = 0.

    r is the slope of the modes at the hub: friction is a rank-one damper there.
    """
    n, r = len(truth.omega) + 1, truth.mode_shapes[0]
    omega = np.append(0.0, truth.omega)
    rates = np.diag(2 * 0.005 * omega) + friction * np.outer(r, r)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -rates]])
    poles = np.linalg.eigvals(A)
    return np.sort(np.abs(poles[poles.imag > 1e-6 * np.abs(poles)]))


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("friction", [0.0, 0.1, 50.0])
def test_frequencies_are_the_arms_whatever_the_friction(source: str, friction: float) -> None:
    """Heavy friction makes the rigid body's pole faster than the first mode."""
    truth = truth_with(friction)
    design = design_model(truth, OBJECTIVE, source, 3)
    assert design.omega.shape == (3,)
    assert np.all(np.diff(design.omega) > 0)
    assert design.plant.system.nstates == 8
    if source in NAMES:
        # Rayleigh and Ritz: frequencies of a few functions are those of the arm from above.
        assert np.all(design.omega >= truth.omega[:3] * (1 - 1e-9))
        assert_allclose(design.omega[0], truth.omega[0], rtol=0.15)
    elif source.startswith("modal"):
        assert_allclose(design.omega, damped(truth, friction)[:3], rtol=1e-6)
    elif friction < 1:  # a balanced reduction keeps what counts, and moves it a little
        assert_allclose(design.omega, truth.omega[:3], rtol=0.01)


def test_a_reduction_carries_its_bound_and_a_basis_its_model() -> None:
    truth = truth_with(0.0)
    for source in SOURCES:
        design = design_model(truth, OBJECTIVE, source, 2)
        assert (design.model is None) == (source in REDUCTIONS)
        assert (design.reduced is None) == (source in NAMES)


DESIGN = """
title = "t"
[arm]
catalogue = "paper-beam"
damping_ratio = 0.01
hub = {{ inertia = 0.05 }}
payload = {{ mass = 0.1 }}
[model]
basis = "{basis}"
n = 4
[controller]
method = "lqg"
limits = {{ tip = 0.1, torque = 1 }}
noise = {{ torque = 0.1, theta = 1e-3 }}
[slew]
angle_deg = 30
duration_s = 2
"""


@pytest.mark.parametrize("kind", BASES.values(), ids=BASES)
def test_a_script_and_a_design_file_have_the_same_model(kind: type[Basis], tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    path.write_text(DESIGN.format(basis=kind.name), encoding="utf-8")
    case = read_design(path).case
    design = design_model(sc.truth(case.arm), case.objective, case.basis, case.n)
    script = sc.assemble(case.arm, kind(4))
    assert design.model is not None
    for name in ("mass", "damping", "stiffness", "omega"):
        assert_array_equal(getattr(design.model, name), getattr(script, name))


def test_static_correction_in_the_loop_is_the_same_from_both_sides() -> None:
    """K around the plant with the static response is K₀ around the plant without it."""
    design = design_model(truth_with(0.0), OBJECTIVE, "modal-truncation-static", 2)
    plain = design_model(truth_with(0.0), OBJECTIVE, "modal-truncation", 2)
    own = plain.controller("lqg", {}).system
    corrected = design.controller("lqg", {}).system
    inside = control.feedback(plain.path.to_control(), own, sign=1)
    outside = control.feedback(design.path.to_control(), corrected, sign=1)
    assert np.any(np.asarray(design.path.D))
    assert_allclose(
        np.sort_complex(outside.poles()), np.sort_complex(inside.poles()), rtol=1e-6, atol=1e-8
    )


def test_impossible_models_are_refused() -> None:
    truth = truth_with(0.0)
    with pytest.raises(sc.InputError, match="did you mean 'balanced-truncation'"):
        design_model(truth, OBJECTIVE, "balanced-trunkation", 2)
    with pytest.raises(sc.InputError, match="nothing to reduce; give at most 11"):
        design_model(truth, OBJECTIVE, "modal-truncation", 12)
