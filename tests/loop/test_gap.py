"""ν-gap and generalised margin: a metric, closed forms, and the theorem that joins the two."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_multiloops import flexible_plant, lqg_controller
from strategies import deterministic

from slewctl import InputError
from slewctl.loop.robust.ncf_margin import best_output_scale, ncf_margin
from slewctl.loop.robust.nu_gap import nu_gap
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.given_system import static

gains = st.floats(-5.0, 5.0)


def lag(gain: float, pole: float) -> control.StateSpace:
    """gain/(s − pole)."""
    return control.ss([[pole]], [[1.0]], [[gain]], [[0.0]])


def chordal(a: complex, b: complex) -> float:
    return abs(a - b) / np.sqrt((1 + abs(a) ** 2) * (1 + abs(b) ** 2))


def random_plants(seed: int, count: int) -> list[control.StateSpace]:
    """Plants of two inputs and two outputs, near enough to each other to have gaps below one."""
    rng = np.random.default_rng(seed)
    base = flexible_plant(rng, 3, 2, 2)
    A, B, C, _ = (np.asarray(getattr(base, name)) for name in "ABCD")
    return [
        control.ss(
            A * (1 + 0.02 * rng.normal()),
            B + 0.02 * rng.normal(size=B.shape),
            C + 0.02 * rng.normal(size=C.shape),
            0.02 * rng.normal(size=(2, 2)),
        )
        for _ in range(count)
    ]


@given(gains, gains)
@deterministic(25)
def test_scalar_gains_in_closed_form(a: float, b: float) -> None:
    """|a − b|/√((1 + a²)(1 + b²)), also where 1 + ab < 0: static graphs have no winding."""
    assert nu_gap(static(a), static(b)).value == pytest.approx(chordal(a, b), abs=1e-12)


@pytest.mark.parametrize(("k", "m"), [(1.0, 1.5), (1.0, 4.0), (0.3, 0.31)])
def test_integrators_in_closed_form(k: float, m: float) -> None:
    """Of k/s and m/s the distance |k − m| ω/√((ω² + k²)(ω² + m²)) is largest at ω = √(km)."""
    found = nu_gap(lag(k, 0.0), lag(m, 0.0))
    assert found.value == pytest.approx(abs(k - m) / (k + m), rel=1e-8)
    assert found.frequency_hz == pytest.approx(np.sqrt(k * m) / (2 * np.pi), rel=1e-3)


@pytest.mark.parametrize(("k", "p", "q"), [(1.0, 1.0, 2.0), (5.0, 1.0, -1.0), (100.0, -0.5, 0.5)])
def test_lags_in_closed_form(k: float, p: float, q: float) -> None:
    """Of k/(s + p) and k/(s + q), winding conditions hold while k² + pq > 0: largest at ω = 0."""
    found = nu_gap(lag(k, -p), lag(k, -q))
    assert found.winding == (k**2 + p * q > 0)
    assert found.value == pytest.approx(chordal(k / p, k / q), rel=1e-8)


def test_the_winding_condition_tells_what_the_distance_does_not() -> None:
    """1/(s + 1) and 1/(s − 1): 1 + P₂(−s)P₁ vanishes at s = 0 only; with less gain it winds."""
    assert nu_gap(lag(1.0, -1.0), lag(1.0, 1.0)).value == 1
    found = nu_gap(lag(0.5, -1.0), lag(0.5, 1.0))
    assert not found.winding
    assert found.value == 1
    assert found.largest_distance == pytest.approx(chordal(0.5, -0.5))
    assert nu_gap(lag(5.0, -1.0), lag(5.0, 1.0)).winding


def test_published_example() -> None:
    """100/(2s + 1), 100/(2s − 1), 100/(s + 1)²: gaps 0.02, 0.8988 and 0.8941.

    The plants are those of G. Vinnicombe, Frequency domain uncertainty and the graph
    topology, IEEE Trans. Automatic Control 38 (1993).
    """
    stable, unstable = lag(50.0, -0.5), lag(50.0, 0.5)
    double = control.tf2ss(control.tf([100], [1, 2, 1]))
    assert nu_gap(stable, unstable).value == pytest.approx(0.02, abs=5e-5)
    assert nu_gap(stable, double).value == pytest.approx(0.8988, abs=5e-5)
    assert nu_gap(unstable, double).value == pytest.approx(0.8941, abs=5e-5)


def test_a_metric() -> None:
    plants = random_plants(3, 4)
    n = len(plants)
    gap = np.array([[nu_gap(a, b).value for b in plants] for a in plants])
    assert np.abs(np.diag(gap)).max() < 1e-7
    assert gap == pytest.approx(gap.T, rel=1e-6, abs=1e-9)
    assert gap[np.triu_indices(n, 1)].min() > 0.05
    assert gap.max() <= 1
    for i in range(n):
        for j in range(n):
            for k in range(n):
                assert gap[i, k] <= gap[i, j] + gap[j, k] + 1e-9


def test_against_the_distance_at_each_frequency() -> None:
    """σ_max((I + P₂P₂*)^(−1/2)(P₁ − P₂)(I + P₁*P₁)^(−1/2)) on a grid refined at every pole."""
    first, second = random_plants(5, 2)

    def root(matrix: np.ndarray) -> np.ndarray:
        values, vectors = np.linalg.eigh(matrix)
        return (vectors / np.sqrt(values)) @ vectors.conj().T

    poles = np.concatenate([first.poles(), second.poles()])
    spread = np.concatenate([-(10 ** np.linspace(-2, 2, 60)), 10 ** np.linspace(-2, 2, 60)])
    omega = (np.abs(poles.imag)[:, None] + np.abs(poles.real)[:, None] * spread).ravel()
    omega = np.concatenate([omega[omega > 0], np.geomspace(1e-3, 1e3, 400)])
    eye, distance = np.eye(2), []
    for P1, P2 in zip(
        FrequencyResponse(first)(omega), FrequencyResponse(second)(omega), strict=True
    ):
        inner = root(eye + P2 @ P2.conj().T) @ (P1 - P2) @ root(eye + P1.conj().T @ P1)
        distance.append(np.linalg.norm(inner, 2))
    found = nu_gap(first, second).largest_distance
    assert max(distance) <= found * (1 + 1e-7)
    assert found == pytest.approx(max(distance), rel=1e-3)


def test_margin_in_closed_form() -> None:
    """b of k/s with u = −c y: at low frequency c/√(1 + c²), at high 1/√(1 + c²)."""
    for k, c in ((1.0, 1.0), (2.0, 0.5), (0.1, 3.0)):
        found = ncf_margin(lag(k, 0.0), static(c))
        assert found.value == pytest.approx(min(c, 1) / np.sqrt(1 + c**2), rel=1e-8)
    unstable = ncf_margin(lag(1.0, 0.0), static(-1.0))
    assert (unstable.value, unstable.stable, unstable.frequency_hz) == (0.0, False, None)


def test_margin_of_static_loops_is_the_distance_from_the_inverse_of_the_controller() -> None:
    for gain, back in ((2.0, -0.7), (0.3, -4.0), (-1.0, 0.2)):
        expected = chordal(gain, 1 / back)
        assert ncf_margin(static(gain), static(back), sign=1).value == pytest.approx(expected)


def perturbed(rng: np.random.Generator, plant: control.StateSpace) -> control.StateSpace:
    A, B, C, _ = (np.asarray(getattr(plant, name)) for name in "ABCD")
    size = 10 ** rng.uniform(-4, 0.3)
    return control.ss(
        A * (1 + size * rng.normal()),
        B + size * rng.normal(size=B.shape),
        C + size * rng.normal(size=C.shape),
        0,
    )


@pytest.mark.slow
def test_a_margin_larger_than_the_gap_keeps_the_loop_stable() -> None:
    """With Vinnicombe's bound on the margin that is left: none violated; both outcomes occur."""
    rng = np.random.default_rng(1)
    safe = lost = 0
    for _ in range(40):
        plant = flexible_plant(rng, int(rng.integers(1, 5)), 1, int(rng.integers(1, 3)))
        controller = lqg_controller(rng, plant)
        other = perturbed(rng, plant)
        b, gap = ncf_margin(plant, controller, sign=1), nu_gap(plant, other)
        after = ncf_margin(other, controller, sign=1)
        if b.value > gap.value:
            safe += 1
            assert after.stable
            left = np.sin(np.arcsin(b.value) - np.arcsin(gap.value))
            assert after.value >= left * (1 - 1e-6)
        lost += not after.stable
    assert safe > 4
    assert lost > 3


