"""Positive position feedback: a resonant filter on a deflection that damps a mode.

The deflection y of mode k drives a filter ξ̈ + 2ζ_f ω_f ξ̇ + ω_f² ξ = ω_f² y and the actuator
gets +κ ξ (C. J. Goh and T. K. Caughey, Int. J. Control 41, 1985; J. L. Fanson and T. K. Caughey,
AIAA Journal 28, 1990).  Where every mode answers in y with the same sign, as for the moment
at the root, the vibrations under this feedback alone are stable exactly when the static loop
gain κ Σ r_m/ω_m² is below one, however many modes there are: the loop softens the arm but
never drives it.  For a mode by itself with static gain g the choice ω_f = ω/√(1−g), ζ_f = √g
puts all four poles on two points of frequency ω and damping ratio ½√(g/(1−g)), up to
g = 0.8, where they become real.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.classical.filters import (
    ANGLES,
    angle_of,
    low_pass,
    model_of,
    not_used,
    picked,
    rigid_arm,
    summed,
)
from slewctl.design.classical.pd_notch import PDWish, pd_law
from slewctl.design.clocked import with_clock
from slewctl.design.mode_numbers import check_modes
from slewctl.design.result import Check, Controller, finished
from slewctl.errors import DesignError, InputError, check_choice, check_each, check_positive, shown
from slewctl.model import Model
from slewctl.plant import GeneralisedPlant, signal
from slewctl.plant.statespace import drive

# Kinds of deflection signal, the one that all modes answer with the same sign first.
_PREFERRED = ("root_moment", "moment", "tip_deflection", "deflection", "tip")
# An answer that is smaller than this fraction of the largest static one is none.
_SILENT = 1e-9


@guarded
@with_clock
def positive_position(
    plant: GeneralisedPlant,
    *,
    bandwidth_hz: float | None = None,
    damping_ratio: float = 0.7,
    modes: Sequence[int] = (1,),
    gain: float | Sequence[float] = 0.2,
    filter_damping: float | None = None,
    signal_used: str = "",
    rolloff_hz: float | None = None,
) -> Controller:
    """Return PD control of the hub angle with positive position feedback of a deflection.

    Parameters
    ----------
    plant : GeneralisedPlant
        It must measure ``theta``, or ``theta_motor``, and a signal that shows the bending:
        ``root_moment``, ``tip_deflection``, a moment or deflection at a station, or ``tip``,
        from which the rigid rotation is subtracted.
    bandwidth_hz, damping_ratio : float
        Of the rigid arm's pair of poles, as in `slewctl.design.classical.pd_notch.pd_notch`.
    modes : list of int
        Flexible modes that get a filter, numbered from 1.
    gain : float, or list of one for each of `modes`
        Static loop gain of the mode by itself, between 0 and 1: the fraction of its
        stiffness that the filter takes away.  Alone the mode gets a damping ratio of
        ½√(gain/(1 − gain)).
    filter_damping : float, optional
        Damping ratio ζ_f of every filter; by default that for which filter and mode end up
        with the same poles.
    signal_used : str
        Sensor to feed back; by default the first measured of those named above.
    rolloff_hz : float, optional
        Corner of the PD law's low-pass filter, ten times the bandwidth by default.

    Returns
    -------
    Controller
        Not verified where the loop on the design model is unstable.

    Raises
    ------
    InputError
        For impossible values, or a mode that the model has not got.
    DesignError
        If no bending is measured, the signal does not show a mode, or the filters together
        would take away all of the arm's stiffness.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1, "root_moment": 0.01}
    >>> problem = sc.Problem(arm, limits={"tip": 0.03, "torque": 1.0}, noise=noise)
    >>> K = sc.positive_position(problem.plant("clamped-free", n=1), bandwidth_hz=0.3)
    >>> problem.judge(K).stable
    True
    """
    start = perf_counter()
    model, rigid = model_of(plant), rigid_arm(plant)
    angle = angle_of(plant)
    if isinstance(modes, str) or not isinstance(modes, Sequence) or not modes:
        raise InputError(
            f"{shown(modes)} names no modes", where="modes", remedy="give a list, as in [1]"
        )
    chosen = check_modes(modes, model.n, "modes")
    gains = _gains(gain, len(chosen))
    damping = None if filter_damping is None else check_positive(filter_damping, "filter_damping")
    law = pd_law(rigid, PDWish.of(bandwidth_hz, damping_ratio, rolloff_hz))
    bending = _bending(plant, model, signal_used)
    filters = [_filter(bending, mode, g, damping) for mode, g in zip(chosen, gains, strict=True)]
    static = _static_gain(bending, filters)
    branches = [(bending.row, (low_pass(f.omega, f.ratio),), f.gain) for f in filters]
    return finished(
        plant,
        summed(plant, [law.branch(plant), *branches], "positive_position"),
        "positive-position",
        {**law.gains, "positive_position": np.array([[f.gain for f in filters]])},
        checks=() if static is None else (Check("static gain of the filters' loop", static, 1.0),),
        assumptions=(
            *law.described(plant, rigid),
            *(f.described(model) for f in filters),
            _condition(bending, static),
            *not_used(plant, (angle, f"{angle}_dot", bending.name)),
        ),
        seconds={"solve": perf_counter() - start},
    )


@dataclass(frozen=True, eq=False)
class _Bending:
    """A measured deflection free of the rigid rotation, and how each mode answers in it.

    Attributes
    ----------
    name : str
    row : ndarray, shape (sensors,)
        The combination of the sensors.
    omega : ndarray, shape (n,)
    residues : ndarray, shape (n,)
        r in y = Σ r_m/(s² + … + ω_m²) u.
    """

    name: str
    row: Array
    omega: Array
    residues: Array

    @property
    def static(self) -> Array:
        """Static answer of each mode."""
        return self.residues / self.omega**2

    @property
    def one_sign(self) -> bool:
        """Whether all modes answer with the same sign."""
        kept = self.static[np.abs(self.static) > _SILENT * np.abs(self.static).max()]
        return bool(np.all(kept > 0) or np.all(kept < 0))


@dataclass(frozen=True)
class _Filter:
    """A positive position filter of one mode: + gain·ω²/(s² + 2ζωs + ω²) on the deflection."""

    mode: int
    share: float
    omega: float
    ratio: float
    gain: float

    def described(self, model: Model) -> str:
        alone = math.sqrt(self.share / (1 - self.share)) / 2
        return (
            f"filter for mode {self.mode} ({model.frequencies_hz[self.mode - 1]:.4g} Hz) at "
            f"{self.omega / (2 * math.pi):.4g} Hz with damping ratio {self.ratio:.3g}; tuned best, "
            f"it would give the mode by itself a damping ratio of {alone:.3g}"
        )


def _gains(given: object, count: int) -> tuple[float, ...]:
    if isinstance(given, Sequence) and not isinstance(given, str):
        if len(given) != count:
            raise InputError(
                f"{len(given)} gains for {count} modes",
                where="gain",
                remedy="give one for each of modes, or a single one for all",
            )
        return check_each(given, "gain", _gain)
    return (_gain(given, "gain"),) * count


def _gain(given: object, where: str) -> float:
    gain = check_positive(given, where)
    if gain >= 1:
        raise InputError(
            f"{gain:g} is not below 1",
            where=where,
            remedy="give the fraction of the mode's stiffness to take away, such as 0.2; "
            "at 1 nothing would be left",
        )
    return gain


def _bending(plant: GeneralisedPlant, model: Model, wanted: object) -> _Bending:
    """Return the deflection to feed back."""
    rows = {}
    for name in plant.sensors:
        sensor = signal(name, beam=model.arm.beam)
        if name not in ANGLES and sensor.of == "displacement":
            rows[name] = sensor.row(model)
    if not rows:
        raise DesignError(
            f"no sensor shows the bending, only {', '.join(plant.sensors)}",
            where="noise",
            remedy="add one, such as noise.root_moment or noise.tip_deflection",
        )
    if not isinstance(wanted, str) or wanted:
        name = check_choice(wanted, rows, "signal_used")
    else:
        name = min(rows, key=lambda key: _PREFERRED.index(key.partition("@")[0]))
    row = rows[name].copy()
    angle, row[0] = float(row[0]), 0.0
    U = model.mode_shapes[:, 1:]
    residues = drive(model.arm, plant.actuator)[0] * U[0] * (row @ U)
    return _Bending(
        name,
        picked(plant, **{name: 1.0}) - picked(plant, **{angle_of(plant): angle}),
        model.omega,
        residues,
    )


def _filter(bending: _Bending, mode: int, share: float, damping: float | None) -> _Filter:
    """Return the filter of a mode.

    The other modes answer at ω_k as if at rest, or as masses, with d; they change what the
    filter sees of itself: its stiffness becomes ω_f²(1 − κd).  Gain and tuning allow for that.
    """
    k = mode - 1
    omega, own = float(bending.omega[k]), float(bending.static[k])
    if abs(own) <= _SILENT * np.abs(bending.static).max():
        raise DesignError(
            f"{bending.name} does not show mode {mode}",
            where="modes",
            remedy="leave the mode out, or measure the bending elsewhere",
        )
    others = np.delete(np.arange(len(bending.omega)), k)
    d = float(np.sum(bending.residues[others] / (bending.omega[others] ** 2 - omega**2)))
    left = own / (own + share * d) if own + share * d != 0 else -1.0  # 1 − κd
    if left <= 0:
        raise DesignError(
            f"the other modes hide mode {mode} in {bending.name} at a gain of {share:g}",
            where="gain",
            remedy="lower it, or measure the bending elsewhere",
        )
    tuned = omega / math.sqrt((1 - share) * left)
    ratio = math.sqrt(share * left) if damping is None else damping
    return _Filter(mode, share, tuned, ratio, share / own * left)


def _static_gain(bending: _Bending, filters: Sequence[_Filter]) -> float | None:
    """Return the static loop gain, or None where modes answer with different signs."""
    if not bending.one_sign:
        return None
    total = float(np.sum(bending.static))
    gain = sum(f.gain for f in filters) * total
    if gain >= 1:
        largest = max(filters, key=lambda f: abs(f.gain))
        raise DesignError(
            f"the filters together would have a static gain of {gain:.3g}, "
            f"{largest.gain * total:.3g} of it for mode {largest.mode}, and at 1 nothing is left "
            "of the arm's stiffness",
            where="gain",
            remedy=f"lower that of mode {largest.mode}, or leave the mode out",
        )
    return gain


def _condition(bending: _Bending, static: float | None) -> str:
    if static is None:
        return (
            f"modes answer in {bending.name} with different signs: no static gain guarantees "
            "stability, the closed loop's poles alone decide"
        )
    return (
        f"all modes answer in {bending.name} with one sign: by themselves the filters leave the "
        f"vibrations stable as long as their static gain, {static:.3g}, is below 1"
    )
