"""The catalogue of arms with published data."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import Arm, InputError, arms


@pytest.mark.parametrize("name", arms.names())
def test_every_entry_builds_the_same_arm_twice_and_names_its_source(name: str) -> None:
    arm = arms.get(name)
    assert isinstance(arm, Arm)
    assert arms.get(name) == arm
    assert hash(arms.get(name)) == hash(arm)
    assert arms.CATALOGUE[name].source
    assert arms.CATALOGUE[name].uncertain


def test_paper_beam_is_equation_48() -> None:
    arm = arms.get("paper-beam")
    xi = np.linspace(0, 1, 11)
    assert arm.beam.length == 1.0
    for profile in (arm.beam.mass_profile, arm.beam.stiffness_profile):
        assert_allclose(profile(xi), 1 - 5 / 6 * xi**3, rtol=0, atol=3e-16)
    assert (arm.hub.inertia, arm.hub.radius, arm.hub.friction) == (0.0, 0.0, 0.0)
    assert (arm.payload.mass, arm.payload.inertia, arm.damping_ratio) == (0.0, 0.0, 0.0)


def test_misspelt_name_gets_a_suggestion() -> None:
    with pytest.raises(InputError) as error:
        arms.get("paper-bean")
    assert str(error.value) == "arm: unknown name 'paper-bean'; did you mean 'paper-beam'?"


@pytest.mark.parametrize("name", ["zzzz", "", 3, None])
def test_unknown_name_lists_the_known_ones(name: object) -> None:
    with pytest.raises(InputError) as error:
        arms.get(name)
    assert all(known in str(error.value) for known in arms.names())
