"""Damping laws of an arm, beside its modal damping ratios and the friction at its hub."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from slewctl.arm.magnitudes import check_size_or_zero


@dataclass(frozen=True)
class Rayleigh:
    """Damping in proportion to mass and stiffness: D = αM + βK on [θ, q].

    Mode k of the free arm gets 2ζω = α + βω².  M is the whole mass matrix, with hub, rotor
    and payload, and acts on the inertial velocity: α is a drag in proportion to mass that
    brakes the rigid rotation as well, whose rate decays as exp(−αt).  Leave α out to damp
    the bending alone.

    Parameters
    ----------
    alpha : float
        α in 1/s.
    beta : float
        β in s.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Arm(sc.arms.paper_beam().beam, damping=sc.Rayleigh(beta=1e-4)).damping
    Rayleigh(alpha=0.0, beta=0.0001)
    """

    alpha: float = 0.0
    beta: float = 0.0
    kind: ClassVar[str] = "rayleigh"

    def __post_init__(self) -> None:
        for name in ("alpha", "beta"):
            value = check_size_or_zero(getattr(self, name), f"damping.{name}")
            object.__setattr__(self, name, value)

    @property
    def coefficients(self) -> tuple[float, float]:
        """(α, β) of D = αM + βK."""
        return self.alpha, self.beta

    def scaled(self, factor: float) -> Rayleigh:
        """Return the law with all that it damps times a factor."""
        return Rayleigh(factor * self.alpha, factor * self.beta)


@dataclass(frozen=True)
class KelvinVoigt:
    """Internal damping of the beam's material, stress = E(ε + η dε/dt), so D = ηK_e.

    The bending moment becomes EI(v'' + η v̇'').  Mode k of the free arm gets 2ζω = ηω²: the
    damping ratio rises with the frequency, and modes above 2/η oscillate no more.  (Banks
    and Inman, "On damping mechanisms in beams", J. Appl. Mech. 58 (1991) 716–723.)

    Parameters
    ----------
    retardation_time : float
        η in s.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Arm(sc.arms.paper_beam().beam, damping=sc.KelvinVoigt(1e-4)).damping
    KelvinVoigt(retardation_time=0.0001)
    """

    retardation_time: float
    kind: ClassVar[str] = "kelvin-voigt"

    def __post_init__(self) -> None:
        value = check_size_or_zero(self.retardation_time, "damping.retardation_time")
        object.__setattr__(self, "retardation_time", value)

    @property
    def coefficients(self) -> tuple[float, float]:
        """(α, β) of D = αM + βK; K has nothing to do with the rigid rotation."""
        return 0.0, self.retardation_time

    def scaled(self, factor: float) -> KelvinVoigt:
        """Return the law with all that it damps times a factor."""
        return KelvinVoigt(factor * self.retardation_time)


@dataclass(frozen=True)
class Drag:
    """Drag of the medium along the beam alone: a force c per length and velocity.

    It acts on the inertial velocity (r + x)θ̇ + v̇, so that it brakes the turning arm as well:
    D = c ∫ [r + x, Φ]ᵀ[r + x, Φ] dx.  Hub, payload and lumped masses have none; the friction
    of the axis is `Hub.friction`.

    Parameters
    ----------
    per_length : float
        c in N·s/m².

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Arm(sc.arms.paper_beam().beam, damping=sc.Drag(0.1)).damping
    Drag(per_length=0.1)
    """

    per_length: float
    kind: ClassVar[str] = "drag"

    def __post_init__(self) -> None:
        value = check_size_or_zero(self.per_length, "damping.per_length")
        object.__setattr__(self, "per_length", value)

    @property
    def coefficients(self) -> tuple[float, float]:
        """(α, β) of D = αM + βK: none of it is in proportion to either."""
        return 0.0, 0.0

    def scaled(self, factor: float) -> Drag:
        """Return the law with all that it damps times a factor."""
        return Drag(factor * self.per_length)


DampingLaw = Rayleigh | KelvinVoigt | Drag
LAWS: tuple[type[DampingLaw], ...] = (Rayleigh, KelvinVoigt, Drag)
