"""Spillover: what the modes that a design model left out do to the loop.

With the design model P and the truth P + Δ the loop on the truth is stable if the design
loop is and ‖KSΔ‖∞ < 1, S = (I − PK)⁻¹ (small gain).  Both models turn as the same rigid
body: its poles at the origin cancel in Δ, which has to be done before Δ is formed, since
its norm would not be finite otherwise.

Beside that test, which is safe but may refuse a good loop, stands what happens: the residues
of Δ are raised from 0 to 1, all or those of one mode, and the first value at which the loop
becomes unstable is 1/(gain margin) read backwards, exact, and names the mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_sylvester

from slewctl._threads import single_threaded
from slewctl._types import ComplexArray
from slewctl.errors import InputError, shown
from slewctl.loop.closed import Loop
from slewctl.loop.parts import arranged
from slewctl.loop.realisation import Realisation, realisation
from slewctl.loop.robust.critical_scale import closed_stable, critical_scale
from slewctl.loop.single.mode_names import mode_name
from slewctl.loop.single.stability import UnstableLoopError
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.interconnect import diagonal
from slewctl.numerics.modes import Eigensystem, at_origin
from slewctl.numerics.ordered_schur import ordered_schur
from slewctl.plant import generalised_plant
from slewctl.plant.readings import refuse_lags

# A pole this close to the axis, relative, is on it to working precision.
_UNDAMPED = 1e-9
# How well both models must agree on the rigid body, relative.
_SAME_BODY = 1e-6


@dataclass(frozen=True)
class SmallGain:
    """The small-gain test on what the design model left out.

    Attributes
    ----------
    value : float
        ‖KSΔ‖∞.
    frequency_hz : float
        Where.
    mode : str
        The mode of the truth with the largest share there.
    certified : bool
        Whether the value is below one, which makes the loop on the truth stable.
    """

    value: float
    frequency_hz: float
    mode: str
    certified: bool


@dataclass(frozen=True)
class ResidualMode:
    """One mode of the truth, and what its difference to the design model does by itself.

    Attributes
    ----------
    number : int
        Counted from one.
    frequency_hz : float
    modelled : bool
        Whether the design model has a mode of this number; the difference is then that of
        the two, and the whole mode otherwise.
    gain : float
        ‖KSΔ_k‖∞: below one, this mode alone cannot destabilise.
    critical_scale : float
        The share of this difference alone at which the loop becomes unstable; infinite if
        none below a thousand does.
    spills_over : bool
        Whether the loop with this difference alone, wholly present, is unstable.  It may be
        stable again beyond a critical scale below one.
    """

    number: int
    frequency_hz: float
    modelled: bool
    gain: float
    critical_scale: float
    spills_over: bool


@dataclass(frozen=True)
class Spillover:
    """What the modes that the design model left out do, each and all together.

    Attributes
    ----------
    modes : tuple of ResidualMode
        In order of frequency.
    critical_scale : float
        The share of all differences together at which the loop first becomes unstable;
        infinite if none below a thousand does.
    critical_hz : float or None
        The frequency at which it does.
    first : str
        The mode of the truth with the largest share there; empty if there is none.
    """

    modes: tuple[ResidualMode, ...]
    critical_scale: float
    critical_hz: float | None
    first: str

    @property
    def worst(self) -> ResidualMode:
        """The mode with the largest gain."""
        return max(self.modes, key=lambda mode: mode.gain)


@single_threaded
def small_gain(loop: Loop, design: Model) -> SmallGain:
    """Return the small-gain test of a loop on the truth, seen from its design model.

    Parameters
    ----------
    loop : Loop
        The controller closed around the truth.
    design : Model
        The model that the controller was designed on, of the same arm.

    Returns
    -------
    SmallGain

    Raises
    ------
    InputError
        If the two models do not turn as the same rigid body.
    UnstableLoopError
        If the design loop itself is unstable.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> loop = problem.judge(sc.lqg(plant)).loop
    >>> sc.small_gain(loop, plant.model).certified
    True
    """
    parts = LeftOut.of(loop, design)
    peak = parts.seen(parts.difference).peak()
    hertz = float(peak.omega / (2 * np.pi)) if np.isfinite(peak.omega) else np.inf
    return SmallGain(peak.value, hertz, parts.largest(peak.omega, loop.model), peak.value < 1)


def spillover(loop: Loop, design: Model) -> Spillover:
    """Return which modes spill over, one by one and all together.

    Parameters
    ----------
    loop, design
        As for `small_gain`.

    Returns
    -------
    Spillover

    Raises
    ------
    InputError, UnstableLoopError
        As `small_gain`.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> loop = problem.judge(sc.lqg(plant)).loop
    >>> sc.spillover(loop, plant.model).worst.number
    2
    """
    parts = LeftOut.of(loop, design)
    whole, hertz = critical_scale(parts.seen(parts.difference))
    found = []
    for k in range(loop.model.n):
        seen = parts.seen(parts.of_mode(k))
        share = critical_scale(seen)[0]
        found.append(
            ResidualMode(
                k + 1,
                float(loop.model.frequencies_hz[k]),
                k < design.n,
                seen.peak().value,
                share,
                not closed_stable(seen, 1.0),
            )
        )
    at = np.inf if hertz is None else 2 * np.pi * hertz
    return Spillover(tuple(found), whole, hertz, parts.largest(at, loop.model))


@dataclass(frozen=True, eq=False)
class LeftOut:
    """The modes of both models as systems of their own, and KS of the design loop.

    Attributes
    ----------
    truth, design : tuple of Realisation
        One for each flexible mode, from the actuator to the sensors; each sum, with the
        rigid body, is the whole model.
    control : Realisation
        KS = K(I − PK)⁻¹, from what is added to the measurements to the actuator.
    """

    truth: tuple[Realisation, ...]
    design: tuple[Realisation, ...]
    control: Realisation

    @staticmethod
    def of(loop: Loop, design: Model) -> LeftOut:
        """Return the parts of a loop on the truth, seen from its design model.

        Raises
        ------
        InputError, UnstableLoopError
            As `small_gain`.
        """
        check_model(design, "small_gain")
        if not isinstance(loop, Loop) or loop.controller.sample_time:
            raise InputError(
                f"{shown(loop)} is not a loop with a continuous controller",
                where="small_gain",
                remedy="close one, as in slewctl.close(truth, objective, controller)",
            )
        refuse_lags(loop.model.arm, "small_gain")
        objective, path = loop.objective, loop.plant.path
        reduced = realisation(generalised_plant(design, objective).path, "small_gain")
        full = realisation(path, "small_gain")
        K = arranged(loop.controller.linear, path.output_labels, path.input_labels, "controller")
        closed = reduced.closed(realisation(K, "small_gain"))
        if not closed.stable:
            raise UnstableLoopError(
                "the controller does not stabilise the design model itself",
                where="small_gain",
                remedy="give the model that it was designed on",
            )
        sensors = len(objective.sensors)
        control_part = Realisation(
            closed.A, closed.B[:, :sensors], closed.C[sensors:], closed.D[sensors:, :sensors]
        )
        truth_rigid, truth_modes = _modes(full, loop.model)
        design_rigid, design_modes = _modes(reduced, design)
        _require_same_body(truth_rigid, design_rigid, float(loop.model.omega[0]))
        return LeftOut(truth_modes, design_modes, control_part)

    @property
    def difference(self) -> Realisation:
        """Δ without the poles at the origin."""
        shape = self.truth[0].D.shape
        return _sum(self.truth, shape).minus(_sum(self.design, shape))

    def of_mode(self, k: int) -> Realisation:
        """Return what the k-th flexible mode contributes to Δ."""
        if k < len(self.design):
            return self.truth[k].minus(self.design[k])
        return self.truth[k]

    def seen(self, part: Realisation) -> Realisation:
        """Return KS·part, from the actuator round the loop to itself."""
        return self.control.after(part)

    def largest(self, omega: float, model: Model) -> str:
        """Return the name of the mode with the largest share in KSΔ at ω in rad/s."""
        if not np.isfinite(omega):
            return ""
        point = np.array([omega])
        KS = FrequencyResponse(self.control.system)(point).reshape(self.control.D.shape)
        parts = [self.of_mode(k) for k in range(len(self.truth))]
        shares = [
            np.linalg.norm(KS @ FrequencyResponse(part.system)(point).reshape(part.D.shape))
            for part in parts
        ]
        k = int(np.argmax(shares))
        return mode_name(k + 1, float(model.frequencies_hz[k]))


def _modes(P: Realisation, model: Model) -> tuple[Realisation, tuple[Realisation, ...]]:
    """Return the rigid body at the origin, and the part of each flexible mode.

    A pole belongs to the mode that moves most in it; a slow one of friction at the hub is
    counted with the first mode.

    Parameters
    ----------
    P : Realisation
        In modal coordinates [η, η̇] of `model`, scaled at most.
    """
    # In modal coordinates the zeros of the rigid body are exact, and a slow pole none of them.
    T, Z, size = ordered_schur(P.A, lambda poles: at_origin(poles, float(model.omega[0])))
    B, C = Z.T @ P.B, P.C @ Z
    # T = [[T₁, T₁₂], [0, T₂]]: with Y from a Sylvester equation the two parts separate.
    Y = solve_sylvester(T[:size, :size], -T[size:, size:], -T[:size, size:])
    rigid = Realisation(T[:size, :size], B[:size] - Y @ B[size:], C[:, :size], P.D * 0)
    flexible = Eigensystem.of(T[size:, size:])
    values, right, left = flexible.poles, flexible.columns, flexible.rows
    if np.any(values.real >= -_UNDAMPED * np.abs(values)):
        raise InputError(
            "a flexible mode is undamped, and what it adds to the loop unbounded",
            where="small_gain",
            remedy="give the arm some damping",
        )
    moves = (Z[:, :size] @ Y + Z[:, size:]) @ right
    share = np.abs(moves * (left @ Z[:, size:].T).T).reshape(2, model.n + 1, -1).sum(axis=0)
    owner = np.maximum(np.argmax(share, axis=0), 1)
    entry, shape = left @ B[size:], (C[:, size:] + C[:, :size] @ Y) @ right
    parts: list[list[Realisation]] = [[] for _ in range(model.n)]
    for k in np.flatnonzero(values.imag >= 0):
        parts[owner[k] - 1].append(_real_part(values[k], entry[k], shape[:, k]))
    return rigid, tuple(_sum(mode, P.D.shape) for mode in parts)


def _real_part(value: complex, entry: ComplexArray, shape: ComplexArray) -> Realisation:
    """Return c bᵀ/(s − λ), plus its conjugate where λ is complex, with real matrices."""
    nothing = np.zeros((len(shape), len(entry)))
    a, w = value.real, value.imag
    if w == 0:
        return Realisation(np.array([[a]]), entry.real[None], shape.real[:, None], nothing)
    return Realisation(
        np.array([[a, w], [-w, a]]),
        np.vstack([2 * entry.real, -2 * entry.imag]),
        np.column_stack([shape.real, shape.imag]),
        nothing,
    )


def _sum(parts: Sequence[Realisation], shape: tuple[int, ...]) -> Realisation:
    """Return the sum of systems that have outputs and inputs as in `shape`."""
    p, m = shape
    total = Realisation(np.zeros((0, 0)), np.zeros((0, m)), np.zeros((p, 0)), np.zeros((p, m)))
    for part in parts:
        total = Realisation(
            diagonal(total.A, part.A),
            np.vstack([total.B, part.B]),
            np.hstack([total.C, part.C]),
            total.D,
        )
    return total


def _require_same_body(truth: Realisation, design: Realisation, omega: float) -> None:
    """Refuse rigid parts whose responses differ: their Δ would not be bounded."""
    s = 1j * omega * np.array([1.0, 3.0])
    of_truth, of_design = (
        np.array([P.C @ np.linalg.solve(x * np.eye(P.states) - P.A, P.B) for x in s])
        for P in (truth, design)
    )
    apart = float(np.abs(of_truth - of_design).max())
    if truth.states != design.states or apart > _SAME_BODY * np.abs(of_truth).max():
        raise InputError(
            "the design model does not turn as the same rigid body as the truth",
            where="small_gain",
            remedy="give a model of the same arm",
        )
