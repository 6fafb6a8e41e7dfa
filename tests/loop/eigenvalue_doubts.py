"""The margins checked by poles: stable inside, unstable outside, and as often as was found.

Crossings are found from values of L on the axis.  Poles of closed loops are another
computation: inside the margins none may be unstable, beyond them there must be as many as
the directions of the crossings say, and at 1 ± 1e-6 of each margin the critical pole must
lie on either side of the limit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.loop.single.return_ratio import BrokenLoop

# So far inside and outside of a margin the poles are asked: well above their rounding.
_STEP = 1e-6
# Where a margin is infinite this factor stands for it.
_WIDE = 50.0


@dataclass(frozen=True)
class Limit:
    """A gain factor or a turn in rad at which a pole lies at jω, and how it leaves.

    Attributes
    ----------
    value : float
    omega : float
        In rad/s; infinite where the loop gains an infinite pole.
    """

    value: float
    omega: float


def gain_doubts(loop: BrokenLoop, limits: list[Limit]) -> list[str]:
    """Return what the poles of loops with changed gain contradict, in words.

    Parameters
    ----------
    limits : list of Limit
        All gain factors at which a pole lies on the limit, increasing.
    """
    above = [limit for limit in limits if limit.value > 1]
    below = [limit for limit in reversed(limits) if limit.value < 1]
    found: list[str] = []
    for side, name, wide in ((above, "raised", _WIDE), (below, "lowered", 1 / _WIDE)):
        edge = side[0].value if side else wide
        inward = -np.sign(edge - 1) * _STEP
        for factor in (edge**0.5, edge * (1 + inward)):
            if loop.unstable(factor)[0]:
                found.append(f"unstable with the gain {name} by {factor:.6g}, inside the margin")
        if not side or np.isinf(side[0].omega):
            continue
        following = side[1].value if len(side) > 1 else edge * (2.0 if edge > 1 else 0.5)
        beyond = float(np.sqrt(edge * following))
        if not _leaves(loop, side[0], 1.0 if edge > 1 else -1.0, 1.0):
            found.append(f"no pole crosses the limit with the gain {name} by {edge:.6g}")
        if abs(beyond / edge - 1) > 100 * _STEP:
            least, most = loop.unstable(beyond)
            expected = 1 if side[0].omega in (0.0, loop.response.nyquist) else 2
            if not least <= expected <= most:
                found.append(f"{least} poles are unstable with the gain {name} by {beyond:.6g}")
    return found


def phase_doubts(loop: BrokenLoop, turns: Array, omega: Array, rising: Array) -> list[str]:
    """Return what the poles of turned loops contradict, in words.

    Parameters
    ----------
    turns : ndarray
        Turns in rad, between −π and π, that put a pole at +jω for each gain crossing.
    omega, rising : ndarray
        The crossings in rad/s, and +1 where |L| rises.
    """
    found: list[str] = []
    least = float(np.min(np.abs(turns), initial=np.pi))
    for part in (1 / 3, 2 / 3, 1 - _STEP):
        if loop.unstable(complex(np.exp(1j * part * least)))[0]:
            found.append(f"unstable when turned by {np.degrees(part * least):.6g} deg")
    if len(turns) and least < np.pi * (1 - _STEP):
        k = int(np.argmin(np.abs(turns)))
        if not _leaves(loop, Limit(float(turns[k]), float(omega[k])), 1.0, 1j):
            found.append(f"no pole crosses the limit when turned by {np.degrees(least):.6g} deg")
    # From 0 to π each crossing is met once, at jω or −jω: the count of A + BC is known.
    if abs(1 - loop.D) > 1e-6 and not np.any(np.abs(turns) > np.pi * (1 - _STEP)):
        fewest, most = loop.unstable(-1.0)
        expected = int(np.sum(np.where(turns > 0, rising, -rising)))
        if not fewest <= expected <= most:
            found.append(
                f"the {len(turns)} crossings of |L| = 1 explain {expected} unstable poles of "
                f"1 - L, there are {fewest}"
            )
    return found


def _leaves(loop: BrokenLoop, limit: Limit, outward: float, unit: complex) -> bool:
    """Whether the pole at the limit is stable just inside and unstable just outside.

    The factor is `value` for a gain and e^(j·value) for a turn (`unit` = j); the pole is
    followed by Newton's method from where its derivative puts it.
    """
    turn = unit == 1j
    factor = np.exp(1j * limit.value) if turn else complex(limit.value)
    towards = np.sign(limit.value) if turn else outward
    slope = loop.steepest(limit.omega, factor)
    if not np.isfinite(slope):
        return False
    growth = []
    for sense in (-1, 1):
        change = unit * sense * towards * _STEP * (abs(limit.value) if turn else 1.0)
        point = loop.points(np.array([limit.omega])) + slope * change
        changed = factor * np.exp(change)
        with np.errstate(all="ignore"):
            for _ in range(3):
                step = (1 + changed * loop.response.at(point)) / (
                    changed * loop.response.slope(point)
                )
                point = np.where(np.isfinite(step), point - step, point)
        growth.append(float(loop.growth(point)[0]))
    return growth[0] < 0 < growth[1]
