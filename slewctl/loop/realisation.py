"""Matrices of systems with several inputs and outputs, and how they combine.

python-control's arithmetic keeps names and sample times; here only the matrices are wanted,
of continuous systems or of what sampled ones become by the bilinear map.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError
from slewctl.loop.parts import state_space
from slewctl.numerics.balance import balance
from slewctl.numerics.bilinear import equivalent
from slewctl.numerics.hinf_norm import Peak, peak_gain
from slewctl.numerics.interconnect import diagonal, parallel, series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import stability_threshold


@dataclass(frozen=True, eq=False)
class Realisation:
    """The matrices of ẋ = Ax + Bu, y = Cx + Du.

    Attributes
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
    """

    A: Array
    B: Array
    C: Array
    D: Array

    @property
    def states(self) -> int:
        """Number of states n."""
        return len(self.A)

    @cached_property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A."""
        return np.linalg.eigvals(self.A).astype(complex)

    @property
    def stable(self) -> bool:
        """Whether every pole lies left of the axis by more than rounding."""
        if not self.states:
            return True
        return bool(self.poles.real.max() < -stability_threshold(self.A))

    @property
    def balanced(self) -> Realisation:
        """The same system in states for which A is balanced."""
        if not self.states:
            return self
        scale = balance(self.A)
        return Realisation(
            self.A / scale[:, None] * scale, self.B / scale[:, None], self.C * scale, self.D
        )

    @property
    def system(self) -> LinearSystem:
        """The same as a continuous `LinearSystem`."""
        return LinearSystem(self.A, self.B, self.C, self.D)

    def peak(self) -> Peak:
        """Return ‖G‖∞, the caller having decided stability, and where it is reached."""
        return peak_gain(self.system)

    def scaled(self, left: Array, right: Array) -> Realisation:
        """Return diag(left) G diag(right)."""
        return Realisation(
            self.A, self.B * right, left[:, None] * self.C, left[:, None] * self.D * right
        )

    def after(self, first: Realisation) -> Realisation:
        """Return the product self·first: `first` feeds this system."""
        return Realisation(*series(first.system, self.system).matrices)

    def minus(self, other: Realisation) -> Realisation:
        """Return self − other, in parallel."""
        less = LinearSystem(other.A, other.B, -other.C, -other.D)
        return Realisation(*parallel(self.system, less).matrices)

    def closed(self, K: Realisation) -> Realisation:
        """Return [I; K](I − GK)⁻¹[I G]: from what is added to y and u to y and u, u = Ky.

        Raises
        ------
        InputError
            If the loop is not well posed: I − D D_K is singular.
        """
        p, m = self.D.shape
        # At the junctions: y = C x + D u + v and u = C_K x_K + D_K y, u with w added at the plant.
        junction = check_well_posed(self.D, K.D)
        # [y; u] from the states.
        outputs: Array = np.asarray(np.linalg.solve(junction, diagonal(self.C, K.C)), dtype=float)
        passed = np.linalg.solve(
            junction, np.block([[np.eye(p), self.D], [np.zeros((m, p)), np.zeros((m, m))]])
        )
        entry = diagonal(self.B, K.B)  # the plant is fed u + w, the controller y
        swap = np.block([[np.zeros((m, p)), np.eye(m)], [np.eye(p), np.zeros((p, m))]])
        direct = np.zeros((m + p, p + m))
        direct[:m, p:] = np.eye(m)
        return Realisation(
            diagonal(self.A, K.A) + entry @ swap @ outputs,
            entry @ (swap @ passed + direct),
            outputs,
            passed,
        )


def check_well_posed(D: Array, K: Array) -> Array:
    """Return [I −D; −K I] of the feedthroughs of a plant and its controller, u = K y.

    Raises
    ------
    InputError
        If it is singular.
    """
    p, m = D.shape
    junction: Array = np.block([[np.eye(p), -D], [-K, np.eye(m)]])
    if np.linalg.cond(junction) > 1e12:
        raise InputError(
            "the loop is not well posed: 1 minus the product of both feedthroughs is singular",
            where="loop",
            remedy="remove a feedthrough, or change its size",
        )
    return junction


def realisation(system: object, where: str) -> Realisation:
    """Return the matrices of a system; a sampled one is mapped by z = (1 + s)/(1 − s).

    The map takes the unit circle to the imaginary axis and keeps stability, norms and gaps.

    Parameters
    ----------
    system : LinearSystem, or what `state_space` takes
    where : str
        What asked for it, for messages.

    Raises
    ------
    InputError
        For anything else, or a sampled system with a pole at z = −1.
    """
    found = equivalent(state_space(system, where))
    if found.turn:
        raise InputError(
            "the sampled system has a pole at z = −1, half the sampling frequency",
            where=where,
            remedy="change the sample time, or move the pole",
        )
    return Realisation(
        *(np.asarray(matrix, dtype=float) for matrix in (found.A, found.B, found.C, found.D))
    )


def hertz(v: float, system: LinearSystem) -> float | None:
    """Return in Hz the frequency at s = jv of `realisation`; None where it is infinite."""
    omega = float(equivalent(system).omega(np.array([v]))[0]) if system.dt else v
    return omega / (2 * np.pi) if np.isfinite(omega) else None
