"""What a design promises about itself, and how it refuses."""

from __future__ import annotations

import sys
from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import OBJECTIVES, design_plant
from general_plants import made

from slewctl import DesignError, GeneralisedPlant, Objective, kalman, lqg, lqr
from slewctl.design import Certificate, Check, finished
from slewctl.design.riccati import lqr_kalman
from slewctl.numerics.matrix_equations import RiccatiSolution


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("modes", [1, 2, 5, 10, 20])
def test_every_check_passes(objective: Objective, modes: int) -> None:
    certificate = lqg(design_plant(modes, objective)).certificate
    assert certificate.verified, str(certificate)
    assert len(certificate.checks) >= 4
    assert str(certificate).startswith("verified (")


@pytest.mark.parametrize(
    "tamper",
    [
        # At the optimum a gain error enters the cost squared: 1 % shows as 1e-4.
        lambda s: replace(s, gain=s.gain * 1.01),
        lambda s: replace(s, X=s.X * 1.00001),
        lambda s: replace(s, residual=1e-3),
        lambda s: replace(s, residual=float("nan")),
    ],
)
@pytest.mark.parametrize("which", ["optimal_feedback", "optimal_filter"])
def test_tampered_result_is_not_verified(
    monkeypatch: pytest.MonkeyPatch, which: str, tamper: object
) -> None:
    original = getattr(lqr_kalman, which)

    def tampered(plant: GeneralisedPlant) -> RiccatiSolution:
        return tamper(original(plant))  # type: ignore[operator]

    monkeypatch.setitem(vars(sys.modules["slewctl.design.riccati.lqg"]), which, tampered)
    certificate = lqg(design_plant(2)).certificate
    assert not certificate.verified
    assert str(certificate).startswith("NOT verified (")
    assert "FAILED" in str(certificate)


def test_nan_never_passes() -> None:
    assert not Check("x", float("nan"), 1.0).passed
    assert not Check("x", 0.0, float("nan")).passed
    assert not Certificate((Check("a", 0.0, 1.0), Check("x", float("nan"), np.inf))).verified


def test_check_allows_its_tolerance_and_no_more() -> None:
    assert Check("x", 1.0, 1.0).passed
    assert not Check("x", np.nextafter(1.0, 2.0), 1.0).passed


@pytest.mark.parametrize("penalised", ["tip_deflection", "root_moment"])
def test_unpenalised_rotation_is_named(penalised: str) -> None:
    objective = Objective({penalised: 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    with pytest.raises(DesignError, match="the rigid-body rotation is not penalised") as caught:
        lqg(design_plant(2, objective))
    assert "limits.tip" in str(caught.value)


@pytest.mark.parametrize("measured", ["tip_deflection", "root_moment", "theta_dot"])
def test_unseen_rotation_is_named(measured: str) -> None:
    objective = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, measured: 0.01})
    message = "the rigid-body rotation is not seen by any sensor"
    with pytest.raises(DesignError, match=message) as caught:
        lqg(design_plant(2, objective))
    assert "noise.theta" in str(caught.value)


def test_refused_by_the_half_that_is_concerned() -> None:
    blind = design_plant(
        2, Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "root_moment": 0.01})
    )
    lqr(blind)
    with pytest.raises(DesignError, match="not seen"):
        kalman(blind)


def test_controller_names_its_signals_and_gains() -> None:
    controller = lqg(design_plant(2, OBJECTIVES[1]))
    assert controller.sensors == ("theta", "tip")
    assert controller.system.output_labels == ["torque"]
    assert controller.gains["state_feedback"].shape == (1, 6)
    assert controller.gains["observer"].shape == (6, 2)


def test_what_is_not_verified_tells_what_failed_and_no_more() -> None:
    passed = Check("poles", 0.0, 0.0)
    failed = Check("real part of a pole", 0.25, 0.0, "narrow the range")
    assert str(Certificate((passed, passed))).count("poles: 0.0e+00 <= 0e+00") == 2
    told = str(Certificate((passed, failed, passed)))
    assert told == (
        "NOT verified (real part of a pole FAILED: 2.5e-01, at most 0e+00 allowed, "
        "narrow the range; 2 others passed)"
    )


def test_a_pole_on_the_axis_is_not_verified() -> None:
    """An integrator that the controller leaves alone: its pole is at zero, to rounding."""
    plant = made(
        np.diag([0.0, -1.0]), np.array([[0, 0, 0], [1.0, 0, 1]]), [[0, 1], [0, 0], [0, 1]],
        np.array([[0, 0, 0], [0, 0, 1], [0, 1.0, 0]]),
    )  # fmt: skip
    system = control.ss(-2.0, 1.0, -0.5, 0.0, inputs=["y0"], outputs=["u"])
    found = finished(plant, system, "own", {})
    assert not found.certificate.verified
    assert found.h2_cost == np.inf
