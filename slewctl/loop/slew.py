"""A slew: the response of a closed loop to a smooth turn of the reference angle."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
from scipy.linalg import expm

from slewctl._show import Axes, DataFrame, axes_or_new, to_frame
from slewctl._types import Array, BoolArray
from slewctl.errors import InputError, check_count, check_number, check_positive
from slewctl.loop.closed import Loop
from slewctl.loop.sampled import SampledLoop
from slewctl.loop.sampled_motion import sampled_motion
from slewctl.plant import state_space
from slewctl.plant.signals import TORQUE, signal

# The summary looks between the points of the curves.
_OVERSAMPLING = 4
# Relative: an instant this little after the end is the end.
_ROUNDING = 1e-12
_WATCHED = ("theta", "theta_dot", "tip", "tip_deflection")


@dataclass(frozen=True)
class Slew:
    """A rest-to-rest turn along a quintic polynomial (minimum jerk).

    Parameters
    ----------
    angle_deg : float
        Angle turned, not zero.
    duration_s : float
        Time that the reference takes.
    horizon_s : float, optional
        Time simulated, longer than the duration; by default three times as long.

    Raises
    ------
    InputError
        For no turn, or times that are not positive or too short.
    """

    angle_deg: float
    duration_s: float
    horizon_s: float | None = None

    def __post_init__(self) -> None:
        if check_number(self.angle_deg, "slew.angle_deg") == 0:
            raise InputError("no turn", where="slew.angle_deg", remedy="give an angle")
        check_positive(self.duration_s, "slew.duration_s")
        if self.horizon_s is not None:
            check_positive(self.horizon_s, "slew.horizon_s")
            if self.horizon_s <= self.duration_s:
                raise InputError(
                    f"{self.horizon_s:g} s ends before the slew of {self.duration_s:g} s",
                    where="slew.horizon_s",
                    remedy="make it longer than slew.duration_s",
                )

    @property
    def end(self) -> float:
        """Time simulated, in s."""
        return 3 * self.duration_s if self.horizon_s is None else self.horizon_s

    def reference(self, t: Array) -> tuple[Array, Array, Array]:
        """Return angle (rad), rate and acceleration of the reference at times t."""
        T, angle = self.duration_s, np.radians(self.angle_deg)
        s = np.clip(t / T, 0.0, 1.0)
        return (
            angle * s**3 * (10 - 15 * s + 6 * s**2),
            angle / T * 30 * s**2 * (1 - s) ** 2,
            angle / T**2 * 60 * s * (1 - s) * (1 - 2 * s),
        )


@dataclass(frozen=True)
class SlewSummary:
    """A slew in a few numbers.

    Attributes
    ----------
    settling_time_s : float
        When the tip has come within 2 % of its travel for good; infinite if it has not.
    residual_m : float
        Largest tip error after the reference has come to rest; infinite if it never does.
    peak_torque : float
        Largest |torque| on the hub in N·m.
    peak_voltage : float or None
        Largest |voltage| in V; None for an arm without a motor.
    saturates : bool
        Whether a peak exceeds the motor's torque or voltage limit: the slew as simulated,
        which knows no limits, is then not what the arm would do.
    """

    settling_time_s: float
    residual_m: float
    peak_torque: float
    peak_voltage: float | None = None
    saturates: bool = False
    overshoot: float = 0.0


@dataclass(frozen=True, eq=False)
class SlewResponse:
    """What the arm does during a slew.

    Attributes
    ----------
    t : ndarray
        Times in s.
    theta, tip, tip_deflection, torque : ndarray
        rad, m, m and N·m; the torque is that on the hub.
    actuator : ndarray
        What the controller commands: the torque, or the motor's voltage in V.
    tip_reference : ndarray
        (r + L) θ_ref in m.
    summary : SlewSummary
    """

    t: Array
    theta: Array
    tip: Array
    tip_deflection: Array
    torque: Array
    actuator: Array
    tip_reference: Array
    summary: SlewSummary

    def to_frame(self) -> DataFrame:
        """Return the curves as a pandas data frame, one time a row."""
        names = ("t", "theta", "tip", "tip_deflection", "torque", "tip_reference")
        columns = [getattr(self, name).tolist() for name in names]
        return to_frame([dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the tip and where it should be.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        ax = axes_or_new(ax)
        ax.plot(self.t, self.tip_reference, lw=4, alpha=0.4, label="wanted")
        ax.plot(self.t, self.tip, label="tip")
        ax.set_xlabel("time (s)")
        ax.set_ylabel("tip (m)")
        ax.legend()
        return ax


def simulate_slew(loop: Loop, slew: Slew, points: int = 401) -> SlewResponse:
    """Return the response of a stable loop to `slew`.

    The controller is given y − y_ref, where y_ref is what each sensor would read on a rigid
    arm; the torque J θ̈_ref + c θ̇_ref that would turn the rigid arm is added, or the voltage
    that makes the motor give it.  c is the drag on the rigid rotation: the friction at the
    hub and the mass-proportional damping.

    A sampled controller is given y − y_ref of each sampling instant.  The torque added to
    what it computes at t_k is the mean of the same expression over the time that it is held,
    from t_k + delay to t_{k+1} + delay.

    Parameters
    ----------
    loop : Loop
    slew : Slew
    points : int
        Number of times of the curves, at least 3; the response is exact at each of them.
        The summary is read from four times as many.  Of a sampled loop they are about so
        many of the samples and times between them.

    Raises
    ------
    UnstableLoopError
        If the loop is unstable.
    InputError
        For less than three points.
    """
    loop.require_stable("a slew response")
    check_count(points, "points", 3)
    steps = _OVERSAMPLING * (points - 1)
    t, outputs = (
        _sampled(loop, slew, steps)
        if isinstance(loop, SampledLoop)
        else _propagated(loop, slew, steps)
    )
    theta, theta_dot, tip, deflection, actuator = outputs
    torque, voltage = _torque_and_voltage(loop, actuator, theta_dot)
    reach = loop.model.arm.hub.radius + loop.model.arm.beam.length
    travel = reach * np.radians(slew.angle_deg)
    settled = _settling(t, tip - travel, abs(travel), t >= slew.duration_s)
    summary = _summary(loop, settled, torque, voltage)
    kept = slice(None, None, max(_OVERSAMPLING * (len(t) - 1) // steps, 1))
    wanted = reach * slew.reference(t)[0]
    return SlewResponse(
        t[kept],
        theta[kept],
        tip[kept],
        deflection[kept],
        torque[kept],
        actuator[kept],
        wanted[kept],
        summary,
    )


def _propagated(loop: Loop, slew: Slew, steps: int) -> tuple[Array, Array]:
    """Return times and outputs of the tracking loop, exact at the times.

    The reference is a polynomial in time: with its five derivatives as further states the
    loop runs by itself, and its matrix exponential is exact however coarse the times are.
    """
    system = _tracking_system(loop)
    T, angle = slew.duration_s, np.radians(slew.angle_deg)
    # Derivative k of the reference is angle/T^k times state k.
    motion = [angle, angle / T, angle / T**2]
    drive = np.zeros((system.ninputs, 6))
    for k, size in enumerate(motion):
        unit = [size * float(j == k) for j in range(3)]
        drive[:, k] = [*_rigid_readings(loop, *unit), _feedforward(loop, *unit[1:])]
    A, B, C, D = (np.asarray(getattr(system, name)) for name in "ABCD")
    n = len(A)
    whole = np.block([[A, B @ drive], [np.zeros((6, n)), np.eye(6, k=1) / T]])
    out = np.hstack([C, D @ drive])
    moving = max(round(steps * T / slew.end / _OVERSAMPLING), 1) * _OVERSAMPLING
    state = np.concatenate([np.zeros(n), [0, 0, 0, 60, -360, 720]])
    states = [state]
    for count, span in ((moving, T), (max(steps - moving, 1), slew.end - T)):
        step = expm(whole * (span / count))
        for _ in range(count):
            states.append(step @ states[-1])
        # Come to rest: the derivatives of the reference end where it does.
        states[-1] = np.concatenate([states[-1][:n], [1.0, 0, 0, 0, 0, 0]])
    t = np.concatenate(
        [np.linspace(0, T, moving + 1), np.linspace(T, slew.end, max(steps - moving, 1) + 1)[1:]]
    )
    return t, out @ np.array(states).T


def _sampled(loop: SampledLoop, slew: Slew, steps: int) -> tuple[Array, Array]:
    """Return times and outputs of a sampled loop, about so many times and exact at each."""
    T, delay = loop.sample_time, loop.controller.delay
    samples = int(slew.end / T * (1 + _ROUNDING)) + 1
    instants = T * np.arange(samples + 1.0)
    readings = np.array([_rigid_readings(loop, *unit) for unit in np.eye(3)])
    motion = np.array(slew.reference(instants[:-1]))
    # Each input acts from one of these times to the next.
    angle, rate, _ = slew.reference(delay + instants)
    means = zip(np.diff(angle) / T, np.diff(rate) / T, strict=True)
    forward = np.array([_feedforward(loop, *mean) for mean in means])
    watched = state_space(loop.model, _WATCHED, input=loop.objective.actuator, coordinates="modal")
    substeps = -(-steps // samples)
    t, outputs = sampled_motion(loop, watched, motion.T @ readings, forward, substeps)
    simulated = t <= slew.end * (1 + _ROUNDING)
    return t[simulated], outputs[:, simulated]


def _feedforward(loop: Loop, rate: float, acceleration: float) -> float:
    """Return the actuator's signal that would turn the rigid arm along the reference."""
    model = loop.model
    # The first rows of M and D are those of the rigid rotation.
    torque = model.mass[0, 0] * acceleration + model.damping[0, 0] * rate
    motor = model.arm.motor
    if loop.objective.actuator == TORQUE or motor is None:
        return float(torque)
    return float(motor.voltage(torque, rate))


