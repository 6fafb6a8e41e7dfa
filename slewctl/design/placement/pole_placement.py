"""Pole placement: output feedback with the poles of state feedback and observer chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.clocked import check_clock
from slewctl.design.energy_coordinates import ScaledPlant, scaled
from slewctl.design.observer import observer_feedback
from slewctl.design.placement.placed_gains import (
    own_pairs,
    placed_feedback,
    placed_observer,
)
from slewctl.design.placement.plain import Balanced, exactly
from slewctl.design.placement.pole_pairs import (
    LonePole,
    PolePair,
    Roots,
    flexible_modes,
    mode_name,
    open_loop,
)
from slewctl.design.placement.sampled_energy import SampledEnergy
from slewctl.design.placement.sampled_placement import PlacedEstimate
from slewctl.design.placement.wishes import (
    Wanted,
    check_damped,
    explicit,
    followed,
    left_alone,
    matched,
    wished,
)
from slewctl.design.result import Controller, finished
from slewctl.errors import InputError, check_positive
from slewctl.numerics.given_system import read_matrix
from slewctl.numerics.linear_system import linear
from slewctl.plant import GeneralisedPlant

Pole = complex | Sequence[float]


@guarded
def pole_placement(
    plant: GeneralisedPlant,
    *,
    bandwidth_hz: float | None = None,
    damping_ratio: float | None = None,
    added_damping: float | Sequence[float] | Mapping[str, float] | None = None,
    leave: Sequence[int] = (),
    poles: Sequence[Pole] | None = None,
    observer_speed: float | None = None,
    observer_damping: float | None = None,
    observer_poles: Sequence[Pole] | None = None,
    sample_time: float | None = None,
    delay: float = 0.0,
) -> Controller:
    """Return an observer with state feedback whose poles are placed as wished.

    Either by physical wishes, with `bandwidth_hz`, or one by one, with `poles`.  The state
    feedback does not move a mode to which no damping is added.  The observer still damps
    its estimate of such a mode: one that runs along undamped is out of step with the arm as
    soon as the frequency of the model is off by more than the damping, and makes the loop
    unstable although neither gain touches the mode.

    Parameters
    ----------
    plant : GeneralisedPlant
    bandwidth_hz : float
        Undamped frequency of the rigid body's pair of poles; it has no default.
    damping_ratio : float
        Of the same pair; by default 0.7.
    added_damping : float, list or table
        Damping ratio added to every flexible mode at its own frequency, or to each as listed,
        or to those named in a table such as ``{"1": 0.05}``; by default none.
    leave : list of int
        Flexible modes that keep their poles in the state feedback and in the observer,
        numbered from 1; they need not be reached or seen.
    poles : list, optional
        Instead of the wishes: two poles in rad/s for each mode that is not left alone, and
        one for a lag of the plant; complex ones as ``[re, im]`` together with their conjugates.
    observer_speed : float
        How many times as fast as the poles of the state feedback those of the observer decay,
        by default 3; see `slewctl.design.placement.wishes.faster`.
    observer_damping : float
        Damping ratio of the observer for modes that the state feedback does not move, where
        they have less by themselves, by default 0.1; 0 keeps their poles in the observer too.
    observer_poles : list, optional
        Instead of speed and damping: explicit poles of the observer, as `poles`.
    sample_time : float, optional
        T in s.  Given, the controller is a sampled one, and each pole s is placed at z = e^(sT)
        on the sampled plant itself.
    delay : float
        Time in s from a sample to the output that is computed from it, up to ten of them: the
        state feedback acts on the state predicted for then, and the delay adds poles at z = 0
        alone.

    Returns
    -------
    Controller
        Verified when the recomputed poles are the wanted ones, each to within what its own
        condition number makes of rounding.  The sensitivity of the placed poles is among its
        assumptions.

    Raises
    ------
    InputError
        For a wish that is impossible, missing, contradicts another or applies to no mode.
    DesignError
        If a mode that is to be moved is not reached by the actuator or not seen by the
        sensors, or one that is left alone is undamped.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.pole_placement(plant, bandwidth_hz=0.3, damping_ratio=0.7)
    >>> problem.judge(K).stable
    True
    """
    start = perf_counter()
    T = check_clock(plant, sample_time, delay)
    energy = scaled(plant)
    loop = open_loop(energy.A)
    own = own_pairs(energy, loop)
    alone = left_alone(leave, flexible_modes(own))
    if poles is None:
        if bandwidth_hz is None:
            raise InputError(
                "missing",
                where="bandwidth_hz",
                remedy="give the frequency of the rigid body's poles in Hz, or give poles",
            )
        ratio = 0.7 if damping_ratio is None else damping_ratio
        added = 0.0 if added_damping is None else added_damping
        wanted = wished(own, bandwidth_hz, ratio, added, alone)
    else:
        _refuse_beside(
            "poles",
            bandwidth_hz=bandwidth_hz,
            damping_ratio=damping_ratio,
            added_damping=added_damping,
        )
        wanted = _explicitly(own, poles, "poles", alone)
    check_damped(own, wanted)
    if observer_poles is None:
        speed = check_positive(3.0 if observer_speed is None else observer_speed, "observer_speed")
        seen = followed(own, wanted, alone, speed, observer_damping)
    else:
        _refuse_beside(
            "observer_poles", observer_speed=observer_speed, observer_damping=observer_damping
        )
        seen = _explicitly(own, observer_poles, "observer_poles", alone)
        check_damped(own, seen)
    said = [_poles_said("state feedback", own, wanted), _poles_said("observer", own, seen)]
    if T:
        sampled = SampledEnergy.of(energy, own, T)
        loop = sampled.loop(loop)
        control = placed_feedback(plant.actuator, sampled, loop, sampled.mapped(wanted))
        observer = placed_observer(sampled, loop, sampled.mapped(seen))
        gains = control.gain, observer.gain
        estimate = PlacedEstimate(plant, T, float(delay), "pole_placement", None, *gains)
        system, entry = estimate.system(), estimate.entry
        said = [estimate.timing, *said, f"each pole s is placed at z = e^(sT), T = {T:g} s"]
    else:
        control = placed_feedback(plant.actuator, energy, loop, wanted)
        observer = placed_observer(energy, loop, seen)
        system = observer_feedback(plant, control.gain, observer.gain, "pole_placement")
        entry = None
    return finished(
        plant,
        system,
        "pole-placement",
        {"state_feedback": control.gain, "observer": observer.gain},
        checks=(control.check("state feedback"), observer.check("observer")),
        assumptions=(
            *said,
            control.described("state feedback"),
            observer.described("observer"),
        ),
        seconds={"solve": perf_counter() - start},
        delay=float(delay),
        entry=entry,
    )


@guarded
def place(plant: Any, *given: Any) -> Array:
    """Return the state feedback gain K that gives A − B K the wanted poles.

    Called as ``place(plant, poles)``, ``place(sys, poles)`` or ``place(A, B, poles)``.

    Parameters
    ----------
    plant : GeneralisedPlant, control.StateSpace, or ndarray A
    *given
        B after A; then the poles, one for each state, in rad/s (of a sampled system in z);
        complex numbers, or ``[re, im]``.  A mode whose own poles are among them is not moved.
        Poles may be repeated.

    Returns
    -------
    ndarray, shape (m, n)
        In the plant's coordinates; u = −K x.

    Raises
    ------
    InputError
        If the poles are not n, or a conjugate is missing.
    DesignError
        If the actuator does not reach a mode that is to be moved.
    AccuracyError
        If the poles cannot be placed to working precision.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.place([[0, 1], [0, 0]], [[0], [1]], [-1, -2])
    array([[2., 3.]])
    """
    if isinstance(plant, GeneralisedPlant):
        (poles,) = exactly(given, "the poles")
        energy: ScaledPlant | Balanced = scaled(plant)
        actuator = plant.actuator
    else:
        system = linear(plant)
        if system is None:
            B, poles = exactly(given, "B and the poles")
            energy = Balanced.of(read_matrix(plant, "A"), read_matrix(B, "B"))
        else:
            (poles,) = exactly(given, "the poles")
            energy = Balanced.of(system.A, system.B)
        actuator = "input"
    loop = open_loop(energy.A)
    wanted = matched(own_pairs(energy, loop), explicit(poles, "poles"), "poles")
    return placed_feedback(actuator, energy, loop, wanted).verified.gain


@guarded
def place_observer(plant: GeneralisedPlant, poles: Sequence[Pole]) -> Array:
    """Return the observer gain K_f that gives A − K_f C₂ the wanted poles.

    With several sensors the gain is the one, of those found, with the best conditioned
    eigenvectors when every sensor is measured in units of its noise.

    Parameters
    ----------
    plant : GeneralisedPlant
    poles : list
        As for `place`.

    Returns
    -------
    ndarray, shape (n, sensors)
        In the plant's coordinates; x̂' = A x̂ + B₂ u + K_f (y − C₂ x̂).

    Raises
    ------
    InputError, DesignError, AccuracyError
        As `place`, for the sensors.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> gain = sc.place_observer(plant, [-2, -3, -1 + 9j, -1 - 9j])
    >>> gain.shape
    (4, 1)
    """
    energy = scaled(plant)
    loop = open_loop(energy.A)
    wanted = matched(own_pairs(energy, loop), explicit(poles, "poles"), "poles")
    return placed_observer(energy, loop, wanted).verified.gain


def _explicitly(own: Sequence[Roots], given: object, where: str, alone: frozenset[int]) -> Wanted:
    return matched(own, explicit(given, where, stable=True), where, alone)


def _refuse_beside(poles: str, **wishes: object) -> None:
    """Refuse wishes that explicit poles would leave without a meaning."""
    for name, value in wishes.items():
        if value is not None:
            raise InputError(
                f"given beside {poles}",
                where=name,
                remedy=f"give either {name} or {poles}",
            )


def _poles_said(what: str, own: Sequence[Roots], wanted: Wanted) -> str:
    """Return what happens to each mode, in words."""
    moved = [
        f"{mode_name(n, own[n]).partition(' (')[0]} to {pair.frequency / (2 * np.pi):.4g} Hz with "
        f"damping ratio {pair.ratio:.3g}"
        for n, pair in sorted(wanted.items())
    ]
    kept = [n for n in range(len(own)) if n not in wanted]
    modes = ", ".join(str(n) for n in kept if isinstance(own[n], PolePair))
    alone = [f"mode {modes}"] if modes else []
    alone += ["the real pole" for n in kept if isinstance(own[n], LonePole)]
    unmoved = f"; not moved: {' and '.join(alone)}" if alone else ""
    return f"poles of the {what}: " + "; ".join(moved) + unmoved
