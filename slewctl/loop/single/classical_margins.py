"""Margins of a stable single loop, continuous or sampled, none of them from a grid.

With light damping a resonance is narrower than any frequency grid.  The whole axis is taken
in intervals instead, each of which proves what it is asked (`certificate`).
"""

from __future__ import annotations

import numpy as np

from slewctl.errors import AccuracyError, InputError, check_number
from slewctl.loop.parts import System, state_space
from slewctl.loop.single.axis_ends import WIDEST, UndecidedError
from slewctl.loop.single.certificate import (
    NARROW,
    UnprovedStabilityError,
    certified_margins,
    margins_of,
)
from slewctl.loop.single.factored_loop import FactoredLoop, factored
from slewctl.loop.single.margin_results import Margins
from slewctl.loop.single.mode_names import Modes, modes_of_loop
from slewctl.loop.single.stability import UnstableLoopError, check_single, require_stable

# Dead time times the fastest pole: half of the digits of the phase there are left.
_LATEST = 1e8


def classical_margins(
    loop: System,
    *,
    skew: float = 0.0,
    modes: Modes | None = None,
    factors: FactoredLoop | None = None,
    within: float = NARROW,
    most_gain: float = WIDEST,
) -> Margins:
    """Return the margins of a loop, if it is stable when closed.

    Parameters
    ----------
    loop : control.StateSpace or control.TransferFunction
        Return ratio L, one input and output, continuous or sampled, closed as 1 + L = 0.
    skew : float
        σ of the disk: 0 is balanced, positive where the gain may rise more than fall.
    modes : Modes, optional
        By which the frequencies are named; otherwise the lightly damped poles of L.
    factors : FactoredLoop, optional
        The same loop as plant and controller, which are better known than their product, and
        its dead time, which `loop` has not got.
    within : float
        How near to each other value and proof are wanted: beyond it twice the digits are taken,
        which cost ten times as much.
    most_gain : float
        The largest gain factor that matters.  Where it is given, the nearest gain limits alone
        are looked for, up to there.

    Returns
    -------
    Margins

    Raises
    ------
    UnstableLoopError
        An unstable loop has no margin.
    AccuracyError
        If nothing can be proved of a loop.
    InputError
        If the loop has several inputs or outputs, an unknown sample time, an entry that is
        not finite, or feedthrough −1, for which 1 + L has no inverse.

    Examples
    --------
    >>> import control as ct
    >>> from slewctl.loop import classical_margins
    >>> m = classical_margins(ct.tf([8], [1, 3, 3, 1]) * 0.5)
    >>> round(10 ** (m.gain_db.value / 20), 9), m.intervals > 0
    (2.0, True)
    """
    light = state_space(loop, "margins")
    check_single(light)
    check_number(skew, "skew")
    if abs(1 + float(light.D[0, 0])) <= 4 * np.finfo(float).eps:
        raise InputError(
            "the feedthrough of L is -1, so that 1 + L has no inverse",
            where="margins",
            remedy="the loop is not well posed: change its direct feedthrough",
        )
    named = modes or modes_of_loop(light)
    delay = factors.delay if factors else 0.0
    if factors and delay * float(np.abs(factors.poles).max(initial=0.0)) > _LATEST:
        raise InputError(
            f"the dead time of {delay:g} s is beyond all that the loop does: its phase would be "
            "rounding alone",
            where="delay",
            remedy="give it in seconds",
        )
    try:
        # Beside a pole bounds are infinite, and what follows from them undecided.
        with np.errstate(all="ignore"):
            return certified_margins(
                factors or factored(light), light, skew, named, within, most_gain
            )
    except UndecidedError as error:
        if not delay:
            require_stable(light)  # says which poles are not
            if isinstance(error, UnprovedStabilityError):
                with np.errstate(all="ignore"):
                    return margins_of(error.found, light, skew, named, (str(error),))
        late = " with dead time" if delay else ""
        raise AccuracyError(
            f"nothing is certain of the loop{late}: {error}",
            where="delay" if delay else "margins",
            remedy="look at the loop without it, and at its delay margin"
            if delay
            else "give modes some damping, or take out what feedback does not move",
        ) from error
    except UnstableLoopError:
        if not delay:
            require_stable(light)  # says which poles
        raise
