"""The truth against exact characteristic equations, and its own statements about itself.

A root is proved to lie within ω(1 ± δ) when the exact determinant, in 30 digits, changes
sign between the two ends; δ is the error that the truth states plus ROUNDING.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import mpmath as mp
import numpy as np
import pytest
from exact_beam import (
    Determinant,
    alternates_between,
    count_below,
    encloses,
    series_determinant,
    uniform_determinant,
    wedge_determinant,
)
from numpy.polynomial import polynomial
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh

from slewctl import (
    Arm,
    Beam,
    Hub,
    InputError,
    Model,
    Payload,
    Polynomial,
    Slewing,
    Stations,
    Truth,
    arm_modes,
    arms,
    assemble,
    truth,
)
from slewctl.model import frequencies
from slewctl.plant import state_space

EPS = np.finfo(float).eps
# Sums of some 60 rounded terms in the factors of M and K: √60 ε, twice for the ratio.
ROUNDING = 16 * EPS

HUBS_AND_PAYLOADS = [
    (Hub(), Payload()),
    (Hub(0.3, 0.1), Payload(0.5, 0.02)),
    (Hub(50.0), Payload(0.0, 0.3)),
    (Hub(0.0, 0.4), Payload(3.0)),
]


@pytest.fixture(autouse=True)
def _thirty_digits() -> Iterator[None]:
    with mp.workdps(30):
        yield


def assert_exact(model: Truth, determinant: Determinant) -> None:
    """Each frequency is within its stated error of an exact one, in the right order."""
    allowed = model.frequency_errors + ROUNDING
    for omega, relative in zip(model.omega, allowed, strict=True):
        assert encloses(determinant, omega, relative), f"no root within {relative:.1e} of {omega}"
    assert alternates_between(determinant, model.omega)


@pytest.mark.slow
@pytest.mark.parametrize(("hub", "payload"), HUBS_AND_PAYLOADS)
def test_uniform_beam_has_the_roots_of_its_characteristic_equation(
    hub: Hub, payload: Payload
) -> None:
    model = truth(Arm(Beam(1.0, 2.0, 3.0), hub, payload), 12)
    determinant = partial(uniform_determinant, model.arm)
    assert_exact(model, determinant)
    # Nothing is missed: as many sign changes as modes below the next one's distance.
    assert count_below(determinant, 1.01 * model.omega[-1], 300) == 12
    assert model.frequency_errors.max() < 1e-11


@pytest.mark.slow
def test_series_solution_agrees_with_the_closed_form() -> None:
    """The oracle for general profiles is itself held against the closed form, to 20 digits."""
    arm = Arm(Beam(1.0, 2.0, 3.0), Hub(0.3, 0.1), Payload(0.5, 0.02))
    determinants = (partial(uniform_determinant, arm), partial(series_determinant, arm))
    for guess in (5.3, 22.0):
        roots = [mp.findroot(d, (guess, guess * 1.01), verify=False) for d in determinants]
        assert abs(roots[0] / roots[1] - 1) < mp.mpf(10) ** -20


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2])
def test_wedge_and_cone_have_the_roots_of_their_bessel_functions(n: int) -> None:
    """m̄ = uⁿ, EI = uⁿ⁺², u = 1 − 0.6x: exact solutions by Bessel functions (Kirchhoff)."""
    profile = [tuple(polynomial.polypow([1.0, -0.6], power)) for power in (n, n + 2)]
    model = truth(Arm(Beam(1.0, *profile), Hub(0.3, 0.1), Payload(0.1, 0.02)), 4)
    assert_exact(model, lambda omega: wedge_determinant(model.arm, 0.6, n, omega))


STEP = Stations((0, 0.4, 0.4, 1), (3, 3, 1, 1))
TABLE = Stations((0, 0.3, 1), (2, 1, 0.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("beam", "modes"),
    [
        (Beam(1.0, 1.0, STEP), 5),
        (Beam(1.0, STEP, TABLE), 4),
        (Beam(1.0, (1.0, 0.0, -0.5), TABLE), 4),
    ],
    ids=["stepped", "step and table", "polynomial and table"],
)
def test_steps_and_tables_have_exact_frequencies(beam: Beam, modes: int) -> None:
    model = truth(Arm(beam, Hub(0.2, 0.05), Payload(0.3, 0.01)), modes)
    assert_exact(model, partial(series_determinant, model.arm))


@pytest.mark.slow
def test_paper_beam_has_exact_frequencies() -> None:
    model = truth(arms.get("paper-beam"), 4)
    assert_exact(model, partial(series_determinant, model.arm))


def test_paper_beam_has_the_converged_frequencies() -> None:
    published = [2.927294, 8.760107, 17.644837, 29.613771, 44.685289, 62.870721]
    model = truth(arms.get("paper-beam"))
    assert_allclose(model.frequencies_hz[:6], published, rtol=0, atol=0.5e-6)


@pytest.mark.parametrize("modes", [1, 3, 20, 60])
def test_truth_is_a_model_in_its_own_modes(modes: int, full_arm: Arm) -> None:
    """UᵀMU = I with U almost diagonal: the basis functions are the modes."""
    model = truth(full_arm, modes)
    assert isinstance(model, Model)
    assert model.modes == model.n == modes
    U = model.mode_shapes
    tolerance = 200 * EPS * model.omega[-1] / model.omega[0]
    assert_allclose(U.T @ model.mass @ U, np.eye(modes + 1), atol=tolerance, rtol=0)
    assert_allclose(U[1:, 1:], np.eye(modes), atol=tolerance, rtol=0)
    assert_allclose(np.diag(model.stiffness)[1:], model.omega**2, rtol=tolerance)
    assert_array_equal(model.stiffness[0], 0)
    assert np.all(model.frequency_errors >= 0)
    assert model.tolerance == model.frequency_errors.max() <= 1e-11


def test_more_modes_change_none_of_the_first(full_arm: Arm) -> None:
    few, many = truth(full_arm, 5), truth(full_arm, 40)
    allowed = few.frequency_errors + many.frequency_errors[:5] + 2 * ROUNDING
    assert np.all(np.abs(few.omega / many.omega[:5] - 1) <= allowed)


@pytest.mark.parametrize("taper", [(1.0, -0.98), (1.0, 0.0, 0.0, -0.99)])
@pytest.mark.parametrize("modes", [1, 5, 20])
def test_sharp_tapers_get_as_many_functions_as_they_need(
    taper: tuple[float, ...], modes: int
) -> None:
    """Nearly pointed tips converge slowly: the basis grows until doubling it changes nothing."""
    model = truth(Arm(Beam(1.0, taper, taper)), modes)
    assert model.tolerance <= 1e-11
    doubled = assemble(model.arm, Polynomial(2 * model.functions)).omega[:modes]
    rounding = ROUNDING * model.omega / model.omega[0]
    assert np.all(np.abs(model.omega / doubled - 1) <= model.frequency_errors + rounding)


def test_truth_is_computed_once() -> None:
    assert truth(arms.get("paper-beam"), 3) is truth(arms.get("paper-beam"), 3)


def test_truth_says_what_it_is() -> None:
    text = str(truth(arms.get("paper-beam"), 3))
    assert "paper beam: 3 modes to 17.64 Hz" in text


@pytest.mark.parametrize("modes", [0, -1, True, "3", 2.5, None])
def test_impossible_numbers_of_modes_are_refused(modes: object) -> None:
    with pytest.raises(InputError, match=r"truth\.modes"):
        truth(arms.get("paper-beam"), modes)


def test_truth_refuses_what_is_no_arm() -> None:
    with pytest.raises(InputError):
        truth("paper-beam")


def locked_frequencies(arm: Arm, n: int) -> np.ndarray:
    model = assemble(arm, Polynomial(n))
    return np.sqrt(eigh(model.stiffness[1:, 1:], model.mass[1:, 1:], eigvals_only=True))


def test_heavy_hub_makes_a_cantilever() -> None:
    """ω² of mode k rises above the locked one by at most Φ̃_k²/J_h <= J_beam/J_h = 1e-6 of it."""
    beam = Beam(1.0, (1.0, 0.0, -0.5), 2.0)
    free = truth(Arm(beam, Hub(1e6 * truth(Arm(beam), 1).mass[0, 0])), 6)
    locked = locked_frequencies(Arm(beam), 18)[:6]
    ratio = free.omega / locked - 1
    assert np.all(ratio > -1e-9)
    assert np.all(ratio < 1e-6)


@pytest.mark.parametrize(
    ("payload", "roots"),
    [
        # A payload of infinite mass holds the tip: pinned–pinned, sin z = 0.
        (Payload(1e7), np.arange(1, 6) * np.pi),
        # One of infinite inertia keeps its slope: pinned–sliding, cos z = 0.
        (Payload(0.0, 1e7), (np.arange(1, 6) - 0.5) * np.pi),
        # Both: pinned–clamped, tan z = tanh z, above the payload's own slow swing.
        (Payload(1e7, 1e7), np.array([0.0, 3.92660231, 7.06858275, 10.21017612, 13.35176878])),
    ],
    ids=["mass", "inertia", "both"],
)
def test_heavy_payload_holds_the_tip(payload: Payload, roots: np.ndarray) -> None:
    """ω → z² from above, the rest being of the order z⁴ times one part in 1e7."""
    model = truth(Arm(Beam(1.0, 1.0, 1.0), Hub(), payload), 5)
    assert_allclose(np.sqrt(model.omega)[roots > 0], roots[roots > 0], rtol=2e-6)


def low_frequency_moment(model: Model, omega: float = 1e-2) -> float:
    """Root moment per torque, both at a frequency far below the first mode."""
    plant = state_space(model, ["root_moment"], coordinates="modal")
    return float(np.real(np.asarray(plant(1j * omega)).item()))


QUASI_STATIC = 1e-4 / 100  # (ω/ω_1)², ω_1 > 10 rad/s for these arms


@pytest.mark.parametrize("make", [lambda arm: assemble(arm, Polynomial(20))], ids=["polynomial"])
@pytest.mark.parametrize("hub", [0.0, 0.01, 0.3, 3.0])
def test_root_moment_is_minus_the_torque_that_passes_the_hub(
    make: Callable[[Arm], Model], hub: float
) -> None:
    """EI v''(0) = J_h θ̈ − τ: −τ J_beam/J quasi-statically, −τ without a hub."""
    beam = Beam(1.0, 3.0, 5.0)
    moment = low_frequency_moment(make(Arm(beam, Hub(hub))))
    assert moment == pytest.approx(-1 / (1 + hub), rel=10 * QUASI_STATIC)


@pytest.mark.parametrize("omega", [1.0, 7.0, 40.0])
def test_root_moment_without_a_hub_is_minus_the_torque_at_any_frequency(omega: float) -> None:
    """EI v''(0) = −τ exactly; twenty polynomials resolve three wavelengths to rounding."""
    arm = Arm(Beam(1.0, 3.0, 5.0), damping_ratio=0.0)
    moment = low_frequency_moment(assemble(arm, Polynomial(20)), omega)
    assert moment == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize("model", [truth, lambda arm: assemble(arm, Slewing(3))])
def test_root_moment_is_refused_where_it_would_read_zero(model: Callable[[Arm], Model]) -> None:
    """Without a hub the moment is −τ, but the arm's own modes do not bend at the root."""
    with pytest.raises(InputError, match="bends at the root"):
        low_frequency_moment(model(Arm(Beam(1.0, 3.0, 5.0))))


