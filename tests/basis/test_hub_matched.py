"""Hub-matched functions over all decades of hub and payload, against many digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose
from precise_matched import deflection, determinant, eigenfunction

from slewctl import Arm, Beam, Hub, InputError, Payload, Stations
from slewctl.basis import ClampedFree, HubMatched, Ratios, Slewing
from slewctl.basis.characteristic import clamped_free_roots, slewing_roots
from slewctl.basis.inertia import panel_rule
from slewctl.basis.matched_roots import hub_matched_roots

EPS = np.finfo(float).eps
DECADES = (0.0, 1e-7, 1e-3, 0.3, 40.0, 1e5, 1e10)


def all_ratios() -> list[Ratios]:
    """One hub or payload quantity over all decades, then random ones together."""
    alone = [Ratios(**{name: v}) for name in ("hub_inertia", "payload_mass", "payload_inertia") for v in DECADES]  # fmt: skip
    rng = np.random.default_rng(5)

    def draw(low: float, high: float) -> float:
        return 0.0 if rng.random() < 0.2 else float(10 ** rng.uniform(low, high))

    together = [Ratios(draw(-7, 10), draw(-3, 1), draw(-10, 10), draw(-10, 10)) for _ in range(9)]
    return alone + together


def precise_root(ratios: Ratios, z: float) -> mp.mpf:
    """The root next to z, in the working precision."""
    near = mp.mpf(z)
    return mp.findroot(
        lambda x: determinant(ratios, x) * mp.exp(-x),
        (near * (1 - mp.mpf(2) ** -45), near * (1 + mp.mpf(2) ** -45)),
        solver="anderson",
        tol=mp.mpf(10) ** (-2 * mp.mp.dps + 60),
        verify=False,
    )


@pytest.mark.slow
def test_each_root_is_enclosed_by_four_units_in_the_last_place() -> None:
    """g is a sum of a dozen terms that are each a few roundings: a sign change proves the root."""
    for ratios in all_ratios():
        z = hub_matched_roots(200, ratios)
        reach = 4 * np.spacing(z)
        for i in (0, 1, 3, 12, 199):
            with mp.workdps(50 + int(z[i])):
                below, above = mp.mpf(z[i]) - mp.mpf(reach[i]), mp.mpf(z[i]) + mp.mpf(reach[i])
                assert determinant(ratios, below) * determinant(ratios, above) < 0, (ratios, i)


@pytest.mark.slow
def test_no_root_is_missed_or_found_twice() -> None:
    """Between neighbouring roots the determinant has the sign of its index, and none is left over."""
    for ratios in all_ratios()[::2]:
        z = hub_matched_roots(12, ratios)
        assert np.all(np.diff(z) > 0)
        between = [z[0] / 2, *((z[1:] + z[:-1]) / 2)]
        # A fine scan up to the fifth root finds five sign changes and no more.
        with mp.workdps(60):
            signs = [int(mp.sign(determinant(ratios, mp.mpf(x)))) for x in between]
            assert signs == [(-1) ** i for i in range(12)]
            scan = np.geomspace(z[0] / 10, between[5], 150)
            found = [int(mp.sign(determinant(ratios, mp.mpf(x)))) for x in scan]
        assert np.count_nonzero(np.diff(found)) == 5, ratios


def test_limits_are_the_slewing_and_the_clamped_free_roots() -> None:
    """At J_h → ∞ the roots approach like 1/J_h; both are within two units in the last place."""
    for ratios, known in ((Ratios(), slewing_roots(200)), (Ratios(1e30), clamped_free_roots(200))):
        z = hub_matched_roots(200, ratios)
        assert np.all(np.abs(z - known.z) <= 4 * np.spacing(z))


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize(
    ("ratios", "limit"),
    [(Ratios(), Slewing), (Ratios(1e-18), Slewing), (Ratios(1e12), ClampedFree)],
)
def test_limits_are_the_slewing_and_the_clamped_free_functions(
    ratios: Ratios, limit: type, derivative: int
) -> None:
    """Up to normalisation, to 1e-8 for 100 functions."""
    xi = np.linspace(0, 1, 401)
    own, known = HubMatched(100, ratios), limit(100)
    points, weights = panel_rule(tuple(np.linspace(0, 1, 41)), 24)
    size = np.sqrt(weights @ known.evaluate(points, 2) ** 2)
    expected = known.evaluate(xi, derivative) / (size * np.sign(known.evaluate(np.ones(1))[0]))
    error = np.abs(own.evaluate(xi, derivative) - expected).max(axis=0)
    assert np.all(error <= 1e-8 * np.abs(expected).max(axis=0))


def assert_functions(ratios: Ratios, total: int, which: tuple[int, ...], digits: int = 100) -> None:
    """Assert functions and two derivatives; of each the largest value is one.

    A relative error ε of z and ξ turns an angle by 2zε; a 4 × 4 null vector adds some ten ε.
    """
    xi = [0.0, 1e-4, 0.013, 0.37, 0.5, 0.925, 0.999, 1.0]
    basis, z = HubMatched(total, ratios), hub_matched_roots(total, ratios)
    for i in which:
        with mp.workdps(digits + 2 * int(z[i])):
            root = precise_root(ratios, z[i])
            start = eigenfunction(ratios, root)
            exact = [[deflection(start, root, x, d) for x in xi] for d in range(3)]
            largest = [max(map(abs, row)) for row in exact]
            shapes = np.array(
                [[float(v / s) for v in row] for row, s in zip(exact, largest, strict=True)]
            )
        for d in range(3):
            computed = basis.evaluate(np.array(xi), d)[:, i]
            computed *= shapes[d] @ computed / (computed @ computed)
            tolerance = (4 * z[i] + 32) * EPS
            assert_allclose(computed, shapes[d], rtol=0, atol=tolerance, err_msg=str(ratios))


@pytest.mark.slow
def test_functions_are_those_of_the_boundary_conditions() -> None:
    for ratios in all_ratios()[::2]:
        assert_functions(ratios, 40, (0, 1, 5, 39))


@pytest.mark.slow
def test_curvatures_are_orthonormal() -> None:
    """∫φ_i''φ_j'' = δ_ij, the normalisation and the orthogonality of the modes in one."""
    xi, weights = panel_rule(tuple(np.linspace(0, 1, 41)), 24)
    for ratios in all_ratios():
        curvature = HubMatched(60, ratios).evaluate(xi, 2)
        gram = (curvature.T * weights) @ curvature
        assert_allclose(gram, np.eye(60), rtol=0, atol=186 * EPS)  # z_60 ε


@pytest.mark.parametrize(
    "ratios", [Ratios(1e50, 1e3, 1e50, 1e50), Ratios(0.0, 1e10, 0.0, 1e-300)], ids=str
)
def test_functions_are_finite_for_the_largest_numbers(ratios: Ratios) -> None:
    for derivative in range(3):
        values = HubMatched(200, ratios).evaluate(np.linspace(0, 1, 21), derivative)
        assert np.all(np.isfinite(values))


@pytest.mark.slow
@pytest.mark.parametrize(
    "ratios", [Ratios(1e50, 1.0, 1e50, 1e50), Ratios(0.0, 1e10, 0.0, 1e-300)], ids=str
)
def test_functions_for_the_largest_numbers_meet_the_boundary_conditions(ratios: Ratios) -> None:
    assert_functions(ratios, 200, (0, 1, 2, 199), digits=400)


def test_ratios_of_a_uniform_arm_are_its_own() -> None:
    arm = Arm(Beam(2.0, 3.0, 5.0), Hub(1.2, 0.3), Payload(0.9, 0.6))
    found = HubMatched(3).matched_to(arm).ratios
    expected = Ratios(1.2 / 24, 0.15, 0.15, 0.6 / 24)
    for name in ("hub_inertia", "hub_radius", "payload_mass", "payload_inertia"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=8 * EPS)


def test_ratios_of_another_arm_keep_its_moment_of_inertia() -> None:
    """Mass 3 ∫m̄x²/L² of the uniform beam: for 2 kg/m up to 1 m and 1 beyond, 3·(2 + 7)/3/4."""
    mass = Stations((0.0, 1.0, 1.0, 2.0), (2.0, 2.0, 1.0, 1.0))
    found = HubMatched(3).matched_to(Arm(Beam(2.0, mass, 5.0), Hub(1.2), Payload(0.9))).ratios
    assert found.hub_inertia == pytest.approx(1.2 / 4 / 2.25, rel=8 * EPS)
    assert found.payload_mass == pytest.approx(0.9 / 2.25, rel=8 * EPS)


@pytest.mark.parametrize("name", ["hub_inertia", "hub_radius", "payload_mass", "payload_inertia"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf, "1", 1e51])
def test_impossible_ratios_are_refused(name: str, value: object) -> None:
    with pytest.raises(InputError) as error:
        Ratios(**{name: value})
    assert error.value.where == f"ratios.{name}"


@pytest.mark.parametrize("wrong", [0.5, Arm(Beam(1.0, 1.0, 1.0))])
def test_what_are_no_ratios_are_refused(wrong: object) -> None:
    with pytest.raises(InputError, match="leave it out to match"):
        HubMatched(3, wrong)  # type: ignore[arg-type]
