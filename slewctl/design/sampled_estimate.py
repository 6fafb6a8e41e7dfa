"""State feedback of a sampled estimate: an observer that uses the reading of the same instant.

At t_k the observer has used y_k already and knows the inputs that are on their way; the input
computed from it is −K χ̂, χ̂ the prediction of what the input will meet when it arrives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference, at_rest
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, SampledPlant, sampled_plant, split_delay

# The state of a controller that sums the angle's error.
INTEGRAL_STATE = "theta_integral"


@dataclass(frozen=True, eq=False)
class SampledEstimate:
    """A controller on a clock, from the gains that a method has found.

    The state that the input meets is χ = [x; the input on its way, for a fraction of a sample;
    the integral σ of the angle's error, if there is one].

    Attributes
    ----------
    plant : GeneralisedPlant
    T, delay : float
        In s.
    name : str
        Of the system.
    angle : int or None
        Which sensor is integrated.
    """

    plant: GeneralisedPlant
    T: float
    delay: float
    name: str
    angle: int | None

    @property
    def feedback(self) -> Array:
        """K on χ, shape (1, size)."""
        raise NotImplementedError

    @property
    def correction(self) -> Array:
        """M of x̂_{k|k} = x̂_{k|k−1} + M (y_k − C x̂_{k|k−1}), shape (n, sensors)."""
        raise NotImplementedError

    @property
    def surprise(self) -> float:
        """Gain on the part of θ's reading that is noise, which σ takes in as well."""
        return 0.0

    @property
    def timing(self) -> str:
        """When is read and when is commanded, in words."""
        return (
            f"the sensors are read at t_k = k·{self.T:g} s; the {self.plant.actuator} computed "
            f"from the reading at t_k is held from t_k + {self.delay:g} s to t_(k+1) + "
            f"{self.delay:g} s"
        )

    @cached_property
    def whole(self) -> SampledPlant:
        """The plant with all of the delay."""
        return sampled_plant(self.plant, self.T, self.delay)

    @cached_property
    def short(self) -> SampledPlant:
        """The plant with the fraction of the delay: what u meets when it arrives."""
        samples, fraction = split_delay(self.T, self.delay)
        return sampled_plant(self.plant, self.T, fraction) if samples else self.whole

    @property
    def ahead(self) -> int:
        """Number of samples by which the state is predicted."""
        return self.whole.waiting - self.short.waiting

    @property
    def dynamics(self) -> tuple[Array, Array]:
        """A and B of the regulator's states."""
        return self.augmented(self.short)

    def augmented(self, plant: SampledPlant) -> tuple[Array, Array]:
        """Return A and B of a sampled plant with σ_{k+1} = σ_k + T θ_k, if there is one."""
        if self.angle is None:
            return plant.A, plant.B
        n = len(plant.A)
        A = np.zeros((n + 1, n + 1))
        A[:n, :n], A[n, n] = plant.A, 1.0
        A[n, :n] = self.T * plant.C[self.angle]
        return A, np.vstack([plant.B, [[0.0]]])

    @cached_property
    def _gain(self) -> Array:
        """Gain on the states of the whole plant: K of the regulator on the prediction."""
        A = self.augmented(self.whole)[0]
        n, size = len(self.plant.A), len(A)
        met = [*range(n), *([n + self.whole.waiting - 1] if self.short.waiting else [])]
        met += [size - 1] if self.angle is not None else []
        return self.feedback @ np.linalg.matrix_power(A, self.ahead)[met]

    def system(self) -> LinearSystem:
        """Return the controller: states x̂_{k|k−1}, inputs on their way, σ_k."""
        F, G, H, J = self._observer
        states = [f"{state}_estimate" for state in self.whole.path.state_labels]
        return LinearSystem(
            F - H @ (self._gain - J @ self._seen),
            G - H @ J,
            J @ self._seen - self._gain,
            -J,
            self.T,
            inputs=list(self.plant.sensors),
            outputs=[self.plant.actuator],
            states=[*states, *([] if self.angle is None else [INTEGRAL_STATE])],
            name=self.name,
        )

    @cached_property
    def _seen(self) -> Array:
        """C from the controller's states: what the filter expects to measure."""
        return np.hstack([self.whole.C, np.zeros((len(self.whole.C), int(self.angle is not None)))])

    @cached_property
    def _observer(self) -> tuple[Array, Array, Array, Array]:
        """F, G, H of s⁺ = F s + G y + H u, and J of u = −gain·s − J (y − C s)."""
        n, size = len(self.plant.A), len(self._gain[0])
        A, H = self.augmented(self.whole)
        M = np.zeros((size, len(self.plant.sensors)))
        M[:n] = self.correction
        F, G = A @ (np.eye(size) - M @ self._seen), A @ M
        J = self._gain @ M
        if self.angle is not None:
            # σ takes in the measurement itself, not its estimate.
            F[-1], G[-1] = np.eye(size)[-1], self.T * np.eye(len(G[0]))[self.angle]
            noise = np.eye(len(G[0])) - self.plant.C2 @ self.correction
            J = J + self.surprise * noise[self.angle]
        return F, G, H, J

    @property
    def entry(self) -> Array:
        """How the input enters the controller's states; see `slewctl.design.Controller`."""
        return self._observer[2]

    def reference(self) -> Reference | None:
        """Return how the reference enters: by commanding the state, and σ by its error."""
        rest = at_rest(self.plant)
        if rest is None:
            return None
        H, size = self._observer[2], len(self._gain[0])
        there = np.zeros((size, 1))
        there[: len(self.plant.A)] = rest[0]
        there[len(self.plant.A) : len(self.whole.A)] = rest[1]
        entry = self._gain @ there + rest[1]
        B = H @ entry
        if self.angle is not None:
            B[-1] -= self.T
        return Reference(B, entry)
