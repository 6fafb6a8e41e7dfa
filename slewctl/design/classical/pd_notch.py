"""Collocated PD control of the hub angle with notch filters: what most servo drives run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.classical.filters import (
    RigidArm,
    Section,
    angle_of,
    check_frequency,
    in_series,
    low_pass,
    model_of,
    not_used,
    notch,
    picked,
    response,
    rigid_arm,
    summed,
)
from slewctl.design.clocked import with_clock
from slewctl.design.mode_numbers import check_modes
from slewctl.design.result import Check, Controller, finished
from slewctl.errors import DesignError, InputError, check_positive, shown
from slewctl.model import Model
from slewctl.plant import GeneralisedPlant
from slewctl.plant.signals import signal
from slewctl.plant.statespace import drive

# The low-pass filter starts this far above the rigid body's poles unless told otherwise.
_ROLLOFF = 10.0
# A mode is notched when the filters' lag takes this part of its own damping away.
_TAKEN = 0.5
# A double pole is recomputed to about 1e-8 of its magnitude.
_POLE_TOLERANCE = 1e-6


@guarded
@with_clock
def pd_notch(
    plant: GeneralisedPlant,
    *,
    bandwidth_hz: float | None = None,
    damping_ratio: float = 0.7,
    notch_modes: Sequence[int] | str = "auto",
    notch_depth: float | None = None,
    notch_width: float | None = None,
    rolloff_hz: float | None = None,
) -> Controller:
    """Return PD control of the hub angle with notches at flexible modes.

    u = −(k_p θ + k_d θ̇) through a low-pass filter of second order and the notches.  The gains
    give the rigid arm, with these very filters in its loop, exactly the poles wished; what
    the flexible modes make of it, the certificate says.

    Parameters
    ----------
    plant : GeneralisedPlant
        It must measure ``theta``, or ``theta_motor`` on the rotor's side of an elastic joint;
        the rate of the same angle is used if it is measured, other sensors
        are not.  Without it the rate is that of the filtered angle.
    bandwidth_hz : float
        Undamped frequency of the rigid arm's pair of poles; it has no default.
    damping_ratio : float
        Of the same pair.
    notch_modes : list of int, or "auto"
        Flexible modes, numbered from 1, that get a notch at their frequency (the hub turning
        freely, where the loop gain peaks); empty for none.  "auto": those that the filters'
        lag would rob of more than half their own damping.
    notch_depth : float
        Gain that remains at the mode, between 0 and 1; a tenth by default.
    notch_width : float
        Width of each notch between its −3 dB points over its frequency, a half by default.
    rolloff_hz : float, optional
        Corner of the low-pass filter, ten times the bandwidth by default.

    Returns
    -------
    Controller
        Not verified where the loop on the design model is unstable.

    Raises
    ------
    InputError
        For impossible values, a mode that the model has not got, or a shape of notches where
        there are none.
    DesignError
        If the angle is not measured, or the wish needs a negative gain.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.pd_notch(plant, bandwidth_hz=0.3)
    >>> problem.judge(K).stable
    True
    """
    start = perf_counter()
    model, rigid = model_of(plant), rigid_arm(plant)
    angle = angle_of(plant)
    wish = PDWish.of(bandwidth_hz, damping_ratio, rolloff_hz)
    depth = _depth(0.1 if notch_depth is None else notch_depth)
    width = check_positive(0.5 if notch_width is None else notch_width, "notch_width")
    chosen = _modes(notch_modes, model.n)
    for name, given in (("notch_depth", notch_depth), ("notch_width", notch_width)):
        if chosen == () and given is not None:
            raise InputError(
                "there is no notch to shape", where=name, remedy="leave it out, or name notch_modes"
            )

    def notches(modes: Sequence[int]) -> list[Section]:
        return [notch(model.omega[mode - 1], depth, width) for mode in modes]

    automatic = chosen is None
    if chosen is None:
        chosen = _robbed_modes(plant, model, wish, notches)
    law = pd_law(rigid, wish, notches(chosen))
    system = summed(plant, [law.branch(plant)], "pd_notch")
    return finished(
        plant,
        system,
        "pd-notch",
        law.gains,
        checks=(law.check(rigid),),
        assumptions=(
            *law.described(plant, rigid),
            _said(model, chosen, automatic, f"{depth:.3g} over a width of {width:.3g}"),
            *not_used(plant, (angle, f"{angle}_dot")),
        ),
        seconds={"solve": perf_counter() - start},
    )


def _said(model: Model, modes: Sequence[int], automatic: bool, shape: str) -> str:
    """Return which modes are notched and how, in words."""
    which = "notches"
    if automatic:
        which += " where the filters' lag takes more than half of a mode's own damping"
    placed = ", ".join(f"mode {m} ({model.frequencies_hz[m - 1]:.4g} Hz)" for m in modes)
    if placed:
        return f"{which}: {placed}, each leaving {shape} of its frequency"
    return f"{which}: none" + (f"; one would leave {shape} of its frequency" if automatic else "")


@dataclass(frozen=True)
class PDWish:
    """Poles of the rigid arm under PD control, and where the controller rolls off (rad/s)."""

    omega: float
    damping_ratio: float
    rolloff: float

    @classmethod
    def of(cls, bandwidth_hz: object, damping_ratio: object, rolloff_hz: object) -> PDWish:
        """Return the wish of options in Hz; refuse impossible ones."""
        meaning = "the frequency of the rigid arm's poles"
        bandwidth = check_frequency(bandwidth_hz, "bandwidth_hz", meaning)
        rolloff = (
            _ROLLOFF * bandwidth if rolloff_hz is None else check_positive(rolloff_hz, "rolloff_hz")
        )
        if rolloff <= bandwidth:
            raise InputError(
                f"{rolloff:g} Hz is not above the bandwidth of {bandwidth:g} Hz",
                where="rolloff_hz",
                remedy="give several times the bandwidth",
            )
        ratio = check_positive(damping_ratio, "damping_ratio")
        return cls(2 * math.pi * bandwidth, ratio, 2 * math.pi * rolloff)

    @property
    def companion(self) -> Array:
        """A matrix with the wished poles; 2 × 2."""
        return np.array([[0.0, 1.0], [-(self.omega**2), -2 * self.damping_ratio * self.omega]])


@dataclass(frozen=True)
class PDLaw:
    """The gains of u = −(k_p θ + k_d θ̇) through filters, and the filters."""

    wish: PDWish
    proportional: float
    derivative: float
    filters: tuple[Section, ...]

    @property
    def gains(self) -> dict[str, Array]:
        """Both gains by name, in units of the actuator per rad and per rad/s."""
        return {
            "proportional": np.array([[self.proportional]]),
            "derivative": np.array([[self.derivative]]),
        }

    def branch(self, plant: GeneralisedPlant) -> tuple[Array, tuple[Section, ...], float]:
        """Return the controller as a branch of `summed`."""
        angle = angle_of(plant)
        if f"{angle}_dot" in plant.sensors:
            gains = {angle: self.proportional, f"{angle}_dot": self.derivative}
            return picked(plant, **gains), self.filters, -1.0
        return picked(plant, **{angle: 1.0}), self.with_derivative(), -1.0

    def with_derivative(self) -> tuple[Section, ...]:
        """Return k_p + k_d s with the filters, as a filter of the angle alone."""
        first, *others = self.filters
        _, _, corner = first.numerator  # a low-pass filter: no powers of s above
        numerator = (0.0, corner * self.derivative, corner * self.proportional)
        return (Section(numerator, first.denominator), *others)

    def at(self, s: complex) -> complex:
        """Return the controller's response at s, without its minus sign."""
        return (self.proportional + s * self.derivative) * response(self.filters, s)

    def check(self, rigid: RigidArm) -> Check:
        """Return how far the recomputed poles on the rigid arm are from the wished ones."""
        A, B, C, _ = in_series(self.with_derivative())
        J, c, k = rigid.inertia, rigid.drag, rigid.torque_per_unit
        states = len(A)
        loop = np.block(
            [
                [np.array([[0.0, 1.0], [0.0, -c / J]]), np.vstack([np.zeros(states), -k / J * C])],
                [np.hstack([B, np.zeros((states, 1))]), A],
            ]
        )
        poles, wished = np.linalg.eigvals(loop), np.linalg.eigvals(self.wish.companion)
        distance = np.abs(poles[:, None] - wished).min(axis=0) / np.abs(wished)
        return Check("poles of the rigid arm", float(distance.max()), _POLE_TOLERANCE)

    def described(self, plant: GeneralisedPlant, rigid: RigidArm) -> tuple[str, ...]:
        """Return what was assumed, in words."""
        hertz = 2 * math.pi
        angle = angle_of(plant)
        measured = f"{angle}_dot" in plant.sensors
        rate = f"{angle}_dot" if measured else f"{angle} behind the low-pass filter"
        unit = "V" if plant.actuator == "voltage" else "N·m"
        return (
            f"poles at {self.wish.omega / hertz:.4g} Hz with damping ratio "
            f"{self.wish.damping_ratio:.3g} for {rigid}, the filters included: "
            f"{self.proportional:.4g} {unit}/rad and {self.derivative:.4g} {unit}·s/rad",
            f"rate from {rate}; low-pass filter of second order at "
            f"{self.wish.rolloff / hertz:.4g} Hz",
        )


