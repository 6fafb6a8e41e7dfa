"""What the nonlinear equations cannot describe."""

from __future__ import annotations

from slewctl.errors import SlewctlError


class LargeDeflectionError(SlewctlError):
    """The arm bends further than equations of second order in the deflection can describe."""
