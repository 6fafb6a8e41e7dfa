"""What a controller is designed on: a basis or a reduction, the same plant to the method."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose

import slewctl as sc
from slewctl.basis import NAMES
from slewctl.compare import REDUCTIONS, SOURCES, design_model

OBJECTIVE = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "tip": 1e-3})


def truth_with(friction: float, modes: int = 12) -> sc.Truth:
    hub = sc.Hub(0.1944, friction=friction)
    return sc.truth(replace(sc.arms.paper_beam(), hub=hub, damping_ratio=0.005), modes)


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("friction", [0.0, 0.1, 50.0])
def test_frequencies_are_the_arms_whatever_the_friction(source: str, friction: float) -> None:
    """Heavy friction makes the rigid body's pole faster than the first mode."""
    truth = truth_with(friction)
    design = design_model(truth, OBJECTIVE, source, 3)
    assert design.omega.shape == (3,)
    assert np.all(np.diff(design.omega) > 0)
    assert design.plant.system.nstates == 8
    # Friction moves the damped poles of a reduction a little; a Galerkin model has its own.
    if source in REDUCTIONS and friction < 1:
        assert_allclose(design.omega, truth.omega[:3], rtol=0.01)


def test_a_reduction_carries_its_bound_and_a_basis_its_model() -> None:
    truth = truth_with(0.0)
    for source in SOURCES:
        design = design_model(truth, OBJECTIVE, source, 2)
        assert (design.model is None) == (source in REDUCTIONS)
        assert (design.reduced is None) == (source in NAMES)


def test_static_correction_in_the_loop_is_the_same_from_both_sides() -> None:
    """K around the plant with the static response is K₀ around the plant without it."""
    design = design_model(truth_with(0.0), OBJECTIVE, "modal-truncation-static", 2)
    plain = design_model(truth_with(0.0), OBJECTIVE, "modal-truncation", 2)
    own = plain.controller("lqg", {}).system
    corrected = design.controller("lqg", {}).system
    inside = control.feedback(plain.control_path, own, sign=1)
    outside = control.feedback(design.control_path, corrected, sign=1)
    assert np.any(np.asarray(design.control_path.D))
    assert_allclose(
        np.sort_complex(outside.poles()), np.sort_complex(inside.poles()), rtol=1e-6, atol=1e-8
    )


def test_impossible_models_are_refused() -> None:
    truth = truth_with(0.0)
    with pytest.raises(sc.InputError, match="did you mean 'balanced-truncation'"):
        design_model(truth, OBJECTIVE, "balanced-trunkation", 2)
    with pytest.raises(sc.InputError, match="nothing to reduce; give at most 11"):
        design_model(truth, OBJECTIVE, "modal-truncation", 12)
