"""The delay margin of a sampled loop around a continuous plant."""

from __future__ import annotations

import control
import numpy as np
import pytest
from flexible_loops import FlexibleLoop, random_flexible_loops
from loop_examples import TWO_SENSORS, uniform_arm
from scipy.linalg import expm

from slewctl import ClampedFree, assemble, close, generalised_plant, lqg, truth
from slewctl.errors import InputError
from slewctl.loop import UnstableLoopError
from slewctl.loop.margin_functions import hybrid_delay_margin, margins
from slewctl.loop.parts import state_space
from slewctl.loop.single.hybrid_delay import delayed_loop, sampled_with_delay, smallest_delay
from slewctl.numerics.given_system import static
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import sampled_plant

S = control.tf("s")


def light(system: object) -> LinearSystem:
    return state_space(system, "loop")


def radius(loop: control.StateSpace) -> float:
    return float(np.abs(np.linalg.eigvals(loop.A - loop.B @ loop.C / (1 + loop.D))).max())


def continuous(loop: FlexibleLoop) -> control.StateSpace:
    one = static(1.0).to_control()
    return FlexibleLoop(loop.omega, loop.zeta, loop.residues, one).plant


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.1, 0.25, 0.31])
def test_delayed_plant_against_a_simulation_in_small_steps(delay: float) -> None:
    """A held input of random steps, delayed, by exponentials over hundredths of the sample."""
    plant = control.ss(3 / (S**2 + 0.4 * S + 9) + 1 / (S + 2))
    A, B, C, D = (np.asarray(getattr(plant, n)) for n in "ABCD")
    T, parts = 0.1, 100
    system = sampled_with_delay(A, B, C, D, T, delay)
    u = np.random.default_rng(0).standard_normal(12)
    fine = expm(np.block([[A, B], [np.zeros((1, 4))]]) * T / parts)
    x, exact = np.zeros(3), []
    for k in range(12 * parts):
        if k % parts == 0:
            exact.append(float((C @ x)[0]))
        sample = int(np.floor((k - round(delay / T * parts)) / parts))
        held = u[sample] if sample >= 0 else 0.0
        x = fine[:3, :3] @ x + fine[:3, 3] * held
    state, got = np.zeros(system.nstates), []
    for value in u:
        got.append(float((system.C @ state + system.D[:, 0] * value)[0]))
        state = system.A @ state + system.B[:, 0] * value
    np.testing.assert_allclose(got, exact, atol=1e-12)


def test_whole_samples_multiply_by_powers_of_z() -> None:
    plant = control.ss(3 / (S**2 + 0.4 * S + 9))
    A, B, C, D = (np.asarray(getattr(plant, n)) for n in "ABCD")
    z = np.exp(0.7j)
    for part in (0.0, 0.03):
        direct = sampled_with_delay(A, B, C, D, 0.1, 0.2 + part).to_control()(z)
        assert direct == pytest.approx(
            sampled_with_delay(A, B, C, D, 0.1, part).to_control()(z) / z**2
        )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [30, 34])
def test_stable_at_every_smaller_delay_and_unstable_beyond(seed: int) -> None:
    tried = 0
    for loop in random_flexible_loops(seed, 30, 12):
        if not loop.step or not np.all(np.abs(loop.closed_poles) < 1):
            continue
        with_delay = delayed_loop(light(continuous(loop)), light(loop.controller))
        found = hybrid_delay_margin(continuous(loop), loop.controller)
        assert found.confirmed
        if found.seconds > 30 * loop.step:
            continue
        tried += 1
        for delay in np.linspace(0, found.seconds, 40)[:-1]:
            assert radius(with_delay(delay)) < 1
        assert radius(with_delay(found.seconds * (1 + 1e-5))) > 1
    assert tried >= 1


def test_fast_sampling_gives_the_continuous_margin() -> None:
    """With the hold's T/2 added the margin tends to that of the continuous loop as T²."""
    P, K = 1 / (S * (S + 1)), 2.0
    exact = margins(P, K).delay_s.value
    errors = []
    for T in (0.2, 0.1, 0.05):
        found = hybrid_delay_margin(P, control.tf([K], [1.0], T))
        errors.append(abs(found.seconds + T / 2 - exact))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > 1.8)


