"""A slew: the response of a closed loop to a smooth turn of the reference angle."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np

from slewctl._types import Array, BoolArray
from slewctl.errors import check_number, check_positive
from slewctl.loop.closed import Loop
from slewctl.plant import SIGNALS, TORQUE, state_space

_WATCHED = ("theta", "tip", "tip_deflection")


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
        Time simulated; by default three times the duration.
    """

    angle_deg: float
    duration_s: float
    horizon_s: float | None = None

    def __post_init__(self) -> None:
        check_positive(abs(check_number(self.angle_deg, "slew.angle_deg")), "|slew.angle_deg|")
        check_positive(self.duration_s, "slew.duration_s")
        if self.horizon_s is not None:
            check_positive(self.horizon_s, "slew.horizon_s")

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
    """A slew in three numbers.

    Attributes
    ----------
    settling_time_s : float
        When the tip has come within 2 % of its travel for good; infinite if it has not.
    residual_m : float
        Largest tip error after the reference has come to rest; infinite if it never does.
    peak_torque : float
        Largest |torque| in N·m.
    """

    settling_time_s: float
    residual_m: float
    peak_torque: float


@dataclass(frozen=True, eq=False)
class SlewResponse:
    """What the arm does during a slew.

    Attributes
    ----------
    t : ndarray
        Times in s.
    theta, tip, tip_deflection, torque : ndarray
        rad, m, m and N·m.
    tip_reference : ndarray
        (r + L) θ_ref in m.
    summary : SlewSummary
    """

    t: Array
    theta: Array
    tip: Array
    tip_deflection: Array
    torque: Array
    tip_reference: Array
    summary: SlewSummary


def simulate_slew(loop: Loop, slew: Slew, points: int = 601) -> SlewResponse:
    """Return the response of a stable loop to `slew`.

    The controller is given y − y_ref, where y_ref is what each sensor would read on a rigid
    arm; the torque J θ̈_ref that would turn the rigid arm is added.

    Parameters
    ----------
    loop : Loop
    slew : Slew
    points : int
        Number of times; between them the inputs are taken as linear.

    Raises
    ------
    UnstableLoopError
        If the loop is unstable.
    """
    loop.require_stable("a slew response")
    t = np.linspace(0.0, slew.end, points)
    angle, rate, acceleration = slew.reference(t)
    system = _tracking_system(loop)
    forward = loop.model.mass[0, 0] * acceleration + loop.model.arm.hub.friction * rate
    inputs = np.vstack([*_rigid_readings(loop, angle, rate, acceleration), forward])
    outputs = control.forced_response(system, t, inputs).outputs
    theta, tip, deflection, torque = outputs
    reach = loop.model.arm.hub.radius + loop.model.arm.beam.length
    travel = reach * np.radians(slew.angle_deg)
    summary = _summary(t, tip - travel, abs(travel), torque, t >= slew.duration_s)
    return SlewResponse(t, theta, tip, deflection, torque, reach * angle, summary)


def _summary(
    t: Array, error: Array, travel: float, torque: Array, resting: BoolArray
) -> SlewSummary:
    outside = np.flatnonzero(np.abs(error) > 0.02 * travel)
    settled = int(outside[-1]) + 1 if len(outside) else 0
    return SlewSummary(
        settling_time_s=float(t[settled]) if settled < len(t) else np.inf,
        residual_m=float(np.abs(error[resting]).max()) if resting.any() else np.inf,
        peak_torque=float(np.abs(torque).max()),
    )


def _rigid_readings(loop: Loop, angle: Array, rate: Array, acceleration: Array) -> list[Array]:
    """Return what each sensor would read if the arm were rigid."""
    motion = {"displacement": angle, "rate": rate, "acceleration": acceleration}
    readings = []
    for name in loop.controller.sensors:
        signal = SIGNALS[name]
        readings.append(signal.row(loop.model)[0] * motion[signal.of])
    return readings


def _tracking_system(loop: Loop) -> control.StateSpace:
    """Return the loop from [sensor references, added torque] to [θ, tip, deflection, torque]."""
    watched = state_space(loop.model, _WATCHED, coordinates="modal")
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
        inputs=[*(f"{name}_ref" for name in loop.controller.sensors), "torque_forward"],
        outputs=[*_WATCHED, TORQUE],
    )
