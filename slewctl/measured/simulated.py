"""A rig on the computer: the log that an arm would give, to plan a measurement or try a fit."""

from __future__ import annotations

from typing import Any

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.errors import (
    InputError,
    check_choice,
    check_count,
    check_nonnegative,
    check_positive,
    shown,
)
from slewctl.measured.dry_friction import RUBBED, at_the_drive, mean_sign
from slewctl.measured.log import Log
from slewctl.measured.rig_model import HeldRig, Modes, equations, hold
from slewctl.model.assembly import check_arm
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.dead_time import loop_dead_time
from slewctl.plant.signals import ACTUATORS, check_signals, signal
from slewctl.plant.statespace import Actuator, drive

# Steps of a sample in which dry friction is held.
_STEPS = 10


@single_threaded
def simulated_log(
    arm: Arm,
    excitation: Any,
    sample_time: float,
    *,
    actuator: str = "torque",
    sensor: str = "theta",
    modes: int = 20,
    gain: float = 1.0,
    delay: float = 0.0,
    noise: float = 0.0,
    counts_per_turn: float | None = None,
    dry_friction: float = 0.0,
    feedback: tuple[Any, Any] | None = None,
    seed: int = 0,
) -> Log:
    """Return the log of a rig that is this arm: held input, sampled and quantised output.

    Parameters
    ----------
    arm : Arm
    excitation : array_like, shape (n,)
        The input in N·m or V; with `feedback` the reference that the sensor is told to follow.
    sample_time : float
        In s.
    actuator : {"torque", "voltage"}
    sensor : str
    modes : int
        Of the truth.
    gain : float
        Of the actuator: what it gives of what it is told.
    delay : float
        Dead time in s, beside those that the arm's actuator and sensor have.
    noise : float
        Standard deviation of white noise on every sample, in the sensor's unit.
    counts_per_turn : float, optional
        Of an encoder: the sensor, an angle, is rounded to its steps.
    dry_friction : float
        Coulomb friction at the hub in N·m.
    feedback : tuple of two array_like, optional
        Numerator and denominator in z⁻¹ of a controller u = K(z)·(reference − y), computed at
        every sample.
    seed : int
        Of the noise.

    Returns
    -------
    Log
        From rest; with the reference where there is one.

    Raises
    ------
    InputError
        For what is impossible, such as counts of a sensor that is no angle.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.Beam(0.5, 0.3, 0.15), sc.Hub(0.003, friction=0.02), damping_ratio=0.01)
    >>> log = sc.simulated_log(arm, sc.prbs(1000, seed=1), 0.005, counts_per_turn=2048)
    >>> print(log)
    log from torque to theta: 1000 samples, 5 s at 0.005 s
      the output moves in steps of 0.003068 rad, 2048 a turn: ...
    """
    check_arm(arm, "simulated_log")
    T = check_positive(sample_time, "sample_time")
    check_choice(actuator, ACTUATORS, "actuator")
    for name, value in (("delay", delay), ("noise", noise), ("dry_friction", dry_friction)):
        check_nonnegative(value, name)
    try:
        told = np.asarray(excitation, dtype=float)
    except (TypeError, ValueError):
        told = np.zeros(0)
    if told.ndim != 1 or not len(told) or not np.isfinite(told).all():
        raise InputError(
            f"{shown(excitation)} is no signal",
            where="excitation",
            remedy="give one number for each sample, as from sc.prbs",
        )
    check_signals([sensor], "sensor", arm.beam)
    driven: Actuator = "voltage" if actuator == "voltage" else "torque"
    system = equations(arm, driven, sensor, Modes(check_count(modes, "modes")), beside=(RUBBED,))
    late = delay + loop_dead_time(arm, [sensor])
    disturbance = np.random.default_rng(seed).normal(0.0, 1.0, len(told)) * noise
    step = 0.0
    if counts_per_turn is not None:
        if signal(sensor).unit != "rad":
            raise InputError(
                f"{sensor} is no angle", where="counts_per_turn", remedy="leave it out"
            )
        step = 2 * np.pi / check_positive(counts_per_turn, "counts_per_turn")
    rubs = at_the_drive(arm, driven, sensor, Modes(modes))
    rig = _Rig(system, T, dry_friction / drive(arm, driven)[0], rubs)
    law = _Law(feedback) if feedback is not None else None
    inputs, output = rig.run(told, gain, late, disturbance, step, law)
    return Log(T, inputs, output, told if law else None, actuator, sensor)


class _Law:
    """A controller in z⁻¹, sample by sample."""

    def __init__(self, law: tuple[Any, Any]) -> None:
        num, den = (np.atleast_1d(np.asarray(part, dtype=float)) for part in law)
        if not len(den) or den[0] == 0:
            raise InputError("the denominator begins with 0", where="feedback", remedy="mend it")
        self.num, self.den = num / den[0], den[1:] / den[0]
        self.errors, self.inputs = np.zeros(len(self.num)), np.zeros(len(self.den))

    def __call__(self, error: float) -> float:
        self.errors = np.concatenate([[error], self.errors[:-1]])
        told = float(self.num @ self.errors - self.den @ self.inputs)
        self.inputs = np.concatenate([[told], self.inputs])[: len(self.den)]
        return told


class _Rig:
    """The arm, in steps of a sample, or of a tenth of one where dry friction is held in each."""

    def __init__(self, system: LinearSystem, sample_time: float, dry: float, rubs: Array) -> None:
        self.steps = _STEPS if dry else 1
        self.T = sample_time
        self.system = system
        self.dry = dry  # in the actuator's unit
        self.rubs = rubs

    def run(
        self, told: Array, gain: float, delay: float, noise: Array, step: float, law: _Law | None
    ) -> tuple[Array, Array]:
        """Return the inputs and the measured outputs."""
        h = self.T / self.steps
        rig = HeldRig.of(self.system, h, delay)
        friction = hold(self.system.A, self.rubs, h)[1]
        rate = self.system.C[-1]
        halts = self.dry * float(rate @ friction)
        through = float(self.system.D[0, 0])
        queue = np.zeros(rig.whole + 1 + self.steps * len(told))
        inputs, outputs = np.empty(len(told)), np.empty(len(told))
        x = np.zeros(len(rig.transition))
        for k in range(len(told)):
            first = self.steps * k
            due = slice(rig.whole + 1 + first, rig.whole + 1 + first + self.steps)
            if law is None:
                inputs[k] = told[k]
                queue[due] = gain * told[k]
            # What passes straight through is what is held at this instant.
            held = queue[first if rig.part or law else first + 1]
            y = float(rig.output @ x) + through * held + noise[k]
            outputs[k] = step * round(y / step) if step else y
            if law is not None:
                inputs[k] = law(told[k] - outputs[k])
                queue[due] = gain * inputs[k]
            for m in range(first, first + self.steps):
                x_next = rig.transition @ x + rig.now * queue[m + 1] + rig.before * queue[m]
                if self.dry:
                    sign = mean_sign(float(rate @ x), float(rate @ x_next), halts)
                    x_next -= friction * (self.dry * sign)
                x = x_next
        return inputs, outputs
