"""Margins by brute force, from nothing but the modal sum of the plant and a dense grid.

Nothing here calls the code under test: the plant is evaluated in closed form from
frequencies and mode shapes, the controller by direct solves, and the grid puts hundreds of
points into every half-width of every open- and closed-loop pole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from slewctl import Loop
from slewctl.plant import SIGNALS

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Function = Callable[[Array], ComplexArray]


@dataclass(frozen=True)
class BruteMargins:
    """Gain factors, phase in degrees and delay in s, with infinity for 'none'.

    `modulus` and `disk` are the smallest on the grid: bounds from above.
    """

    up: float
    down: float
    phase_deg: float
    delay_s: float
    gain_crossings: Array
    modulus: float
    disk: float


def loop_function(loop: Loop) -> Function:
    """Return L(jω) = −K(jω)G(jω) of a loop from closed forms."""
    system = loop.controller.system
    A, B, C = (np.asarray(getattr(system, name)) for name in "ABC")

    def controller(s: ComplexArray) -> ComplexArray:
        eye = np.eye(len(A))
        parts = np.array_split(s, max(1, len(s) // 20000))
        rows = [C @ np.linalg.solve(p[:, None, None] * eye - A, B.astype(complex)) for p in parts]
        return np.concatenate(rows)[:, 0, :]

    def value(omega: Array) -> ComplexArray:
        s = 1j * np.asarray(omega, dtype=float)
        with np.errstate(invalid="ignore"):
            L = -np.sum(controller(s) * plant_response(loop, s), axis=1)
        return np.where(np.isfinite(L), L, complex(np.inf, 0))

    return value


def plant_response(loop: Loop, s: ComplexArray) -> ComplexArray:
    """Return the sensors' response to the torque, (frequencies, sensors), from modal sums."""
    model = loop.model
    omega = np.concatenate([[0.0], model.omega])
    drive = model.mode_shapes[0]  # b is the first unit vector
    with np.errstate(divide="ignore", invalid="ignore"):  # an undamped pole on the grid
        compliance = drive / (
            s[:, None] ** 2 + 2 * model.arm.damping_ratio * omega * s[:, None] + omega**2
        )
    # Friction acts on θ alone, where the torque acts: a rank-one update (Sherman–Morrison).
    relief = 1 + model.arm.hub.friction * s * (compliance @ drive)
    rates = {"displacement": 0, "rate": 1, "acceleration": 2}
    columns = []
    for name in loop.controller.sensors:
        signal = SIGNALS[name]
        row = signal.row(model) @ model.mode_shapes
        columns.append(s ** rates[signal.of] * (compliance @ row) / relief)
    return np.stack(columns, axis=1)


def resolved_grid(poles: ComplexArray, points: int = 200) -> Array:
    """Return frequencies with `points` in every half-width of every pole, and a global sweep."""
    poles = poles[np.abs(poles) > 1e-9 * np.abs(poles).max()]
    size = np.abs(poles)
    near = np.linspace(-3, 3, 6 * points + 1)
    far = np.geomspace(3, 1e5, points)
    offsets = np.concatenate([-far[::-1], near, far])
    centres = {(float(abs(p.imag)), float(abs(p.real))) for p in poles if p.real}
    centres |= {(float(abs(p)), float(abs(p.real))) for p in poles if abs(p.real) > 0.01 * abs(p)}
    parts = [np.geomspace(1e-5 * size.min(), 1e5 * size.max(), 5000)]
    parts += [centre + half * offsets for centre, half in centres]
    grid = np.unique(np.concatenate(parts))
    return grid[grid >= 1e-5 * size.min()]


def roots_on(grid: Array, values: Array, exact: Callable[[Array], Array]) -> Array:
    """Return all roots between grid points, including pairs hidden inside one local extremum."""
    sign = np.sign(values)
    where = np.flatnonzero(sign[1:] * sign[:-1] < 0)
    brackets = [(grid[i], grid[i + 1]) for i in where]
    left, middle, right = values[:-2], values[1:-1], values[2:]
    turning = (np.abs(middle) < np.abs(left)) & (np.abs(middle) < np.abs(right))
    same = (left * middle > 0) & (middle * right > 0)
    # A pair of roots can hide only where the extremum is close to zero beside its change.
    tight = np.abs(middle) < 2 * np.maximum(np.abs(left - middle), np.abs(right - middle))
    for i in np.flatnonzero(turning & same & tight):
        fine = np.linspace(grid[i], grid[i + 2], 401)
        inner = exact(fine)
        for j in np.flatnonzero(inner[1:] * inner[:-1] < 0):
            brackets.append((fine[j], fine[j + 1]))

    def scalar(w: float) -> float:
        return float(exact(np.array([w]))[0])

    def root(a: float, b: float) -> float:
        at_a, at_b = scalar(a), scalar(b)
        if at_a * at_b > 0:  # one of them is the root: many at once are rounded otherwise
            return a if abs(at_a) < abs(at_b) else b
        return float(brentq(scalar, a, b, xtol=1e-300, rtol=1e-15))

    return np.array([root(a, b) for a, b in brackets])


def brute_margins(
    function: Function, poles: ComplexArray, points: int = 200, limit: float = np.inf
) -> BruteMargins:
    """Return the margins of a stable loop from a grid resolved at `poles`.

    Parameters
    ----------
    limit : float
        Half the sampling frequency in rad/s of a sampled loop, where L is real.
    """
    grid = resolved_grid(poles, points)
    grid = grid[grid < limit]
    L = function(grid)
    grid, L = grid[np.isfinite(L)], L[np.isfinite(L)]

    def sound(of: Callable[[ComplexArray], Array]) -> Callable[[Array], Array]:
        def value(w: Array) -> Array:
            v = function(w)
            # Exactly on an undamped pole or zero the search ends; the jump is sorted out below.
            fine = np.isfinite(v) & (v != 0)
            return np.where(fine, of(np.where(fine, v, 1.0)), 0.0)

        return value

    gain = roots_on(grid, np.log(np.abs(L)), sound(lambda v: np.log(np.abs(v))))
    real = roots_on(grid, L.imag / np.abs(L), sound(lambda v: v.imag / np.abs(v)))
    at = function(real) if len(real) else np.zeros(0, complex)
    # A sign change at an undamped pole or zero is a jump, not a root.
    at = at[np.isfinite(at) & (at != 0)]
    if np.isfinite(limit):
        at = np.concatenate([at, function(np.array([limit])).real])
    crossing = at[(np.abs(at.imag) < 1e-6 * np.abs(at)) & (at.real < 0)]
    factors = -1 / crossing.real
    beyond = np.angle(-function(gain)) if len(gain) else np.zeros(0)
    with np.errstate(all="ignore"):
        nearest = np.abs(1 + L)
    return BruteMargins(
        up=float(min(factors[factors >= 1], default=np.inf)),
        down=float(max(factors[factors < 1], default=0.0)),
        phase_deg=float(np.degrees(np.min(np.abs(beyond), initial=np.inf))),
        delay_s=float(np.min(np.mod(beyond, 2 * np.pi) / gain, initial=np.inf)),
        gain_crossings=np.sort(gain),
        modulus=float(nearest.min()),
        disk=float((2 * nearest / np.abs(1 - L)).min()),
    )
