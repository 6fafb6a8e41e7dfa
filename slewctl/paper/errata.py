"""What is misprinted in the paper, and the computation that shows it.

Places and forms are those of the copy at hand, a scan: a sign or an index among them may
be the scan's fault and not the paper's.
"""

from __future__ import annotations

from dataclasses import dataclass

from slewctl.paper import energy, shapes
from slewctl.paper.evidence import Evidence


@dataclass(frozen=True)
class Erratum:
    """One misprint.

    Attributes
    ----------
    place : str
        Table or equation.
    printed, corrected : str
        Both forms, as text.
    evidence : tuple of Evidence
        What was computed, with the errors of both forms.
    """

    place: str
    printed: str
    corrected: str
    evidence: tuple[Evidence, ...]


def errata() -> tuple[Erratum, ...]:
    """Return the eight errata in the order of the paper, each with computed evidence."""
    return (
        Erratum(
            "Table 1, last row",
            "(2i − 2)π/2 and (4i + 2)π/4",
            "(2i − 1)π/2 and (4i + 1)π/4",
            shapes.asymptotes(),
        ),
        Erratum(
            "eq. 12, second and third terms",
            "θ̇ ∫ m̄ v² dx and 2θ̇ ∫ m̄ x v̇ dx",
            "θ̈ ∫ m̄ v² dx and 2θ̇ ∫ m̄ v v̇ dx",
            (energy.torque_balance(),),
        ),
        Erratum(
            "eq. 13 and 14",
            "EI v'''' and EI v'''",
            "(EI v'')'' and (EI v'')' for a non-uniform beam",
            (shapes.virtual_work(), shapes.tip_force()),
        ),
        Erratum(
            "eq. 20",
            "−(ω² m̄ x / L³) x ∫ ξ V dξ",
            "−(3 ω² m̄ x / L³) ∫ ξ V dξ",
            (shapes.eigenfunction_residual(),),
        ),
        Erratum("eq. 32", "½ θ̇² qᵀ", "½ θ̇² qᵀ M_e q", (energy.discrete_energy(),)),
        Erratum("eq. 33", "∫ m̄_x Φ dx", "∫ m̄ x Φ dx", (energy.coupling_row(),)),
        Erratum(
            "eq. 37 and 38",
            "M_c, which is not defined anywhere, beside K_c",
            "M_e of eq. 33; one mass matrix and one stiffness matrix",
            (energy.discrete_torque_balance(),),
        ),
        Erratum(
            "eq. 45",
            "−s (cosh βx − cos βx)",
            "+s (cosh βx − cos βx), s = (sin βL + sinh βL)/(cos βL + cosh βL)",
            (shapes.tip_curvature(), shapes.first_table_entry()),
        ),
    )