def pd_law(rigid: RigidArm, wish: PDWish, filters: Sequence[Section] = ()) -> PDLaw:
    """Return the PD law whose loop on the rigid arm has exactly the wished poles.

    With C a matrix that has those poles and F the filters, (k_p + k_d C) k F(C) must be
    −(J C² + c C): two equations, which hold for real, complex and double poles alike.

    Raises
    ------
    DesignError
        If a gain comes out negative.
    """
    C = wish.companion
    every = (low_pass(wish.rolloff), *filters)
    needed: Array = -(rigid.inertia * C @ C + rigid.drag * C) / rigid.torque_per_unit
    for section in every:
        needed = np.linalg.solve(section.of(C), needed).astype(float)  # functions of C commute
    law = PDLaw(wish, float(needed[0, 0]), float(needed[0, 1]), every)
    _refuse_negative(law, rigid)
    return law


def _refuse_negative(law: PDLaw, rigid: RigidArm) -> None:
    if law.proportional > 0 and law.derivative >= 0:
        return
    own = rigid.drag / (2 * rigid.inertia * law.wish.omega)
    if own >= law.wish.damping_ratio:
        raise DesignError(
            f"friction and back-EMF alone damp the rigid arm with a ratio of {own:.3g} at this "
            f"bandwidth, more than the {law.wish.damping_ratio:g} asked for",
            where="damping_ratio",
            remedy="ask for more, or for a higher bandwidth_hz",
        )
    raise DesignError(
        f"with the lag of its filters the controller would need gains of "
        f"{law.proportional:.3g} on the angle and {law.derivative:.3g} on the rate, and neither "
        "may be negative",
        where="bandwidth_hz",
        remedy="lower it, raise rolloff_hz or damping_ratio, or use fewer or narrower notches",
    )


