"""The motor that turns the hub: from volts to torque, through a gear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from slewctl._types import Array
from slewctl.arm.magnitudes import check_size, check_size_or_zero
from slewctl.errors import InputError

Value = TypeVar("Value", float, Array)


@dataclass(frozen=True)
class Motor:
    """A DC motor with a gear, its inductance neglected.

    The torque on the hub is τ = ηg Kg ηm kt (V − Kg km θ̇)/Rm and the rotor adds
    ηg Kg² Jm to the hub's inertia (Quanser Inc., Rotary Servo Base Unit workbook:
    Jeq = J_hub + ηg Kg² Jm).  The rotor's own torque passes the gear as the motor's does,
    so it carries the same ηg; both hold while the motor drives the arm.

    `Hub.inertia` and `Hub.friction` are those of everything on the hub's side of the gear.
    If the inertia was measured or published with the rotor, as an equivalent inertia is,
    leave `rotor_inertia` out: it would count twice.

    Parameters
    ----------
    resistance : float
        Rm in Ω.
    torque_constant : float
        kt in N·m/A.
    back_emf_constant : float
        km in V·s/rad, of the motor's own shaft.
    gear_ratio : float
        Kg: turns of the motor for one of the hub.
    gear_efficiency, motor_efficiency : float
        ηg and ηm, greater than 0 and at most 1.
    rotor_inertia : float
        Jm in kg·m², about the motor's own shaft.
    torque_limit : float, optional
        Largest torque on the hub in N·m.
    voltage_limit : float, optional
        Largest voltage in V.  The model is linear and exceeds both limits when told to; a
        slew says whether it did.

    Raises
    ------
    InputError
        For an impossible value.

    Examples
    --------
    >>> import slewctl as sc
    >>> motor = sc.Motor(2.6, 0.0077, 0.0077, gear_ratio=70.0, voltage_limit=15.0)
    >>> sc.Arm(sc.arms.paper_beam().beam, motor=motor).motor.gear_ratio
    70.0
    """

    resistance: float
    torque_constant: float
    back_emf_constant: float
    gear_ratio: float = 1.0
    gear_efficiency: float = 1.0
    motor_efficiency: float = 1.0
    rotor_inertia: float = 0.0
    torque_limit: float | None = None
    voltage_limit: float | None = None

    def __post_init__(self) -> None:
        for name in ("resistance", "torque_constant", "gear_ratio"):
            object.__setattr__(self, name, check_size(getattr(self, name), f"motor.{name}"))
        for name in ("back_emf_constant", "rotor_inertia"):
            value = check_size_or_zero(getattr(self, name), f"motor.{name}")
            object.__setattr__(self, name, value)
        for name in ("gear_efficiency", "motor_efficiency"):
            object.__setattr__(self, name, _efficiency(getattr(self, name), f"motor.{name}"))
        for name in ("torque_limit", "voltage_limit"):
            if getattr(self, name) is not None:
                value = check_size(getattr(self, name), f"motor.{name}")
                object.__setattr__(self, name, value)

    @property
    def torque_per_volt(self) -> float:
        """Torque on the hub at rest per volt, ηg Kg ηm kt/Rm, in N·m/V."""
        drive = self.gear_efficiency * self.gear_ratio * self.motor_efficiency
        return drive * self.torque_constant / self.resistance

    @property
    def volts_per_rate(self) -> float:
        """Back-EMF per rate of the hub, Kg km, in V·s/rad."""
        return self.gear_ratio * self.back_emf_constant

    @property
    def back_emf_damping(self) -> float:
        """Viscous friction that the back-EMF makes at the hub, in N·m·s/rad."""
        return self.torque_per_volt * self.volts_per_rate

    @property
    def reflected_inertia(self) -> float:
        """The rotor's inertia as the hub feels it, ηg Kg² Jm, in kg·m²."""
        return self.gear_efficiency * self.gear_ratio**2 * self.rotor_inertia

    def torque(self, voltage: Value, rate: Value) -> Value:
        """Return the torque on the hub in N·m at a voltage (V) and a hub rate (rad/s)."""
        return self.torque_per_volt * (voltage - self.volts_per_rate * rate)

    def voltage(self, torque: Value, rate: Value) -> Value:
        """Return the voltage in V that makes a torque (N·m) at a hub rate (rad/s)."""
        return torque / self.torque_per_volt + self.volts_per_rate * rate


def _efficiency(value: object, name: str) -> float:
    number = check_size(value, name)
    if number > 1:
        raise InputError(
            f"{number:g} is greater than 1", where=name, remedy="give a fraction, such as 0.9"
        )
    return number
