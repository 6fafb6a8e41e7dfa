"""Options without a default: every method says what is missing and what to give."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from design_problems import design_model, design_plant

import slewctl as sc
from slewctl.design import METHODS
from slewctl.errors import InputError, SlewctlError


def refused(method: str) -> SlewctlError | None:
    try:
        METHODS[method](design_plant(2))
    except SlewctlError as error:
        return error
    return None


@pytest.mark.parametrize("method", METHODS)
def test_every_option_has_a_default_or_is_asked_for(method: str) -> None:
    parameters = inspect.signature(METHODS[method]).parameters.values()
    assert all(p.default is not p.empty for p in parameters if p.kind is p.KEYWORD_ONLY)
    refusal = refused(method)
    assert refusal is None or (refusal.where and refusal.remedy)


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
