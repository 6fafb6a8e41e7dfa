"""From an arm and a basis to M, D, K and b of M ẍ + D ẋ + K x = b τ, x = [θ, q] (eq. 41–42).

Nothing is assembled from squared sums: mass and stiffness are kept as factors F and S with
M = FᵀF and K_e = SᵀS (one row a quadrature point, hub or body term), so that both are
symmetric and semidefinite by construction and the frequencies come from a singular value
decomposition.  The low ones keep a relative accuracy of about ε·ω_k/ω_1, however stiff the
highest function of the basis is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl._show import Described
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import Arm, Drag, ModalData
from slewctl.basis import Basis, modal_rows
from slewctl.basis.named import described
from slewctl.basis.with_joint import WithJoint, jointed
from slewctl.errors import InputError, shown
from slewctl.model.damping import damping_matrix
from slewctl.model.modal_factors import modal_factors
from slewctl.model.quadrature import SAMPLED_DEGREE, Rule, composite, settled
from slewctl.model.ritz import Factors, RitzModes, ritz_modes


@dataclass(frozen=True, eq=False, repr=False)
class Model(Described):
    """The linear model M ẍ + D ẋ + K x = b τ of an arm in one basis, x = [θ, q].

    With an elastic joint x = [θ_m, q] with the rotor's angle, and the first of q is the twist
    θ − θ_m of the joint.

    Attributes
    ----------
    arm : Arm
    basis : Basis
    mass, damping, stiffness : ndarray, shape (n+1, n+1)
        M, D and K, symmetric; SI units.
    input : ndarray, shape (n+1,)
        b: the torque acts on θ, or on the rotor.
    omega : ndarray, shape (n,)
        Undamped natural frequencies of the flexible modes in rad/s, increasing.
    mode_shapes : ndarray, shape (n+1, n+1)
        U with UᵀMU = I, one column a mode, the rigid-body rotation first.
    quadrature_error : float
        Bound (for a callable profile: estimate) of the relative error of the integrals.
    """

    arm: Arm
    basis: Basis
    mass: Array
    damping: Array
    stiffness: Array
    input: Array
    omega: Array
    mode_shapes: Array
    quadrature_error: float

    def __str__(self) -> str:
        hertz = ", ".join(f"{f:.4g}" for f in self.frequencies_hz[:4])
        more = " …" if self.n > 4 else ""
        of = f"; {self.arm.damping_told}" if self.arm.damping_modes == "hub-locked" else ""
        return f"{self.arm.name} on {self.n} {self.basis.name} functions: {hertz}{more} Hz{of}"

    def __post_init__(self) -> None:
        for name in ("mass", "damping", "stiffness", "input", "omega", "mode_shapes"):
            getattr(self, name).setflags(write=False)

    @property
    def n(self) -> int:
        """Number of flexible coordinates: the admissible functions and a joint's twist."""
        return self.basis.n

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of [θ, q], or of [θ_m, twist, q] with an elastic joint; shape (n+1,)."""
        if self.arm.joint is None:
            return ("theta", *(f"q{i}" for i in range(1, self.n + 1)))
        own = ("twist",) if isinstance(self.basis, WithJoint) else ()
        rest = (f"q{i}" for i in range(1, self.n + 1 - len(own)))
        return ("theta_motor", *own, *rest)

    @property
    def turning(self) -> Array:
        """The row that reads the hub's angle θ off [θ, q] or [θ_m, q], shape (n+1,)."""
        return np.concatenate([[1.0], self.basis.twist])

    @property
    def frequencies_hz(self) -> Array:
        """Undamped natural frequencies of the flexible modes in Hz, increasing."""
        return self.omega / (2 * np.pi)

    def displacement(self, x: Array) -> Array:
        """Return the rows that map [θ, q] to the arc displacement (r + x)θ + v(x).

        Parameters
        ----------
        x : ndarray, shape (m,)
            Points on the beam in metres from the clamp.

        Returns
        -------
        ndarray, shape (m, n+1)
        """
        x = np.asarray(x, dtype=float)
        shapes = self.basis.evaluate(x / self.arm.beam.length)
        shapes[:] += np.multiply.outer(self.arm.hub.radius + x, self.basis.twist)
        return np.column_stack([self.arm.hub.radius + x, shapes])

    def of_modes(self, values: Array) -> Array:
        """Return what values of each mode of an arm's data are in q, shape (n,)."""
        return modal_rows(self.basis, values)


