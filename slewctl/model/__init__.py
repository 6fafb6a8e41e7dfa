"""Models of an arm: quadrature, assembly of M, D, K and b, and the converged truth."""

from slewctl.model.assembly import Model, assemble
from slewctl.model.truth import Truth, truth

__all__ = ["Model", "Truth", "assemble", "truth"]
