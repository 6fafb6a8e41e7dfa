"""Every erratum is shown by a computation: the corrected form holds, the printed does not."""

import numpy as np
import pytest

from slewctl.arm.catalogue import paper_beam
from slewctl.basis import ClampedFree, Polynomial
from slewctl.model import assemble
from slewctl.paper import energy
from slewctl.paper.errata import errata
from slewctl.paper.shapes import PrintedClampedFree

ERRATA = errata()


def test_there_are_eight():
    assert len(ERRATA) == 8


@pytest.mark.parametrize("erratum", ERRATA, ids=lambda erratum: erratum.place)
def test_corrected_form_holds_and_printed_form_fails(erratum):
    assert erratum.evidence
    for evidence in erratum.evidence:
        assert evidence.printed_error > 0.1
        assert evidence.corrected_error < 1e-6 * evidence.printed_error
        assert abs(evidence.printed - evidence.reference) == evidence.printed_error


def test_printed_sign_of_eq_45_gives_another_first_frequency():
    evidence = ERRATA[-1].evidence[-1]
    assert evidence.printed == pytest.approx(3.435, abs=5e-4)
    assert evidence.corrected == pytest.approx(3.854694, abs=0.5e-6)


def test_printed_and_corrected_eq_45_differ_in_nothing_but_the_sign():
    """Half their sum is sin βx − sinh βx."""
    x = np.linspace(0.0, 1.0, 11)
    basis = ClampedFree(3)
    from_both = (basis.evaluate(x) + PrintedClampedFree(3).evaluate(x)) / 2
    z = np.array([1.87510407, 4.69409113, 7.85475744])
    expected = np.sin(np.outer(x, z)) - np.sinh(np.outer(x, z))
    np.testing.assert_allclose(from_both, expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("derivative", [1, 2])
def test_derivatives_of_the_printed_form(derivative):
    basis, x, h = PrintedClampedFree(3), np.linspace(0.1, 0.9, 9), 1e-5
    lower = derivative - 1
    difference = (basis.evaluate(x + h, lower) - basis.evaluate(x - h, lower)) / (2 * h)
    np.testing.assert_allclose(basis.evaluate(x, derivative), difference, rtol=1e-6, atol=1e-6)


def test_kinetic_energy_of_eq_9_is_that_of_the_assembled_model():
    """½ẋᵀMẋ at q = 0, where the term with θ̇²v² vanishes."""
    beam, mass = energy.line(), assemble(paper_beam(), Polynomial(3)).mass
    rates = np.array([0.7, 0.2, -0.5, 0.3])
    T = energy.kinetic_energy(beam, rates[0], np.zeros(3), rates[1:])
    expected = rates @ mass @ rates / 2
    assert T.real == pytest.approx(expected, rel=1e-13)


def test_motion_is_consistent():
    h = 1e-6
    for t in (0.2, 1.7):
        before, at, after = (energy.motion(t + step) for step in (-h, 0.0, h))
        np.testing.assert_allclose((after.q - before.q) / (2 * h), at.q_dot, atol=1e-8)
        np.testing.assert_allclose((after.q_dot - before.q_dot) / (2 * h), at.q_ddot, atol=1e-8)
        assert (after.turn - before.turn) / (2 * h) == pytest.approx(at.turn_rate, abs=1e-8)


def test_eq_14_is_harmless_where_the_tip_carries_no_moment():
    """With EI v'' = 0 at the tip, (EI v'')' = EI v''' there: the slip has no effect by itself."""
    taper = np.polynomial.Polynomial([1, 0, 0, -5 / 6])
    v = np.polynomial.Polynomial([0, 0, 3, -1])
    assert v.deriv(2)(1.0) == 0
    assert (taper * v.deriv(2)).deriv()(1.0) == pytest.approx(taper(1.0) * v.deriv(3)(1.0))
