"""The margins do what they say: a loop changed by less is stable, by more unstable."""

from __future__ import annotations

import control
import numpy as np
import pytest
from numpy.typing import NDArray
from random_loops import stable_loops

from slewctl import Loop

Array = NDArray[np.float64]
LOOPS = [(seed, index) for seed in (2, 4) for index in range(8)]


@pytest.fixture(scope="module")
def loops() -> dict[tuple[int, int], Loop]:
    return {
        (seed, index): loop for seed in (2, 4) for index, loop in enumerate(stable_loops(seed, 8))
    }


def parts(loop: Loop) -> tuple[Array, Array, Array]:
    system = loop.return_ratio
    return np.asarray(system.A), np.asarray(system.B), np.asarray(system.C)


def delay(seconds: float, sections: int = 6, order: int = 6) -> control.StateSpace:
    """Return e^(−s·seconds) as a chain of Padé sections, exact to rounding up to ωτ = 2π.

    Where |L| < 1 the approximation is all-pass, as the delay is, and cannot matter.
    """
    section = control.ss(control.tf(*control.pade(1.0, order)))
    rate = sections / seconds
    scaled = control.StateSpace(section.A * rate, section.B * rate, section.C, section.D)
    chain = scaled
    for _ in range(sections - 1):
        chain = scaled * chain
    return chain


def growth_with_delay(loop: Loop, seconds: float) -> float:
    A, B, C = parts(loop)
    late = control.StateSpace(A, B, C, 0) * delay(seconds)
    closed = late.A - late.B @ late.C
    return float(np.linalg.eigvals(closed).real.max())


def growth_with_phase(loop: Loop, turn: float) -> float:
    A, B, C = parts(loop)
    return float(np.linalg.eigvals(A - np.exp(1j * turn) * B @ C).real.max())


def growth_with_gain(loop: Loop, factor: float) -> float:
    A, B, C = parts(loop)
    return float(np.linalg.eigvals(A - factor * B @ C).real.max())


def test_delay_chain_is_a_delay() -> None:
    system = delay(0.3)
    for omega in (0.1, 1.0, 10.0, 20.0):
        value = complex(system(1j * omega))
        assert value == pytest.approx(np.exp(-0.3j * omega), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("key", LOOPS)
def test_delay_margin(loops: dict[tuple[int, int], Loop], key: tuple[int, int]) -> None:
    loop = loops[key]
    margin = loop.margins.delay_s.value
    for inside in (0.05, 0.3, 0.7, 0.999):
        assert growth_with_delay(loop, inside * margin) < 0
    assert growth_with_delay(loop, 1.001 * margin) > 0


@pytest.mark.slow
@pytest.mark.parametrize("key", LOOPS)
def test_phase_margin(loops: dict[tuple[int, int], Loop], key: tuple[int, int]) -> None:
    loop = loops[key]
    margin = np.radians(loop.margins.phase_deg.value)
    for inside in (0.05, 0.3, 0.7, 0.999):
        assert growth_with_phase(loop, inside * margin) < 0
        assert growth_with_phase(loop, -inside * margin) < 0
    outside = [growth_with_phase(loop, sign * 1.001 * margin) for sign in (1, -1)]
    assert max(outside) > 0


@pytest.mark.parametrize("key", LOOPS)
def test_gain_margins(loops: dict[tuple[int, int], Loop], key: tuple[int, int]) -> None:
    loop = loops[key]
    up = 10 ** (loop.margins.gain_db.value / 20)
    down = 10 ** (-loop.margins.gain_reduction_db.value / 20)
    if np.isfinite(up):
        assert growth_with_gain(loop, 1.001 * up) > 0
    if down > 0:
        assert growth_with_gain(loop, 0.999 * down) > 0
    # Everything between is stable; with an infinite margin, as far as 1e3 and 1e-3.
    highest, lowest = min(0.999 * up, 1e3), max(1.001 * down, 1e-3)
    for factor in np.geomspace(lowest, highest, 25):
        assert growth_with_gain(loop, float(factor)) < 0
