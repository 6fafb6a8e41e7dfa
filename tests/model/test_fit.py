"""Identification: what a fit finds, how well, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import Arm, Beam, Hub, InputError, Joint, Payload, Stations, arms
from slewctl.arm.variation import scaled
from slewctl.measured.fit import fit
from slewctl.model.adjustable import ADJUSTABLE
from slewctl.model.locked import frequencies

START = Arm(
    Beam(1.2, (2.0, -0.8), (50.0, 0.0, -20.0)), Hub(0.8, 0.1), Payload(0.3, 0.01), name="start"
)
JOINTED = replace(START, joint=Joint(120.0, rotor_inertia=0.3))


def changed(arm: Arm, **values: float) -> Arm:
    """`arm` with properties replaced; dots are written as double underscores."""
    for name, value in values.items():
        arm = ADJUSTABLE[name.replace("__", ".")].write(arm, value)
    return arm


RECOVERABLE = [
    ("hub-locked", {"beam.stiffness": 1.7}),
    ("hub-locked", {"beam.stiffness": 0.8, "payload.mass": 0.55}),
    ("hub-locked", {"beam.mass": 1.3, "payload.mass": 0.2, "payload.inertia": 0.03}),
    ("free", {"beam.stiffness": 1.4, "hub.inertia": 0.2}),
    ("free", {"hub.inertia": 2.0, "hub.radius": 0.3}),
    ("free", {"payload.mass": 0.0, "hub.inertia": 0.5}),
    ("free", {"joint.stiffness": 70.0, "payload.mass": 0.2}),
    ("rotor-locked", {"joint.stiffness": 90.0, "beam.stiffness": 1.2}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("boundary", "truth"), RECOVERABLE)
def test_exact_data_give_the_arm_back(boundary: str, truth: dict[str, float]) -> None:
    start = JOINTED if "joint.stiffness" in truth else START
    measured = start
    for name, value in truth.items():
        measured = ADJUSTABLE[name].write(measured, value)
    exact = frequencies(measured, 5, boundary).hz
    found = fit(start, exact, [*truth], boundary, uncertainty=1e-3)
    for name, value in truth.items():
        scale = max(value, ADJUSTABLE[name].scale(start))
        assert found[name].value == pytest.approx(value, abs=1e-8 * scale)
    assert np.abs(found.residuals).max() < 1e-9
    assert_allclose(frequencies(found.arm, 5, boundary).hz, exact, rtol=1e-9)
    assert found.undetermined == ()
    assert found.model_error < 1e-9


def test_modes_may_be_left_out() -> None:
    measured = changed(START, beam__stiffness=1.3, payload__mass=0.5)
    exact = frequencies(measured, 6).hz
    found = fit(START, {6: exact[5], 1: exact[0], 3: exact[2]}, ["payload.mass", "beam.stiffness"])
    assert found.modes == (1, 3, 6)
    assert_allclose([e.value for e in found.estimates], [0.5, 1.3], rtol=1e-8)


@pytest.mark.parametrize(
    "mass",
    [3.0, (2.0, -1.0), Stations((0.0, 0.5, 1.2), (2.0, 1.5, 1.0)), lambda x: 2.0 - np.sin(x)],
)
def test_every_kind_of_profile_is_scaled(mass: object) -> None:
    arm = Arm(Beam(1.2, mass, 40.0), Hub(0.3))
    heavier = changed(arm, beam__mass=1.25)
    xi = np.linspace(0, 1, 7)
    assert_allclose(heavier.beam.mass_profile(xi), 1.25 * arm.beam.mass_profile(xi), rtol=1e-14)
    found = fit(arm, frequencies(heavier, 3, "free").hz, ["beam.mass"], "free")
    assert found["beam.mass"].value == pytest.approx(1.25, rel=1e-8)
    assert hash(found.arm) == hash(replace(found.arm))
    assert type(scaled(mass, 2.0)) is type(scaled(scaled(mass, 2.0), 0.5))


def test_covariance_is_that_of_repeated_noisy_measurements() -> None:
    """Measurements off by ±σ√4, one at a time, have the covariance of four independent noises.

    So have the fits to them, but for their third derivatives (Julier and Uhlmann's points).
    """
    measured = changed(START, beam__stiffness=1.2, payload__mass=0.4)
    exact = frequencies(measured, 4).hz
    free, sigma = ["beam.stiffness", "payload.mass"], 1e-3
    expected = fit(START, exact, free, uncertainty=sigma)
    noise = 2 * sigma * np.vstack([np.eye(4), -np.eye(4)])
    found = np.array(
        [
            [e.value for e in fit(measured, noisy, free, uncertainty=sigma).estimates]
            for noisy in exact * (1 + noise)
        ]
    ) * [1.2, 1.0]  # the factor is on the stiffness of the arm that a fit starts from
    assert_allclose(np.cov(found.T, bias=True), expected.covariance, rtol=1e-3)
    spread = [e.standard_deviation for e in expected.estimates]
    assert_allclose(found.mean(axis=0), [1.2, 0.4], atol=0.01 * np.max(spread))


def test_scatter_is_estimated_from_the_residuals() -> None:
    """One factor, m modes: ω ∝ √s, so σ_s = 2 s σ/√m with σ² = Σr²/(m − 1)."""
    noise = np.array([1.001, 0.9985, 1.002, 0.9995])
    found = fit(START, frequencies(START, 4).hz * noise, ["beam.stiffness"])
    sigma = np.sqrt(np.sum(found.residuals**2) / 3)
    assert_allclose(found.uncertainty, sigma, rtol=1e-12)
    estimate = found["beam.stiffness"]
    expected = 2 * estimate.value * sigma / np.sqrt(4)
    # The derivatives ∂r_k/∂ln s = (1 + r_k)/2 differ from one half by the residuals.
    assert estimate.standard_deviation == pytest.approx(expected, rel=3e-3)
    assert not found.uncertainty_given
    assert np.isnan(found.misfit_probability)


def test_stated_uncertainty_weighs_the_modes() -> None:
    """Two modes that disagree by d: the factor moves to the weighted mean of the logarithms."""
    hz = frequencies(START, 2).hz * [1.0, 1.02]
    found = fit(START, hz, ["beam.stiffness"], uncertainty={1: 0.001, 2: 0.01})
    shift = np.log(1.02) * 0.001**2 / (0.001**2 + 0.01**2)
    assert np.log(found["beam.stiffness"].value) / 2 == pytest.approx(shift, rel=0.03)
    # χ² = (1 − 1/1.02)²/(σ₁² + σ₂²) = 3.806, whose tail is 0.051.
    assert found.misfit_probability == pytest.approx(0.0511, abs=5e-4)


def test_as_many_properties_as_measurements_leave_the_scatter_unknown() -> None:
    found = fit(START, frequencies(START, 1).hz, ["beam.stiffness"])
    assert found.degrees_of_freedom == 0
    assert np.isnan(found["beam.stiffness"].standard_deviation)
    assert "± unknown" in str(found)
    assert "scatter: unknown" in str(found)


def test_units_do_not_matter() -> None:
    """Millimetre, tonne, second: EI in t·mm³/s², inertia in t·mm²; frequencies stay."""
    length, mass = 1e3, 1e-3
    other = Arm(
        Beam(1.2 * length, (2.0e-6, -0.8e-6), (50.0 * 1e6, 0.0, -20.0 * 1e6)),
        Hub(0.8 * mass * length**2, 0.1 * length),
        Payload(0.3 * mass, 0.01 * mass * length**2),
    )
    hz = frequencies(changed(START, payload__mass=0.4, hub__radius=0.2), 4, "free").hz
    noisy = hz * [1.001, 0.999, 1.0005, 1.0]
    free = ["payload.mass", "hub.radius"]
    one, two = (fit(arm, noisy, free, "free") for arm in (START, other))
    for name, unit in (("payload.mass", mass), ("hub.radius", length)):
        assert two[name].value == pytest.approx(one[name].value * unit, rel=1e-7)
        spread = one[name].standard_deviation * unit
        assert two[name].standard_deviation == pytest.approx(spread, rel=1e-5)


def test_stiffness_and_mass_cannot_be_told_apart() -> None:
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.5))
    hz = frequencies(changed(arm, beam__stiffness=1.2), 3).hz
    found = fit(arm, hz, ["beam.mass", "beam.stiffness"], uncertainty=0.01)
    assert found.undetermined == (("beam.mass", "beam.stiffness"),)
    assert all(np.isinf(e.standard_deviation) for e in found.estimates)
    assert np.all(np.isnan(found.covariance))
    assert found.degrees_of_freedom == 2
    assert "beam.mass, beam.stiffness cannot be told apart: fix one of them" in str(found)
    # Their ratio is known; the last named stays as it was.
    assert found["beam.stiffness"].value == 1.0
    assert found["beam.mass"].value == pytest.approx(1 / 1.2, rel=1e-8)


def test_a_payload_fixes_the_scale_of_the_mass() -> None:
    hz = frequencies(changed(START, beam__mass=1.2), 3).hz
    found = fit(START, hz, ["beam.mass", "beam.stiffness"])
    assert found.undetermined == ()
    assert_allclose([e.value for e in found.estimates], [1.2, 1.0], rtol=1e-8)


def test_scaling_all_inertias_and_stiffness_is_one_group() -> None:
    free = ["payload.mass", "beam.stiffness", "hub.inertia", "beam.mass", "payload.inertia"]
    found = fit(START, frequencies(START, 6, "free").hz, free, "free")
    assert [sorted(group) for group in found.undetermined] == [sorted(free)]
    assert found.degrees_of_freedom == 2
    assert np.abs(found.residuals).max() < 1e-9


def test_hub_has_no_effect_on_hub_locked_frequencies() -> None:
    hz = frequencies(changed(START, beam__stiffness=1.1), 3).hz
    found = fit(START, hz, ["hub.inertia", "beam.stiffness", "hub.radius"], uncertainty=0.01)
    assert found.undetermined == (("hub.inertia",), ("hub.radius",))
    assert found["hub.inertia"].value == pytest.approx(0.8, rel=1e-15)
    assert found["beam.stiffness"].value == pytest.approx(1.1, rel=1e-8)
    assert found["beam.stiffness"].standard_deviation == pytest.approx(2 * 1.1 * 0.01 / 3**0.5)
    assert "hub.radius has no effect on these frequencies" in str(found)


def test_what_wants_to_be_negative_is_held_at_zero() -> None:
    arm = Arm(Beam(1.0, 1.0, 1.0), payload=Payload(0.1))
    without = frequencies(replace(arm, payload=Payload()), 3).hz
    found = fit(arm, 1.01 * without, ["payload.mass"], uncertainty=0.01)
    assert found["payload.mass"].value == 0.0
    assert found["payload.mass"].at_limit
    assert found["payload.mass"].standard_deviation > 0
    assert "(at its limit)" in str(found)


def test_report_reads_well() -> None:
    hz = frequencies(START, 2).hz * [1.0, 1.01]
    text = str(fit(START, hz, ["beam.stiffness"], uncertainty=0.01)).splitlines()
    assert text[0] == "fit of start to 2 hub-locked frequencies"
    assert text[1].startswith("  beam.stiffness = 1.00")
    assert text[1].endswith(", from 1")
    assert text[2].startswith("  chance of a worse fit by scatter alone: 0.")
    assert text[3].startswith("  mode 1: measured ")
    assert len(text) == 5


def test_result_cannot_be_changed() -> None:
    found = fit(START, frequencies(START, 2).hz, ["beam.stiffness"])
    with pytest.raises(ValueError, match="read-only"):
        found.residuals[0] = 1.0
    with pytest.raises(InputError, match=r"did you mean 'beam\.stiffness'"):
        found["beam.stifness"]


REFUSED = [
    ({"measured": [1.0, np.nan]}, "fit.measured[2]: nan is not a finite"),
    ({"measured": [-1.0, 2.0]}, "fit.measured[1]: -1 is not positive"),
    ({"measured": []}, "fit.measured: [] holds no frequencies"),
    ({"measured": 3.0}, "fit.measured: 3.0 holds no frequencies"),
    ({"measured": [2.0, 1.0]}, "does not increase with the mode number"),
    ({"measured": {0: 2.0}}, "mode: 0 is not a whole number >= 1"),
    ({"measured": {1.5: 2.0}}, "mode: 1.5 is not a whole number >= 1"),
    ({"free": ["payload.mas"]}, "fit.free: unknown name 'payload.mas'; did you mean 'payload.mass'?"),
    ({"free": ["beam.mass"] * 2}, "names one twice"),
    ({"free": []}, "fit.free: [] is not a list of properties"),
    ({"free": "beam.mass"}, "fit.free: 'beam.mass' is not a list of properties"),
    ({"free": ["beam.mass", "hub.inertia", "hub.radius"]}, "3 free properties but 2 measured frequencies"),
    ({"boundary": "fre"}, "fit.boundary: unknown name 'fre'; did you mean 'free'?"),
    ({"uncertainty": 0.0}, "fit.uncertainty: 0 is not positive"),
    ({"uncertainty": np.inf}, "fit.uncertainty: inf is not a finite number"),
    ({"uncertainty": {1: 0.1}}, "fit.uncertainty: given for modes [1], measured are [1, 2]"),
    ({"arm": "paper-beam"}, "'paper-beam' is not an Arm"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "message"), REFUSED)
def test_bad_input_is_refused_in_one_line(wrong: dict[str, object], message: str) -> None:
    given = {"arm": START, "measured": [1.0, 5.0], "free": ["beam.stiffness"]}
    with pytest.raises(InputError) as error:
        fit(**(given | wrong))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_quanser_link_is_a_stiffer_cantilever_without_payload() -> None:
    """4.12 Hz to half a percent; the second dip, read on an 8 % grid, to two percent.

    A uniform cantilever 4.6 % stiffer meets both: 26 Hz is 0.7 % above what 4.12 Hz says.
    A payload would have to be 2.3 ± 3.8 g: none is needed.
    """
    link, dips, spread = arms.get("quanser-flexible-link"), {1: 4.12, 2: 26.0}, {1: 0.005, 2: 0.02}
    found = fit(link, dips, ["beam.stiffness"], uncertainty=spread)
    estimate = found["beam.stiffness"]
    assert estimate.value == pytest.approx(1.046, abs=0.5e-3)
    assert estimate.standard_deviation == pytest.approx(0.010, abs=0.5e-3)
    assert abs(found.residuals[1]) < 0.007
    assert found.misfit_probability > 0.5
    both = fit(link, dips, ["beam.stiffness", "payload.mass"], uncertainty=spread)
    payload = both["payload.mass"]
    assert payload.value < payload.standard_deviation
    assert abs(both.correlation[0, 1]) > 0.99
    assert "correlated" in str(both)


def test_quanser_vendor_frequency_contradicts_the_measured_dips() -> None:
    """The vendor's 3 Hz with the published 26 Hz is no uniform cantilever."""
    link = arms.get("quanser-flexible-link")
    found = fit(link, {1: 3.0, 2: 26.0}, ["beam.stiffness"], uncertainty=0.02)
    assert found.misfit_probability < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [3.06, 0.3])
@pytest.mark.parametrize("payload", [0.1, 0.6])
def test_a_poor_start_ends_at_the_same_arm(stiffness: float, payload: float) -> None:
    """From far away the search has minima with no payload at all; they are not taken."""
    start = Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.2)), Hub(0.05, 0.1))
    measured = changed(start, beam__stiffness=stiffness, payload__mass=payload)
    hz = frequencies(measured, 5, "free").hz
    found = fit(start, hz, ["payload.mass", "beam.stiffness"], "free")
    assert_allclose([e.value for e in found.estimates], [payload, stiffness], rtol=1e-8)