def _robbed_modes(
    plant: GeneralisedPlant,
    model: Model,
    wish: PDWish,
    notches: Callable[[Sequence[int]], list[Section]],
) -> tuple[int, ...]:
    """Return the modes that lose more than half their own damping to the filters' lag.

    To first order the loop moves the pole of mode m by j k φ_u φ_y K(jω)/(2ω) with φ its rotation
    where the torque acts and where the angle is measured: to the right where K lags, or, with
    an elastic joint between, where it leads and the two turn against each other.  A notch
    changes the gains, and the lag at other modes, so the question is asked again until no mode
    is added.
    """
    rigid, omega, U = rigid_arm(plant), model.omega, model.mode_shapes[:, 1:]
    drag = drive(model.arm, plant.actuator)[1]
    own = (np.sum(U * (model.damping @ U), axis=0) + drag * U[0] ** 2) / 2
    seen = signal(angle_of(plant)).row(model) @ model.mode_shapes[:, 1:]
    reach = rigid.torque_per_unit * U[0] * seen / (2 * omega)
    chosen: tuple[int, ...] = ()
    while True:
        law = pd_law(rigid, wish, notches(chosen))
        taken = np.array([-law.at(1j * w).imag for w in omega]) * reach
        robbed = {int(m) + 1 for m in np.flatnonzero(taken > _TAKEN * own)}
        if robbed <= set(chosen):
            return chosen
        chosen = tuple(sorted(robbed | set(chosen)))


def _depth(given: object) -> float:
    depth = check_positive(given, "notch_depth")
    if depth >= 1:
        raise InputError(
            f"{depth:g} is not below 1",
            where="notch_depth",
            remedy="give the gain that remains at the mode, such as 0.1 for a tenth",
        )
    return depth


def _modes(given: object, n: int) -> tuple[int, ...] | None:
    """Return the modes to notch, or None where they are to be found."""
    if isinstance(given, str) and given == "auto":
        return None
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(
            f"{shown(given)} names no modes",
            where="notch_modes",
            remedy='give a list such as [1, 2], an empty one, or "auto"',
        )
    return check_modes(given, n, "notch_modes")