@single_threaded
def assemble(arm: Arm, basis: Basis | str, n: int | None = None) -> Model:
    """Return the model of `arm` discretised by `basis`.

    Parameters
    ----------
    arm : Arm
    basis : Basis or str
        A description, such as ``HubMatched(4)``, or a name such as ``"hub-matched"`` with `n`:
        it is matched to this arm.
    n : int, optional
        Number of functions of a basis given by name.

    Returns
    -------
    Model
        With J, Φ̃, M_e and K_e of eq. 33 and 35 extended by the hub's inertia (with the
        motor's rotor) and radius, the payload and the masses along the beam; modal damping
        ``arm.damping_ratio`` on the flexible modes, hub free or locked (those that the basis
        has, the last ratio on all beyond those given), the law ``arm.damping``, and
        ``arm.hub.friction`` on θ.  An elastic joint is a flexible coordinate more, the first;
        its damping and the rotor's friction join.  The integrals are exact to rounding
        for polynomial and tabulated profiles; for a callable they are refined until they
        settle, and `Model.quadrature_error` says how far.

    Raises
    ------
    InputError
        If `arm` or `basis` is something else, or the mass matrix is not positive definite.
    AccuracyError
        If the integrals of a callable profile do not settle.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> sc.assemble(arm, sc.ClampedFree(2)).frequencies_hz.round(2).tolist()
    [1.06, 4.16]
    """
    check_arm(arm, "assemble")
    matched = jointed(arm, described(basis, n, "assemble").matched_to(arm))
    if arm.joint is None and matched.twist.any():
        raise InputError(
            f"the {matched.name} functions twist a joint that the arm has not got",
            where="assemble",
            remedy="give the arm its joint, or another basis",
        )
    return model_from_factors(arm, matched, factors(arm, matched))


def check_arm(arm: object, where: str) -> None:
    """Refuse what is not an `Arm`."""
    if not isinstance(arm, Arm):
        raise InputError(f"{shown(arm)} is not an Arm", where=where, remedy="give a slewctl.Arm")


def check_model(model: object, where: str) -> None:
    """Refuse what is not a `Model`."""
    if not isinstance(model, Model):
        raise InputError(
            f"{shown(model)} is not a Model",
            where=where,
            remedy="make one with slewctl.assemble or slewctl.truth",
        )


def factors(arm: Arm, basis: Basis) -> Factors:
    """Return the square-root factors of `arm` in `basis` (see `Factors`)."""
    if isinstance(arm.beam, ModalData):
        return Factors(*modal_factors(arm, basis), np.zeros((0, basis.n + 1)))
    profiles = (arm.beam.mass_profile, arm.beam.stiffness_profile)
    degrees = [profile.degree for profile in profiles]
    breakpoints = (*arm.breakpoints, *basis.breakpoints)
    exponent = 2 * basis.growth.exponent
    shape_degree = 2 * max(basis.growth.degree, 1)
    known = [d for d in degrees if d is not None]
    if len(known) == len(degrees):
        rule = composite(breakpoints, exponent, shape_degree + max(known))
        return _factors_on(arm, basis, rule)
    degree = shape_degree + SAMPLED_DEGREE

    def build(points: tuple[float, ...]) -> tuple[Array, ...]:
        found = _factors_on(arm, basis, composite(points, exponent, degree))
        drag = (found.drag,) if len(found.drag) else ()
        return found.mass, found.stiffness, *drag

    (mass, stiffness, *drag), change = settled(build, breakpoints, "beam")
    return Factors(mass, stiffness, drag[0] if drag else np.zeros((0, basis.n + 1)), change)


