"""The paper that this package implements, reproduced and corrected."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.paper.conditioning import ConditioningFinding, ConditioningPoint
    from slewctl.paper.conditioning_prose import conditioning_words
    from slewctl.paper.figures import Figures, ShapeFigure
    from slewctl.paper.findings import HubFinding, HubPoint
    from slewctl.paper.integrators import IntegratorFinding
    from slewctl.paper.reproduction import PARTS, PaperReproduction, reproduce

__all__ = [
    "PARTS",
    "ConditioningFinding",
    "ConditioningPoint",
    "Figures",
    "HubFinding",
    "HubPoint",
    "IntegratorFinding",
    "PaperReproduction",
    "ShapeFigure",
    "conditioning_words",
    "reproduce",
]

__getattr__, __dir__ = attach(__name__, __file__)
