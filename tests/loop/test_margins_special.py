"""Loops at which a margin is easily lost: static, all-pass, with poles on the limit, hidden poles."""

from __future__ import annotations

import gc
from functools import partial
from weakref import ReferenceType, ref

import control
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_examples import loop_on, stable_loop, uniform_arm, unstable_loop

from slewctl.errors import InputError, SlewctlError
from slewctl.loop import Margins, UnstableLoopError, ncf_margin, nu_gap
from slewctl.loop.margin_functions import margins
from slewctl.loop.parts import negated
from slewctl.loop.single.certificate import certify
from slewctl.loop.single.factor import Factor, factor_of
from slewctl.loop.single.factored_loop import factored
from slewctl.numerics.given_system import static
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.modal_form import COPIES

S = control.tf("s")
Z = control.tf("z")


def factor(decibel: float) -> float:
    return float(10 ** (decibel / 20))


@pytest.mark.parametrize("step", [0, 0.1])
def test_static_loop(step: float) -> None:
    """L = −0.5: 1 + 2L = 0 at every frequency, |1 + L| = 1/2, |S − 1/2| = 3/2."""
    m = margins(static(-0.5, step))
    assert factor(m.gain_db.value) == pytest.approx(2, rel=1e-15)
    assert m.gain_reduction_db.value == m.phase_deg.value == m.delay_s.value == np.inf
    assert (m.modulus.value, m.disk.value) == (0.5, pytest.approx(2 / 3))
    assert m.gain_db.note
    assert m.phase_deg.note
    assert m.confirmed


def test_gain_margin_reached_only_at_infinite_frequency() -> None:
    """L = (1 − s/2)/(1 + s) → −1/2: at twice the gain a pole becomes infinite."""
    m = margins((-0.5 * S + 1) / (S + 1))
    assert factor(m.gain_db.value) == pytest.approx(2, rel=1e-15)
    assert m.gain_db.frequency_hz is None
    assert "infinite" in m.gain_db.note
    assert m.confirmed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loop", "phase"),
    [
        (static(1.0), 180.0),
        # L = (2 − s)/(2 + s) goes to −1: there 1 + L has no inverse.
        ((2 - S) / (2 + S), None),
        # −1 at zero frequency: a pole at the origin, whatever else.
        ((S - 2) / (S + 2), None),
        ((S**2 - S + 1) / (S**2 + S + 1), 0.0),
    ],
)
def test_all_pass_loops(loop: control.TransferFunction, phase: float | None) -> None:
    if phase is None or phase == 0.0:
        with pytest.raises(SlewctlError):
            margins(loop)
    else:
        m = margins(loop)
        assert m.phase_deg.value == pytest.approx(phase)
        assert m.delay_s.value == 0.0
        assert "one at all frequencies" in m.phase_deg.note


def test_static_loop_of_size_one() -> None:
    """L = 1: turned by 180 degrees it is −1; one sample late, a pole lies at z = −1."""
    m = margins(static(1.0, 0.1))
    assert m.phase_deg.value == 180
    assert m.delay_s.value == 0
    assert "whole sample" in m.delay_s.note


@pytest.mark.slow
@given(
    st.lists(
        st.sampled_from([-0.8, -0.5, -0.2, 0.3, 0.6, 0.9]), min_size=1, max_size=4, unique=True
    ),
    st.booleans(),
)
@settings(deadline=None, max_examples=5, derandomize=True)
def test_no_all_pass_loop_with_dynamics_is_stable(poles: list[float], plus: bool) -> None:
    """1 + L has then a numerator whose roots come in pairs z, 1/z."""
    below = np.poly(poles)
    above = below[::-1] * (1 if plus else -1)
    with pytest.raises(SlewctlError):
        margins(control.tf(above, below, 0.1))


