"""Simulation of a large slew: the nonlinear equations under a given torque."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._show import Axes, Described, axes_or_new
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_positive, shown
from slewctl.loop.motion.gauss_collocation import GaussCollocation, Step, gauss_nodes
from slewctl.loop.motion.modal_equations import ModalForm
from slewctl.model.nonlinear import NonlinearModel
from slewctl.model.spin import warn_of_softening

_TOGETHER = 256  # intervals, a power of two

Torque = Callable[[float], float] | Sequence[float] | Array | float


@dataclass(frozen=True, eq=False, repr=False)
class Swing(Described):
    """How the arm moves in a large slew.

    Attributes
    ----------
    t : ndarray, shape (N,)
        Times in s.
    theta, theta_dot : ndarray, shape (N,)
        Of the hub, rad and rad/s.
    theta_motor, theta_motor_dot : ndarray, shape (N,)
        Of the rotor: behind an elastic joint not those of the hub.
    q, q_dot : ndarray, shape (N, n)
        Coordinates of the deflection, the twist of a joint first, and their rates.
    tip, tip_deflection : ndarray, shape (N,)
        Along the arc and relative to the turned axis, in m.
    torque : ndarray, shape (N,)
        N·m.
    energy : ndarray, shape (N,)
        Kinetic and elastic, in J.
    energy_error : float
        Largest difference between the energy and the work done on the arm less what it
        dissipates, over the largest energy: an independent check of the integration.
    steps : int
        Steps taken.
    """

    t: Array
    theta: Array
    theta_motor: Array
    q: Array
    theta_dot: Array
    theta_motor_dot: Array
    q_dot: Array
    tip: Array
    tip_deflection: Array
    torque: Array
    energy: Array
    energy_error: float
    steps: int

    def __str__(self) -> str:
        turned = np.degrees(self.theta[-1] - self.theta[0])
        return (
            f"swing by {turned:.4g}° in {self.t[-1] - self.t[0]:.4g} s: deflection up to "
            f"{np.abs(self.tip_deflection).max():.3g} m, energy kept to {self.energy_error:.0e}"
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the deflection of the tip over time.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        ax = axes_or_new(ax)
        ax.plot(self.t, self.tip_deflection)
        ax.set_xlabel("time (s)")
        ax.set_ylabel("tip deflection (m)")
        return ax

    @property
    def states(self) -> Array:
        """[θ_m, q, θ̇_m, q̇] at each time, shape (N, 2(n+1)); θ_m = θ without a joint."""
        return np.column_stack([self.theta_motor, self.q, self.theta_motor_dot, self.q_dot])


@single_threaded
def simulate_swing(
    equations: NonlinearModel,
    t: Array,
    torque: Torque = 0.0,
    *,
    initial: Sequence[float] | Array | None = None,
    rtol: float = 1e-7,
) -> Swing:
    """Return the motion of an arm under a given torque, large angles and rates included.

    Parameters
    ----------
    equations : NonlinearModel
    t : ndarray, shape (N,)
        Increasing times in s at which the motion is wanted; it starts at the first.
    torque : callable, array or number
        In N·m: a function of the time in s, or values at `t` with straight lines between
        them, or a constant.  Jumps of a function are found, at the cost of some fifty
        short steps each.
    initial : array, shape (2(n+1),), optional
        State [θ, q, θ̇, q̇] at t[0], θ_m in the place of θ with an elastic joint; at rest by
        default.
    rtol : float
        Error allowed in a step relative to the largest rate so far, 1e-13 at least.

    Returns
    -------
    Swing

    Warns
    -----
    SpinSofteningWarning
        If, without stiffening, θ̇ passes the rate beyond which the deflection diverges.

    Raises
    ------
    InputError
        If times do not increase, the initial state has another length, or a number is not
        finite.
    LargeDeflectionError
        If the arm bends further than the equations can describe.
    AccuracyError
        If the tolerance cannot be met.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> import numpy as np
    >>> swing = sc.simulate_swing(sc.large_slew(model), np.linspace(0, 1, 5), torque=0.1)
    >>> swing.theta.shape
    (5,)
    """
    if not isinstance(equations, NonlinearModel):
        raise InputError(
            f"{shown(equations)} is not a nonlinear model",
            where="simulate_swing",
            remedy="give one, as from large_slew",
        )
    t = swing_times(t, "simulate_swing.t")
    rtol = max(check_positive(rtol, "simulate_swing.rtol"), 1e-13)
    drive = _Drive(torque, t)
    form = ModalForm(equations, drive)
    start = form.from_state(_initial(initial, equations))
    omega = equations.linear.omega[0]
    floor = float(np.linalg.norm(form.u)) * drive.typical * min(1 / omega, t[-1] - t[0])
    solver = GaussCollocation(form.A, form.forcing, form.remainder, form.counted, rtol, floor)
    record = _Record(form, start, t)
    try:
        for step in solver.steps(start, drive.roots, 0.5 / omega):
            record.add(step)
    except AccuracyError as error:
        raise form.reason(error) from error
    finally:
        if record.fastest > equations.critical_spin_rad_s:
            warn_of_softening(record.fastest, equations.critical_spin_rad_s)
    return record.swing()


class _Drive:
    """The torque as a function of time, and the intervals on which it is smooth."""

    def __init__(self, torque: Torque, t: Array) -> None:
        self._function: Callable[[float], float] | None = None
        self._t = t
        ends = t
        if callable(torque):
            self._function = torque
            ends = t[[0, -1]]
        else:
            values = _finite(torque, "torque")
            if values.shape not in ((), t.shape):
                raise InputError(
                    f"{values.size} values of the torque for {t.size} times",
                    where="simulate_swing.torque",
                    remedy="give one value for each time, or a function of the time",
                )
            if values.ndim == 0:
                ends = t[[0, -1]]
            self._values = np.broadcast_to(values, t.shape)
        self.roots = _intervals(ends)
        self.typical = float(np.abs(self(np.linspace(t[0], t[-1], 257))).max())

    def __call__(self, times: Array) -> Array:
        """Return the torque at `times`, in N·m."""
        if self._function is None:
            return np.interp(times, self._t, self._values)
        values = np.array([self._function(float(time)) for time in times], dtype=float)
        if not np.all(np.isfinite(values)):
            bad = times[~np.isfinite(values)][0]
            raise InputError(
                f"the torque is not finite at t = {bad:.6g} s",
                where="simulate_swing.torque",
                remedy="return a finite number for every time simulated",
            )
        return values


def _intervals(ends: Array) -> list[tuple[float, float]]:
    """Return (start, length) of the intervals within which steps are halved or joined.

    Equal intervals are taken by a power of two together, so that steps that take in several
    of them, where the kinks at their ends do no harm, end where an interval does.
    """
    lengths = np.diff(ends)
    mean = float(lengths.mean())
    if not np.all(np.abs(lengths - mean) <= 1e-9 * mean):
        return [(float(a), float(h)) for a, h in zip(ends[:-1], lengths, strict=True)]
    found, first = [], 0
    while first < len(lengths):
        together = min(_TOGETHER, 2 ** int(np.log2(len(lengths) - first)))
        found.append((float(ends[first]), mean * together))
        first += together
    return found


class _Record:
    """What is kept of the steps: the states wanted, and the power balance at every step."""

    def __init__(self, form: ModalForm, start: Array, t: Array) -> None:
        self._form, self._t = form, t
        self._found = np.empty((len(t), len(start)))
        self._found[0], self._filled = start, 1
        self._ends, self._work = [start], [0.0]
        self._last: Step | None = None
        self._hub = form.equations.linear.turning
        self.fastest = float(np.abs(form.rates(start[None]) @ self._hub).max())

    def add(self, step: Step) -> None:
        """Take in one step."""
        self._last = step
        upto = int(np.searchsorted(self._t, step.start + step.h, side="right"))
        if upto > self._filled:
            self._found[self._filled : upto] = step.at(self._t[self._filled : upto])
            self._filled = upto
        rates = self._form.rates(step.stages)
        self.fastest = max(self.fastest, float(np.abs(rates @ self._hub).max()))
        drag = ((rates @ self._form.equations.linear.damping) * rates).sum(axis=1)
        power = self._form.torque(step.times) * rates[:, 0] - drag
        self._work.append(self._work[-1] + step.h * float(gauss_nodes(len(power)).weights @ power))
        self._ends.append(step.end)

    def swing(self) -> Swing:
        """Return the result."""
        form, model = self._form, self._form.equations.linear
        if self._last is not None:  # rounding may have left the last time out
            self._found[self._filled :] = self._last.at(self._t[self._filled :])
        states = form.to_states(self._found)
        x, rates = np.split(states, 2, axis=1)
        tip = model.displacement(np.array([model.arm.beam.length]))[0]
        bent = model.basis.evaluate(np.ones(1))[0]
        energy = form.equations.energy(form.to_states(np.array(self._ends)))
        balance = np.abs(energy - energy[0] - self._work).max()
        return Swing(
            t=self._t,
            theta=x @ self._hub,
            theta_motor=x[:, 0],
            q=x[:, 1:],
            theta_dot=rates @ self._hub,
            theta_motor_dot=rates[:, 0],
            q_dot=rates[:, 1:],
            tip=x @ tip,
            tip_deflection=x[:, 1:] @ bent,
            torque=form.torque(self._t),
            energy=form.equations.energy(states),
            energy_error=float(balance / max(energy.max(), np.finfo(float).tiny)),
            steps=len(self._work) - 1,
        )


def _finite(values: object, name: str) -> Array:
    """Return `values` as an array of finite real numbers."""
    where = f"simulate_swing.{name}"
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{shown(values)} is not numeric", where=where, remedy="give numbers"
        ) from error
    if not np.all(np.isfinite(found)):
        raise InputError(
            f"value {int(np.flatnonzero(~np.isfinite(found.ravel()))[0])} is not finite",
            where=where,
            remedy="give finite numbers",
        )
    return found


def swing_times(values: object, where: str) -> Array:
    """Return increasing times; refuse anything else."""
    t = _finite(values, "t")
    if t.ndim != 1 or len(t) < 2 or np.any(np.diff(t) <= 0):
        raise InputError(
            "the times do not increase" if t.ndim == 1 and len(t) > 1 else "fewer than two times",
            where=where,
            remedy="give increasing times in s, as from numpy.linspace",
        )
    return t


def _initial(values: Sequence[float] | Array | None, equations: NonlinearModel) -> Array:
    size = 2 * (equations.n + 1)
    state = np.zeros(size) if values is None else _finite(values, "initial")
    if state.shape != (size,):
        raise InputError(
            f"an initial state of shape {state.shape} for {size} states",
            where="simulate_swing.initial",
            remedy="give θ, q1 … qn and then their rates",
        )
    return state
