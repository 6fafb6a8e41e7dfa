"""Evidence from the kinetic energy of eq. 9: eq. 12, 32, 33 and 37.

The beam is led along a made-up smooth motion, v = Φ(x) q(t) with three polynomial shapes.
Everything is measured on eq. 9 itself: T is quadratic in θ̇ and bilinear in θ̇ and q̇, so
central differences with a unit step are exact; its time derivative is taken with a
complex step, which does not cancel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial as PowerSeries
from numpy.polynomial.legendre import leggauss

from slewctl._types import Array, ComplexArray
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Polynomial
from slewctl.model import assemble
from slewctl.paper import published
from slewctl.paper.evidence import Evidence, weigh

# Instants at which both sides are compared.
_TIMES = np.linspace(0.0, 3.0, 13)
_COMPLEX_STEP = 1e-30  # no cancellation, so it can be as small as this
_GAUSS_POINTS = 30  # exact for the modes of a uniform beam to rounding

# The made-up motion: amplitudes, rates (rad/s) and phases of q, and those of θ̇.
_AMPLITUDE = np.array([0.4, -0.25, 0.15])
_RATE = np.array([2.1, 3.7, 5.3])
_PHASE = np.array([0.3, 1.1, -0.6])
_TURN_MEAN, _TURN_AMPLITUDE, _TURN_RATE = 1.3, 0.7, 1.1


@dataclass(frozen=True, eq=False)
class Instant:
    """The motion at one time, which may be complex: θ̇, θ̈, q, q̇ and q̈."""

    turn: complex
    turn_rate: complex
    q: ComplexArray
    q_dot: ComplexArray
    q_ddot: ComplexArray


def motion(t: complex) -> Instant:
    """Return the made-up motion at time `t` in s."""
    angle = _RATE * t + _PHASE
    return Instant(
        complex(_TURN_MEAN + _TURN_AMPLITUDE * np.sin(_TURN_RATE * t)),
        complex(_TURN_AMPLITUDE * _TURN_RATE * np.cos(_TURN_RATE * t)),
        (_AMPLITUDE * np.sin(angle)).astype(complex),
        (_AMPLITUDE * _RATE * np.cos(angle)).astype(complex),
        (-_AMPLITUDE * _RATE**2 * np.sin(angle)).astype(complex),
    )


@dataclass(frozen=True, eq=False)
class Line:
    """The paper's beam on Gauss points: x, weights times m̄ and dm̄/dx, and three shapes.

    Attributes
    ----------
    x, mass, mass_slope : ndarray, shape (points,)
        m, kg and kg/m; the last two carry the weights.
    shapes : ndarray, shape (points, 3)
    """

    x: Array
    mass: Array
    mass_slope: Array
    shapes: Array


def line() -> Line:
    """Return the paper's beam with three polynomial shapes (v = v' = 0 at the root)."""
    nodes, weights = leggauss(_GAUSS_POINTS)
    x, weights = (nodes + 1) / 2, weights / 2
    taper = PowerSeries(published.TAPER)
    shapes = Polynomial(len(_AMPLITUDE)).evaluate(x)
    return Line(x, weights * taper(x), weights * taper.deriv()(x), shapes)


def kinetic_energy(
    beam: Line, turn: complex, q: ComplexArray | Array, q_dot: ComplexArray | Array
) -> complex:
    """Return T of eq. 9 in J, term by term as the paper prints it (it is right)."""
    v, v_dot = beam.shapes @ q, beam.shapes @ q_dot
    inertia = beam.mass @ beam.x**2
    return complex(
        turn**2 * inertia / 2
        + turn**2 * (beam.mass @ v**2) / 2
        + turn * (beam.mass @ (beam.x * v_dot))
        + beam.mass @ v_dot**2 / 2
    )


def angular_momentum_rate(beam: Line, t: float) -> float:
    """Return d/dt ∂T/∂θ̇ of eq. 9 along the motion, in N·m."""
    at = motion(t + 1j * _COMPLEX_STEP)
    ahead = kinetic_energy(beam, at.turn + 1, at.q, at.q_dot)
    behind = kinetic_energy(beam, at.turn - 1, at.q, at.q_dot)
    return ((ahead - behind) / 2).imag / _COMPLEX_STEP


def torque_balance() -> Evidence:
    """Weigh both forms of eq. 12 against d/dt ∂T/∂θ̇."""
    beam = line()
    reference = [angular_momentum_rate(beam, t) for t in _TIMES]
    printed: list[float] = []
    corrected: list[float] = []
    for t in _TIMES:
        at = motion(t)
        v, v_dot, v_ddot = (beam.shapes @ w.real for w in (at.q, at.q_dot, at.q_ddot))
        turn, turn_rate = at.turn.real, at.turn_rate.real
        rest = turn_rate * (beam.mass @ beam.x**2) + beam.mass @ (beam.x * v_ddot)
        square = beam.mass @ v**2
        printed.append(float(rest + turn * square + 2 * turn * (beam.mass @ (beam.x * v_dot))))
        corrected.append(float(rest + turn_rate * square + 2 * turn * (beam.mass @ (v * v_dot))))
    return weigh(
        "left side of eq. 12 against d/dt of dT/d(theta_dot) of eq. 9 along a smooth motion",
        "N·m",
        reference=reference,
        printed=printed,
        corrected=corrected,
    )


def discrete_energy() -> Evidence:
    """Weigh eq. 32 with ½θ̇²qᵀ (a row, read as ½θ̇²qᵀq) and ½θ̇²qᵀM_e q against eq. 9."""
    beam = line()
    model = assemble(paper_beam(), Polynomial(len(_AMPLITUDE)))
    inertia, coupling, mass = model.mass[0, 0], model.mass[0, 1:], model.mass[1:, 1:]
    reference, printed, corrected = [], [], []
    for t in _TIMES:
        at = motion(t)
        turn, q, q_dot = at.turn.real, at.q.real, at.q_dot.real
        rest = turn**2 * inertia / 2 + turn * coupling @ q_dot + q_dot @ mass @ q_dot / 2
        reference.append(kinetic_energy(beam, at.turn, at.q, at.q_dot).real)
        printed.append(rest + turn**2 * (q @ q) / 2)
        corrected.append(rest + turn**2 * (q @ mass @ q) / 2)
    return weigh(
        "kinetic energy of eq. 32 against eq. 9 along a smooth motion; the printed term is a "
        "row and not a number, and is read as if the missing matrix were the identity",
        "J",
        reference=reference,
        printed=printed,
        corrected=corrected,
    )


def coupling_row() -> Evidence:
    """Weigh ∫ (dm̄/dx) Φ dx and ∫ m̄ x Φ dx (eq. 33) against ∂²T/∂θ̇∂q̇ of eq. 9."""
    beam = line()
    still = np.zeros(len(_AMPLITUDE))
    reference = [
        (kinetic_energy(beam, 1.0, still, unit) - kinetic_energy(beam, -1.0, still, unit)).real / 2
        for unit in np.eye(len(still))
    ]
    return weigh(
        "coupling of theta and q in eq. 33, the printed subscript read as a derivative, "
        "against the mixed second derivative of eq. 9",
        "kg·m²",
        reference=reference,
        printed=beam.mass_slope @ beam.shapes,
        corrected=(beam.mass * beam.x) @ beam.shapes,
    )


def discrete_torque_balance() -> Evidence:
    """Weigh eq. 37 with K_c and with M_e for the undefined M_c against d/dt ∂T/∂θ̇."""
    beam = line()
    model = assemble(paper_beam(), Polynomial(len(_AMPLITUDE)))
    inertia, coupling = model.mass[0, 0], model.mass[0, 1:]
    sides: tuple[list[float], list[float]] = ([], [])
    for t in _TIMES:
        at = motion(t)
        turn, turn_rate = at.turn.real, at.turn_rate.real
        q, q_dot, q_ddot = at.q.real, at.q_dot.real, at.q_ddot.real
        rest = inertia * turn_rate + coupling @ q_ddot
        for side, matrix in zip(sides, (model.stiffness, model.mass), strict=True):
            block = matrix[1:, 1:]
            side.append(float(rest + turn_rate * (q @ block @ q) + 2 * turn * (q @ block @ q_dot)))
    return weigh(
        "left side of eq. 37 against d/dt of dT/d(theta_dot) of eq. 9: the paper defines M_e "
        "and K_c but no M_c; with K_c in its place the balance fails, with M_e it holds",
        "N·m",
        reference=[angular_momentum_rate(beam, t) for t in _TIMES],
        printed=sides[0],
        corrected=sides[1],
    )
