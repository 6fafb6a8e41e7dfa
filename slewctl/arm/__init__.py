"""What an arm is: its parts, and a catalogue of arms with their sources."""

from slewctl.arm.parts import Arm, Beam, Hub, Payload, Stations
from slewctl.arm.profiles import Profile, ProfileSpec

__all__ = ["Arm", "Beam", "Hub", "Payload", "Profile", "ProfileSpec", "Stations"]
