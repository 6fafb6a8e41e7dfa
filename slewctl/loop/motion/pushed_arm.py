"""An arm with all that pushes on it: the linear equations, and what joins them.

In modes η and their momenta π the equations of a large slew are those of the linear arm, of
which the rates are η̇ = π − δθ̇t, and θ̇²S̃η beside them (see `modal_equations`).  An elastic
joint's play takes k·clip(twist, ±b) from its spring.
"""

from __future__ import annotations

import math

import numpy as np

from slewctl._types import Array
from slewctl.loop.closed import Loop
from slewctl.loop.motion.conditions import Conditions
from slewctl.model.nonlinear import large_slew
from slewctl.plant import arm_signals
from slewctl.plant.signals import TORQUE, signal
from slewctl.plant.statespace import APPLIED

# What is held over a step: the command, a torque where the motor's acts, one on the hub, and a
# force on the tip.
COMMAND, AT_MOTOR, ON_HUB, ON_TIP = range(4)
PUSHES = 4
# Of a limit: what rounding leaves between it and what follows from a command that was cut there.
_AT_LIMIT = 1e-12
# What is read off the arm's states; the last is what the actuator applies.
SEEN = ("theta", "theta_dot", "theta_motor", "theta_motor_dot", "tip", "tip_deflection", APPLIED)


class PushedArm:
    """The arm of a loop under conditions.

    Parameters
    ----------
    loop : Loop
    conditions : Conditions

    Attributes
    ----------
    A, B : ndarray, shapes (n, n), (n, PUSHES)
    C : ndarray, shape (sensors, n)
        Readings.
    seen, through : ndarray, shapes (signals, n), (signals,)
        `SEEN`, of the states and of the command.
    """

    def __init__(self, loop: Loop, conditions: Conditions) -> None:
        model, plant = loop.model, loop.plant
        self.loop, self.conditions = loop, conditions
        self.A, self.C = np.asarray(plant.A), np.asarray(plant.C2)
        watched = arm_signals(plant, SEEN)
        self.seen, self.through = np.asarray(watched.C), np.asarray(watched.D)[:, 0]
        U, self.size = model.mode_shapes, model.n + 1
        tip = signal("tip", beam=model.arm.beam).row(model)
        self.B = np.zeros((len(self.A), PUSHES))
        self.B[:, COMMAND] = np.asarray(plant.B2)[:, 0]
        for place, row in ((AT_MOTOR, model.input), (ON_HUB, model.turning), (ON_TIP, tip)):
            self.B[self.size : 2 * self.size, place] = row @ U
        self._rotor = np.array(U[0])
        self._reads_rates = bool(self.C[:, self.size : 2 * self.size].any())
        self._squared = np.concatenate([[0.0], model.omega**2])
        self._twist = (model.turning - np.eye(self.size)[0]) @ U
        self._play = math.radians(conditions.backlash_deg) / 2
        self._spring = model.arm.joint.stiffness if model.arm.joint else 0.0
        self.equations = large_slew(model) if conditions.nonlinear else None
        self._lost: Array | None = None
        if self.equations is not None:
            self._softening = U[1:].T @ self.equations.softening @ U[1:]
            self._hub = self.equations.turning
            self._rotor_of_hub = float(self._rotor @ self._hub)
            self._compliance = float(self._hub @ self._hub)

    @property
    def linear(self) -> bool:
        """Whether nothing joins the linear equations between two steps."""
        return self.equations is None and not self._play

    def slowed(self, x: Array) -> Array:
        """Return states with the rates η̇ in the places of the momenta; rows of them too."""
        if self.equations is None:
            return x
        change, rate = self._turning(x)
        moved = np.array(x)
        lost = np.multiply.outer(change * rate, self._hub)
        moved[..., self.size : 2 * self.size] -= lost
        return moved

    def _turning(self, x: Array) -> tuple[Array, Array]:
        """Return δ and θ̇ of a state, or of rows of them."""
        eta = x[..., : self.size]
        pull = eta @ self._softening
        change = (eta * pull).sum(axis=-1)
        meeting = 1 + change * self._compliance
        if not np.all(meeting > 0) and self.equations is not None:
            worst = np.atleast_2d(eta)[int(np.argmin(np.atleast_1d(meeting)))]
            raise self.equations.excessive(self.loop.model.mode_shapes[1:] @ worst)
        return change, x[..., self.size : 2 * self.size] @ self._hub / meeting

    def readings(self, x: Array) -> Array:
        """Return what the sensors read of one state."""
        return np.asarray(self.C @ (self.slowed(x) if self._reads_rates else x))

    def rotor_rate(self, x: Array) -> float:
        """Return the rate where the motor's torque acts, in rad/s, of one state."""
        size = self.size
        momenta = x[size : 2 * size]
        rate = float(self._rotor @ momenta)
        if self.equations is None:
            return rate
        eta = x[:size]
        change = float(eta @ (self._softening @ eta))
        turning = float(self._hub @ momenta) / (1 + change * self._compliance)
        return rate - change * turning * self._rotor_of_hub

    def remainder(self, x: Array, A: Array) -> Array:
        """Return what joins A x, of a matrix whose first states are the arm's."""
        size = self.size
        found = np.zeros(len(A))
        if self.equations is not None:
            # As `_turning`, of one state: a thousand times a second.
            eta = x[:size]
            pull = self._softening @ eta
            change = float(eta @ pull)
            meeting = 1 + change * self._compliance
            if not meeting > 0:
                raise self.equations.excessive(self.loop.model.mode_shapes[1:] @ eta)
            rate = float(x[size : 2 * size] @ self._hub) / meeting
            found += (-change * rate) * self._turned(A)
            found[size : 2 * size] += rate**2 * pull
        if self._play:
            twist = float(self._twist @ x[:size])
            free = self._spring * min(max(twist, -self._play), self._play)
            found[size : 2 * size] += free * self._twist
        return found

    def _turned(self, A: Array) -> Array:
        """Return what a rate of all modes as of the hub's turning does in A."""
        if self._lost is None:
            self._lost = A[:, self.size : 2 * self.size] @ self._hub
        return self._lost

    def energy(self, x: Array) -> Array:
        """Return the kinetic and elastic energy of rows of states, in J."""
        eta, momenta = x[:, : self.size], x[:, self.size : 2 * self.size]
        rates = self.slowed(x)[:, self.size : 2 * self.size]
        twist = eta @ self._twist
        free = np.clip(twist, -self._play, self._play)
        elastic = (eta**2) @ self._squared + self._spring * ((twist - free) ** 2 - twist**2)
        return np.asarray(((momenta * rates).sum(axis=1) + elastic) / 2)