def test_slewing_set_carries_no_root_moment_at_all() -> None:
    moment = low_frequency_moment(assemble(Arm(Beam(1.0, 3.0, 5.0), Hub(1.0)), Slewing(5)))
    assert moment == 0.0


def test_root_moment_of_the_truth_with_a_hub_converges_with_its_modes() -> None:
    """The modes cut off bend the root too: the rest falls like 1/modes³ once it falls."""
    beam = Beam(1.0, 3.0, 5.0)
    errors = [
        abs(low_frequency_moment(truth(Arm(beam, Hub(0.3)), modes), 1e-3) * 1.3 + 1)
        for modes in (10, 20, 40)
    ]
    assert errors[1] < errors[0] / 6
    assert errors[2] < errors[1] / 6


def test_arm_modes_are_the_basis_that_needs_no_more_functions(full_arm: Arm) -> None:
    exact = truth(full_arm, 6)
    for n in (1, 3, 6):
        model = assemble(full_arm, arm_modes(full_arm, n))
        np.testing.assert_allclose(model.omega, exact.omega[:n], rtol=1e-10)


@pytest.mark.parametrize("modes", [501, 10**9, 10**400])
def test_more_modes_than_can_be_computed_are_refused_with_the_limit(
    modes: int, full_arm: Arm
) -> None:
    for ask in (truth, frequencies):
        with pytest.raises(InputError, match="where 500 are the most") as error:
            ask(full_arm, modes)
        assert error.value.remedy == "give at most 500"