def test_units() -> None:
    """Scaling a plant is the same as measuring it in other units, and b has a best one."""
    rng = np.random.default_rng(6)
    plant = flexible_plant(rng, 3, 1, 2)
    controller, other = lqg_controller(rng, plant), perturbed(np.random.default_rng(0), plant)
    units, force = np.array([3.0, 0.2]), 5.0

    def in_units(P: control.StateSpace) -> control.StateSpace:
        return control.ss(P.A, np.asarray(P.B) * force, np.asarray(P.C) / units[:, None], 0)

    back = control.ss(
        controller.A, np.asarray(controller.B) * units, np.asarray(controller.C) / force, 0
    )
    scales = {"output_scale": units.tolist(), "input_scale": force}
    assert nu_gap(plant, other, **scales).value == pytest.approx(
        nu_gap(in_units(plant), in_units(other)).value, rel=1e-6
    )
    assert ncf_margin(plant, controller, sign=1, **scales).value == pytest.approx(
        ncf_margin(in_units(plant), back, sign=1).value, rel=1e-6
    )
    best = best_output_scale(plant, controller, sign=1)
    top = ncf_margin(plant, controller, sign=1, output_scale=best.tolist()).value
    for _ in range(12):
        tried = best * 10 ** rng.uniform(-1, 1, 2)
        b = ncf_margin(plant, controller, sign=1, output_scale=tried.tolist()).value
        assert b <= top * 1.02


