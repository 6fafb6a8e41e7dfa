"""The nonlinear equations of a large slew (eq. 37–38), with geometric stiffening.

    [J + qᵀSq] θ̈ + 2θ̇ qᵀS q̇ + Φ̃ q̈ + (D ẋ)_θ = τ
    Φ̃ᵀ θ̈ + M_e q̈ + (D ẋ)_q + [K_e − θ̇² S] q = 0,      S = M_s − κK_g, x = [θ, q]

With an elastic joint θ in these is the hub's angle, θ_m plus the twist that q holds.

κ = 0 is the paper's equations, in which a fast slew diverges as soon as θ̇ passes the lowest
hub-locked frequency; κ = 1 adds the tension of the turning beam, which prevents it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._show import Described
from slewctl._types import Array
from slewctl.model.assembly import Model
from slewctl.model.large_deflection import LargeDeflectionError
from slewctl.model.spin import (
    carried_mass_factor,
    check_model,
    critical_spin_rad_s,
    stiffening_factor,
)


@dataclass(frozen=True, eq=False, repr=False)
class NonlinearModel(Described):
    """The nonlinear equations of a large slew (see the module's docstring).

    States are [θ, q, θ̇, q̇] as in `state_space`.  J, Φ̃, M_e, K_e and D are those of the
    linear model.  Their energy is ½[J + qᵀSq]θ̇² + θ̇Φ̃q̇ + ½q̇ᵀM_eq̇ + ½qᵀK_eq.

    Attributes
    ----------
    linear : Model
        The linear model that holds for small θ̇ and q.
    carried_mass : ndarray, shape (n, n)
        M_s: M_e without the payload's rotary inertia.
    geometric_stiffness : ndarray, shape (n, n)
        K_g: the stiffness by tension for a spin of 1 rad/s.
    stiffening : bool
        κ = 1 or 0.
    """

    linear: Model
    carried_mass: Array
    geometric_stiffness: Array
    stiffening: bool

    def __str__(self) -> str:
        tension = "with" if self.stiffening else "without"
        return f"large slews of {self.linear}, {tension} stiffening by tension"

    def __post_init__(self) -> None:
        for name in ("carried_mass", "geometric_stiffness"):
            getattr(self, name).setflags(write=False)

    @property
    def n(self) -> int:
        """Number of admissible functions."""
        return self.linear.n

    @cached_property
    def softening(self) -> Array:
        """S = M_s − κK_g, shape (n, n): −θ̇²S is what the spin adds to the stiffness."""
        if not self.stiffening:
            return self.carried_mass
        S = self.carried_mass - self.geometric_stiffness
        S.setflags(write=False)
        return S

    @cached_property
    def critical_spin_rad_s(self) -> float:
        """The rate θ̇ beyond which the deflection diverges; infinite with stiffening."""
        return np.inf if self.stiffening else critical_spin_rad_s(self.linear)

    @cached_property
    def turning(self) -> Array:
        """Uᵀt, shape (n+1,): how far each mode turns the hub, t the row of θ."""
        return self.linear.turning @ self.linear.mode_shapes

    @cached_property
    def compliance(self) -> Array:
        """M⁻¹t, shape (n+1,): the accelerations at rest per unit of torque on the hub."""
        return self.linear.mode_shapes @ self.turning

    def excessive(self, q: Array) -> LargeDeflectionError:
        """Return the error that says at which deflection `q` the equations cease to hold."""
        change = _form(q, self.softening)
        tip = float(self.linear.basis.evaluate(np.ones(1))[0] @ q)
        return LargeDeflectionError(
            f"with a tip deflection of {abs(tip):.3g} m the shortening of the bent beam takes "
            f"{-change:.3g} kg·m² from the inertia of {self.linear.mass[0, 0]:.3g} kg·m², of which "
            f"a sudden torque on the hub meets only {1 / (self.turning @ self.turning):.3g} kg·m²",
            where="large slew",
            remedy="slew more gently, give the hub its inertia, use fewer functions, or leave "
            "out the stiffening where the arm turns slowly",
        )

    def accelerations(self, x: Array, rates: Array, torque: float) -> Array:
        """Return [θ̈, q̈], shape (n+1,), that solve the equations of motion.

        Parameters
        ----------
        x, rates : ndarray, shape (n+1,)
            [θ, q] and [θ̇, q̇].
        torque : float
            τ in N·m.

        Raises
        ------
        LargeDeflectionError
            If the deflection makes the mass matrix indefinite, which it can with
            stiffening alone.
        """
        U, model = self.linear.mode_shapes, self.linear
        Sq, hub = self.softening @ x[1:], model.turning
        rate = float(hub @ rates)
        force = -(model.stiffness @ x) - model.damping @ rates
        force -= 2 * rate * (Sq @ rates[1:]) * hub
        force[0] += torque
        force[1:] += rate**2 * Sq
        change = float(x[1:] @ Sq)
        # The determinant of the mass matrix over that of M.
        meeting = 1 + change * float(self.turning @ self.turning)
        if not meeting > 0:
            raise self.excessive(x[1:])
        # M⁻¹ = UUᵀ, and qᵀSq adds a matrix of rank one to M: Sherman and Morrison.
        free = U @ (U.T @ force)
        return np.asarray(free - (change * (hub @ free) / meeting) * self.compliance)

    def derivative(self, state: Array, torque: float) -> Array:
        """Return the time derivative of the state [θ, q, θ̇, q̇], shape (2(n+1),)."""
        x, rates = np.split(np.asarray(state, dtype=float), 2)
        return np.concatenate([rates, self.accelerations(x, rates, torque)])

    def energy(self, state: Array) -> Array:
        """Return the kinetic and elastic energy in J.

        Parameters
        ----------
        state : ndarray, shape (..., 2(n+1))
        """
        x, rates = np.split(np.asarray(state, dtype=float), 2, axis=-1)
        change = _form(x[..., 1:], self.softening)
        kinetic = _form(rates, self.linear.mass) + change * (rates @ self.linear.turning) ** 2
        return np.asarray((kinetic + _form(x, self.linear.stiffness)) / 2)

    def angular_momentum(self, state: Array) -> Array:
        """Return [J + qᵀSq]θ̇ + Φ̃q̇ in N·m·s, which only τ and the drag on θ change.

        Parameters
        ----------
        state : ndarray, shape (..., 2(n+1))
        """
        x, rates = np.split(np.asarray(state, dtype=float), 2, axis=-1)
        change = _form(x[..., 1:], self.softening)
        return np.asarray(rates @ self.linear.mass[0] + change * (rates @ self.linear.turning))


def _form(x: Array, matrix: Array) -> Array:
    """Return xᵀ · matrix · x along the last axis."""
    return np.asarray(((x @ matrix) * x).sum(axis=-1))


def large_slew(model: Model, stiffening: bool = True) -> NonlinearModel:
    """Return the nonlinear equations that hold for large and fast slews of an arm.

    Parameters
    ----------
    model : Model
        The linear model, as from `assemble` or `truth`.
    stiffening : bool
        Whether the tension of the turning beam stiffens it (κ = 1).  Without it the
        equations are the paper's, and wrong when θ̇ nears the lowest hub-locked frequency.

    Returns
    -------
    NonlinearModel

    Raises
    ------
    InputError
        If `model` is not a model.
    AccuracyError
        If the integrals of a callable profile do not settle.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> type(sc.large_slew(model)).__name__
    'NonlinearModel'
    """
    check_model(model, "large_slew")
    F = carried_mass_factor(model.arm, model.basis)
    G = stiffening_factor(model.arm, model.basis)
    return NonlinearModel(model, F.T @ F, G.T @ G, bool(stiffening))