def test_a_mode_above_half_the_sampling_frequency_counts() -> None:
    """The samples show it slow, but the delay turns it at its own speed."""
    P = 1 / (S + 1) - 12.0 / (S**2 + 0.4 * S + 38.0**2)
    K = control.tf([3.0], [1.0], 0.1)
    found = hybrid_delay_margin(P, K)
    with_delay = delayed_loop(light(control.ss(P)), light(control.ss(K)))
    first = next(d for d in np.arange(1, 1000) * 1e-4 if radius(with_delay(d)) >= 1)
    assert first - 1e-4 <= found.seconds <= first
    # Between the hold and the computer a whole sample is stood, and twice the time.
    assert margins(P, K).delay_s.value > 2 * found.seconds
    assert radius(with_delay(0.1)) < 1


def test_no_delay_matters_where_the_loop_is_small() -> None:
    found = hybrid_delay_margin(0.5 / (S + 1), control.tf([1.0], [1.0], 0.1))
    assert found.seconds == np.inf
    assert found.omega is None


def test_delay_that_the_loop_has_is_subtracted() -> None:
    P, K = 1 / (S * (S + 1)), control.tf([2.0], [1.0], 0.1)
    whole = hybrid_delay_margin(P, K).seconds
    assert hybrid_delay_margin(P, K, delay=0.07).seconds == pytest.approx(whole - 0.07, rel=1e-9)
    assert margins(P, K, delay=0.07).phase_deg.value < margins(P, K).phase_deg.value


def test_refusals() -> None:
    P, K = 1 / (S * (S + 1)), control.tf([2.0], [1.0], 0.1)
    with pytest.raises(InputError, match="no controller"):
        hybrid_delay_margin(P)
    with pytest.raises(InputError, match="sampled"):
        hybrid_delay_margin(P, 1 / (S + 1))
    with pytest.raises(UnstableLoopError):
        hybrid_delay_margin(P, 100 * K)


def test_smallest_delay_takes_any_loop() -> None:
    """A loop given by hand: a pure delay of whole samples, L = k z^(−1−d)."""

    def loop(delay: float) -> control.StateSpace:
        return delayed_loop(light(control.ss(2.0 / (S + 1))), static(3.0, 0.2))(delay)

    found = smallest_delay(loop, 0.2)
    assert radius(loop(found.seconds * (1 - 1e-6))) < 1 < radius(loop(found.seconds * (1 + 1e-6)))


def test_loop_of_an_arm_agrees_with_the_exactly_sampled_plant() -> None:
    """The poles of the arm's own sampling, another computation, leave the circle there."""
    T, delay = 0.05, 0.02
    plant = generalised_plant(assemble(uniform_arm(), ClampedFree(2)), TWO_SENSORS)
    controller = lqg(plant, sample_time=T, delay=delay)
    loop = close(truth(uniform_arm(), 5), TWO_SENSORS, controller)
    found = hybrid_delay_margin(loop)
    assert found.confirmed
    radii = [
        np.abs(sampled_plant(loop.plant, T, delay + t).close(controller.system).poles).max()
        for t in (found.seconds * (1 - 1e-5), found.seconds * (1 + 1e-5))
    ]
    assert radii[0] < 1 < radii[1]
    again = margins(loop.plant, controller)
    assert again.phase_deg.value == pytest.approx(loop.margins.phase_deg.value, rel=1e-9)
    assert again.gain_db.value == pytest.approx(loop.margins.gain_db.value, rel=1e-9)


@pytest.mark.parametrize("lag", [0.01, 0.05])
def test_a_controller_with_a_pole_at_minus_one(lag: float) -> None:
    """Infinite at half the sampling frequency: less than a sample is stood, and the poles say it."""
    P, K = control.ss(1 / (lag * S + 1)), control.tf([0.1], [1, 1], 0.1)
    found = hybrid_delay_margin(P, K)
    with_delay = delayed_loop(light(P), light(control.ss(K)))
    for delay in np.linspace(0, found.seconds * (1 - 1e-6), 20):
        assert radius(with_delay(delay)) < 1
    assert radius(with_delay(found.seconds * (1 + 1e-6))) > 1
    assert found.seconds < 0.1
    assert margins(P, K).delay_s.value == 0
