"""Published switching times of the two-mass benchmark (m₁ = m₂ = k = 1, |u| ≤ 1, one unit)."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from slewctl.trajectory.rest_to_rest import rest_to_rest
from slewctl.trajectory.shapers import Mode

# Time-optimal rest to rest of the benchmark of the American Control Conference: the
# switches and the end; with zero sensitivity to the frequency in the second row.
PUBLISHED = {
    1: [1.002678, 2.108933, 3.215188, 4.217867],
    2: [0.712399, 1.656345, 2.932979, 4.209613, 5.153560, 5.865958],
}


@pytest.mark.parametrize("order", [1, 2])
def test_two_mass_benchmark(order: int) -> None:
    found = rest_to_rest(1.0, 1.0, 2.0, [Mode(sqrt(2))], order)
    np.testing.assert_allclose([*found.switches, found.duration], PUBLISHED[order], atol=1e-5)