class Limits:
    """What becomes of a command: motor and actuator have so much torque and voltage."""

    def __init__(self, loop: Loop, conditions: Conditions) -> None:
        arm = loop.model.arm
        self._motor = arm.motor
        self._commands_torque = loop.objective.actuator == TORQUE
        found = [arm.drive.torque_limit, arm.motor.torque_limit if arm.motor else None]
        torque = min((limit for limit in found if limit is not None), default=math.inf)
        voltage = (arm.motor.voltage_limit if arm.motor else None) or math.inf
        self.on = conditions.saturate
        self._own, self._other = (torque, voltage) if self._commands_torque else (voltage, torque)
        self.of_speed = self.on and math.isfinite(self._other)

    def held(self, command: float, speed: float) -> float:
        """Return a command as the drive gives it at a speed of the rotor, in rad/s."""
        if not self.on:
            return command
        motor = self._motor
        if self.of_speed and motor is not None:
            if self._commands_torque:
                ends = [float(motor.torque(end * self._other, speed)) for end in (-1, 1)]
            else:
                ends = [float(motor.voltage(end * self._other, speed)) for end in (-1, 1)]
            command = min(max(command, ends[0]), ends[1])
        return min(max(command, -self._own), self._own)

    def met(self, other: Array) -> Array:
        """Return torque or voltage, whichever is not commanded, at its limit where it was cut.

        What follows from a command that was cut there is the limit but for rounding.
        """
        if not self.of_speed:
            return other
        there = np.abs(np.abs(other) - self._other) <= _AT_LIMIT * self._other
        return np.where(there, np.copysign(self._other, other), other)
