"""Arms of the catalogue that nobody has built, to show how one is described."""

from __future__ import annotations

from slewctl.arm.beam import Beam
from slewctl.arm.hub import Hub
from slewctl.arm.joint import Joint
from slewctl.arm.masses import LumpedMass, Payload
from slewctl.arm.modal_data import ModalData, Place
from slewctl.arm.motor import Motor
from slewctl.arm.parts import Arm


def two_wing_satellite() -> Arm:
    """Return a satellite with two equal wings, as a data sheet tells of it.

    Made up: a bus of 900 kg·m² and two uniform wings of 8 m and 40 kg, clamped 1 m from the
    axis, with a first frequency of 0.25 Hz.  The figures are rounded as a sheet would be, and
    of both wings together, which bend alike.
    """
    return Arm(
        ModalData(
            inertia=3327.0,
            frequencies_hz=(0.25, 1.567, 4.387),
            coupling=(47.71, 10.38, 4.595),
            places=(
                Place("tip", lever=9.0, shapes=(0.2236, -0.2236, 0.2236)),
                Place("root", moments=(100.4, 629.4, 1762.0)),
            ),
        ),
        name="satellite with two wings",
    )


def ruler_on_servo() -> Arm:
    """Return a steel ruler on a laboratory servo, with an accelerometer on its way.

    Made up: a ruler of 0.6 m, 30 mm by 1.2 mm, clamped 20 mm from the axis, an accelerometer
    of 12 g at 0.45 m and a screw of 8 g at the tip.
    """
    ruler = Beam.rectangular(
        0.6, width=0.03, thickness=0.0012, youngs_modulus=2.0e11, density=7850.0
    )
    return Arm(
        ruler,
        Hub(inertia=0.004, radius=0.02, friction=0.01),
        Payload(mass=0.008),
        masses=(LumpedMass(0.45, mass=0.012),),
        damping_modes="hub-locked",
        name="ruler on a servo",
    )


def harmonic_drive_boom() -> Arm:
    """Return a made-up boom of 1 m with a payload of 1 kg, on a harmonic drive of ratio 100."""
    motor = Motor(
        resistance=0.8,
        torque_constant=0.1,
        back_emf_constant=0.1,
        gear_ratio=100.0,
        gear_efficiency=0.7,
        rotor_inertia=2e-5,
        torque_limit=80.0,
        voltage_limit=48.0,
    )
    joint = Joint(stiffness=3000.0, damping=1.0, rotor_friction=2.0)
    return Arm(
        Beam(1.0, mass_per_length=1.6, bending_stiffness=1000.0),
        Hub(inertia=0.05, radius=0.06),
        Payload(mass=1.0, inertia=0.002),
        motor=motor,
        joint=joint,
        name="harmonic drive boom",
    )
