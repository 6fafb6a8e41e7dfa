"""The paper that this package implements, reproduced and corrected."""

from slewctl.paper.figures import Figures, ShapeFigure
from slewctl.paper.findings import HubFinding, HubPoint
from slewctl.paper.integrators import IntegratorFinding
from slewctl.paper.reproduction import PARTS, PaperReproduction, reproduce

__all__ = [
    "PARTS",
    "Figures",
    "HubFinding",
    "HubPoint",
    "IntegratorFinding",
    "PaperReproduction",
    "ShapeFigure",
    "reproduce",
]
