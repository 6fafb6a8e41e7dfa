"""A generalised plant in the coordinates that matrix inequalities can be solved in.

An interior-point solver sees only numbers.  In raw coordinates those of a flexible arm span
many decades (entries ω² beside ones, displacements of 1e-6 m beside rates), and the solver
stops early or, worse, calls a poor point optimal.  Here every mode gets the two states
[ωη, η̇], whose squares are its energies; time is counted in units of 1/ω₁; the control is
measured by what it costs and each measurement by its noise.

The plant may come in any coordinates: they are taken apart into its modes, one invariant
subspace each, and every gain is taken back afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from slewctl._types import Array
from slewctl.design.energy_modes import Modes, Signals, modes_of
from slewctl.errors import AccuracyError, DesignError
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import full_column_rank
from slewctl.plant import GeneralisedPlant, check_plant

# The modes must give the state matrix back to this, relative to its balanced norm.
_RESIDUAL = 1e-7


@dataclass(frozen=True, eq=False)
class ScaledPlant:
    """A generalised plant in modal energy coordinates and without units.

    With x = state @ x_s, time t = t_s/rate, u = control_unit @ u_s and y = sensor_unit @ y_s:

        dx_s/dt_s = A x_s + B1 w + B2 u_s,   z = C1 x_s + D12 u_s,   y_s = C2 x_s + D21 w,

    where D12ᵀD12 = I and D21 D21ᵀ = I.  The squared H2 norm of the plant is ``rate`` times
    that of the scaled one; an H∞ norm, and any norm at a frequency, is the same.

    Attributes
    ----------
    A, B1, B2, C1, C2, D12, D21 : ndarray
    state : ndarray, shape (n, n)
        x = state @ x_s.
    rate : float
        ω₁ in rad/s, the lowest flexible frequency.
    omega : ndarray, shape (n,)
        Frequency of each scaled state's mode over ``rate``; 1 for the rigid body.
    control_unit, sensor_unit : ndarray, shapes (1, 1) and (sensors, sensors)
    residual : float
        How well the scaled state matrix gives the plant's back, relative.
    """

    A: Array
    B1: Array
    B2: Array
    C1: Array
    C2: Array
    D12: Array
    D21: Array
    state: Array
    rate: float
    omega: Array
    control_unit: Array
    sensor_unit: Array
    residual: float

    def state_feedback(self, F: Array) -> Array:
        """Return K with u = −K x for u_s = −F x_s.

        Parameters
        ----------
        F : ndarray, shape (1, n)
        """
        return np.asarray(np.linalg.solve(self.state.T, (self.control_unit @ F).T).T, dtype=float)

    def observer_gain(self, L: Array) -> Array:
        """Return K_f with x̂' = … + K_f (y − C₂x̂) for … + L (y_s − C2 x̂_s).

        Parameters
        ----------
        L : ndarray, shape (n, sensors)
        """
        return self.rate * (self.state @ np.linalg.solve(self.sensor_unit.T, L.T).T)

    @property
    def diagonal(self) -> bool:
        """Whether the plant's own states are modal: each a multiple of an energy state."""
        return bool(np.array_equal(self.state, np.diag(np.diag(self.state))))

    def energy_plant(self, plant: GeneralisedPlant) -> tuple[GeneralisedPlant, ScaledPlant]:
        """Return the plant that this was made of, units kept, with energy states.

        The recomputations that confirm a result are made on it: in raw coordinates they
        themselves lose many digits.

        Parameters
        ----------
        plant : GeneralisedPlant
            The one given to `scaled`.

        Returns
        -------
        tuple of GeneralisedPlant and ScaledPlant
            The second differs from this one by ``state``, the identity.
        """
        system, back = plant.linear, np.linalg.inv(self.control_unit)
        turned = LinearSystem(
            self.rate * self.A,
            self.rate * np.hstack([self.B1, self.B2 @ back]),
            np.vstack([self.C1, self.sensor_unit @ self.C2]),
            system.D,
            inputs=system.input_labels,
            outputs=system.output_labels,
            states=[f"energy{i}" for i in range(1, len(self.A) + 1)],
            name=f"{system.name}_energy",
        )
        return replace(plant, system=turned), replace(self, state=np.eye(len(self.A)))

    def controller(self, system: LinearSystem) -> LinearSystem:
        """Return u = K(s) y for a controller u_s = K_s(s_s) y_s, its signals named as before.

        Parameters
        ----------
        system : LinearSystem
            In scaled time, from y_s to u_s.
        """
        A, B, C, D = (np.asarray(getattr(system, name)) for name in "ABCD")
        from_sensors = np.linalg.inv(self.sensor_unit)
        return LinearSystem(
            self.rate * A,
            self.rate * B @ from_sensors,
            self.control_unit @ C,
            self.control_unit @ D @ from_sensors,
            inputs=system.input_labels,
            outputs=system.output_labels,
            states=system.state_labels,
            name=system.name,
        )


