"""Options without a default: every method says what is missing and what to give."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from design_problems import OBJECTIVE, design_model, design_plant

import slewctl as sc
from slewctl.design import METHODS
from slewctl.errors import InputError

# Positive position feedback needs a sensor of the bending.
BENDING = sc.Objective(OBJECTIVE.limits, {"torque": 0.1, "theta": 0.01, "root_moment": 0.1})
# What cannot be chosen for a user, in the order in which it is asked for.
NEEDED: dict[str, dict[str, object]] = {
    "lqg": {},
    "h2-lmi": {},
    "h2-region": {},
    "h2-hinf": {"hinf_max": 1e3, "weight_hz": 1.0},
    "payload-lmi": {"payload_mass": [0.0, 0.1]},
    "variance-bound": {"std_max": {"torque": 1e3}},
    "pole-placement": {"bandwidth_hz": 0.1},
    "pd-notch": {"bandwidth_hz": 0.1},
    "positive-position": {"bandwidth_hz": 0.1},
    "lead": {"crossover_hz": 0.01},
    "given": {"pid": {"kp": 1.0}},
}


@pytest.mark.parametrize("method", METHODS)
def test_every_option_has_a_default_or_is_asked_for(method: str) -> None:
    """Each refusal names one option that is missing; given all of them there is a design."""
    parameters = inspect.signature(METHODS[method]).parameters.values()
    assert all(p.default is not p.empty for p in parameters if p.kind is p.KEYWORD_ONLY)
    plant, given = design_plant(2, BENDING), dict[str, object]()
    for option, value in NEEDED[method].items():
        with pytest.raises(InputError) as refusal:
            METHODS[method](plant, **given)
        assert (refusal.value.where, refusal.value.what) == (option, "missing")
        assert refusal.value.remedy
        given[option] = value
    found = METHODS[method](plant, **given)
    assert isinstance(found, sc.Controller)
    assert found.certificate.verified, found.certificate


def test_arrays_are_no_names() -> None:
    plant, array = design_plant(2), np.array([1.0, 2.0])
    with pytest.raises(InputError, match="formulation"):
        sc.h2_lmi(plant, formulation=array)
    with pytest.raises(InputError, match="minimise"):
        sc.variance_bound(plant, std_max={"torque": 1.0}, minimise=array)
    with pytest.raises(InputError, match="notch_modes"):
        sc.pd_notch(plant, bandwidth_hz=0.2, notch_modes=np.array([-1]))


def test_close_says_which_argument_is_wrong() -> None:
    plant = design_plant(2)
    assert plant.objective is not None
    with pytest.raises(InputError, match="close"):
        sc.close(plant.objective, design_model(2), sc.lqg(plant))
    with pytest.raises(InputError, match="in this order"):
        sc.close(design_model(2), sc.lqg(plant), plant.objective)
