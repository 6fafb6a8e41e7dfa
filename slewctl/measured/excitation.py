"""What excites a rig for a measurement."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.errors import check_count, check_positive


def prbs(samples: int, *, amplitude: float = 1.0, hold: int = 1, seed: int = 0) -> Array:
    """Return a pseudo-random binary signal, ±amplitude, shape (samples,).

    Parameters
    ----------
    samples : int
    amplitude : float
        In N·m or V.
    hold : int
        Samples for which a level is held at least: larger moves more at low frequencies.
    seed : int
        Another seed is another signal.

    Returns
    -------
    ndarray, shape (samples,)

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.prbs(6, amplitude=2.0, hold=2, seed=1).tolist()
    [-2.0, -2.0, 2.0, 2.0, 2.0, 2.0]
    """
    check_count(samples, "prbs.samples")
    check_count(hold, "prbs.hold")
    check_positive(amplitude, "prbs.amplitude")
    levels = np.random.default_rng(seed).integers(0, 2, -(-samples // hold))
    return np.repeat(amplitude * (2.0 * levels - 1.0), hold)[:samples]
