"""A lead compensator on the hub angle."""

from __future__ import annotations

import math
from time import perf_counter

import numpy as np

from slewctl.design.breakdown import guarded
from slewctl.design.classical.filters import (
    Section,
    angle_of,
    check_frequency,
    in_series,
    lead_section,
    low_pass,
    not_used,
    picked,
    response,
    rigid_arm,
    summed,
)
from slewctl.design.clocked import with_clock
from slewctl.design.result import Check, Controller, finished
from slewctl.errors import DesignError, InputError, check_positive
from slewctl.plant import GeneralisedPlant

# The low-pass filter starts this far above the crossover unless told otherwise.
_ROLLOFF = 10.0
# Of what was asked for, recomputed: rounding of a few multiplications, generously.
_TOLERANCE = 1e-9


@guarded
@with_clock
def lead(
    plant: GeneralisedPlant,
    *,
    crossover_hz: float | None = None,
    phase_lead_deg: float = 50.0,
    rolloff_hz: float | None = None,
) -> Controller:
    """Return a lead compensator on the hub angle, with a low-pass filter of second order.

    Parameters
    ----------
    plant : GeneralisedPlant
        It must measure ``theta``, or ``theta_motor``; other sensors are not used.
    crossover_hz : float
        Where the loop around the rigid arm has gain one; it has no default.
    phase_lead_deg : float
        Phase of the whole controller there, the low-pass filter's lag made up for: the phase
        margin of the rigid arm without friction.
    rolloff_hz : float, optional
        Corner of the low-pass filter, ten times the crossover by default.

    Returns
    -------
    Controller
        Not verified where the loop on the design model is unstable.

    Raises
    ------
    InputError
        For impossible values.
    DesignError
        If the angle is not measured, or one lead cannot give the phase.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.lead(plant, crossover_hz=0.3)
    >>> problem.judge(K).stable
    True
    """
    start = perf_counter()
    rigid = rigid_arm(plant)
    angle = angle_of(plant)
    crossover = (
        2 * math.pi * check_frequency(crossover_hz, "crossover_hz", "where the loop has gain one")
    )
    corner = _ROLLOFF * crossover
    if rolloff_hz is not None:
        corner = 2 * math.pi * check_positive(rolloff_hz, "rolloff_hz")
    if corner <= crossover:
        raise InputError(
            f"{corner / (2 * math.pi):g} Hz is not above the crossover",
            where="rolloff_hz",
            remedy="give several times crossover_hz",
        )
    wanted = math.radians(check_positive(phase_lead_deg, "phase_lead_deg"))
    smooth = low_pass(corner)
    sections = (_lead(crossover, wanted - float(np.angle(smooth.at(1j * crossover)))), smooth)
    s = 1j * crossover
    arm = rigid.torque_per_unit / (rigid.inertia * s**2 + rigid.drag * s)
    gain = 1 / abs(arm * response(sections, s))
    system = summed(plant, [(picked(plant, **{angle: 1.0}), sections, -gain)], "lead")
    A, B, C, D = in_series(sections)
    found = (C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)[0, 0] * gain
    zero, pole = sections[0].numerator, sections[0].denominator
    return finished(
        plant,
        system,
        "lead",
        {"lead": np.array([[gain]])},
        checks=(
            Check("gain at the crossover, rigid arm", abs(abs(found * arm) - 1), _TOLERANCE),
            Check("phase lead at the crossover", abs(np.angle(found) - wanted), _TOLERANCE),
        ),
        assumptions=(
            f"crossover at {crossover / (2 * math.pi):.4g} Hz for {rigid}",
            f"zero at {zero[1] / zero[0] / (2 * math.pi):.4g} Hz, pole at "
            f"{pole[1] / (2 * math.pi):.4g} Hz, low-pass filter of second order at "
            f"{corner / (2 * math.pi):.4g} Hz",
            *not_used(plant, (angle,)),
        ),
        seconds={"solve": perf_counter() - start},
    )


def _lead(omega: float, phase: float) -> Section:
    """Return (1 + s/z)/(1 + s/p) with its largest phase, in rad, at ω."""
    if phase >= math.pi / 2:
        raise DesignError(
            f"a lead of {math.degrees(phase):.3g} degrees, the low-pass filter's lag included, is "
            "more than one compensator can give",
            where="phase_lead_deg",
            remedy="ask for less, or raise rolloff_hz",
        )
    return lead_section(omega, phase)