def _torque_and_voltage(loop: Loop, actuator: Array, rate: Array) -> tuple[Array, Array | None]:
    """Return the torque on the hub and the motor's voltage, if the arm has a motor."""
    motor = loop.model.arm.motor
    if motor is None:
        return actuator, None
    if loop.objective.actuator == TORQUE:
        return actuator, motor.voltage(actuator, rate)
    return motor.torque(actuator, rate), actuator


def _settling(t: Array, error: Array, travel: float, resting: BoolArray) -> tuple[float, float]:
    """Return the settling time and the residual (see `SlewSummary`)."""
    outside = np.flatnonzero(np.abs(error) > 0.02 * travel)
    settled = int(outside[-1]) + 1 if len(outside) else 0
    return (
        float(t[settled]) if settled < len(t) else np.inf,
        float(np.abs(error[resting]).max()) if resting.any() else np.inf,
    )


def _summary(
    loop: Loop, settled: tuple[float, float], torque: Array, voltage: Array | None
) -> SlewSummary:
    motor = loop.model.arm.motor
    peak_torque = float(np.abs(torque).max())
    if motor is None or voltage is None:
        return SlewSummary(*settled, peak_torque)
    peak_voltage = float(np.abs(voltage).max())
    saturates = motor.saturates(peak_torque, peak_voltage)
    return SlewSummary(*settled, peak_torque, peak_voltage, saturates)