def test_feedthrough_of_size_one_that_is_not_all_pass() -> None:
    """L = (s + 3)/(s + 1): |L| falls to one only at infinite frequency."""
    m = margins((S + 3) / (S + 1))
    assert m.gain_crossings_hz == ()
    assert m.phase_deg.value == np.inf
    assert "above one" in m.phase_deg.note
    assert m.delay_s.value == 0.0
    assert m.delay_s.note


def test_feedthrough_near_one_has_its_crossing() -> None:
    """|L| = 1 for L = d(s + a)/(s + b) at ω² = (b² − d²a²)/(d² − 1), far above both poles."""
    d, a, b = 0.9999, 3.0, 1.0
    m = margins(d * (S + a) / (S + b))
    omega = np.sqrt((b**2 - (d * a) ** 2) / (d**2 - 1))
    assert 2 * np.pi * np.array(m.gain_crossings_hz) == pytest.approx([omega], rel=1e-9)
    assert m.confirmed


def test_any_delay_destabilises_a_loop_of_large_feedthrough() -> None:
    m = margins((2 * S + 1) / (S + 1))
    assert m.delay_s.value == 0.0
    assert "infinite frequency" in m.delay_s.note


def test_feedthrough_minus_one_is_refused() -> None:
    with pytest.raises(InputError, match="no inverse"):
        margins((-S + 3) / (S + 1))


@pytest.mark.slow
def test_loop_that_is_real_at_all_frequencies_cannot_be_stable() -> None:
    """L(s) = L(−s): the closed-loop poles lie symmetrically about the axis."""
    with pytest.raises(UnstableLoopError):
        margins(3 / (S**2 + 1))


def test_real_at_all_frequencies_after_a_stable_cancellation() -> None:
    m = margins(-0.5 * (S + 1) / (S + 1))
    assert factor(m.gain_db.value) == pytest.approx(2, rel=1e-14)
    assert m.phase_deg.value == np.inf


@pytest.mark.slow
@pytest.mark.parametrize("zeta", [0.0, 1e-9, 1e-4])
def test_poles_on_the_axis(zeta: float) -> None:
    """An integrator and rate-fed modes: L is positive real, and no gain limits it."""
    L = 0.3 / S + 0.2 * S / (S**2 + 2 * zeta * S + 1) + 0.1 * S / (S**2 + 9)
    m = margins(control.ss(L))
    assert m.gain_db.value == m.gain_reduction_db.value == np.inf
    assert m.confirmed


@given(st.floats(0.05, 3.0), st.floats(-0.5, 0.9))
@settings(deadline=None, max_examples=25, derandomize=True)
def test_pole_at_minus_one(gain: float, zero: float) -> None:
    """k(z − a)/(z + 1) · 1/z, both poles known in closed form: z² + (1 + k)z − ka = 0."""
    L = gain * (Z - zero) / (Z + 1) / Z
    loop = control.tf([gain, -gain * zero], [1, 1, 0], 0.1)
    del L
    poles = np.roots([1, 1 + gain, -gain * zero])
    if np.abs(poles).max() >= 1 - 1e-9:
        with pytest.raises(UnstableLoopError):
            margins(loop)
        return
    m = margins(loop)
    _limits_agree(m, loop)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_poles_at_plus_and_minus_one(sign: float) -> None:
    """An integrator and an oscillation at half the sampling frequency: neither may be lost."""
    loop = control.tf([0.2, 0.05 * sign, -0.1], [1, 0, -1], 0.2)
    poles = np.roots(np.polyadd([1, 0, -1], [0.2, 0.05 * sign, -0.1]))
    assert (np.abs(poles).max() < 1) == _stable(loop, 1.0)
    if _stable(loop, 1.0):
        _limits_agree(margins(loop), loop)
    else:
        with pytest.raises(UnstableLoopError):
            margins(loop)


def _stable(loop: control.TransferFunction, k: complex) -> bool:
    num, den = np.atleast_1d(loop.num[0][0]), np.atleast_1d(loop.den[0][0])
    return bool(np.abs(np.roots(np.polyadd(den.astype(complex), k * num))).max() < 1)


