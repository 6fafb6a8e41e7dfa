"""Evidence from roots, shapes and virtual work: Table 1, eq. 13–14, 20 and 45."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial as PowerSeries
from numpy.polynomial.legendre import leggauss

from slewctl._types import Array
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Basis, ClampedFree
from slewctl.basis.characteristic import clamped_free_roots, slewing_roots
from slewctl.basis.contract import Growth
from slewctl.model import assemble
from slewctl.paper import published
from slewctl.paper.evidence import Evidence, weigh
from slewctl.paper.tables import AsymptoteRow, root_table

# Exact for the first modes to rounding.
_GAUSS_POINTS = 40
# The uniform beam of eq. 20 has L = m̄ = EI = 1, so that ω = β².
_X = np.linspace(0.0, 1.0, 201)


@dataclass(frozen=True)
class PrintedClampedFree(Basis):
    """Eq. 45 with the sign that the paper prints; for few functions only (it uses cosh)."""

    name: ClassVar[str] = "clamped-free, sign as printed"

    @property
    def growth(self) -> Growth:
        return ClampedFree(self.n).growth

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        roots = clamped_free_roots(self.n)
        z = roots.z
        s = (roots.sin + np.sinh(z)) / (roots.cos + np.cosh(z))
        a = np.multiply.outer(np.asarray(xi, dtype=float), z)
        odd, even = (
            (np.sin(a) - np.sinh(a), np.cosh(a) - np.cos(a)),
            (np.cos(a) - np.cosh(a), np.sinh(a) + np.sin(a)),
            (-np.sin(a) - np.sinh(a), np.cosh(a) + np.cos(a)),
        )[derivative]
        return z**derivative * (odd - s * even)


def asymptotes() -> tuple[Evidence, Evidence]:
    """Weigh both formulas of Table 1's last row against the roots with i = 6 … 10."""
    table = root_table()

    def judge(family: str, rows: tuple[AsymptoteRow, ...]) -> Evidence:
        return weigh(
            f"formula for the {family} roots against the roots themselves, i = 6 to 10",
            "1",
            reference=[row.root for row in rows],
            printed=[row.printed for row in rows],
            corrected=[row.corrected for row in rows],
        )

    return (
        judge("clamped-free", table.clamped_free_asymptotes),
        judge("pinned-free", table.slewing_asymptotes),
    )


def virtual_work() -> Evidence:
    """Weigh ∫EI v''''δv dx and ∫(EI v'')''δv dx (eq. 13) against ∫EI v''δv'' dx.

    v = x²(6 − 4x + x²) has v''(L) = v'''(L) = 0, so that no boundary term remains, and
    δv = x², x³, … x⁶.
    """
    v = PowerSeries([0.0, 0.0, 6.0, -4.0, 1.0])
    stiffness = PowerSeries(published.TAPER)
    moment = stiffness * v.deriv(2)
    trials = _trials()
    return weigh(
        "virtual work of the internal forces of eq. 13 on five virtual displacements of the "
        "tapered beam against that of the bending energy, eq. 10",
        "N·m",
        reference=[_integral(moment * trial.deriv(2)) for trial in trials],
        printed=[_integral(stiffness * v.deriv(4) * trial) for trial in trials],
        corrected=[_integral(moment.deriv(2) * trial) for trial in trials],
    )


def tip_force() -> Evidence:
    """Weigh EI v''' and (EI v'')' at the tip (eq. 14) for a deflection with a tip moment.

    The reference is the shear that balances the virtual work of eq. 10:
    [∫(EI v'')''δv dx + EI v''δv'|_L − ∫EI v''δv'' dx] / δv(L).
    """
    v = PowerSeries([0.0, 0.0, 1.0, 1.0])
    stiffness = PowerSeries(published.TAPER)
    moment = stiffness * v.deriv(2)
    reference = [
        (
            _integral(moment.deriv(2) * trial)
            + float(moment(1.0) * trial.deriv()(1.0))
            - _integral(moment * trial.deriv(2))
        )
        / float(trial(1.0))
        for trial in _trials()
    ]
    return weigh(
        "shear force at the tip in eq. 14, for v = x^2 + x^3, against the one that balances "
        "virtual work; where EI v'' vanishes at the tip, as without a payload, both forms agree",
        "N",
        reference=reference,
        printed=float(stiffness(1.0) * v.deriv(3)(1.0)),
        corrected=float(moment.deriv()(1.0)),
    )


def eigenfunction_residual() -> Evidence:
    """Weigh both right sides of eq. 20 against its left side, for the exact V of eq. 29."""
    root = slewing_roots(1)
    z, ratio = float(root.z[0]), float(root.sin[0] / np.sinh(root.z[0]))

    def shape(x: Array) -> Array:
        return np.sin(z * x) + ratio * np.sinh(z * x) - z * (1 + ratio) * x

    nodes, weights = leggauss(_GAUSS_POINTS)
    moment = float(weights @ ((nodes + 1) / 2 * shape((nodes + 1) / 2)) / 2)
    fourth = z**4 * (np.sin(z * _X) + ratio * np.sinh(z * _X))
    return weigh(
        "right side of eq. 20 along the uniform beam against its left side, for the first "
        "eigenfunction of eq. 29",
        "N/m",
        reference=fourth - z**4 * shape(_X),
        printed=-(z**4) * moment * _X,
        corrected=-3 * z**4 * moment * _X,
    )


def tip_curvature() -> Evidence:
    """Weigh φ_i''(L)/β_i², i = 1 … 5, with both signs of eq. 45 against zero (eq. 14)."""
    n = published.FUNCTIONS
    z = clamped_free_roots(n).z
    tip = np.ones(1)
    return weigh(
        "curvature at the free end of the five clamped-free functions, which must vanish",
        "1",
        reference=0.0,
        printed=PrintedClampedFree(n).evaluate(tip, 2)[0] / z**2,
        corrected=ClampedFree(n).evaluate(tip, 2)[0] / z**2,
    )


def first_table_entry() -> Evidence:
    """Weigh the first entry of Table 2 by both signs of eq. 45 against the printed entry."""
    printed, corrected = (
        float(assemble(paper_beam(), basis).frequencies_hz[0])
        for basis in (PrintedClampedFree(1), ClampedFree(1))
    )
    return weigh(
        "first natural frequency with one clamped-free function against Table 2, row 1",
        "Hz",
        reference=published.FIRST_CLAMPED_FREE[0],
        printed=printed,
        corrected=corrected,
    )


def _trials() -> tuple[PowerSeries, ...]:
    return tuple(PowerSeries([0.0] * power + [1.0]) for power in range(2, 7))


def _integral(integrand: PowerSeries) -> float:
    primitive = integrand.integ()
    return float(primitive(1.0) - primitive(0.0))
