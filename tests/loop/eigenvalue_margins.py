"""Margins of a stable single loop from eigenvalues: a second opinion on those from intervals.

The frequencies where |L| = 1 or L is real are eigenvalues (`eigenvalue_crossings`), the
smallest distance to −1 is enclosed by level sets, and the poles of changed loops are asked
whether they agree (`eigenvalue_doubts`).
"""

from __future__ import annotations

import numpy as np
from eigenvalue_crossings import all_sampled, nearest, sine, truly_real
from eigenvalue_doubts import Limit, gain_doubts, phase_doubts

from slewctl.loop.single.crossings import Crossings, Samples, crossings, log_gain
from slewctl.loop.single.margin_report import Report
from slewctl.loop.single.margin_results import Margins
from slewctl.loop.single.mode_names import Modes, modes_of_loop
from slewctl.loop.single.perturbation import Changed
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.linear_system import LinearSystem

# |L| is one at all frequencies when it differs by no more than this and its rounding.
_ALL_PASS = 1e-10
# L is known where it is this much larger than its rounding error.
_KNOWN = 0.1


def eigenvalue_margins(
    light: LinearSystem, *, skew: float = 0.0, modes: Modes | None = None
) -> Margins:
    """Return the margins of a loop that is stable when closed.

    Gain and phase margins are exact to rounding, typically 1e-9 relative, and modulus and
    disk margins within `PEAK_TOLERANCE`.  What only touches a limit, within about 1e-10, is
    undecidable in double precision and may count as a crossing or not.

    Parameters
    ----------
    light : LinearSystem
        Return ratio L, one input and output, stable when closed as 1 + L = 0.
    skew, modes
        See `classical_margins`.
    """
    broken = BrokenLoop(light)
    samples = all_sampled(broken)
    gain = crossings(broken, samples, log_gain)
    limits = _gain_limits(broken, truly_real(broken, crossings(broken, samples, sine)))
    report = Report(
        broken.response,
        broken.D,
        broken.last,
        broken.step,
        not len(broken.A),
        modes or modes_of_loop(light),
        Changed(light),
    )
    modulus, disk = nearest(broken, samples, 1.0), nearest(broken, samples, skew)
    turns = -np.angle(-broken.response(gain.omega))
    doubts = gain_doubts(broken, limits)
    if _all_pass(samples):
        phase, delay = report.all_pass()
    else:
        doubts += phase_doubts(broken, turns, gain.omega, gain.rising)
        above = bool(np.median(log_gain(samples.values)) > 0) if not len(turns) else False
        phase, delay = (
            report.phase(turns, gain.omega, above),
            report.delay(turns, gain.omega, above),
        )
    pairs = [(limit.value, limit.omega) for limit in limits]
    balanced = 1 / disk.value if disk.value else np.inf
    found = {
        "gain_db": report.gain(pairs, "rise"),
        "gain_reduction_db": report.gain(pairs, "fall"),
        "phase_deg": phase,
        "delay_s": delay,
        "modulus": report.nearest("modulus", 1 / modulus.value, modulus.omega, 1.0),
        "disk": report.nearest("disk", balanced, disk.omega, skew),
    }
    return Margins(
        **report.named(found),
        gain_crossings_hz=tuple(float(w) / (2 * np.pi) for w in gain.omega),
        confirmed=not doubts,
        skew=float(skew),
        doubts=tuple(doubts),
        crossings=report.all_crossings(pairs, turns, gain.omega),
    )


def _all_pass(samples: Samples) -> bool:
    size = np.abs(samples.values)
    clear = np.isfinite(samples.rounding)
    return bool(np.all(np.abs(size - 1)[clear] <= _ALL_PASS + 10 * samples.rounding[clear]))


def _gain_limits(loop: BrokenLoop, real: Crossings) -> list[Limit]:
    """Return all gain factors at which a pole lies on the limit, increasing."""
    if not len(loop.A):
        return [Limit(-1 / loop.D, np.inf)] if loop.D < 0 else []
    omega = np.concatenate([[0.0], real.omega, [loop.response.nyquist] if loop.step else []])
    values, doubtful = loop.response(omega), loop.response.uncertainty(omega)
    found = []
    for w, value, rounding in zip(omega.tolist(), values.tolist(), doubtful, strict=True):
        # A double integrator in rounded coordinates has a finite, meaningless L(0).
        if w and not rounding < _KNOWN * abs(value):
            value, rounding = loop.solved(w)
        if rounding < _KNOWN * abs(value) < np.inf and value.real < 0:
            found.append(Limit(-1 / value.real, w))
    if not loop.step and loop.D < 0:
        found.append(Limit(-1 / loop.D, np.inf))
    return sorted(found, key=lambda limit: limit.value)
