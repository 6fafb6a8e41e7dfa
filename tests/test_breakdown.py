"""Whatever arithmetic raises becomes one error with its place, and nothing is warned of."""

from __future__ import annotations

import pickle
import warnings

import numpy as np
import pytest
from scipy.linalg import solve

from slewctl.breakdown import computing
from slewctl.errors import BreakdownError, DesignError, FaultsError, InputError


@pytest.mark.parametrize(
    "work",
    [
        lambda: 1 / 0,
        lambda: 10.0**400,
        lambda: np.linalg.inv(np.zeros((2, 2))),
        lambda: np.linalg.eigvals([[np.nan]]),
        lambda: [][0],
        lambda: int("x" * 10_000),
    ],
)
def test_errors_of_the_packages_name_the_place(work: object) -> None:
    with pytest.raises(BreakdownError) as caught, computing("a.toml"):
        work()  # type: ignore[operator]
    message = str(caught.value)
    assert message.startswith("a.toml: the computation broke down (")
    assert message.endswith("; change a weight or a value")
    assert len(message) < 600


def test_an_error_of_our_own_gets_its_place_once() -> None:
    for where, told in {"": "a.toml: no", "hub": "a.toml: hub: no", "a.toml:3: x": "a.toml:3: x: no",
                        "a.toml": "a.toml: no", "a.tomls": "a.toml: a.tomls: no"}.items():  # fmt: skip
        with pytest.raises(DesignError) as caught, computing("a.toml"), computing():
            raise DesignError("no", where=where)
        assert str(caught.value) == told


def test_what_ends_the_program_is_no_breakdown() -> None:
    for end in (KeyboardInterrupt, SystemExit):
        with pytest.raises(end), computing("a.toml"):
            raise end


def test_no_warning_of_a_package_is_printed() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with computing("a.toml"):
            np.log(np.zeros(1))
            solve(np.array([[1.0, 1.0], [1.0, 1.0 + 1e-16 + 3e-16]]), np.ones(2))
            warnings.warn("old", DeprecationWarning, stacklevel=1)
    assert caught == []


def test_several_faults_keep_their_places() -> None:
    both = FaultsError([InputError("a", where="x"), InputError("b", remedy="c")])
    assert str(both.within("f")) == "f: x: a\nf: b; c"
    assert isinstance(both, InputError)
    assert str(pickle.loads(pickle.dumps(both))) == str(both)
