"""`h2syn`: the H2-optimal controller of any partitioned system, as python-control has it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.riccati.discrete_lqg import SampledOptimum
from slewctl.design.riccati.lqr_kalman import Plain, weighted_feedback, weighted_filter
from slewctl.errors import AccuracyError, DesignError, InputError, check_count
from slewctl.numerics.given_system import read_system
from slewctl.numerics.h2_norm import system_cost
from slewctl.numerics.interconnect import AlgebraicLoopError, behind_feedthrough, lft
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import RiccatiSolution
from slewctl.numerics.observability import poles_and_growth
from slewctl.plant import ill_posed

if TYPE_CHECKING:
    import control

# The cost of the closed loop from a Lyapunov equation agrees with the Riccati equations' to this.
_AGREED = 1e-8


@guarded
def h2syn(P: control.StateSpace, nmeas: int, ncon: int) -> control.StateSpace:
    """Return the controller u = K y that minimises the H2 norm from w to z.

    Parameters
    ----------
    P : control.StateSpace
        From [w, u] to [z, y], continuous or sampled.  Cross terms (D₁₂ᵀC₁, B₁D₂₁ᵀ) and D₂₂
        are taken into account, and D₁₁ as far as a feedthrough of K cancels it.
    nmeas, ncon : int
        Number of measurements y, the last outputs, and of controls u, the last inputs.

    Returns
    -------
    control.StateSpace
        From y to u, connected with a plus sign, on the clock of P.

    Raises
    ------
    DesignError
        If a mode is not penalised, seen or reached, a measurement has no noise or a control
        no penalty, or white noise passes straight to z whatever the controller.
    InputError
        If P is no such system, or its loop has no solution.
    AccuracyError
        If the closed loop, recomputed, is not stable or not as good as it should be.

    Examples
    --------
    >>> import control, slewctl as sc
    >>> P = control.ss([[-1]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]])
    >>> K = sc.h2syn(P, 1, 1)
    >>> round(float(K.poles()[0].real), 6)
    -1.828427
    """
    plant = _Partitioned.of(read_system(P, "P"), nmeas, ncon)
    straight = _cancelling(plant)
    shifted = plant.fed_back(straight)
    if plant.system.sample_time:
        optimum = SampledOptimum(shifted, *_solutions(shifted))
        inner, cost = optimum.system(), optimum.cost
    else:
        regulator, observer = _solutions(shifted)
        K, L = regulator.gain, observer.gain.T
        inner = LinearSystem(shifted.A - shifted.B2 @ K - L @ shifted.C2, L, -K,
                             np.zeros((len(K), L.shape[1])))  # fmt: skip
        missed = shifted.D12 @ K
        cost = float(
            np.trace(shifted.B1.T @ regulator.X @ shifted.B1)
            + np.trace(missed @ observer.X @ missed.T)
        )
    whole = LinearSystem(inner.A, inner.B, inner.C, inner.D + straight, plant.system.dt)
    try:
        meeting = behind_feedthrough(whole, plant.D22)
    except AlgebraicLoopError as error:
        raise ill_posed() from error
    found = meeting.named(plant.sensors, plant.actuators, name="h2syn")
    _verify(plant.system, found, cost)
    return found.to_control()


@dataclass(frozen=True, eq=False)
class _Partitioned:
    """A system from [w, u] to [z, y]; D₂₂ is left out of what is fed back."""

    system: LinearSystem
    nmeas: int
    ncon: int

    @classmethod
    def of(cls, system: LinearSystem, nmeas: int, ncon: int) -> _Partitioned:
        for name, count, whole, what in (
            ("nmeas", nmeas, system.noutputs, "outputs"),
            ("ncon", ncon, system.ninputs, "inputs"),
        ):
            if check_count(count, name) >= whole:
                raise InputError(
                    f"{count} of {whole} {what}",
                    where=name,
                    remedy="leave at least one for w and z",
                )
        if not system.nstates:
            raise InputError("it has no states", where="P", remedy="give a dynamic system")
        return cls(system, nmeas, ncon)

    @property
    def disturbances(self) -> int:
        return self.system.ninputs - self.ncon

    @property
    def sample_time(self) -> float:
        return self.system.sample_time

    @property
    def sensors(self) -> tuple[str, ...]:
        return self.system.output_labels[-self.nmeas :]

    @property
    def actuators(self) -> tuple[str, ...]:
        return self.system.input_labels[-self.ncon :]

    @property
    def A(self) -> Array:
        return self.system.A

    @property
    def B1(self) -> Array:
        return self.system.B[:, : -self.ncon]

    @property
    def B2(self) -> Array:
        return self.system.B[:, -self.ncon :]

    @property
    def C1(self) -> Array:
        return self.system.C[: -self.nmeas]

    @property
    def C2(self) -> Array:
        return self.system.C[-self.nmeas :]

    @cached_property
    def D11(self) -> Array:
        return self.system.D[: -self.nmeas, : -self.ncon]

    @cached_property
    def D12(self) -> Array:
        return self.system.D[: -self.nmeas, -self.ncon :]

    @cached_property
    def D21(self) -> Array:
        return self.system.D[-self.nmeas :, : -self.ncon]

    @cached_property
    def D22(self) -> Array:
        return self.system.D[-self.nmeas :, -self.ncon :]

    def fed_back(self, straight: Array) -> _Partitioned:
        """Return the system with u = straight·y + u', and without its D₂₂."""
        A = self.A + self.B2 @ straight @ self.C2
        B1 = self.B1 + self.B2 @ straight @ self.D21
        C1 = self.C1 + self.D12 @ straight @ self.C2
        D11 = self.D11 + self.D12 @ straight @ self.D21
        if not self.sample_time:
            D11 = np.zeros_like(D11)  # cancelled, to rounding
        system = LinearSystem(
            A,
            np.hstack([B1, self.B2]),
            np.vstack([C1, self.C2]),
            np.block([[D11, self.D12], [self.D21, np.zeros_like(self.D22)]]),
            self.system.dt,
        )
        return _Partitioned(system, self.nmeas, self.ncon)


