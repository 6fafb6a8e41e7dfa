"""Simulation of a slew whose hub angle is given: a servo so stiff that the arm cannot move it.

With θ(t) given the second row of the equations is linear in q,

    M_e q̈ + D_qq q̇ + [K_e − θ̇² S] q = −Φ̃ᵀθ̈ − D_qθ θ̇,

and the first says which torque the servo gives.  In the modes with the hub held, p, the stiff
part is implicit; θ̇²S changes with time, which is carried along as a state of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.errors import InputError, check_positive, shown
from slewctl.loop.motion.gauss_collocation import GaussCollocation, Step, gauss_nodes
from slewctl.loop.motion.large_slew import Swing, swing_times
from slewctl.loop.motion.slew_inputs import Slew
from slewctl.model.assembly import factors
from slewctl.model.nonlinear import NonlinearModel
from slewctl.model.ritz import ritz_modes
from slewctl.model.spin import warn_of_softening

Angle = Callable[[float], Sequence[float]] | Slew


@single_threaded
def simulate_turned_hub(
    equations: NonlinearModel, t: Array, angle: Angle, *, rtol: float = 1e-7
) -> Swing:
    """Return the motion of an arm whose hub is turned as given, whatever torque that takes.

    Parameters
    ----------
    equations : NonlinearModel
    t : ndarray, shape (N,)
        Increasing times in s at which the motion is wanted; at the first the arm is straight
        and turns rigidly.
    angle : callable or Slew
        Returns θ (rad), θ̇ (rad/s) and θ̈ (rad/s²) at a time in s.
    rtol : float
        Error allowed in a step relative to the largest rate so far, 1e-13 at least.

    Returns
    -------
    Swing
        `Swing.torque` is what the servo gives.

    Warns
    -----
    SpinSofteningWarning
        If, without stiffening, θ̇ passes the rate beyond which the deflection diverges.

    Raises
    ------
    InputError
        If times do not increase, `angle` returns something else than three finite numbers, or
        the arm has an elastic joint.
    AccuracyError
        If the tolerance cannot be met.

    Examples
    --------
    >>> import numpy as np
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> equations = sc.large_slew(sc.assemble(arm, "clamped-free", n=2))
    >>> turned = sc.simulate_turned_hub(equations, np.linspace(0, 4, 5), sc.Slew(30.0, 4.0))
    >>> np.degrees(turned.theta).round(2).tolist()
    [0.0, 3.11, 15.0, 26.89, 30.0]
    """
    if not isinstance(equations, NonlinearModel):
        raise InputError(
            f"{shown(equations)} is not a nonlinear model",
            where="simulate_turned_hub",
            remedy="give one, as from large_slew",
        )
    if equations.linear.arm.joint is not None:
        raise InputError(
            "behind an elastic joint a servo turns the rotor, and the hub follows as it can",
            where="simulate_turned_hub",
            remedy="leave the arm's joint out, if its hub is turned as given",
        )
    wanted = swing_times(t, "simulate_turned_hub.t")
    tolerance = max(check_positive(rtol, "simulate_turned_hub.rtol"), 1e-13)
    return _Turned(equations, _Given(angle)).swing(wanted, tolerance)


class _Given:
    """The hub's motion at many times."""

    def __init__(self, angle: Angle) -> None:
        if not isinstance(angle, Slew) and not callable(angle):
            raise InputError(
                f"{shown(angle)} is not a function of the time",
                where="simulate_turned_hub.angle",
                remedy="give a slewctl.Slew, or a function that returns θ, θ̇ and θ̈",
            )
        self._angle = angle

    def __call__(self, times: Array) -> Array:
        """Return [θ, θ̇, θ̈], shape (3, len(times))."""
        if isinstance(self._angle, Slew):
            return np.asarray(self._angle.reference(times))
        found = [self._angle(float(time)) for time in times]
        values = np.array(found, dtype=float) if all(np.shape(f) == (3,) for f in found) else None
        if values is None or not np.all(np.isfinite(values)):
            raise InputError(
                f"{shown(found[0])} is not three finite numbers",
                where="simulate_turned_hub.angle",
                remedy="return θ in rad, θ̇ and θ̈ for every time simulated",
            )
        return np.asarray(values.T)


