"""The grid of a study: dimensionless settings of one arm, and the designs tried at each.

The hub's inertia is given over the beam's own about the axis, the payload's mass over the
beam's, and the controller's bandwidth over the arm's first flexible frequency, so that a
study of one arm speaks for every arm of the same shape.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from slewctl.arm import Arm, ModalData, Payload, require_beam, vary
from slewctl.basis import NAMES
from slewctl.compare.case import MOST_TRUTH_MODES
from slewctl.compare.design_basis import SOURCES
from slewctl.compare.study.varied import Varied, check_on, check_varied
from slewctl.design import METHODS, options
from slewctl.design.methods import GIVEN
from slewctl.errors import (
    InputError,
    check_choice,
    check_count,
    check_damping_ratio,
    check_each,
    check_nonnegative,
    check_positive,
    shown,
)
from slewctl.loop import Slew
from slewctl.model import beam_inertia, beam_mass, total_inertia, truth
from slewctl.plant import Objective

# The Kalman filter of the rigid arm is this many times faster than its regulator.
OBSERVER_SPEED = 2.0
# The largest acceptable tip error over the reach; only its ratio to the torque matters.
_TIP = 0.05
_ANGLE_DEG = 30.0
# What a study can measure.
SENSORS = ("theta", "theta_dot", "tip", "tip_deflection")
# Designs that a study may try: their rows fit in memory, and a machine tries them in days.
MOST_POINTS = 1_000_000
_MOST_GRIDS = 100  # each point is sought in all grids before its own
# Enough to know the first of them.
_FEW_MODES = 10


@dataclass(frozen=True)
class Setting:
    """An arm and what is asked of its controller, dimensionless.

    Parameters
    ----------
    hub_ratio : float
        Hub inertia over the beam's about the axis.
    payload_ratio : float
        Payload mass over the beam's.
    damping_ratio : float
        Of every flexible mode.
    bandwidth : float
        ω_c/ω₁: bandwidth of the rigid arm under LQR over the first flexible frequency.
    sensors : tuple of str
    variation : tuple of (str, float) or None
        What else is changed of the arm, by keys of `slewctl.vary`, in SI units; None in a study
        that changes nothing else.
    """

    hub_ratio: float
    payload_ratio: float
    damping_ratio: float
    bandwidth: float
    sensors: tuple[str, ...]
    variation: Varied | None = None


@dataclass(frozen=True)
class Point:
    """One design at one setting; `basis` may name a reduction of the truth instead.

    Attributes
    ----------
    setting : Setting
    basis : str
    n : int
        Number of functions, or of modes kept.
    method : str
    """

    setting: Setting
    basis: str
    n: int
    method: str

    @property
    def key(self) -> str:
        """A name that sorts by setting first."""
        s = self.setting
        numbers = (s.hub_ratio, s.payload_ratio, s.damping_ratio, s.bandwidth)
        changed = () if s.variation is None else (repr(s.variation),)
        words = (*map(repr, numbers), "+".join(s.sensors), *changed, self.method, self.basis)
        return "|".join((*words, f"{self.n:03d}"))


@dataclass(frozen=True)
class Grid:
    """All combinations of some values of each axis.

    Parameters
    ----------
    bases : tuple of str
        Bases, or reductions of the truth to as many modes, by name.
    methods : tuple of str
    orders : tuple of int
    hub_ratios, payload_ratios, damping_ratios, bandwidths : tuple of float
    sensors : tuple of tuple of str
    variations : tuple of mapping
        What else is changed of the arm, by keys of `slewctl.vary`, in SI units, such as
        ``{"actuator_delay": 0.002}``; ``{}`` for the arm as it is.

    Raises
    ------
    InputError
        For an empty axis, an unknown name, an impossible value or more than `MOST_POINTS`
        combinations.
    """

    bases: tuple[str, ...] = NAMES
    orders: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7, 8)
    methods: tuple[str, ...] = ("lqg",)
    hub_ratios: tuple[float, ...] = (0.0, 0.1, 1.0, 10.0)
    payload_ratios: tuple[float, ...] = (0.0,)
    damping_ratios: tuple[float, ...] = (0.005,)
    bandwidths: tuple[float, ...] = (0.3,)
    sensors: tuple[tuple[str, ...], ...] = (("theta", "theta_dot"),)
    variations: tuple[Any, ...] = (None,)

    def __post_init__(self) -> None:
        for axis in self.__dataclass_fields__:
            values = getattr(self, axis)
            if isinstance(values, str) or not isinstance(values, Sequence) or not len(values):
                raise InputError(
                    f"{shown(values)} is not a list of values", where=axis, remedy="give a list"
                )
        _check_size(Grid.__len__(self), "")  # len() itself would overflow
        for axis in self.__dataclass_fields__:
            object.__setattr__(self, axis, tuple(getattr(self, axis)))
        for axis, check in _CHECKS.items():
            values = check_each(getattr(self, axis), axis, check)
            # A value given twice is tried once.
            object.__setattr__(self, axis, tuple(dict.fromkeys(values)))

    def points(self) -> Iterator[Point]:
        """Yield every point, those of one setting together."""
        settings = itertools.product(
            self.hub_ratios,
            self.payload_ratios,
            self.damping_ratios,
            self.bandwidths,
            self.sensors,
            self.variations,
        )
        for values in settings:
            for method, basis, n in itertools.product(self.methods, self.bases, self.orders):
                yield Point(Setting(*values), basis, n, method)

    def __contains__(self, point: Point) -> bool:
        s = point.setting
        values = (
            point.basis, point.n, point.method, s.hub_ratio, s.payload_ratio, s.damping_ratio,
            s.bandwidth, s.sensors, s.variation,
        )  # fmt: skip
        return all(value in axis for value, axis in zip(values, self._axes, strict=True))

    @cached_property
    def _axes(self) -> tuple[frozenset[object], ...]:
        """The values of each axis, to look them up."""
        return tuple(frozenset(getattr(self, axis)) for axis in self.__dataclass_fields__)

    def __len__(self) -> int:
        return math.prod(len(getattr(self, axis)) for axis in self.__dataclass_fields__)


def _check_size(points: int, where: str) -> None:
    if points > MOST_POINTS:
        raise InputError(
            f"{points:,} designs are too many for a study",
            where=where,
            remedy=f"keep at most {MOST_POINTS:,}: fewer values, or several studies",
        )


def check_sensors(names: object, where: str = "sensors") -> tuple[str, ...]:
    """Return names of sensors; refuse those that a study cannot weigh."""
    if isinstance(names, str) or not isinstance(names, Sequence) or not names:
        raise InputError(
            f"{shown(names)} is not a list of sensors",
            where=where,
            remedy="give a list, such as ['theta', 'tip']",
        )
    if len(set(names)) < len(names):
        raise InputError(
            f"{shown(list(names))} names one twice", where=where, remedy="name each sensor once"
        )
    return check_each(names, where, _one_of(SENSORS))


def _one_of(choices: Iterable[str]) -> Callable[[object, str], str]:
    return lambda value, where: check_choice(value, choices, where)


_CHECKS: dict[str, Callable[[object, str], object]] = {
    "bases": _one_of(SOURCES),
    "methods": _one_of(METHODS.keys() - {GIVEN}),
    "orders": check_count,
    "hub_ratios": check_nonnegative,
    "payload_ratios": check_nonnegative,
    "damping_ratios": check_damping_ratio,
    "bandwidths": check_positive,
    "sensors": check_sensors,
    "variations": check_varied,
}


@dataclass(frozen=True)
class Study:
    """A question asked of one arm over a few grids.

    Parameters
    ----------
    name, title : str
    arm : Arm
        Its hub inertia, payload and damping are replaced at every setting.
    grids : tuple of Grid
        A point that several of them hold is tried once.  Where one has variations, the others
        have the arm as it is.
    truth_modes : int
        Flexible modes of the truth; every verdict on stability is repeated on twice as many.
    """

    name: str
    title: str
    arm: Arm
    grids: tuple[Grid, ...]
    truth_modes: int = 20

    def __post_init__(self) -> None:
        require_beam(self.arm.beam, "study")
        most = MOST_TRUTH_MODES
        if check_count(self.truth_modes, "truth.modes") > most:
            raise InputError(
                f"a truth of {shown(self.truth_modes)} modes for each design takes too long",
                where="truth.modes",
                remedy=f"keep at most {most}",
            )
        if not self.grids:
            raise InputError("there is no grid", where="grid", remedy="add a [[grid]] table")
        if len(self.grids) > _MOST_GRIDS:
            raise InputError(
                f"{len(self.grids)} grids are too many for a study",
                where="grid",
                remedy=f"keep at most {_MOST_GRIDS}",
            )
        largest = max(max(grid.orders) for grid in self.grids)
        if self.truth_modes < 2 * largest:
            raise InputError(
                f"a truth of {self.truth_modes} modes cannot judge {largest} functions",
                where="truth.modes",
                remedy=f"keep at least {2 * largest}",
            )
        _check_size(sum(map(len, self.grids)), "grid")
        for place, grid in enumerate(self.grids):
            check_on(self.arm, grid.variations, f"grid.{place}.variations")
        if any(grid.variations != (None,) for grid in self.grids):
            even = [replace(g, variations=((),)) if g.variations == (None,) else g
                    for g in self.grids]  # fmt: skip
            object.__setattr__(self, "grids", tuple(even))

    def points(self) -> Iterator[Point]:
        """Yield every point once, without a memory of those before."""
        for place, grid in enumerate(self.grids):
            for point in grid.points():
                if not any(point in earlier for earlier in self.grids[:place]):
                    yield point


def arm_of(base: Arm, setting: Setting) -> Arm:
    """Return the arm of a setting: the base's beam with the hub and payload wanted."""
    hub = replace(base.hub, inertia=setting.hub_ratio * beam_inertia(base))
    payload = Payload(setting.payload_ratio * beam_mass(base), base.payload.inertia)
    joint = base.joint and replace(base.joint, rotor_inertia=base.rotor_inertia)
    arm = replace(
        base,
        hub=hub,
        payload=payload,
        damping_ratio=setting.damping_ratio,
        damping=None,
        motor=None,
        joint=joint,
    )
    return vary(arm, **dict(setting.variation or ()))