def _limits_agree(m: Margins, loop: control.TransferFunction) -> None:
    """Fail when roots of the polynomial contradict gain or phase margins."""
    up, down = factor(m.gain_db.value), 1 / factor(m.gain_reduction_db.value)
    for k in np.geomspace(max(down, 1e-2), min(up, 1e2), 12)[1:-1]:
        assert _stable(loop, k)
    if np.isfinite(up):
        assert not _stable(loop, up * (1 + 1e-6))
        assert _stable(loop, up * (1 - 1e-6))
    if down > 0:
        assert not _stable(loop, down * (1 - 1e-6))
    turn = np.radians(min(m.phase_deg.value, 180.0))
    for part in (-0.999999, -0.5, 0.5, 0.999999):
        assert _stable(loop, np.exp(1j * part * turn))
    if np.isfinite(m.phase_deg.value):
        assert not all(_stable(loop, np.exp(1j * s * turn * (1 + 1e-6))) for s in (-1, 1))


@pytest.mark.parametrize(
    ("plant", "controller", "words"),
    [
        (1 / (S - 1), (S - 1) / (S + 2), "s = 1 rad/s is hidden"),
        ((S - 1) / (S + 2), 1 / (S - 1), "s = 1 rad/s is hidden"),
        (1 / S, S / (S + 1), "hidden"),
        ((S**2 + 4) / (S + 1) ** 3, 1 / (S**2 + 4), "hidden"),
        (
            control.tf([1], [1, -1.2], 0.1),
            control.tf([1, -1.2], [1, 0.5], 0.1),
            "z = 1.2 is hidden",
        ),
    ],
)
def test_hidden_unstable_cancellation(
    plant: control.TransferFunction, controller: control.TransferFunction, words: str
) -> None:
    with pytest.raises(UnstableLoopError, match=words):
        margins(plant, controller)


def test_hidden_stable_cancellation_is_none_of_our_business() -> None:
    plain = margins(1 / (S * (S + 2)))
    m = margins((S + 1) / (S * (S + 2)), 1 / (S + 1))
    assert m.phase_deg.value == pytest.approx(plain.phase_deg.value, rel=1e-10)


def test_unstable_loop_names_its_poles() -> None:
    with pytest.raises(UnstableLoopError, match=r"s = 0\.5 rad/s"):
        margins(1 / (S - 1), 0.5)
    with pytest.raises(UnstableLoopError):
        margins(unstable_loop())


def test_plain_systems_are_connected_by_negative_feedback() -> None:
    """1/(s − 1) under the gain 3 is stable with a minus, unstable with a plus."""
    m = margins(1 / (S - 1), 3.0)
    assert factor(m.gain_reduction_db.value) == pytest.approx(3, rel=1e-12)
    with pytest.raises(UnstableLoopError):
        margins(1 / (S - 1), -3.0)


def test_controllers_of_this_toolbox_are_connected_with_a_plus() -> None:
    loop = stable_loop()
    from_loop, from_parts = margins(loop), margins(loop.plant, loop.controller)
    by_path = margins(loop.plant.control_path, loop.controller)
    for name in ("gain_db", "phase_deg", "delay_s", "modulus", "disk"):
        expected = getattr(loop.margins, name).value
        assert getattr(from_loop, name).value == expected
        assert getattr(from_parts, name).value == pytest.approx(expected, rel=1e-9)
        assert getattr(by_path, name).value == pytest.approx(expected, rel=1e-9)


def test_sensors_are_matched_by_name() -> None:
    loop = loop_on(uniform_arm(), _two())
    path = loop.plant.control_path
    turned = control.StateSpace(
        path.A, path.B, path.C[::-1], path.D[::-1],
        inputs=path.input_labels, outputs=path.output_labels[::-1],
    )  # fmt: skip
    assert margins(turned, loop.controller).phase_deg.value == pytest.approx(
        loop.margins.phase_deg.value, rel=1e-9
    )


