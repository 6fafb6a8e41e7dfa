"""The first finding: what each integrator does to both models at the paper's step."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from slewctl import ClampedFree, Slewing, assemble, state_space
from slewctl.arm.catalogue import paper_beam
from slewctl.paper.integrators import INTEGRATORS, integrator_finding


@pytest.fixture(scope="module")
def finding():
    return integrator_finding()


@pytest.fixture(scope="module")
def rows(finding):
    return {row.integrator: row for row in finding.rows}


def test_exact_sampling_is_stable_for_both(rows):
    row = rows["exact zero-order hold"]
    assert row.clamped_free.spectral_radius == row.slewing.spectral_radius == 1.0
    assert row.clamped_free.stable
    assert row.slewing.stable


def test_fourth_order_taylor_step_is_what_the_paper_saw(finding, rows):
    row = rows["Taylor / Runge-Kutta, order 4"]
    assert row.clamped_free.spectral_radius == pytest.approx(15.28, abs=0.005)
    assert row.slewing.spectral_radius == 1.0
    assert not row.clamped_free.stable
    assert row.slewing.stable
    assert finding.slewing.omega_h[-1] == pytest.approx(2.811, abs=5e-4)
    assert finding.slewing.omega_h[-1] < row.limit == pytest.approx(2 * math.sqrt(2))
    # The slewing model passes by less than one percent of the step.
    assert finding.step_s < row.slewing.largest_step_s < 1.01 * finding.step_s


def test_false_fifth_mode_lies_above_the_nyquist_frequency(finding):
    assert finding.nyquist_hz == 50.0
    assert finding.clamped_free.frequencies_hz[-1] == pytest.approx(73.8, abs=0.05)
    assert finding.clamped_free.above_nyquist == (5,)
    assert finding.slewing.above_nyquist == ()
    alias = 1 / finding.step_s - finding.clamped_free.frequencies_hz[-1]
    assert finding.clamped_free.apparent_hz[-1] == pytest.approx(alias)
    np.testing.assert_allclose(finding.slewing.apparent_hz, finding.slewing.frequencies_hz)


def test_other_explicit_methods_lose_the_slewing_model_too(rows):
    for name in (
        "explicit Euler",
        "Taylor / Runge-Kutta, order 2",
        "Taylor / Runge-Kutta, order 3",
        "central difference (Störmer-Verlet)",
    ):
        assert rows[name].slewing.spectral_radius > 2
        assert not rows[name].slewing.stable


def test_implicit_methods_keep_both(rows):
    for name in ("trapezoidal (Tustin; Newmark, average acceleration)", "implicit Euler"):
        for model in (rows[name].clamped_free, rows[name].slewing):
            assert model.spectral_radius == 1.0
            assert model.stable


@pytest.mark.parametrize("method", INTEGRATORS, ids=lambda method: method.name)
def test_declared_limits_are_where_an_undamped_mode_starts_to_grow(method):
    if method.limit is None:
        assert np.all(method.radius(np.geomspace(1e-3, 1e6, 200)) <= 1.0)
    else:
        below = method.limit * np.linspace(0.05, 1 - 1e-6, 200)
        assert np.all(method.radius(below) <= 1 + 1e-14)
        above = method.limit * (1 + 1e-6) + np.geomspace(1e-3, 10, 50)
        assert np.all(method.radius(above) > 1)


def _step_matrices(A, h):
    eye, Z = np.eye(len(A)), A * h
    powers = [np.linalg.matrix_power(Z, k) / math.factorial(k) for k in range(5)]
    return {
        "exact zero-order hold": expm(Z),
        "explicit Euler": sum(powers[:2]),
        "Taylor / Runge-Kutta, order 2": sum(powers[:3]),
        "Taylor / Runge-Kutta, order 3": sum(powers[:4]),
        "Taylor / Runge-Kutta, order 4": sum(powers),
        "trapezoidal (Tustin; Newmark, average acceleration)": np.linalg.solve(
            eye - Z / 2, eye + Z / 2
        ),
        "implicit Euler": np.linalg.inv(eye - Z),
    }


@pytest.mark.parametrize(
    ("field", "basis"), [("clamped_free", ClampedFree(5)), ("slewing", Slewing(5))]
)
def test_radii_agree_with_the_eigenvalues_of_the_step_matrix(finding, rows, field, basis):
    A = np.asarray(state_space(assemble(paper_beam(), basis)).A)
    for name, step in _step_matrices(A, finding.step_s).items():
        radius = np.abs(np.linalg.eigvals(step)).max()
        # The double eigenvalue 1 of the rotation is defective: 1e-8 of rounding becomes 1e-6.
        assert getattr(rows[name], field).spectral_radius == pytest.approx(radius, rel=1e-5)


def test_newmark_radii_agree_with_their_two_step_recursion(finding, rows):
    betas = {
        "central difference (Störmer-Verlet)": 0.0,
        "Newmark, linear acceleration": 1 / 6,
        "trapezoidal (Tustin; Newmark, average acceleration)": 1 / 4,
    }
    for name, beta in betas.items():
        for field in ("clamped_free", "slewing"):
            model = assemble(
                paper_beam(), {"clamped_free": ClampedFree, "slewing": Slewing}[field](5)
            )
            z = model.omega * finding.step_s
            # M x'' replaced by (x₊ − 2x + x₋)/h², K x by K(βx₊ + (1−2β)x + βx₋)
            polynomials = [
                (1 + beta * w**2, -2 + (1 - 2 * beta) * w**2, 1 + beta * w**2) for w in z
            ]
            radii = [np.abs(np.roots(p)).max() for p in polynomials]
            np.testing.assert_allclose(getattr(rows[name], field).mode_radii, radii, rtol=1e-10)
