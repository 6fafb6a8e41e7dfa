"""The hub that carries the beam."""

from __future__ import annotations

from dataclasses import dataclass

from slewctl.arm.magnitudes import check_size_or_zero


@dataclass(frozen=True)
class Hub:
    """The turning hub that carries the beam.

    Parameters
    ----------
    inertia : float
        J_h about the axis, in kg·m², without the rotor that `Motor` or `Joint` gives.
    radius : float
        r in m: the beam is clamped at this distance from the axis.
    friction : float
        Viscous friction c_h at the axis, in N·m·s/rad.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Hub(inertia=0.2, radius=0.05)
    Hub(inertia=0.2, radius=0.05, friction=0.0)
    """

    inertia: float = 0.0
    radius: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("inertia", "radius", "friction"):
            value = check_size_or_zero(getattr(self, name), f"hub.{name}")
            object.__setattr__(self, name, value)
