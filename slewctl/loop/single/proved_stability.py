"""On which side of its limit the stability of a loop is, where computed poles cannot tell."""

from __future__ import annotations

import numpy as np

from slewctl.loop.single.axis_ends import UndecidedError
from slewctl.loop.single.certificate import certify
from slewctl.loop.single.factored_loop import FactoredLoop
from slewctl.loop.single.stability import UnstableLoopError


def proved_stability(loop: FactoredLoop) -> bool | None:
    """Return whether a loop is stable by the argument principle; None where that is undecided.

    A flexible mode that is hardly damped and hardly moved has a pole nearer to the axis than
    the rounding of any eigenvalue of the closed loop; 1 + L on intervals of the axis knows it.

    Parameters
    ----------
    loop : FactoredLoop
    """
    found = _proved(loop)
    # Long numbers cost ten times as much: only where they are wanted.
    if found is None and (longer := loop.longer):
        found = _proved(longer)
    return found


def _proved(loop: FactoredLoop) -> bool | None:
    try:
        with np.errstate(all="ignore"):  # beside a pole bounds are infinite
            unstable = certify(loop).unstable
    except UndecidedError:
        return None
    except UnstableLoopError:
        return False
    return None if unstable is None else unstable == 0
