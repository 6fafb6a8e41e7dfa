"""The paper that this package implements, reproduced and corrected."""

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
