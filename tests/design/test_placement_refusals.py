"""What pole placement refuses, and in whose words."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import OBJECTIVE, design_plant, uniform_arm

from slewctl import (
    Arm,
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    InputError,
    Objective,
    assemble,
    generalised_plant,
)
from slewctl.design import place, place_observer, pole_placement
from slewctl.design.placement import placed_gains as room
from slewctl.errors import AccuracyError

EIGHT = [-1.0, -2.0, [-3.0, 4.0], [-3.0, -4.0], [-5.0, 30.0], [-5.0, -30.0], -70.0, -80.0]


def hidden_mode(mode: int, reached: bool, seen: bool) -> GeneralisedPlant:
    """Return a plant of three modes of which one has no input or no output."""
    plant = design_plant(3)
    system = plant.system
    B, C = np.array(system.B), np.array(system.C)
    if not reached:
        B[4 + mode, -1] = 0.0
    if not seen:
        C[plant.performance :, mode] = 0.0
    changed = control.StateSpace(
        system.A,
        B,
        C,
        system.D,
        inputs=system.input_labels,
        outputs=system.output_labels,
        states=system.state_labels,
    )
    return replace(plant, system=changed)


@pytest.mark.parametrize(
    ("options", "where", "what"),
    [
        ({}, "bandwidth_hz", "missing"),
        ({"bandwidth_hz": -1.0}, "bandwidth_hz", "not positive"),
        ({"bandwidth_hz": "fast"}, "bandwidth_hz", "not a finite number"),
        ({"bandwidth_hz": 0.2, "damping_ratio": 0}, "damping_ratio", "not positive"),
        ({"bandwidth_hz": 0.2, "added_damping": -0.1}, "added_damping", "negative"),
        ({"bandwidth_hz": 0.2, "added_damping": 1.0}, "added_damping", "would have a damping"),
        ({"bandwidth_hz": 0.2, "added_damping": "much"}, "added_damping", "says no damping"),
        ({"bandwidth_hz": 0.2, "added_damping": True}, "added_damping", "says no damping"),
        ({"bandwidth_hz": 0.2, "added_damping": {"4": 0.1}}, "added_damping.4", "no mode 4"),
        ({"bandwidth_hz": 0.2, "added_damping": [0.1] * 4}, "added_damping.3", "no mode 4"),
        ({"bandwidth_hz": 0.2, "added_damping": {"a": 0.1}}, "added_damping", "not the number"),
        ({"bandwidth_hz": 0.2, "added_damping": {"1": 0.1}, "leave": [1]}, "added_damping.1", "alone"),
        ({"bandwidth_hz": 0.2, "leave": [4]}, "leave.0", "no mode 4"),
        ({"bandwidth_hz": 0.2, "leave": [0]}, "leave.0", "rigid-body rotation"),
        ({"bandwidth_hz": 0.2, "leave": 1}, "leave", "not a list"),
        ({"bandwidth_hz": 0.2, "observer_speed": 0}, "observer_speed", "not positive"),
        ({"bandwidth_hz": 0.2, "observer_damping": 1}, "observer_damping", "not below 1"),
        ({"bandwidth_hz": 0.2, "poles": EIGHT}, "bandwidth_hz", "given beside poles"),
        ({"added_damping": 0.1, "poles": EIGHT}, "added_damping", "given beside poles"),
        ({"added_damping": 0.0, "poles": EIGHT}, "added_damping", "given beside poles"),
        ({"damping_ratio": 0.7, "poles": EIGHT}, "damping_ratio", "given beside poles"),
        ({"poles": EIGHT, "observer_poles": EIGHT, "observer_speed": 3.0}, "observer_speed", "given beside observer_poles"),
        ({"poles": EIGHT, "observer_poles": EIGHT, "observer_damping": 0.0}, "observer_damping", "given beside observer_poles"),
        ({"poles": -1.0}, "poles", "not a list"),
        ({"poles": EIGHT[:6]}, "poles", "6 poles for 4 modes"),
        ({"poles": [*EIGHT[:7], 8.0]}, "poles.7", "not left of the imaginary axis"),
        ({"poles": [*EIGHT[:7], [-1.0, 2.0]]}, "poles.7", "without its conjugate"),
        ({"poles": [*EIGHT[:7], -1 - 2j]}, "poles.7", "without its conjugate"),
        ({"poles": [*EIGHT[:7], "x"]}, "poles.7", "not a pole"),
        ({"poles": [*EIGHT[:7], float("nan")]}, "poles.7", "not a finite number"),
        ({"poles": EIGHT, "leave": [1]}, "poles", "8 poles for 3 modes"),
        ({"bandwidth_hz": 0.2, "observer_poles": EIGHT[:2]}, "observer_poles", "2 poles for 4"),
    ],
)  # fmt: skip
def test_impossible_wishes(options: dict[str, object], where: str, what: str) -> None:
    with pytest.raises(InputError, match=what) as caught:
        pole_placement(design_plant(3), **options)
    assert caught.value.where == where
    assert caught.value.remedy


def test_a_plant_is_asked_for() -> None:
    with pytest.raises(InputError, match="not a GeneralisedPlant"):
        pole_placement(3, bandwidth_hz=1.0)  # type: ignore[arg-type]


def test_a_mode_out_of_reach_is_named_and_may_be_left_alone() -> None:
    plant = hidden_mode(2, reached=False, seen=True)
    with pytest.raises(DesignError, match=r"mode 2 \(.* Hz\) is not reached by the torque"):
        pole_placement(plant, bandwidth_hz=0.2, added_damping=0.05)
    controller = pole_placement(plant, bandwidth_hz=0.2, added_damping=0.05, leave=[2])
    assert controller.certificate.verified, str(controller.certificate)


def test_a_mode_out_of_sight_is_named_and_may_be_left_alone() -> None:
    plant = hidden_mode(3, reached=True, seen=False)
    with pytest.raises(DesignError, match=r"mode 3 \(.* Hz\) is not seen by any sensor") as caught:
        pole_placement(plant, bandwidth_hz=0.2)
    assert caught.value.where == "noise"
    assert pole_placement(plant, bandwidth_hz=0.2, leave=[3]).certificate.verified
    assert pole_placement(plant, bandwidth_hz=0.2, observer_damping=0.0).certificate.verified


def test_an_angle_that_is_not_measured() -> None:
    objective = Objective(OBJECTIVE.limits, {"torque": 0.1, "theta_dot": 0.1})
    with pytest.raises(DesignError, match="rigid-body rotation is not seen") as caught:
        pole_placement(design_plant(2, objective), bandwidth_hz=0.2)
    assert "noise.theta" in caught.value.remedy


def test_an_undamped_mode_cannot_be_left_alone() -> None:
    plant = generalised_plant(assemble(uniform_arm(0.0), ClampedFree(2)), OBJECTIVE)
    with pytest.raises(DesignError, match=r"mode 1 .* has no damping of its own"):
        pole_placement(plant, bandwidth_hz=0.2)
    assert pole_placement(plant, bandwidth_hz=0.2, added_damping=0.01).certificate.verified


def test_explicit_poles_keep_a_mode_whose_poles_they_name() -> None:
    plant = hidden_mode(2, reached=False, seen=True)
    omega = plant.model.omega[1]
    own = omega * (-0.005 + 1j * np.sqrt(1 - 0.005**2))
    poles = [*EIGHT[:4], -70.0, -80.0, own, own.conjugate()]
    K = place(plant, poles)
    assert np.all(K[0, [2, 6]] == 0)
    with pytest.raises(DesignError, match="mode 2"):
        place(plant, EIGHT)


def test_a_wrong_gain_is_not_called_verified(monkeypatch: pytest.MonkeyPatch) -> None:
    original = room.assign
    monkeypatch.setattr(room, "assign", lambda *given: original(*given) * (1 + 1e-6))
    plant = design_plant(3)
    certificate = pole_placement(plant, bandwidth_hz=0.2, added_damping=0.05).certificate
    assert not certificate.verified
    assert "FAILED" in str(certificate)
    with pytest.raises(AccuracyError, match="recomputed poles differ"):
        place(plant, EIGHT)
    with pytest.raises(AccuracyError, match="recomputed poles differ"):
        place_observer(plant, EIGHT)


def test_places_in_words() -> None:
    controller = pole_placement(design_plant(2), bandwidth_hz=0.2, added_damping={"1": 0.1})
    said = " | ".join(controller.assumptions)
    assert "rigid-body rotation to 0.2 Hz with damping ratio 0.7" in said
    assert "not moved: mode 2" in said
    assert "eigenvectors of condition" in said


def test_arm_without_modes_of_its_own() -> None:
    bare = Arm(uniform_arm().beam, uniform_arm().hub, damping_ratio=0.01)
    plant = generalised_plant(assemble(bare, ClampedFree(1)), OBJECTIVE)
    assert pole_placement(plant, bandwidth_hz=0.2).gains["state_feedback"].shape == (1, 4)
