"""LQG of a plant that comes sampled: the H2 optimum in discrete time.

With X and P of the two Riccati equations, the sum of zᵀz is a constant and that of

    |u + K x + G w|² in the price R + B₂ᵀXB₂,    G = (R + B₂ᵀXB₂)⁻¹(B₂ᵀXB₁ + D₁₂ᵀD₁₁),

so the best u is what is expected of −Kx − Gw when y has been read: with the innovation
ν = y − C₂x̂ − D₂₂u it is −K x̂ − N ν (Chen and Francis, Optimal Sampled-Data Control Systems,
Springer 1995, chapter 6).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import Protocol

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference, at_rest
from slewctl.design.result import Controller, finished
from slewctl.design.riccati.lqr_kalman import optimal_feedback, optimal_filter, optimum_checks
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import RiccatiSolution
from slewctl.plant import GeneralisedPlant, ill_posed


def sampled_plant_lqg(plant: GeneralisedPlant) -> Controller:
    """Return the LQG controller of a sampled plant; see `slewctl.lqg`."""
    start = perf_counter()
    design = SampledOptimum(plant, optimal_feedback(plant), optimal_filter(plant))
    solved = perf_counter()
    estimates = [f"{state}_estimate" for state in plant.linear.state_labels]
    system = design.system().named(plant.sensors, [plant.actuator], estimates)
    built = perf_counter()
    return finished(
        plant,
        system,
        "lqg",
        {"state_feedback": design.K, "observer": design.L, "innovation": design.N},
        checks=optimum_checks(design.regulator, design.observer, design.cost),
        assumptions=(
            "u_k = −K x̂_k − N (y_k − C x̂_k), x̂ predicted by a stationary Kalman filter; u_k is "
            "computed from y_k and acts at once",
            "w is white noise of unit covariance; optimal for the mean of zᵀz at the samples",
        ),
        seconds={"solve": solved - start, "build": built - solved},
        reference=design.reference(plant),
    )


class Partition(Protocol):
    """The matrices of a sampled plant from [w, u] to [z, y]; a `GeneralisedPlant` is one."""

    @property
    def A(self) -> Array: ...
    @property
    def B1(self) -> Array: ...
    @property
    def B2(self) -> Array: ...
    @property
    def C2(self) -> Array: ...
    @property
    def D11(self) -> Array: ...
    @property
    def D12(self) -> Array: ...
    @property
    def D21(self) -> Array: ...
    @property
    def D22(self) -> Array: ...
    @property
    def disturbances(self) -> int: ...
    @property
    def sample_time(self) -> float: ...


@dataclass(frozen=True, eq=False)
class SampledOptimum:
    """The two Riccati solutions of a sampled plant, and what follows from them."""

    plant: Partition
    regulator: RiccatiSolution
    observer: RiccatiSolution

    @property
    def K(self) -> Array:
        """State feedback, shape (controls, n)."""
        return self.regulator.gain

    @property
    def L(self) -> Array:
        """Predictor gain, shape (n, sensors)."""
        return self.observer.gain.T

    @cached_property
    def price(self) -> Array:
        p = self.plant
        return p.D12.T @ p.D12 + p.B2.T @ self.regulator.X @ p.B2

    @cached_property
    def G(self) -> Array:
        """What u would add if w were known, shape (controls, disturbances)."""
        p = self.plant
        entering = p.B2.T @ self.regulator.X @ p.B1 + p.D12.T @ p.D11
        return np.asarray(np.linalg.solve(self.price, entering))

    @cached_property
    def seen(self) -> tuple[Array, Array]:
        """Covariance of [x − x̂; w] with the innovation, and that of the innovation."""
        p, P = self.plant, self.observer.X
        return np.vstack([P @ p.C2.T, p.D21.T]), p.C2 @ P @ p.C2.T + p.D21 @ p.D21.T

    @cached_property
    def N(self) -> Array:
        """Gain on the innovation, shape (controls, sensors)."""
        cross, innovation = self.seen
        return np.asarray(np.linalg.solve(innovation, (np.hstack([self.K, self.G]) @ cross).T).T)

    @cached_property
    def left(self) -> Array:
        """I − N D₂₂: u enters its own innovation."""
        return np.eye(len(self.N)) - self.N @ self.plant.D22

    def system(self) -> LinearSystem:
        """Return the controller."""
        p = self.plant
        if np.linalg.svd(self.left, compute_uv=False).min() == 0:
            raise ill_posed()
        C, D = (
            np.asarray(-np.linalg.solve(self.left, gain))
            for gain in (self.K - self.N @ p.C2, self.N)
        )
        driven = p.B2 - self.L @ p.D22
        return LinearSystem(
            p.A - self.L @ p.C2 + driven @ C,
            self.L + driven @ D,
            C,
            D,
            p.sample_time,
            name="lqg",
        )

    def reference(self, plant: GeneralisedPlant) -> Reference | None:
        """Return how the reference angle enters: by commanding the state."""
        rest = at_rest(plant)
        if rest is None:
            return None
        entry = np.asarray(np.linalg.solve(self.left, self.K @ rest[0] + rest[1]), dtype=float)
        return Reference((self.plant.B2 - self.L @ self.plant.D22) @ entry, entry)

    @property
    def cost(self) -> float:
        """The optimal squared H2 norm from the two Riccati equations."""
        p, (cross, innovation) = self.plant, self.seen
        known = float(np.sum(p.D11**2) + np.sum((p.B1.T @ self.regulator.X) * p.B1.T))
        known -= float(np.sum((self.G.T @ self.price) * self.G.T))
        missed = np.hstack([self.K, self.G])
        n, w = len(p.A), p.disturbances
        unseen = np.zeros((n + w, n + w))
        unseen[:n, :n], unseen[n:, n:] = self.observer.X, np.eye(w)
        unseen -= cross @ np.linalg.solve(innovation, cross.T)
        return known + float(np.sum((self.price @ missed @ unseen) * missed))
