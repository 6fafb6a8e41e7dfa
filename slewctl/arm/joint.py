"""The elastic joint between the motor's rotor and the hub: a harmonic drive, a belt, a shaft."""

from __future__ import annotations

from dataclasses import dataclass

from slewctl.arm.magnitudes import check_size, check_size_or_zero


@dataclass(frozen=True)
class Joint:
    """An elastic joint: the rotor turns by θ_m, the hub by θ, a spring and a damper between.

        J_m θ̈_m + c_m θ̇_m + k_j(θ_m − θ) + c_j(θ̇_m − θ̇) = τ,

    and k_j(θ_m − θ) + c_j(θ̇_m − θ̇) turns the hub.  θ_m is counted on the output side of the
    gear.  J_m is `rotor_inertia` and the motor's, as `Motor.reflected_inertia` gives it, which
    then turns with the rotor and no more with the hub; the back-EMF is that of θ̇_m.  As k_j
    grows the arm becomes the one without a joint, whose hub carries J_m.

    Parameters
    ----------
    stiffness : float
        k_j in N·m/rad, on the output side.
    damping : float
        c_j in N·m·s/rad.
    rotor_inertia : float
        In kg·m², on the output side (ratio squared included), beside that of `Motor`: of a
        wave generator, a pulley, or of the rotor itself where the arm has no motor.
    rotor_friction : float
        Viscous friction c_m of the rotor, in N·m·s/rad on the output side.

    Raises
    ------
    InputError
        For a stiffness that is not positive or another impossible value.

    Examples
    --------
    >>> import slewctl as sc
    >>> joint = sc.Joint(stiffness=100.0, rotor_inertia=1.0)
    >>> arm = sc.Arm(sc.Beam(0.7, 4.0, 0.6), joint=joint)
    >>> (2 * 3.141592653589793 * sc.truth(arm, 2).frequencies_hz).round(4).tolist()
    [3.2781, 17.2251]
    """

    stiffness: float
    damping: float = 0.0
    rotor_inertia: float = 0.0
    rotor_friction: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", check_size(self.stiffness, "joint.stiffness"))
        for name in ("damping", "rotor_inertia", "rotor_friction"):
            value = check_size_or_zero(getattr(self, name), f"joint.{name}")
            object.__setattr__(self, name, value)