def _two() -> object:
    from loop_examples import TWO_SENSORS

    return TWO_SENSORS


@pytest.mark.parametrize(
    ("given_plant", "given_controller", "words"),
    [
        (control.tf([1], [1, 2], True), None, "sample time"),
        (S**2 / (S + 1), None, "zeros than poles"),
        (control.tf([1], [1, 2], 0.1), 1 / (S + 1), "sample time"),
        (control.StateSpace([[np.nan]], [[1]], [[1]], 0), None, "not finite"),
        (control.StateSpace(-np.eye(2), np.eye(2), np.eye(2), 0), None, "several"),
        ("no system", None, "no state-space"),
        (control.StateSpace(-np.eye(2), np.eye(2), np.eye(2), 0), 1.0, "inputs"),
    ],
)
def test_bad_input_is_refused(given_plant: object, given_controller: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        margins(given_plant, given_controller)  # type: ignore[arg-type]


def test_loop_with_a_second_controller_is_refused() -> None:
    with pytest.raises(InputError, match="already"):
        margins(stable_loop(), 1.0)


def test_modes_of_a_bare_loop_are_its_lightly_damped_poles() -> None:
    L = 5 * S / ((S**2 + 0.02 * S + 4) * (S + 3) ** 2)
    m = margins(L)
    assert m.disk.mode == f"mode 1 ({2 / (2 * np.pi):.4g} Hz)"


@given(st.floats(-0.9, 0.9))
@settings(deadline=None, max_examples=20, derandomize=True)
def test_skewed_disk_meets_its_definition(skew: float) -> None:
    """1/‖S + (σ − 1)/2‖∞ on a dense grid, and α of the gains are the disk's intercepts."""
    L = 25 / (S**3 + 10 * S**2 + 10 * S + 10)
    m = margins(L, skew=skew)
    omega = np.linspace(0.5, 6, 40001)
    value = L(1j * omega)
    alpha = 1 / np.abs(1 / (1 + value) + (skew - 1) / 2)
    assert m.disk.value == pytest.approx(alpha.min(), rel=1e-6)
    assert m.disk.value <= alpha.min() * (1 + 1e-12)
    low, high = m.disk_gains
    circle = m.disk.value * np.exp(1j * np.linspace(0, 2 * np.pi, 100001))
    edge = (1 + (1 - skew) / 2 * circle) / (1 - (1 + skew) / 2 * circle)
    assert (low, high) == (pytest.approx(edge.real.min()), pytest.approx(edge.real.max()))
    cosine = np.cos(np.radians(m.disk_phase_deg))
    on_unit = edge[np.abs(np.abs(edge) - 1) < 1e-3]
    assert np.cos(np.angle(on_unit)) == pytest.approx(cosine, abs=5e-3)


def test_skew_one_is_the_modulus_margin_and_minus_one_that_of_t() -> None:
    L = 25 / (S**3 + 10 * S**2 + 10 * S + 10)
    m = margins(L, skew=1.0)
    assert m.disk.value == pytest.approx(m.modulus.value, rel=1e-12)
    omega = np.linspace(0.5, 6, 100001)
    T = L(1j * omega) / (1 + L(1j * omega))
    assert margins(L, skew=-1.0).disk.value == pytest.approx(1 / np.abs(T).max(), rel=1e-7)


@pytest.mark.parametrize("step", [0, 0.05])
def test_perturbations_put_a_pole_on_the_limit(step: float) -> None:
    """Each one applied once more, with python-control's own interconnections."""
    L = 8 / (S**3 + 3 * S**2 + 4 * S + 3) + 0.01 / (S**2 + 0.01 * S + 30)
    L = control.ss(L.sample(step) if step else L)
    m = margins(L)
    for name in ("gain_db", "phase_deg", "delay_s", "modulus", "disk"):
        crossing = getattr(m, name)
        assert crossing.on_axis < 1e-9, name
        change, omega = crossing.perturbation, 2 * np.pi * crossing.frequency_hz
        point = np.exp(1j * omega * step) if step else 1j * omega
        value = complex(L(point))
        if name == "modulus":
            assert abs(1 + value + change.value) < 1e-8
            closed = control.feedback(1, L + change.system)
            assert abs(change.value) == pytest.approx(crossing.value, rel=1e-8)
        else:
            assert abs(1 + change.value * value) < 1e-8
            if change.system is None:
                assert abs(change.value) == pytest.approx(1, rel=1e-14)
                continue
            closed = control.feedback(1, L * change.system)
        assert np.abs(closed.poles() - point).min() < 1e-7
        outside = np.abs(closed.poles()) - 1 if step else closed.poles().real
        assert np.max(outside) < 1e-7  # it has only just arrived there


@pytest.mark.parametrize("gain", [0.3, 1.0, 3.0, 5.5])
def test_nearest_distances_are_no_smaller_than_is_proved(gain: float) -> None:
    """The smallest |1 + L| and 1/|S − ½| in forty digits lie between proof and value."""
    m = margins(gain / (S * (S + 1) * (S + 2)))

    def w(omega: mpmath.mpf) -> mpmath.mpc:
        s = mpmath.mpc(0, omega)
        return 1 + mpmath.mpf(gain) / (s * (s + 1) * (s + 2))

    for margin, distance in (
        (m.modulus, lambda omega: abs(w(omega))),
        (m.disk, lambda omega: 1 / abs(1 / w(omega) - mpmath.mpf(1) / 2)),
    ):
        with mpmath.workdps(40):
            start = 2 * mpmath.pi * margin.frequency_hz
            flat = mpmath.findroot(partial(mpmath.diff, distance), start)
            least = distance(flat)
            assert margin.at_least is not None
            assert margin.at_least < least
            assert margin.at_least > least * (1 - mpmath.mpf("1e-9"))
            assert abs(margin.value / least - 1) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
def test_a_hub_that_friction_slows_down_in_hours_is_proved(friction: float) -> None:
    """The poles of the angle and of the friction lie beside each other, next to 1e5 rad/s."""
    loop = loop_on(uniform_arm(friction=friction), modes=40)
    order, m = loop.factors.order_at_zero, loop.margins
    slow = np.sort(np.abs(loop.factors.poles))[1]
    assert order == (2 if slow == 0 else 1)
    assert (slow == 0) == (friction <= 1e-9)
    assert not m.unproved
    # Sums of both poles lose the digits that s over the slow one has: 4e-4 at the worst.
    assert (1 - 1e-3) * m.disk.value < m.disk.at_least <= m.disk.value
    assert m.disk.value == pytest.approx(loop_on(uniform_arm()).margins.disk.value, rel=0.1)


def test_copies_of_a_controller_share_their_modes() -> None:
    """A dual, a copy with other names: the same numbers, and not another's."""
    loop = stable_loop()
    plant, K = loop.plant.path, negated(loop.controller.linear)
    one, again = (factored(plant, K.named(name=name)) for name in ("one", "again"))
    assert one.controller is again.controller
    assert one.plant is again.plant
    other = factored(plant, loop.controller.linear)
    assert other.controller is not one.controller
    np.testing.assert_allclose(other.on_axis(np.ones(1)), -one.on_axis(np.ones(1)), rtol=1e-12)


def test_factors_of_systems_that_are_gone_are_not_kept() -> None:
    def made(k: int) -> ReferenceType[Factor]:
        plant = LinearSystem([[-1.0 - k]], [[1.0]], [[1.0]], [[0.0]])
        return ref(factor_of(plant))

    found = [made(k) for k in range(3 * COPIES)]
    gc.collect()
    assert sum(factor() is not None for factor in found) <= COPIES


def test_a_loop_of_which_little_is_known_needs_no_more_memory() -> None:
    """As many intervals as wanted are enclosed part by part, and each as it is alone."""
    factors = stable_loop().factors
    c = np.geomspace(1e-2, 1e3, 45_000)
    together, h = factors.enclosed(c, 1e-3 * c), 1e-3 * c
    for k in (0, 19_999, 20_000, 44_999):
        alone = factors.enclosed(c[k : k + 1], h[k : k + 1])
        for name in ("value", "slope", "curve", "error", "flat", "most"):
            one, other = getattr(together, name)[k], getattr(alone, name)[0]
            assert one == pytest.approx(other, rel=1e-12)


@pytest.mark.parametrize("step", [0.0, 0.1])
def test_a_loop_that_returns_nothing_stands_everything(step: float) -> None:
    plant = control.ss([[-0.5]], [[1.0]], [[1.0]], [[0.0]], step)
    for m in (margins(plant, 0.0), margins(control.ss([[-0.5]], [[0.0]], [[1.0]], [[0.0]], step))):
        assert m.confirmed
        assert m.modulus.value == 1
        assert m.disk.value == 2
        infinite = (m.gain_db, m.gain_reduction_db, m.phase_deg, m.delay_s, m.complementary)
        assert all(each.value == np.inf for each in infinite)


def test_a_dead_time_beyond_all_that_the_loop_does_is_refused() -> None:
    for delay in (1e12, 1e300):
        with pytest.raises(InputError, match="beyond all that the loop does"):
            margins(control.tf([1], [1, 1]), 0.5, delay=delay)


def test_a_factor_that_double_precision_does_not_know_is_not_cut_for_ever() -> None:
    """Lags of 1, 2 and 3 µrad/s beside one of 100 rad/s: intervals of 1e-81 rad/s had been cut."""
    poles = -np.array([1e-6, 2e-6, 3e-6, 100.0])
    A = np.diag(np.ones(3), -1)
    A[0] = -np.poly(poles)[1:]
    C = [[0.0, 0.0, 0.0, 0.1 * np.prod(poles)]]
    slow = LinearSystem(A, np.eye(4, 1), C, [[0.0]])
    with np.errstate(all="ignore"):
        assert certify(factored(slow)).search.intervals < 2_000
    found = margins(slow)
    assert 1 < factor(found.gain_db.at_least or 0.0) <= factor(found.gain_db.value)


@pytest.mark.parametrize(("step", "pole"), [(0, 0.0), (0.1, 1.0), (0.1, -1.0)])
@pytest.mark.parametrize("delay", [0.0, 0.05])
def test_a_pole_on_the_limit_that_is_there_twice_is_hidden(
    step: float, pole: float, delay: float
) -> None:
    """Two integrators side by side: feedback moves their sum, and the difference drifts."""
    sign = -1.0 if pole < 0 else 1.0
    plant = LinearSystem(
        pole * np.eye(2), [[0.1], [0.1]], [[sign, sign]], [[0.0]], *([step] if step else [])
    )
    closed = np.linalg.eigvals(plant.A - plant.B @ plant.C)
    assert np.isclose(closed, pole).any()
    late = {} if step else {"delay": delay}
    with pytest.raises(UnstableLoopError, match="hidden"):
        margins(plant, 1.0, **late)
    if pole >= 0:  # a line with a pole at z = -1 is refused anyway
        assert not ncf_margin(plant, 1.0).stable
        with pytest.raises(InputError, match="leave out modes on the axis"):
            nu_gap(plant, plant)


def test_two_integral_actions_into_one_command_are_hidden() -> None:
    """∫θ and ∫θ′ of a rigid body: one combination of both integrators is seen by nothing."""
    plant = LinearSystem([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)))
    controller = LinearSystem(np.zeros((2, 2)), np.eye(2), [[0.1, 0.1]], [[1.0, 2.0]])
    with pytest.raises(UnstableLoopError, match="hidden"):
        margins(plant, controller)
    assert not ncf_margin(plant, controller).stable
