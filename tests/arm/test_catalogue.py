"""The catalogue of arms with published data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import Arm, InputError, arms
from slewctl.arm.lumped import LumpedLink, quanser_lumped
from slewctl.arm.nrel_blade import EDGEWISE_STIFFNESS, MASS_PER_LENGTH, STATIONS


@pytest.mark.parametrize("name", arms.names())
def test_every_entry_builds_the_same_arm_twice_and_names_its_source(name: str) -> None:
    arm = arms.get(name)
    assert isinstance(arm, Arm)
    assert arms.get(name) == arm
    assert hash(arms.get(name)) == hash(arm)
    entry = arms.CATALOGUE[name]
    assert entry.source
    assert entry.uncertain
    assert entry.summary
    assert "\n" not in entry.summary


@pytest.mark.parametrize("name", arms.names())
def test_every_arm_can_be_designed_for_with_a_damping_that_says_where_it_comes_from(
    name: str,
) -> None:
    arm, suggested = arms.get(name), arms.CATALOGUE[name].damping
    damped = arms.damped(name)
    assert np.all(damped.damping_ratios(5) > 0)
    assert replace(damped, damping_ratio=arm.damping_ratio) == arm
    assert suggested.source
    assert f"({suggested.origin}: " in str(suggested)
    # What a source publishes is the arm's own; what is assumed is not.
    published = suggested.origin != "assumed"
    assert (arm == damped) == published
    assert np.all(arm.damping_ratios(5) == 0) != published


def test_arms_have_different_names() -> None:
    assert len({arms.get(name).name for name in arms.names()}) == len(arms.names())


def test_published_frequencies_are_numbered_and_cited() -> None:
    for entry in arms.CATALOGUE.values():
        for published in entry.published:
            modes, hz = zip(*published.frequencies_hz, strict=True)
            assert list(modes) == sorted(set(modes))
            assert min(modes) >= 1
            assert list(hz) == sorted(hz)
            assert published.source


def test_paper_beam_is_equation_48() -> None:
    arm = arms.get("paper-beam")
    xi = np.linspace(0, 1, 11)
    assert arm.beam.length == 1.0
    for profile in (arm.beam.mass_profile, arm.beam.stiffness_profile):
        assert_allclose(profile(xi), 1 - 5 / 6 * xi**3, rtol=0, atol=3e-16)
    assert (arm.hub.inertia, arm.hub.radius, arm.hub.friction) == (0.0, 0.0, 0.0)
    assert (arm.payload.mass, arm.payload.inertia, arm.damping_ratio) == (0.0, 0.0, 0.0)


def test_quanser_beam_has_the_vendors_mass_and_inertia() -> None:
    arm, lumped = arms.get("quanser-flexible-link"), quanser_lumped()
    mass = arm.beam.mass_profile(np.array([0.5]))[0] * arm.beam.length
    assert mass == pytest.approx(0.065, rel=1e-15)
    assert mass * arm.beam.length**2 / 3 == pytest.approx(lumped.link_inertia, rel=1e-15)
    assert arm.hub_inertia == lumped.hub_inertia == 0.00208  # the rotor is in it already
    assert arm.hub.friction == lumped.friction == 0.015


def test_quanser_motor_makes_the_vendors_torque_per_volt() -> None:
    """Rotary servo workbook, high gear: ηg Kg ηm kt/Rm = 0.1284 N·m/V."""
    motor = arms.get("quanser-flexible-link").motor
    assert motor is not None
    assert motor.torque_per_volt == pytest.approx(0.9 * 70 * 0.69 * 7.68e-3 / 2.6, rel=1e-15)
    assert motor.volts_per_rate == pytest.approx(70 * 7.68e-3, rel=1e-15)
    assert motor.reflected_inertia == 0.0


def test_sheffield_section_has_the_quoted_second_moment() -> None:
    """I = w t³/12 of 19.008 × 3.2004 mm is the source's 5.1924e-11 m⁴ to its five digits."""
    assert pytest.approx(5.1924e-11, abs=0.5e-15) == 19.008e-3 * 3.2004e-3**3 / 12
    stiffness = arms.get("sheffield-manipulator").beam.stiffness_profile(np.array([0.0]))[0]
    assert stiffness == pytest.approx(71e9 * 5.1924e-11, rel=1e-15)