def _cancelling(plant: _Partitioned) -> Array:
    """Return the feedthrough of K that cancels D₁₁ of a continuous plant; else refuse."""
    nothing = np.zeros((plant.ncon, plant.nmeas))
    if plant.sample_time or not np.any(plant.D11):
        return nothing
    straight = -np.linalg.pinv(plant.D12) @ plant.D11 @ np.linalg.pinv(plant.D21)
    left = plant.D11 + plant.D12 @ straight @ plant.D21
    if np.linalg.norm(left) > 1e-12 * np.linalg.norm(plant.D11):
        raise DesignError(
            "white noise reaches z without delay, whatever the controller: infinite variance",
            where="D11",
            remedy="put a lag between them, or leave that output out of z",
        )
    return np.asarray(straight)


def _solutions(plant: _Partitioned) -> tuple[RiccatiSolution, RiccatiSolution]:
    plain = Plain(plant.A, plant.B2, plant.C2, plant.sample_time)
    return (
        weighted_feedback(plain, plant.C1, plant.D12, "z"),
        weighted_filter(plain, plant.B1.T, plant.D21.T),
    )


def _verify(plant: LinearSystem, controller: LinearSystem, cost: float) -> None:
    """Refuse a controller that, closed around the plant as given, is not what it should be."""
    try:
        loop = lft(plant, controller)
    except AlgebraicLoopError as error:
        raise ill_posed() from error
    # Of a D₁₁ that was cancelled rounding is left, which is no feedthrough.
    D = loop.D if loop.sample_time else np.zeros_like(loop.D)
    stable = poles_and_growth(loop.A, loop.sample_time)[1] < 0
    reached = system_cost(LinearSystem(loop.A, loop.B, loop.C, D, loop.dt)).value if stable else 0.0
    if not stable or not abs(reached - cost) <= _AGREED * abs(cost):
        what = "does not stabilise its plant" if not stable else "is not as good as it should be"
        raise AccuracyError(
            f"the controller, recomputed, {what}",
            where="h2syn",
            remedy="bring weights and noises closer together, or measure in other units",
        )
