"""Hub-locked and free frequencies, converged, with honest error estimates."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose
from strategies import arms as any_arm
from strategies import deterministic

from slewctl import Arm, Beam, Hub, InputError, Payload, Stations, truth
from slewctl.basis.characteristic import clamped_free_roots, slewing_roots
from slewctl.model.locked import BOUNDARIES, frequencies, hub_locked_frequencies_hz

UNIFORM = Arm(Beam(2.0, 3.0, 5.0))
UNIT = np.sqrt(5.0 / (3.0 * 2.0**4)) / (2 * np.pi)


def test_uniform_beam_has_the_textbook_roots() -> None:
    """Clamped-free with the hub held, pinned-free without a hub; the errors stated are kept."""
    for boundary, roots in (("hub-locked", clamped_free_roots(8)), ("free", slewing_roots(8))):
        found = frequencies(UNIFORM, 8, boundary)
        exact = UNIT * roots.z**2
        assert_allclose(found.hz, exact, rtol=1e-11)
        assert np.all(np.abs(found.hz / exact - 1) <= found.relative_errors)


def test_shorthand_gives_the_same() -> None:
    assert_allclose(hub_locked_frequencies_hz(UNIFORM, 3), frequencies(UNIFORM, 3).hz, rtol=0)


@deterministic(25)
@given(any_arm())
def test_free_ones_are_the_truths_and_the_locked_ones_interlace(arm: Arm) -> None:
    free, held = frequencies(arm, 4, "free"), frequencies(arm, 5, "hub-locked")
    known = truth(arm, 4)
    tolerance = free.relative_errors + known.frequency_errors
    assert np.all(np.abs(free.hz / known.frequencies_hz - 1) <= 2 * tolerance)
    slack = 1 + 1e-9  # an enormous hub is a locked one
    assert np.all(held.hz[:4] <= slack * free.hz)
    assert np.all(free.hz <= slack * held.hz[1:])


def test_hub_does_not_move_hub_locked_frequencies() -> None:
    beam, payload = Beam(1.0, Stations((0, 0.4, 1), (2, 1, 1)), 3.0), Payload(0.2, 0.1)
    plain = frequencies(Arm(beam, payload=payload), 3).hz
    assert_allclose(frequencies(Arm(beam, Hub(5.0, 0.7, 1.0), payload), 3).hz, plain, rtol=1e-13)


def test_infinite_hub_is_a_locked_one() -> None:
    """The first-order shift is of the order of the ratio of inertias."""
    heavy = Arm(UNIFORM.beam, Hub(8e6))  # a million times the beam's
    ratio = frequencies(heavy, 3, "free").hz / frequencies(heavy, 3).hz
    assert np.all(np.abs(ratio - 1) < 3e-6)


def test_bad_input_is_refused() -> None:
    assert BOUNDARIES == ("hub-locked", "rotor-locked", "free")
    with pytest.raises(InputError, match=r"frequencies\.boundary: unknown name 'locked'"):
        frequencies(UNIFORM, 2, "locked")
    with pytest.raises(InputError, match=r"frequencies\.modes: 0 is not"):
        frequencies(UNIFORM, 0)
    with pytest.raises(InputError, match="not an Arm"):
        frequencies("arm", 1)
