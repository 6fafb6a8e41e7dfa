"""Identification: adjust an arm, with gain and dead time, to a response or to a log."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.errors import AccuracyError, InputError, SlewctlError
from slewctl.measured.estimate import estimate_response
from slewctl.measured.fit_record import Solution, fit_record
from slewctl.measured.fit_result import Estimate
from slewctl.measured.log import Log
from slewctl.measured.record_data import RecordData
from slewctl.measured.redrawn import widened
from slewctl.measured.response import Response
from slewctl.measured.response_data import ResponseData, channel_of, highest_seen, thinned
from slewctl.measured.rig_fit_result import RigFit
from slewctl.measured.rig_model import modes_for
from slewctl.measured.rig_parameters import DELAY, Rig, parameters, with_dead_time
from slewctl.measured.rig_problem import RigProblem
from slewctl.measured.roots import Root, figures, poles_and_zeros, seen
from slewctl.measured.undetermined import coupled_groups
from slewctl.measured.units import unit_of
from slewctl.model.assembly import check_arm
from slewctl.plant.dead_time import loop_dead_time

# A direction is not determined in which a change as large as the properties themselves makes
# less than this, in standard deviations, or, relative to the best known, less than rounding.
_VISIBLE, _ROUNDING = 0.3, 1e-6
# Steps of the first descents, how many go on and for how long, and the fall of the squares
# that ends them.
_FIRST, _SHORT, _SECONDS, _SECOND, _ROUGH = 6, 1e-8, 2, 40, 1e-3
# Mean cosine of the phase by which measured and fitted response differ: they are opposite.
_MIRRORED = -0.3
# Of an encoder's rounding: more noise than this is something else.
_QUIET = 2.0
_DEGREES = 0.3  # of a logarithm: so near to 180/π is a gain asked about
_FAR = 30.0  # a factor from where it started that is worth a word
_NOT_CLOSE = 1.5  # root-mean-square residual, in stated deviations, that is worth a word
_HALF = 0.5  # of a log's output: a rig through which the input makes less is doubted


def fit_rig(arm: Arm, measured: Response | Log, free: Sequence[str]) -> RigFit:
    """Return the fit of `arm` to a response or a log; see `fit`."""
    check_arm(arm, "fit")
    log = measured if isinstance(measured, Log) else None
    if isinstance(measured, Log):
        response = estimate_response(measured)
    else:
        response = measured.at_points(measured.values != 0)  # zero has no logarithm
    highest = highest_seen(response)
    found = parameters(arm, free, channel_of(response), highest)
    data = ResponseData(thinned(response) if log else response, modes_for(arm, highest))
    if not log and 2 * len(data.response.values) <= len(found):
        raise InputError(
            f"{len(found)} free properties but {len(data.response.values)} points",
            where="fit.free",
            remedy="free fewer properties or measure at more frequencies",
        )
    known = loop_dead_time(arm, [response.sensor])
    problem = RigProblem(Rig(arm, delay=known), found)
    if log:
        solution = _on_log(problem, data, log, highest)
    else:
        near = _near(problem, data)
        if _mirrored(problem.rig_at(near), data):
            raise _opposite()
        solution = _on_response(problem, data, near)
    return _result(problem, data, response, log, solution)


def _on_log(problem: RigProblem, data: ResponseData, log: Log, highest: float) -> Solution:
    """Return the fit to a log: from near its response, and from the arm as it was given.

    A record of a few periods resolves no resonance in the averages that a response is made of.
    """
    starts = [_settled(problem, data, problem.start())]
    with suppress(AccuracyError):
        starts.insert(0, _near(problem, data))
    delay = max(problem.rig_at(x).delay for x in starts)

    def record() -> RecordData:
        return RecordData(log, data.modes, highest, delay)

    rig = problem.rig_at(starts[0])
    if _mirrored(rig, data):
        asked = record()
        if asked.unlikely(replace(rig, gain=-rig.gain)) < asked.unlikely(rig):
            raise _opposite()
    return fit_record(problem.no_later_than(record().latest), record, starts)


def _settled(problem: RigProblem, data: ResponseData, x: Array) -> Array:
    """Return coordinates with the gain and the dead time that fit the response best."""
    x = problem.with_gain(x, data.log_gain(problem.rig_at(x)))
    return problem.with_phase(x, data.misfit)


def _near(problem: RigProblem, data: ResponseData) -> Array:
    """Return coordinates near the least squares of a response, from many starts."""

    def residual(x: Array) -> Array:
        return data.residual(problem.rig_at(x))

    def slopes(x: Array) -> Array:
        return problem.differences(data.residual, x, residual(x))

    def misfit(x: Array) -> float:
        return data.misfit(problem.rig_at(x))

    def descended(starts: Sequence[Array], steps: int, tolerance: float) -> list[Array]:
        """Return where the descents end, nearest first; one that leaves all arms ends nowhere."""
        ends = []
        for x in starts:
            with suppress(SlewctlError):
                end = problem.descend(
                    residual, slopes, x, robust=True, steps=steps, tolerance=tolerance
                )
                ends.append((misfit(end), end))
        return [end for _, end in sorted(ends, key=lambda pair: pair[0])]

    starts = problem.starts(data.magnitudes_off, partial(_settled, problem, data))
    rough = descended(starts, _FIRST, _SHORT)
    best = descended(rough[:_SECONDS], _SECOND, _ROUGH)
    if not best:
        raise AccuracyError(
            "no arm near the one given has such a response",
            where="fit",
            remedy="free fewer properties, or start from an arm closer to the measured one",
        )
    return best[0]


def _mirrored(rig: Rig, data: ResponseData) -> bool:
    """Return whether a sensor or an actuator seems to be wired the other way round."""
    # Among the slowest points, where a dead time counts for little.
    turn = data.ratio(replace(rig, delay=0.0)).imag[: -(-len(data.deviation) // 4)]
    return bool(np.mean(np.cos(turn)) < _MIRRORED)


def _opposite() -> InputError:
    return InputError(
        "the response has the opposite sign of the arm's",
        where="fit.measured",
        remedy="turn the sign of the input or of the output",
    )


def _on_response(problem: RigProblem, data: ResponseData, start: Array) -> Solution:
    def residual(x: Array) -> Array:
        return data.residual(problem.rig_at(x))

    def jacobian(x: Array) -> Array:
        return problem.differences(data.residual, x)

    best = problem.descend(residual, jacobian, start, robust=True, held=data.scatter_known)
    left = residual(best)
    spare = max(len(left) - len(best), 1)
    # Large ones count as the search has counted them.
    scatter = float(np.sqrt(np.sum(np.minimum(left**2, 9 * np.median(left**2))) / spare))
    if data.scatter_known:
        scatter = max(scatter, 1.0)
    return Solution(best, jacobian(best), scatter, spare)


def _result(
    problem: RigProblem,
    data: ResponseData,
    response: Response,
    log: Log | None,
    solution: Solution,
) -> RigFit:
    x = solution.coordinates
    sizes = np.where(problem.logarithmic, 1.0, np.maximum(x, 1.0))
    _, singular, rows = np.linalg.svd(solution.jacobian * sizes, full_matrices=False)
    least = max(_VISIBLE * solution.scatter, _ROUNDING * singular[0])
    null = rows[singular <= least]
    groups = coupled_groups(null.T @ null)
    lost = [j for group in groups for j in group]
    inverse = np.linalg.pinv(solution.jacobian * sizes, rcond=least / singular[0])
    inner = solution.scatter**2 * (inverse @ inverse.T) * np.outer(sizes, sizes)
    if solution.redrawn is not None:
        inner = widened(inner, solution.redrawn)
    slopes = problem.slopes(x)
    covariance = inner * np.outer(slopes, slopes)
    covariance[lost, :] = covariance[:, lost] = np.nan
    spread = np.sqrt(np.diag(covariance))
    spread[lost] = np.inf
    values, limits = problem.values(x), problem.at_bounds(x)
    estimates = tuple(
        Estimate(
            each.name, each.unit, each.start, float(values[j]), float(spread[j]),
            bool(limits[j]),
        )
        for j, each in enumerate(problem.free)
    )  # fmt: skip
    rig = problem.rig_at(x)
    fit = RigFit(
        with_dead_time(rig.arm, data.channel.sensor, rig.delay),
        rig.gain,
        rig.delay,
        response,
        data.modes.count,
        estimates,
        tuple(each.of_arm for each in problem.free),
        tuple(each.positive for each in problem.free),
        covariance,
        tuple(tuple(problem.free[j].name for j in group) for group in groups),
        solution.scatter,
        solution.spare,
        _roots(problem, data, response, x, inner),
        log,
        solution.explained,
        (),
    )
    return replace(fit, remarks=tuple(_remarks(fit, data, solution)))


def _roots(
    problem: RigProblem, data: ResponseData, response: Response, x: Array, covariance: Array
) -> tuple[Root, ...]:
    """Return poles and zeros that the response shows, with deviations that the fit gives them."""
    highest = highest_seen(response)
    found: list[Root] = []
    for place, kind in enumerate(("pole", "zero")):

        def told(rig: Rig, place: int = place) -> Array:
            return figures(poles_and_zeros(rig, data.channel, data.modes)[place])

        here = told(problem.rig_at(x))
        slopes = problem.differences(told, x)
        deviation = np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes))
        half = len(here) // 2
        for k in range(half):
            if here[k] > highest:
                break
            measured = seen(response, float(here[k]), kind)
            found.append(
                Root(
                    kind, float(here[k]), float(deviation[k]),
                    float(here[half + k]), float(deviation[half + k]), *measured,
                )
            )  # fmt: skip
    return tuple(found)


def _remarks(fit: RigFit, data: ResponseData, solution: Solution) -> list[str]:
    told = [
        f"{each.name} is hardly determined: its deviation is "
        f"{each.standard_deviation / each.value:.0%} of it"
        for each in fit.estimates
        if not each.at_limit
        and each.value
        and np.isfinite(each.standard_deviation)
        and each.standard_deviation > each.value / 2
    ]
    told += [
        f"{each.name} is {each.value / each.start:.2g} times what the fit started with: look at "
        "the response beside the fitted one"
        for each in fit.estimates
        if each.start and not 1 / _FAR < each.value / each.start < _FAR and each.name != DELAY
    ]
    if fit.response.unit.startswith("rad") and abs(np.log(fit.gain * np.pi / 180)) < _DEGREES:
        told.append(
            f"a gain of {fit.gain:.3g} is nearly that of degrees: is {fit.response.sensor} in "
            f"degrees? Then call it {fit.response.sensor}_deg"
        )
    if fit.explained < _HALF:
        told.append(
            f"through this arm the input makes only {fit.explained:.0%} of the output: look at "
            "the response beside the fitted one before anything of it is believed"
        )
    told += [
        f"{each.name} is at the limit of what is looked for: the fit is doubtful"
        for each in fit.estimates
        if each.at_limit and each.value
    ]
    if fit.log is None and data.scatter_known and fit.scatter > _NOT_CLOSE:
        told.append(
            f"the residuals are {fit.scatter:.2g} times what the coherence allows: the model, or "
            "a resonance narrower than the resolution, is off; intervals are widened by it"
        )
    if fit.log is None and not data.scatter_known:
        told.append(f"scatter: {fit.scatter:.2g} relative, from the residuals")
    dry, _ = solution.dry
    if np.isfinite(dry):
        told.append(
            f"dry friction of about {dry:.2g} {unit_of(data.channel.actuator)} at the hub is told "
            "apart by the sign of its rate; intervals are widened by what wrong signs do"
        )
    if solution.noise > _QUIET:
        told.append(f"the noise is {solution.noise:.2g} times an encoder's rounding")
    return told
