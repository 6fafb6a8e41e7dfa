"""What spinning does to a beam: centrifugal stiffening, softening, and frequencies at a given spin.

A beam element at the distance r + s from the axis pulls outward with m̄(r+s)Ω² ds.  The
tension Ω²P(x) that results stiffens the beam (K_g); in the plane of rotation the pull also
has a component along the deflection, which softens it (M_s).
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.linalg import qr, solve_triangular

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis import Basis
from slewctl.errors import InputError, check_choice, check_number, shown
from slewctl.model.assembly import Model, factors
from slewctl.model.quadrature import SAMPLED_DEGREE, Rule, composite, settled

Plane = Literal["in", "out"]
PLANES: tuple[Plane, ...] = ("in", "out")


class SpinSofteningWarning(UserWarning):
    """Without geometric stiffening the arm spins faster than its model stays stable."""


def warn_of_softening(spin: float, critical: float) -> None:
    """Warn that at `spin` the arm is unstable in a model without stiffening, in rad/s."""
    warnings.warn(
        f"at {abs(spin):.4g} rad/s the arm spins faster than {critical:.4g} rad/s, where its "
        "stiffness in the plane of rotation vanishes in a model without geometric stiffening; "
        "the growing deflection is not real: use stiffening=True",
        SpinSofteningWarning,
        stacklevel=3,
    )


def carried_mass_factor(arm: Arm, basis: Basis) -> Array:
    """Return the factor F of M_s = FᵀF = ∫ m̄ΦᵀΦ dx + Σ m_i Φ(x_i)ᵀΦ(x_i), shape (p, n).

    It is M_e without the rotary inertia of the payload and of the masses along the beam, on
    which the centrifugal pull has no hold.
    """
    points = tuple(replace(mass, inertia=0.0) for mass in arm.masses)
    payload = replace(arm.payload, inertia=0.0)
    light = replace(arm, payload=payload, masses=points, joint=None)
    return factors(light, basis).mass[:, 1:]


def stiffening_factor(arm: Arm, basis: Basis) -> Array:
    """Return the factor G of the geometric stiffness K_g = GᵀG = ∫ P Φ'ᵀΦ' dx, shape (p, n).

    P(x) = ∫_x^L m̄(s)(r+s) ds + Σ m_i(r+x_i), over the bodies beyond x, in kg·m is the tension
    for a spin of 1 rad/s.
    Both integrals are exact to rounding for polynomial and tabulated profiles; for a
    callable one they are refined until they settle.

    Raises
    ------
    AccuracyError
        If the integrals of a callable profile do not settle.
    """
    breakpoints = (*arm.breakpoints, *basis.breakpoints)
    degree = arm.beam.mass_profile.degree
    if degree is not None:
        return _stiffening_on(arm, basis, breakpoints, degree)
    (factor,), _ = settled(
        lambda points: (_stiffening_on(arm, basis, points, SAMPLED_DEGREE),),
        breakpoints,
        "beam.mass_per_length",
    )
    return factor


def _stiffening_on(arm: Arm, basis: Basis, breakpoints: tuple[float, ...], degree: int) -> Array:
    shape_degree = 2 * max(basis.growth.degree, 1)
    # P is the integral of m̄ times x: two degrees above m̄.
    rule = composite(breakpoints, 2 * basis.growth.exponent, shape_degree + degree + 2)
    tension = unit_tension(arm, rule, breakpoints, degree)
    slopes = basis.evaluate(rule.xi, 1) / arm.beam.length
    return np.sqrt(arm.beam.length * rule.weights * tension)[:, None] * slopes


def unit_tension(arm: Arm, rule: Rule, breakpoints: tuple[float, ...], degree: int) -> Array:
    """Return P at the points of `rule`, in kg·m, shape (m,).

    Parameters
    ----------
    arm : Arm
    rule : Rule
    breakpoints : tuple of float
        Where m̄ is not smooth, in (0, 1).
    degree : int
        Degree of m̄ between them.
    """
    L, r = arm.beam.length, arm.hub.radius
    bounds = np.array([0.0, *sorted(set(breakpoints)), 1.0])
    panel = np.searchsorted(bounds, rule.xi) - 1
    inner = composite((), 0.0, degree + 1)
    # From each point, and from each panel's left end, to the panel's right end.
    start = np.concatenate([rule.xi, bounds[:-1]])
    width = np.concatenate([bounds[panel + 1], bounds[1:]]) - start
    s = start[:, None] + width[:, None] * inner.xi
    pull = L * width * ((arm.beam.mass_profile(s) * (r + L * s)) @ inner.weights)
    here, panels = pull[: len(rule.xi)], pull[len(rule.xi) :]
    beyond = np.concatenate([np.cumsum(panels[::-1])[::-1][1:], [0.0]])
    bodies = arm.bodies
    pulled = (bodies.xi > rule.xi[:, None]) @ (bodies.mass * (r + L * bodies.xi))
    return np.asarray(here + beyond[panel] + pulled)


def critical_spin_rad_s(model: Model) -> float:
    """Return the spin at which K_e − Ω²M_s, the stiffness without stiffening, is singular.

    Where no body on the beam has rotary inertia it is the lowest hub-locked frequency, in rad/s.

    Parameters
    ----------
    model : Model

    Returns
    -------
    float
        In rad/s.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> from slewctl.model import critical_spin_rad_s
    >>> round(critical_spin_rad_s(model), 3)
    4.836
    """
    parts = factors(model.arm, model.basis)
    T = qr(parts.stiffness, mode="r")[0][: model.n]
    R = qr(carried_mass_factor(model.arm, model.basis), mode="r")[0][: model.n]
    return 1 / float(np.linalg.norm(solve_triangular(T, R.T, trans="T"), 2))


def spin_frequencies_hz(
    model: Model, spin_rad_s: float, plane: Plane = "in", stiffening: bool = True
) -> Array:
    """Return the natural frequencies in Hz of an arm that turns at a constant rate, shape (n,).

    Parameters
    ----------
    model : Model
    spin_rad_s : float
        Ω: the hub turns at this rate whatever the beam does; with an elastic joint the rotor
        does, and the hub swings about it.
    plane : {"in", "out"}
        In the plane of rotation, M_e q̈ + [K_e − Ω²(M_s − κK_g)] q = 0; or out of it
        (flapping), M_e q̈ + [K_e + κΩ²K_g] q = 0, for a beam of the same bending stiffness
        and a payload of the same rotary inertia, whose own centrifugal moment is left out.
    stiffening : bool
        κ = 1 or 0: whether the tension of the spinning beam stiffens it.

    Returns
    -------
    ndarray
        Increasing.  Without stiffening, NaN for each mode that diverges.

    Warns
    -----
    SpinSofteningWarning
        If a mode diverges.

    Raises
    ------
    InputError
        If `model` is not a model, the spin not a number or the plane unknown; out of the
        plane of an elastic joint, which turns in it alone.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> sc.spin_frequencies_hz(model, 2.0).round(3).tolist()
    [0.782, 4.15]
    """
    check_model(model, "spin_frequencies_hz")
    spin = check_number(spin_rad_s, "spin_frequencies_hz.spin_rad_s")
    check_choice(plane, PLANES, "spin_frequencies_hz.plane")
    if plane == "out" and model.arm.joint is not None:
        raise InputError(
            "an elastic joint turns in the plane of rotation alone",
            where="spin_frequencies_hz.plane",
            remedy="give the model of the arm without its joint",
        )
    squared = _spin_squared(model, spin, plane, stiffening)
    stable = squared > 0
    if not stable.all():
        warn_of_softening(spin, critical_spin_rad_s(model))
    return np.sqrt(np.where(stable, squared, np.nan)) / (2 * np.pi)


def _spin_squared(model: Model, spin: float, plane: Plane, stiffening: bool) -> Array:
    """Return ω² in rad²/s², increasing.

    With K_e + κΩ²K_g = TᵀT and M_e = RᵀR the singular values of R T⁻¹ are 1/ω out of plane.
    In the modes W of that motion, WᵀM_eW = I and M_s = M_e − Σ J_i Φ'(x_i)ᵀΦ'(x_i).
    """
    arm, basis, n = model.arm, model.basis, model.n
    parts = factors(arm, basis)
    rows = [parts.stiffness]
    if stiffening:
        rows.append(spin * stiffening_factor(arm, basis))
    T = qr(np.vstack(rows), mode="r")[0][:n]
    R = qr(parts.mass[:, 1:], mode="r")[0][:n]
    _, periods, V = np.linalg.svd(R @ solve_triangular(T, np.eye(n)))
    flap = periods**-2.0
    if plane == "out":
        return flap
    if arm.joint is not None:
        pulled = solve_triangular(T, carried_mass_factor(arm, basis).T, trans="T").T @ V.T / periods
        in_plane = np.diag(flap) - spin**2 * pulled.T @ pulled
        return np.asarray(np.linalg.eigvalsh(in_plane), dtype=float)
    bodies = arm.bodies
    if not bodies.rotary:
        return flap - spin**2
    slopes = np.sqrt(bodies.inertia)[:, None] * basis.evaluate(bodies.xi, 1) / arm.beam.length
    turn = (solve_triangular(T, slopes.T, trans="T").T @ V.T) / periods
    in_plane = np.diag(flap - spin**2) + spin**2 * turn.T @ turn
    return np.asarray(np.linalg.eigvalsh(in_plane), dtype=float)


def check_model(model: object, where: str) -> None:
    """Refuse what is not a `Model`."""
    if not isinstance(model, Model):
        raise InputError(
            f"{shown(model)} is not a model", where=where, remedy="give one, as from assemble"
        )
