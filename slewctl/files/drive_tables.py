"""``[arm.joint]``, ``[arm.actuator]`` and ``[arm.sensors.SIGNAL]`` of a design file."""

from __future__ import annotations

from typing import Annotated

from slewctl.arm import Actuator, Joint, Sensor
from slewctl.files.table import NonNegative, Positive, Table, told


class JointTable(Table):
    """``[arm.joint]``."""

    stiffness: Annotated[Positive, told("N·m/rad", "on the output side of the gear", 100.0)]
    damping: Annotated[
        NonNegative, told("N·m·s/rad", "between rotor and hub, on the output side", 0.05)
    ] = Joint.damping
    rotor_inertia: Annotated[
        NonNegative,
        told("kg·m²", "on the output side, beside the motor's own times its ratio squared", 0.01),
    ] = Joint.rotor_inertia
    rotor_friction: Annotated[
        NonNegative, told("N·m·s/rad", "viscous, of the rotor, on the output side", 0.1)
    ] = Joint.rotor_friction


class SensorTable(Table):
    """``[arm.sensors.SIGNAL]``."""

    lag: Annotated[NonNegative, told("s", "time constant of a first-order lag", 0.001)] = Sensor.lag
    frequency_hz: Annotated[Positive | None, told("Hz", "of a second-order lag", 100.0)] = None
    damping_ratio: Annotated[
        Positive | None, told("1", "of the second-order lag; 0.7 by default", 0.7)
    ] = None
    delay: Annotated[
        NonNegative,
        told("s", "dead time; the same for all sensors measured together", 0.001),
    ] = Sensor.delay


class ActuatorTable(SensorTable):
    """``[arm.actuator]``."""

    delay: Annotated[NonNegative, told("s", "dead time, exact in margins", 0.002)] = Actuator.delay
    torque_limit: Annotated[
        Positive | None,
        told("N·m", "largest torque, without a motor; a slew says whether it passes it", 2.0),
    ] = None