def objective_of(arm: Arm, bandwidth: float, sensors: Sequence[str]) -> Objective:
    """Return limits and noises that give the rigid arm the bandwidth wanted.

    For J θ̈ = τ with limits y on the tip and u on the torque, LQR has the bandwidth
    ω_c² = u (r + L)/(y J), and for torque noise w and angle noise v the Kalman filter has
    ω_f² = w/(J v).

    Parameters
    ----------
    arm : Arm
    bandwidth : float
        ω_c over the first flexible frequency.
    sensors : sequence of str
    """
    inertia, omega = total_inertia(arm), omega_of(arm, bandwidth)
    filter_omega = OBSERVER_SPEED * omega
    units = reading_units(arm, filter_omega, sensors)
    noise = {name: unit / (inertia * filter_omega**2) for name, unit in units.items()}
    limits = {"tip": _TIP * _reach(arm), "torque": _TIP * inertia * omega**2}
    return Objective(limits, {"torque": 1.0, **noise})


def reading_units(arm: Arm, omega: float, sensors: Sequence[str]) -> dict[str, float]:
    """Return what each sensor reads when the rigid arm swings by 1 rad at omega, in SI units.

    Parameters
    ----------
    arm : Arm
    omega : float
        In rad/s.
    sensors : sequence of str

    Raises
    ------
    InputError
        For a sensor that is not among `SENSORS`.
    """
    units = dict(zip(SENSORS, (1.0, omega, _reach(arm), _reach(arm)), strict=True))
    return {name: units[check_choice(name, SENSORS, "sensors")] for name in sensors}


def _reach(arm: Arm) -> float:
    """Return the distance in m of the tip from the axis."""
    if isinstance(arm.beam, ModalData):
        return arm.beam.lever("tip")
    return arm.hub.radius + arm.beam.length


def omega_of(arm: Arm, bandwidth: float) -> float:
    """Return ω_c in rad/s."""
    return bandwidth * float(truth(arm, _FEW_MODES).omega[0])


def slew_of(arm: Arm, bandwidth: float) -> Slew:
    """Return a slew of one period of the bandwidth."""
    return Slew(_ANGLE_DEG, 2 * math.pi / omega_of(arm, bandwidth))


def options_of(method: str, arm: Arm, bandwidth: float) -> dict[str, object]:
    """Return the options that give a method the bandwidth wanted, of those that it takes."""
    hertz = omega_of(arm, bandwidth) / (2 * math.pi)
    wishes = {
        "bandwidth_hz": hertz,
        "crossover_hz": hertz,
        "observer_speed": OBSERVER_SPEED,
    }
    return {name: wishes[name] for name in options(method) if name in wishes}
