"""Absurd numbers: one clear error that names them, or a result that its certificate judges."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from constrained_problems import OBJECTIVE, arm

from slewctl import (
    AccuracyError,
    ClampedFree,
    Controller,
    DesignError,
    InputError,
    Objective,
    SlewctlError,
    assemble,
    generalised_plant,
    lqg,
)
from slewctl.design import METHODS
from slewctl.design.breakdown import check_finite, guarded

OPTIONS: dict[str, dict[str, object]] = {
    "h2-region": {"damping_ratio_min": 0.05},
    "h2-hinf": {"hinf_max": 30.0, "weight_hz": 1.0},
    "variance-bound": {"std_max": {"torque": 0.5}},
    "pole-placement": {"bandwidth_hz": 0.5},
    "pd-notch": {"bandwidth_hz": 0.5},
    "lead": {"crossover_hz": 0.5},
}
MODEL = assemble(arm(), ClampedFree(1))


@pytest.mark.parametrize("name", ["lqg", "h2-lmi", *OPTIONS])
@pytest.mark.parametrize("key", ["limits.tip", "limits.torque", "noise.torque", "noise.theta"])
@pytest.mark.parametrize("value", [1e-320, 1e-200, 1e200, 1e300])
def test_absurd_weights_are_one_error_or_one_result(name: str, key: str, value: float) -> None:
    tables = {"limits": dict(OBJECTIVE.limits), "noise": dict(OBJECTIVE.noise)}
    table, _, signal = key.partition(".")
    tables[table][signal] = value
    found: Controller | SlewctlError
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            plant = generalised_plant(MODEL, Objective(**tables))
            found = METHODS[name](plant, **OPTIONS.get(name, {}))
        except SlewctlError as error:
            found = error
    if isinstance(found, SlewctlError):
        # A design that an assumption forbids says which; all else names the number.
        assert isinstance(found, DesignError) or found.where.startswith(key)
        assert "\n" not in str(found)
    else:
        assert np.isfinite(found.system.A).all()


def test_an_integral_limit_out_of_range_is_named() -> None:
    plant = generalised_plant(MODEL, OBJECTIVE)
    for limit in (1e-200, 1e200):
        for given in ({}, {"sample_time": 0.01}):
            with pytest.raises(SlewctlError) as caught:
                lqg(plant, integral_limit=limit, **given)
            assert caught.value.where.startswith("integral_limit")


@pytest.mark.parametrize(
    "raised", [ValueError("array must not contain infs"), np.linalg.LinAlgError("Singular matrix"),
               OverflowError(34, "Numerical result out of range"), ZeroDivisionError()]
)  # fmt: skip
def test_what_is_raised_inside_becomes_one_line(raised: Exception) -> None:
    @guarded
    def method(*, weight: float) -> None:
        raise raised

    with pytest.raises(AccuracyError, match="broke down") as caught:
        method(weight=1e-40)
    assert caught.value.where == "weight"
    with pytest.raises(AccuracyError) as caught:
        method(weight=1.0)
    assert caught.value.where == "method"


def test_errors_on_purpose_pass_as_they_are() -> None:
    error = InputError("no", where="here")

    @guarded
    def method() -> None:
        raise error

    with pytest.raises(InputError) as caught:
        method()
    assert caught.value is error


def test_a_number_that_is_none_is_not_handed_on() -> None:
    with pytest.raises(AccuracyError, match="beyond what can be computed"):
        guarded(check_finite)(np.array([np.nan]))
