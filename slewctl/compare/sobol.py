"""Points spread evenly over a cube."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array


def sobol_points(dimension: int, count: int, seed: int) -> Array:
    """Return the first points of a Sobol sequence in the unit cube, turned by a random shift."""
    from scipy.stats import qmc  # slow to load: not before it is wanted

    power = int(np.ceil(np.log2(count)))
    points = qmc.Sobol(dimension, scramble=False).random_base2(power)[:count]
    return np.asarray((points + np.random.default_rng(seed).random(dimension)) % 1.0)