def _rigid_readings(loop: Loop, angle: float, rate: float, acceleration: float) -> list[float]:
    """Return what each sensor would read if the arm were rigid."""
    motion = {"displacement": angle, "rate": rate, "acceleration": acceleration}
    readings = []
    for name in loop.controller.sensors:
        sensor = signal(name, beam=loop.model.arm.beam)
        readings.append(float(sensor.row(loop.model)[0] * motion[sensor.of]))
    return readings


def _tracking_system(loop: Loop) -> control.StateSpace:
    """Return the loop from [sensor references, feedforward] to [θ, θ̇, tip, v(L), actuator]."""
    actuator = loop.objective.actuator
    watched = state_space(loop.model, _WATCHED, input=actuator, coordinates="modal")
    G, K = loop.plant.control_path, loop.controller.system
    Ak, Bk, Ck, Dk = (np.asarray(m) for m in (K.A, K.B, K.C, K.D))
    B, C = np.asarray(G.B), np.asarray(G.C)
    A = np.block([[G.A + B @ Dk @ C, B @ Ck], [Bk @ C, Ak]])
    inputs = np.block([[-B @ Dk, B], [-Bk, np.zeros((K.nstates, 1))]])
    outputs = np.block(
        [[np.asarray(watched.C), np.zeros((len(_WATCHED), K.nstates))], [Dk @ C, Ck]]
    )
    through = np.zeros((len(_WATCHED) + 1, inputs.shape[1]))
    through[-1] = np.concatenate([-Dk[0], [1.0]])
    return control.StateSpace(
        A,
        inputs,
        outputs,
        through,
        inputs=[*(f"{name}_ref" for name in loop.controller.sensors), f"{actuator}_forward"],
        outputs=[*_WATCHED, actuator],
    )
