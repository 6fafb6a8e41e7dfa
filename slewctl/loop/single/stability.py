"""Why a single loop has no margins: the poles that are not stable, and which are hidden."""

from __future__ import annotations

import numpy as np

from slewctl._types import ComplexArray
from slewctl.errors import InputError, SlewctlError
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.linear_system import LinearSystem

# A pole that neither input nor output of L reaches by more than this, relative, is hidden.
_HIDDEN = 1e-9


class UnstableLoopError(SlewctlError):
    """Something was asked of an unstable loop that only a stable one has."""


def check_single(loop: LinearSystem) -> None:
    """Refuse what is not one loop of finite numbers with a known sample time."""
    if loop.ninputs != 1 or loop.noutputs != 1:
        raise InputError(
            "the loop has several inputs or outputs",
            where="margins",
            remedy="give one loop as a control.StateSpace, broken at one point",
        )


def require_stable(loop: LinearSystem) -> None:
    """Raise `UnstableLoopError` with the poles that are not stable, and which are hidden."""
    check_single(loop)
    broken = BrokenLoop(loop)
    if 1 + broken.D == 0 or not broken.unstable(1.0)[1]:
        return  # 1 + D = 0 is refused in its own words
    poles = broken.poles
    growth = broken.growth(poles)
    bad = poles[(growth >= min(0.0, float(growth.max()))) & (poles.imag >= 0)]
    hidden = [pole for pole in bad if _hidden(broken, pole)]
    remedy = "change the design; the loop's poles say where it fails"
    what = f"the closed loop is not stable: {_listed(broken, bad)}"
    if hidden:
        what += (
            f"; {_listed(broken, np.array(hidden))} is hidden: plant and controller cancel it, "
            "so that it does not show in L and no feedback moves it"
        )
        remedy = "do not cancel poles that are not stable"
    elif broken.stable_if_reversed:
        what += "; with the opposite sign of the feedback it is stable"
        remedy = "look at `sign`: it is -1, negative feedback, unless told otherwise"
    raise UnstableLoopError(what, where="margins", remedy=remedy)


def _hidden(loop: BrokenLoop, pole: complex) -> bool:
    """Whether input or output of L does not reach a pole (Popov–Belevitch–Hautus)."""
    size = max(float(np.linalg.norm(loop.A, 2)), float(np.finfo(float).tiny))
    shifted = (loop.A - pole * np.eye(len(loop.A))) / size
    b = loop.B / (np.linalg.norm(loop.B) or 1.0)
    c = loop.C / (np.linalg.norm(loop.C) or 1.0)
    reach = [
        np.linalg.svd(np.hstack([shifted, b]), compute_uv=False)[-1],
        np.linalg.svd(np.vstack([shifted, c]), compute_uv=False)[-1],
    ]
    return bool(min(reach) < _HIDDEN)


def _listed(loop: BrokenLoop, poles: ComplexArray) -> str:
    """Return at most three poles in words: s in rad/s, or z."""
    letter, shift, unit = ("z", 1.0, "") if loop.step else ("s", 0.0, " rad/s")
    ordered = poles[np.argsort(-loop.growth(poles))]
    names = []
    for pole in ordered[:3] + shift:
        turning = f" ± {pole.imag:.4g}j" if pole.imag else ""
        names.append(f"{letter} = {pole.real:.4g}{turning}{unit}")
    more = f" and {len(poles) - 3} more" if len(poles) > 3 else ""
    return ("pole " if len(poles) == 1 else "poles ") + ", ".join(names) + more