def scaled(plant: GeneralisedPlant) -> ScaledPlant:
    """Return a plant in modal energy coordinates.

    Parameters
    ----------
    plant : GeneralisedPlant
        In any coordinates: modal ones, where each mode is scaled as it stands; physical ones
        [x, ẋ], whose modes are the eigenvectors of the stiffness matrix −A₂₁; or any other,
        taken apart into invariant subspaces, one for each pair of poles.

    Returns
    -------
    ScaledPlant

    Raises
    ------
    DesignError
        If the torque is not penalised (D12ᵀD12 singular), or a measurement has no noise.
    AccuracyError
        If the plant's modes cannot be told apart to working precision.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.design import scaled
    >>> scaled(plant).A.shape
    (4, 4)
    """
    check_plant(plant, "scaled")
    control_root = _unit(plant.D12, f"the {plant.actuator} has no penalty", "limits",
                         f"add limits.{plant.actuator}")  # fmt: skip
    sensor_unit = _unit(plant.D21.T, "a measurement has no noise of its own", "noise",
                        "give every sensor a noise density > 0")  # fmt: skip
    B2 = plant.B2 @ np.linalg.inv(control_root).T
    C2 = np.asarray(np.linalg.solve(sensor_unit, plant.C2), dtype=float)
    modes = modes_of(plant.A, Signals(plant.B1, B2, plant.C1, C2))
    if not modes.residual <= _RESIDUAL:
        raise AccuracyError(
            f"the plant's modes cannot be told apart in these coordinates (its state matrix "
            f"comes back with a relative error of {modes.residual:.0e})",
            where="scaled",
            remedy="give the plant in modal coordinates, or add damping that keeps poles apart",
        )
    return _assembled(plant, modes, control_root, sensor_unit)


def _unit(D: Array, what: str, where: str, remedy: str) -> Array:
    """Return the lower triangular G with G Gᵀ = DᵀD; refuse a singular one."""
    if not full_column_rank(D):
        raise DesignError(what, where=where, remedy=remedy)
    root = np.asarray(np.linalg.qr(D, mode="r"), dtype=float)
    return (root * np.where(np.diag(root) < 0, -1.0, 1.0)[:, None]).T


def _assembled(
    plant: GeneralisedPlant, modes: Modes, control_root: Array, sensor_unit: Array
) -> ScaledPlant:
    """Return the scaled plant of its modes; D12ᵀD12 = G Gᵀ with G = control_root."""
    control_unit = np.asarray(np.linalg.inv(control_root.T), dtype=float)
    rate, state, inverse = modes.rate, modes.state, modes.inverse
    return ScaledPlant(
        A=modes.A / rate,
        B1=inverse @ plant.B1 / rate,
        B2=inverse @ plant.B2 @ control_unit / rate,
        C1=plant.C1 @ state,
        C2=solve_triangular(sensor_unit, plant.C2 @ state, lower=True),
        D12=plant.D12 @ control_unit,
        D21=solve_triangular(sensor_unit, plant.D21, lower=True),
        state=state,
        rate=rate,
        omega=modes.omega / rate,
        control_unit=control_unit,
        sensor_unit=sensor_unit,
        residual=modes.residual,
    )
