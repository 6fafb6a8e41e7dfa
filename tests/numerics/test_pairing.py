"""Pairs of the least cost in all, against scipy's solution of the assignment problem."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from slewctl.numerics.pairing import paired


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (1, 1), (4, 4), (3, 7), (7, 3), (12, 12)])
def test_pairs_are_those_of_the_assignment_problem(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(sum(shape))
    for _ in range(50):
        cost = random.random(shape)
        rows, columns = paired(cost)
        known, others = linear_sum_assignment(cost)
        assert rows.tolist() == known.tolist()
        assert columns.tolist() == others.tolist()


def test_nearest_pairs_are_the_answer() -> None:
    known = np.array([1.0, 2.0, 3.0, 4.0])
    found = np.array([3.1, 0.9])
    rows, columns = paired(np.abs(found[:, None] - known))
    assert rows.tolist() == [0, 1]
    assert columns.tolist() == [2, 0]
    rows, columns = paired(np.abs(known[:, None] - found))
    assert rows.tolist() == [0, 2]
    assert columns.tolist() == [1, 0]