class _Turned:
    """The deflection in the modes with the hub held, y = [ωp, ṗ, t]."""

    def __init__(self, equations: NonlinearModel, given: _Given) -> None:
        model = equations.linear
        self.equations, self._given = equations, given
        held = ritz_modes(factors(model.arm, model.basis), "hub-locked")
        self._V, self._w = held.shapes, held.omega
        V, n = self._V, model.n
        self._coupling, self._drag = V.T @ model.mass[1:, 0], V.T @ model.damping[1:, 0]
        self._softening = V.T @ equations.softening @ V
        self._A = np.zeros((2 * n + 1, 2 * n + 1))
        self._A[:n, n : 2 * n] = np.diag(self._w)
        self._A[n : 2 * n, :n] = -np.diag(self._w)
        self._A[n : 2 * n, n : 2 * n] = -V.T @ model.damping[1:, 1:] @ V

    def _forcing(self, times: Array) -> Array:
        n = len(self._w)
        _, rate, acceleration = self._given(times)
        g = np.zeros((len(times), 2 * n + 1))
        g[:, n : 2 * n] = -np.outer(acceleration, self._coupling) - np.outer(rate, self._drag)
        g[:, -1] = 1.0
        return g

    def _remainder(self, y: Array) -> Array:
        n = len(self._w)
        rate = self._given(y[:, -1])[1]
        f = np.zeros_like(y)
        f[:, n : 2 * n] = (rate**2)[:, None] * ((y[:, :n] / self._w) @ self._softening)
        return f

    def _motion(self, times: Array, y: Array) -> tuple[Array, Array, Array]:
        """Return states [θ, q, θ̇, q̇], the torque and the power that damping takes."""
        n, model = len(self._w), self.equations.linear
        theta, rate, acceleration = self._given(times)
        slopes = y @ self._A.T + self._forcing(times) + self._remainder(y)
        q, q_dot, q_ddot = (
            part @ self._V.T for part in (y[:, :n] / self._w, y[:, n : 2 * n], slopes[:, n : 2 * n])
        )
        rates = np.column_stack([rate, q_dot])
        Sq = q @ self.equations.softening
        drag = rates @ model.damping
        torque = (
            (model.mass[0, 0] + (q * Sq).sum(axis=1)) * acceleration
            + 2 * rate * (Sq * q_dot).sum(axis=1)
            + q_ddot @ model.mass[1:, 0]
            + drag[:, 0]
        )
        states = np.column_stack([theta, q, rates])
        return states, torque, (drag * rates).sum(axis=1)

    def swing(self, t: Array, rtol: float) -> Swing:
        """Return the motion at the times wanted."""
        n, equations, model = len(self._w), self.equations, self.equations.linear
        found = np.zeros((len(t), 2 * n + 1))
        found[:, -1] = t
        counted = np.append(np.ones(2 * n), 0.0)
        seen = self._forcing(np.linspace(t[0], t[-1], 257))[:, n : 2 * n]
        floor = float(np.linalg.norm(seen, axis=1).max()) * min(1 / self._w[0], t[-1] - t[0])
        solver = GaussCollocation(self._A, self._forcing, self._remainder, counted, rtol, floor)
        ends, work, filled, fastest = [found[0]], [0.0], 1, 0.0
        last: Step | None = None
        for last in solver.steps(found[0], [(t[0], t[-1] - t[0])], 0.5 / float(self._w[0])):
            upto = int(np.searchsorted(t, last.start + last.h, side="right"))
            found[filled:upto] = last.at(t[filled:upto])
            filled = max(filled, upto)
            states, torque, lost = self._motion(last.times, last.stages)
            power = torque * states[:, n + 1] - lost
            fastest = max(fastest, float(np.abs(states[:, n + 1]).max()))
            work.append(work[-1] + last.h * float(gauss_nodes(len(power)).weights @ power))
            ends.append(last.end)
        if last is not None:  # rounding may have left the last time out
            found[filled:] = last.at(t[filled:])
        if fastest > equations.critical_spin_rad_s:
            warn_of_softening(fastest, equations.critical_spin_rad_s)
        states, torque, _ = self._motion(t, found)
        at_ends = np.array(ends)
        energy = equations.energy(self._motion(at_ends[:, -1], at_ends)[0])
        balance = float(np.abs(energy - energy[0] - work).max())
        x, rates = np.split(states, 2, axis=1)
        tip = model.displacement(np.array([model.arm.beam.length]))[0]
        return Swing(
            t=t,
            theta=x[:, 0],
            theta_motor=x[:, 0],
            q=x[:, 1:],
            theta_dot=rates[:, 0],
            theta_motor_dot=rates[:, 0],
            q_dot=rates[:, 1:],
            tip=x @ tip,
            tip_deflection=x[:, 1:] @ tip[1:],
            torque=torque,
            energy=equations.energy(states),
            energy_error=balance / max(float(energy.max()), np.finfo(float).tiny),
            steps=len(work) - 1,
        )
