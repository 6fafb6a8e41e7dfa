"""Damping laws of an arm, beside its modal damping ratios and the friction at its hub."""

from __future__ import annotations

from dataclasses import dataclass

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

    def __post_init__(self) -> None:
        for name in ("alpha", "beta"):
            value = check_size_or_zero(getattr(self, name), f"damping.{name}")
            object.__setattr__(self, name, value)

    @property
    def coefficients(self) -> tuple[float, float]:
        """(α, β) of D = αM + βK."""
        return self.alpha, self.beta


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

    def __post_init__(self) -> None:
        value = check_size_or_zero(self.retardation_time, "damping.retardation_time")
        object.__setattr__(self, "retardation_time", value)

    @property
    def coefficients(self) -> tuple[float, float]:
        """(α, β) of D = αM + βK; K has nothing to do with the rigid rotation."""
        return 0.0, self.retardation_time
