"""What an arm is: its parts, and a catalogue of arms with their sources."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.arm.damping import KelvinVoigt, Rayleigh
    from slewctl.arm.dynamics import Actuator, Sensor
    from slewctl.arm.joint import Joint
    from slewctl.arm.lumped import LumpedLink, quanser_lumped
    from slewctl.arm.motor import Motor
    from slewctl.arm.parts import Arm, Beam, Hub, Payload, Stations
    from slewctl.arm.profiles import Profile, ProfileSpec
    from slewctl.arm.variation import vary

__all__ = [
    "Actuator",
    "Arm",
    "Beam",
    "Hub",
    "Joint",
    "KelvinVoigt",
    "LumpedLink",
    "Motor",
    "Payload",
    "Profile",
    "ProfileSpec",
    "Rayleigh",
    "Sensor",
    "Stations",
    "quanser_lumped",
    "vary",
]

__getattr__, __dir__ = attach(__name__, __file__)
