"""A plant behind a hold, where its poles are placed in z: z = e^(sT) of each pole s.

With the input held from the moment it arrives, the state at these moments obeys
x⁺ = Φx + Γu whatever the delay is: a delayed input meets the state that is predicted for its
arrival, and its delay adds poles at z = 0 and nothing else (Franklin, Powell and Workman,
Digital Control of Dynamic Systems, section 8.6).
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design.energy_coordinates import ScaledPlant
from slewctl.design.placement.pole_pairs import LonePole, OpenLoop, PolePair, Roots
from slewctl.design.placement.wishes import Wanted
from slewctl.plant.hold import held


@dataclass(frozen=True, eq=False)
class SampledEnergy:
    """Φ, Γ and C of a plant in energy coordinates; gains are taken back to the plant's.

    Attributes
    ----------
    A, B2, C2 : ndarray
        Of x⁺ = A x + B2 u, y = C2 x.
    pairs : sequence of PolePair or LonePole
        The plant's own, in rad/s.
    T : float
        In s.
    energy : ScaledPlant
    rate : float
        One: poles in z have no unit.
    """

    A: Array
    B2: Array
    C2: Array
    pairs: Sequence[Roots]
    T: float
    energy: ScaledPlant
    rate: float = 1.0

    @classmethod
    def of(cls, energy: ScaledPlant, pairs: Sequence[Roots], T: float) -> SampledEnergy:
        n, m = energy.B2.shape
        nothing = np.zeros((n, 0)), np.zeros((0, n + m))
        transition = held(energy.A, energy.B2, *nothing, T * energy.rate).transition
        return cls(transition[:n, :n], transition[:n, n:], energy.C2, pairs, T, energy)

    def loop(self, continuous: OpenLoop) -> OpenLoop:
        """Return the poles in z, mode by mode as the continuous ones."""
        own = self.mapped(dict(enumerate(self.pairs)))
        return OpenLoop(self.A, tuple(own.values()), continuous.states)

    def mapped(self, wanted: Wanted) -> Wanted:
        """Return poles in rad/s as those in z."""
        return {mode: _in_z(pair, self.T) for mode, pair in wanted.items()}

    def state_feedback(self, F: Array) -> Array:
        """Return a gain in the plant's coordinates."""
        return self.energy.state_feedback(F)

    def observer_gain(self, L: Array) -> Array:
        """Return L of x̂⁺ = … + L (y − C₂x̂) in the plant's coordinates."""
        return self.energy.observer_gain(L) / self.energy.rate


def _in_z(pair: Roots, T: float) -> Roots:
    if isinstance(pair, LonePole):
        return LonePole(cmath.exp(pair.pole * T).real)
    first, second = (cmath.exp(pole * T) for pole in pair.poles)
    return PolePair.of(first, second)
