"""Identification: adjust chosen properties of an arm to its measured frequencies, or to more.

The residual of mode k is f_k(p)/f_k − 1.  `Fit` says how well each property is known: its
covariance is (JᵀΣ⁻¹J)⁻¹, and what the measurements cannot tell apart is found from the null
space of J and named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, overload

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import Arm, require_beam
from slewctl.errors import (
    AccuracyError,
    InputError,
    check_choice,
    check_count,
    check_positive,
    shown,
)
from slewctl.measured.fit_problem import Problem, solve
from slewctl.measured.fit_result import Estimate, Fit
from slewctl.measured.fit_rig import fit_rig
from slewctl.measured.log import Log
from slewctl.measured.response import Response, as_response, is_frd
from slewctl.measured.rig_fit_result import RigFit
from slewctl.measured.undetermined import coupled_groups
from slewctl.model.adjustable import ADJUSTABLE, Adjustable
from slewctl.model.assembly import check_arm
from slewctl.model.locked import BOUNDARIES, frequencies
from slewctl.model.locked import Frequencies as Converged
from slewctl.model.ritz import Boundary

if TYPE_CHECKING:
    from control import FrequencyResponseData

_DETERMINED = 1e-6  # relative singular value
_DISCRETISATION = 1e-10  # relative change of the frequencies that needs a larger basis
_ACCEPTABLE = 1e-6  # relative error of a computed frequency, below that of any measurement

Frequencies = Sequence[float] | Mapping[int, float]


@overload
def fit(
    arm: Arm, measured: Response | Log | FrequencyResponseData, free: Sequence[str]
) -> RigFit: ...
@overload
def fit(
    arm: Arm,
    measured: Frequencies,
    free: Sequence[str],
    boundary: Boundary = "hub-locked",
    uncertainty: float | Mapping[int, float] | None = None,
) -> Fit: ...
@single_threaded
def fit(
    arm: Arm,
    measured: Response | Log | FrequencyResponseData | Frequencies,
    free: Sequence[str],
    boundary: Boundary | None = None,
    uncertainty: float | Mapping[int, float] | None = None,
) -> Fit | RigFit:
    """Adjust properties of `arm` to what was measured of it, by least squares.

    Parameters
    ----------
    arm : Arm
        Where to start, and what stays as it is.
    measured : sequence or mapping of float, Response, Log or control.FrequencyResponseData
        Natural frequencies in Hz: a sequence holds modes 1, 2, …; a mapping such as
        ``{1: 4.12, 3: 71.0}`` leaves modes out.  A frequency response is fitted in magnitude
        and phase, weighted by its deviations (where there are any) and from many starts.  A
        log is fitted as it is, without windows: the lightest mode keeps its damping.
    free : sequence of str
        What to adjust: ``beam.stiffness`` and ``beam.mass`` (factors on the arm's own),
        ``payload.mass``, ``payload.inertia``, ``hub.inertia``, ``hub.radius``,
        ``joint.stiffness``; to a response or a log also ``hub.friction``, ``damping`` (a factor
        on all of it) or ``damping.1``, ``damping.2``, … (the ratio of one mode), ``delay`` (s)
        and ``gain``.
    boundary : {"hub-locked", "rotor-locked", "free"}, optional
        Of frequencies: whether the hub was held (so by default), or the rotor behind an elastic
        joint, or turned freely without torque.
    uncertainty : float or mapping of mode number to float, optional
        Relative standard deviation of measured frequencies.  Without it the same one is taken
        for all modes and estimated from the residuals, which needs more measurements than
        free properties.

    Returns
    -------
    Fit or RigFit
        The adjusted arm, with standard deviations, correlations and residuals; it says
        which properties the measurements do not determine.  A `RigFit`, of a response or a log,
        also has gain, dead time, poles and zeros, and the uncertainty as `variations`.

    Raises
    ------
    InputError
        For impossible frequencies, unknown names, or more free properties than
        measurements.
    AccuracyError
        If the search, or the frequencies of the adjusted arm, do not converge.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> found = sc.fit(arm, {1: 0.9}, free=["beam.stiffness"])
    >>> round(float(sc.hub_locked_frequencies_hz(found.arm, 1)[0]), 3)
    0.9

    A log, here of a simulated rig:

    >>> rig = sc.Arm(arm.beam, sc.Hub(0.25), damping_ratio=0.01)
    >>> log = sc.simulated_log(rig, sc.prbs(1500, hold=4, seed=1), 0.02, noise=1e-3)
    >>> found = sc.fit(arm, log, free=["hub.inertia"])
    >>> round(found["hub.inertia"].value, 2)
    0.25
    """
    if isinstance(measured, Response | Log) or is_frd(measured):
        if boundary is not None or uncertainty is not None:
            raise InputError(
                "boundary and uncertainty are those of measured frequencies",
                where="fit",
                remedy="leave them out; a response has deviations of its own",
            )
        data = measured if isinstance(measured, Log) else as_response(measured, "fit.measured")
        return fit_rig(arm, data, free)
    return _fit_frequencies(arm, measured, free, boundary or "hub-locked", uncertainty)


def _fit_frequencies(
    arm: Arm,
    measured: object,
    free: Sequence[str],
    boundary: Boundary,
    uncertainty: float | Mapping[int, float] | None,
) -> Fit:
    problem = _pose(arm, measured, free, boundary, uncertainty)
    while True:
        coordinates = solve(problem)
        exact = frequencies(problem.arm_at(coordinates), problem.modes[-1], boundary)
        change = np.abs(_residuals(problem, exact) - problem.residuals(coordinates)).max()
        if change <= _DISCRETISATION or problem.functions >= exact.functions:
            break
        problem = replace(problem, functions=exact.functions)
    if exact.relative_errors.max() > _ACCEPTABLE:
        raise AccuracyError(
            f"the adjusted arm's frequencies are known to {exact.relative_errors.max():.0e} only",
            where="fit",
            remedy="leave out the highest modes",
        )
    return _report(problem, coordinates, exact)


def _pose(
    arm: Arm,
    measured: object,
    free: Sequence[str],
    boundary: Boundary,
    uncertainty: float | Mapping[int, float] | None,
) -> Problem:
    """Check what the user gave and put it in order."""
    check_arm(arm, "fit")
    require_beam(arm.beam, "fit")
    check_choice(boundary, BOUNDARIES, "fit.boundary")
    by_mode = _by_mode(measured)
    adjustable = _adjustable(free)
    if len(adjustable) > len(by_mode):
        raise InputError(
            f"{len(adjustable)} free properties but {len(by_mode)} measured frequencies",
            where="fit.free",
            remedy="free fewer properties or measure more modes",
        )
    modes = tuple(by_mode)
    return Problem(
        arm,
        adjustable,
        boundary,
        modes,
        np.array([*by_mode.values()]),
        _scatter(uncertainty, modes),
        frequencies(arm, modes[-1], boundary).functions,
    )


def _by_mode(measured: object) -> dict[int, float]:
    """Return the measured frequencies by increasing mode number."""
    where = "fit.measured"
    if isinstance(measured, Mapping):
        pairs = list(measured.items())
    elif isinstance(measured, Sequence | np.ndarray) and not isinstance(measured, str):
        pairs = list(enumerate(measured, 1))
    else:
        pairs = []
    if not pairs:
        raise InputError(
            f"{shown(measured)} holds no frequencies", where=where, remedy="give a list in Hz"
        )
    found = {
        check_count(mode, f"{where} mode"): check_positive(hz, f"{where}[{mode}]")
        for mode, hz in pairs
    }
    ordered = dict(sorted(found.items()))
    if np.any(np.diff([*ordered.values()]) <= 0):
        raise InputError(
            f"{shown([*ordered.values()])} does not increase with the mode number",
            where=where,
            remedy="sort the frequencies, or give a mapping of mode number to frequency",
        )
    return ordered


def _adjustable(free: object) -> tuple[Adjustable, ...]:
    """Return the properties that the user named."""
    if not isinstance(free, Sequence) or isinstance(free, str) or not free:
        raise InputError(
            f"{shown(free)} is not a list of properties",
            where="fit.free",
            remedy=f"give some of {', '.join(ADJUSTABLE)}",
        )
    names = [check_choice(name, ADJUSTABLE, "fit.free") for name in free]
    if len(set(names)) < len(names):
        raise InputError(
            f"{shown(names)} names one twice", where="fit.free", remedy="name each once"
        )
    return tuple(ADJUSTABLE[name] for name in names)


def _scatter(uncertainty: object, modes: tuple[int, ...]) -> Array | None:
    """Return the relative standard deviation of each measurement, or None."""
    where = "fit.uncertainty"
    if uncertainty is None:
        return None
    if not isinstance(uncertainty, Mapping):
        return np.full(len(modes), check_positive(uncertainty, where))
    if set(uncertainty) != set(modes):
        raise InputError(
            f"given for modes {shown([*uncertainty])}, measured are {shown([*modes])}",
            where=where,
            remedy="give one number for all, or one for each measured mode",
        )
    return np.array([check_positive(uncertainty[mode], f"{where}[{mode}]") for mode in modes])


def _residuals(problem: Problem, exact: Converged) -> Array:
    return exact.hz[np.array(problem.modes) - 1] / problem.measured_hz - 1


def _report(problem: Problem, coordinates: Array, exact: Converged) -> Fit:
    """Judge a solution: scatter, covariance, and what is not determined."""
    residuals = _residuals(problem, exact)
    null_space = problem.null_space(coordinates)
    spare = len(residuals) - len(coordinates) + null_space.shape[1]
    scatter, factor = problem.uncertainty, 1.0
    if scatter is None:
        sigma = float(np.sqrt(np.sum(residuals**2) / spare)) if spare else np.nan
        scatter, factor = np.full(len(residuals), sigma), sigma**2
    groups = coupled_groups(null_space @ null_space.T)
    lost = [j for group in groups for j in group]
    covariance = factor * _covariance(problem, coordinates)
    covariance[lost, :] = covariance[:, lost] = np.nan
    spread = np.sqrt(np.diag(covariance))
    spread[lost] = np.inf
    return Fit(
        problem.arm_at(coordinates),
        problem.boundary,
        problem.modes,
        problem.measured_hz,
        problem.measured_hz * (1 + residuals),
        residuals,
        scatter,
        problem.uncertainty is not None,
        _estimates(problem, coordinates, spread),
        covariance,
        tuple(tuple(problem.free[j].name for j in group) for group in groups),
        spare,
        float(exact.relative_errors.max()),
    )


def _estimates(problem: Problem, coordinates: Array, spread: Array) -> tuple[Estimate, ...]:
    at_limit = ~problem.logarithmic & (coordinates == 0)
    values = problem.values(coordinates)
    return tuple(
        Estimate(
            each.name,
            each.unit,
            each.read(problem.arm),
            float(values[j]),
            float(spread[j]),
            bool(at_limit[j]),
        )
        for j, each in enumerate(problem.free)
    )


def _covariance(problem: Problem, coordinates: Array) -> Array:
    """Return (JᵀΣ⁻¹J)⁻¹ of the properties in their units, on the determined directions."""
    inverse = np.linalg.pinv(problem.sensitivity(coordinates), rcond=_DETERMINED)
    slopes = problem.slopes(coordinates) * problem.sizes(coordinates)
    return (inverse @ inverse.T) * np.outer(slopes, slopes)
