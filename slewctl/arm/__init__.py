"""What an arm is: its parts, and a catalogue of arms with their sources."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.arm.appendages import equal_appendages, stacked_appendages
    from slewctl.arm.beam import Beam
    from slewctl.arm.damping import LAWS, DampingLaw, Drag, KelvinVoigt, Rayleigh
    from slewctl.arm.dynamics import Actuator, Sensor
    from slewctl.arm.hub import Hub
    from slewctl.arm.joint import Joint
    from slewctl.arm.lumped import LumpedLink, quanser_lumped
    from slewctl.arm.masses import Bodies, LumpedMass, Payload
    from slewctl.arm.modal_data import ModalData, Place, require_beam
    from slewctl.arm.motor import Motor
    from slewctl.arm.parts import Arm
    from slewctl.arm.profiles import Profile, ProfileSpec, Stations
    from slewctl.arm.variation import vary

__all__ = [
    "LAWS",
    "Actuator",
    "Arm",
    "Beam",
    "Bodies",
    "DampingLaw",
    "Drag",
    "Hub",
    "Joint",
    "KelvinVoigt",
    "LumpedLink",
    "LumpedMass",
    "ModalData",
    "Motor",
    "Payload",
    "Place",
    "Profile",
    "ProfileSpec",
    "Rayleigh",
    "Sensor",
    "Stations",
    "equal_appendages",
    "quanser_lumped",
    "require_beam",
    "stacked_appendages",
    "vary",
]

__getattr__, __dir__ = attach(__name__, __file__)
