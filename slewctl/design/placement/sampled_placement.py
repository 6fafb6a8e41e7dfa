"""Pole placement on a clock: both gains are placed on the sampled plant itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design.sampled_estimate import SampledEstimate
from slewctl.plant import split_delay
from slewctl.plant.hold import held


@dataclass(frozen=True, eq=False)
class PlacedEstimate(SampledEstimate):
    """State feedback and observer from gains that place poles in z.

    Attributes
    ----------
    K : ndarray, shape (1, n)
        On the state that the input meets when it arrives.
    L : ndarray, shape (n, sensors)
        Of x̂_{k+1|k} = Φ x̂_{k|k−1} + Γu + L (y_k − C x̂_{k|k−1}).
    """

    K: Array
    L: Array

    @property
    def feedback(self) -> Array:
        """K on what is known at t_k: the state, and the input held until the new one arrives."""
        if not self.short.waiting:
            return self.K
        plant, (_, rest) = self.plant, split_delay(self.T, self.delay)
        n = len(plant.A)
        nothing = np.zeros((n, 0)), np.zeros((0, n + 1))
        return self.K @ held(plant.A, plant.B2, *nothing, rest).transition[:n]

    @property
    def correction(self) -> Array:
        """Φ⁻¹L."""
        n = len(self.plant.A)
        return np.asarray(np.linalg.solve(self.whole.A[:n, :n], self.L))