def _factors_on(arm: Arm, basis: Basis, rule: Rule) -> Factors:
    L, r = arm.beam.length, arm.hub.radius
    weights = L * rule.weights
    mass_root = np.sqrt(weights * arm.beam.mass_profile(rule.xi))
    stiffness_root = np.sqrt(weights * arm.beam.stiffness_profile(rule.xi)) / L**2
    bodies = arm.bodies
    beam_rows = np.column_stack([r + L * rule.xi, basis.evaluate(rule.xi)])
    body_rows = np.column_stack([r + L * bodies.xi, basis.evaluate(bodies.xi)])
    turn_rows = np.column_stack([np.ones(len(bodies.xi)), basis.evaluate(bodies.xi, 1) / L])
    hub_row = np.zeros((1, basis.n + 1))
    hub_row[0, 0] = math.sqrt(arm.hub_inertia)
    if arm.joint is not None:
        # The hub and all that it carries turn by θ = θ_m + twist, the rotor by θ_m.
        for rows in (beam_rows, body_rows, turn_rows):
            rows[:, 1:] += np.multiply.outer(rows[:, 0], basis.twist)
        hub = math.sqrt(arm.hub.inertia) * np.concatenate([[1.0], basis.twist])
        hub_row[0, 0] = math.sqrt(arm.rotor_inertia)
        hub_row = np.vstack([hub, hub_row])
    mass = np.vstack(
        [
            mass_root[:, None] * beam_rows,
            np.sqrt(bodies.mass)[:, None] * body_rows,
            np.sqrt(bodies.inertia)[:, None] * turn_rows,
            hub_row,
        ]
    )
    stiffness = stiffness_root[:, None] * basis.evaluate(rule.xi, 2)
    if arm.joint is not None:
        stiffness = np.vstack([math.sqrt(arm.joint.stiffness) * basis.twist, stiffness])
    drag = np.zeros((0, basis.n + 1))
    if isinstance(arm.damping, Drag):
        drag = np.sqrt(weights * arm.damping.per_length)[:, None] * beam_rows
    return Factors(mass, stiffness, drag)


def model_from_factors(arm: Arm, basis: Basis, parts: Factors) -> Model:
    """Return the `Model` with modes and modal damping from square-root factors."""
    n = basis.n
    omega, modes = _modes(parts)
    modes[:, 1:] *= tip_signs(basis, modes[1:, 1:])
    mass = parts.mass.T @ parts.mass
    stiffness = np.zeros((n + 1, n + 1))
    stiffness[1:, 1:] = parts.stiffness.T @ parts.stiffness
    free = RitzModes(omega, modes[:, 1:])
    damping = damping_matrix(arm, basis.twist, parts, mass, stiffness, free)
    force = np.zeros(n + 1)
    force[0] = 1.0
    return Model(arm, basis, mass, damping, stiffness, force, omega, modes, parts.quadrature_error)


def tip_signs(basis: Basis, shapes: Array) -> Array:
    """Return the sign of each shape's deflection at the tip, shape (1, k).

    The sign of a mode is free; a positive deflection of the tip makes models comparable.
    """
    return np.where(basis.tip_values(shapes) < 0, -1.0, 1.0)


def _modes(parts: Factors) -> tuple[Array, Array]:
    """Return ω (n,) and U (n+1, n+1) with UᵀMU = I, the rigid-body mode first."""
    found = ritz_modes(parts, "free")
    n = len(found.omega)
    rotation, bending = parts.mass[:, 0], parts.mass[:, 1:]
    inertia = float(rotation @ rotation)
    modes = np.zeros((n + 1, n + 1))
    modes[0, 0] = 1 / math.sqrt(inertia)
    modes[0, 1:] = -(rotation @ bending @ found.shapes) / inertia
    modes[1:, 1:] = found.shapes
    return found.omega, modes