def test_spacecraft_is_converted_from_feet_and_slugs() -> None:
    """In SI: 1.2192 m, 1.3017 kg/m, 2.2904 kg, 10.847 kg·m² for the whole hub."""
    arm = arms.get("flexible-spacecraft")
    assert arm.beam.length == pytest.approx(1.2192, rel=1e-15)
    assert arm.hub.radius == 0.3048
    mass = arm.beam.mass_profile(np.array([0.0]))[0]
    assert mass == pytest.approx(1.3017, abs=0.5e-4)
    assert arm.payload.mass == pytest.approx(2.2904, abs=0.5e-4)
    assert 4 * arm.hub.inertia == pytest.approx(10.847, abs=0.5e-3)
    # Section 6 in × 1/8 in: density and modulus are aluminium's.
    area, second_moment = 0.1524 * 0.003175, 0.1524 * 0.003175**3 / 12
    assert mass / area == pytest.approx(2690, abs=1)
    stiffness = arm.beam.stiffness_profile(np.array([0.0]))[0]
    assert stiffness / second_moment == pytest.approx(75.8e9, rel=1e-3)


def test_nrel_blade_has_the_reports_mass_and_moments_to_a_percent() -> None:
    """Report, table 2-2: 17,740 kg, 363,231 kg·m, 11,776,047 kg·m², centre at 20.475 m.

    Linear interpolation of its own stations gives 0.5 to 0.8 % less, as the entry says.
    """
    assert len(STATIONS) == len(MASS_PER_LENGTH) == len(EDGEWISE_STIFFNESS) == 49
    beam = arms.get("nrel-5mw-rotor").beam
    xi, weights = np.polynomial.legendre.leggauss(4)
    bounds = np.array([0.0, *beam.breakpoints, 1.0])
    half = np.diff(bounds)[:, None] / 2
    points = (bounds[:-1, None] + half) + half * xi
    density = beam.mass_profile(points) * half * weights * beam.length
    moments = [np.sum(density * (points * beam.length) ** k) for k in range(3)]
    assert_allclose(moments[0], 17_609, atol=0.5)
    deficit = 1 - np.array(moments) / [17_740, 363_231, 11_776_047]
    assert np.all((deficit > 0.005) & (deficit < 0.008))
    assert moments[1] / moments[0] == pytest.approx(20.475, rel=2.5e-3)


def test_misspelt_name_gets_a_suggestion() -> None:
    with pytest.raises(InputError) as error:
        arms.get("paper-bean")
    assert str(error.value) == "arm: unknown name 'paper-bean'; did you mean 'paper-beam'?"


@pytest.mark.parametrize("name", ["zzzz", "", 3, None])
def test_unknown_name_lists_the_known_ones(name: object) -> None:
    with pytest.raises(InputError) as error:
        arms.get(name)
    assert all(known in str(error.value) for known in arms.names())


def test_lumped_link_has_the_vendors_three_hertz_with_the_hub_held() -> None:
    link = quanser_lumped()
    assert link.hub_locked_hz == pytest.approx(3.0, rel=1e-15)
    assert link.spring == pytest.approx((6 * np.pi) ** 2 * 0.065 * 0.381**2 / 3, rel=1e-14)
    # The published dip makes the spring 1.9 times as stiff.
    assert round(quanser_lumped(4.12).spring / link.spring, 1) == 1.9


def test_lumped_matrices_have_the_stated_frequencies() -> None:
    link = LumpedLink(0.3, 0.7, 5.0, friction=0.0)
    squares = np.linalg.eigvals(np.linalg.solve(link.mass, link.stiffness)).real
    assert_allclose(sorted(squares), [0, (2 * np.pi * link.free_hz) ** 2], atol=1e-12)
    A, B = link.state_matrices
    assert_allclose(np.abs(np.linalg.eigvals(A)).max(), 2 * np.pi * link.free_hz, rtol=1e-7)
    assert_allclose(B[2:, 0] @ link.mass, [1.0, 0.0], atol=1e-14)


def test_lumped_link_is_the_vendors_state_space() -> None:
    """Rotary Flexible Link workbook: A and B of [θ, α, θ̇, α̇], here with torque as input."""
    link = quanser_lumped()
    J, Jl, K, c = link.hub_inertia, link.link_inertia, link.spring, link.friction
    A, B = link.state_matrices
    expected = np.zeros((4, 4))
    expected[:2, 2:] = np.eye(2)
    expected[2] = [0, K / J, -c / J, 0]
    expected[3] = [0, -K * (J + Jl) / (J * Jl), c / J, 0]
    assert_allclose(A, expected, rtol=1e-13, atol=1e-11)
    assert_allclose(B[:, 0], [0, 0, 1 / J, -1 / J], rtol=1e-13)


@pytest.mark.parametrize("field", ["hub_inertia", "link_inertia", "spring"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, "2"])
def test_lumped_link_refuses_impossible_values(field: str, value: object) -> None:
    with pytest.raises(InputError, match=field):
        LumpedLink(**{"hub_inertia": 1.0, "link_inertia": 1.0, "spring": 1.0, field: value})