def test_sampling_by_the_bilinear_map_keeps_gap_and_margin() -> None:
    rng = np.random.default_rng(2)
    plant = flexible_plant(rng, 2, 1, 1)
    controller, other = lqg_controller(rng, plant), perturbed(np.random.default_rng(1), plant)
    step = 0.1
    discrete = [P.sample(step, method="bilinear") for P in (plant, other, controller)]
    assert nu_gap(*discrete[:2]).value == pytest.approx(nu_gap(plant, other).value, rel=1e-6)
    assert ncf_margin(discrete[0], discrete[2], sign=1).value == pytest.approx(
        ncf_margin(plant, controller, sign=1).value, rel=1e-6
    )
    found = nu_gap(*discrete[:2]).frequency_hz
    assert found is not None
    assert found <= 0.5 / step


def test_what_cannot_be_compared_is_refused() -> None:
    one, two = lag(1.0, -1.0), static(np.ones((1, 2)))
    with pytest.raises(InputError, match="same signals"):
        nu_gap(one, two)
    with pytest.raises(InputError, match="same signals"):
        nu_gap(one, one.sample(0.1))
    with pytest.raises(InputError, match="coprime"):
        nu_gap(control.ss([[0.0]], [[0.0]], [[1.0]], 0), one)
    with pytest.raises(InputError, match="output_scale"):
        nu_gap(one, one, output_scale=0.0)
    with pytest.raises(InputError, match="2 scales for 1"):
        nu_gap(one, one, output_scale=[1.0, 2.0])
    with pytest.raises(InputError, match=r"control\.StateSpace"):
        nu_gap(one, 3.0)
    with pytest.raises(InputError, match="controller"):
        ncf_margin(one, two)
    with pytest.raises(InputError, match="well posed"):
        ncf_margin(static(2.0), static(-0.5))
    with pytest.raises(InputError, match="stable loop"):
        best_output_scale(lag(1.0, 0.0), static(-1.0))
    with pytest.raises(InputError, match="z = −1"):
        nu_gap(control.ss([[-1.0]], [[1.0]], [[1.0]], 0, 0.1), one.sample(0.1))
