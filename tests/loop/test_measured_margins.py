"""Margins on measured responses beside those of the model that the response was computed of."""

from __future__ import annotations

import control as ct
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.special import chdtri

import slewctl as sc

ARM = sc.Arm(sc.Beam(0.6, 0.4, 0.5), sc.Hub(0.01, friction=0.02), damping_ratio=0.02)
PLANT = sc.state_space(sc.truth(ARM, 6), ["theta"], coordinates="modal")
HZ = np.geomspace(0.02, 100, 2000)


def response(system: object, hz: np.ndarray = HZ) -> sc.Response:
    points = 2j * np.pi * hz
    step = float(system.dt or 0)  # type: ignore[attr-defined]
    points = np.exp(points * step) if step else points
    return sc.Response(hz, np.asarray(system(points)), sample_time=step)  # type: ignore[operator]


MEASURED = response(PLANT)


def pid(kp: float, kd: float, ki: float, filter_hz: float) -> ct.TransferFunction:
    s = ct.tf("s")
    return kp + ki / s + kd * s / (1 + s / (2 * np.pi * filter_hz))


@given(
    st.floats(-2, 2), st.floats(-2, 1), st.booleans(), st.floats(1, 100), st.floats(0, 0.02)
)  # fmt: skip
@settings(max_examples=15)
# All but unstable between two points: |1 + L| is 1.47e-3, and 4 % more at the nearest of them.
@example(1.53125, -0.6875, False, 4.0, 0.009765625)
def test_margins_and_stability_are_those_of_the_model(
    kp: float, kd: float, integral: bool, filter_hz: float, delay: float
) -> None:
    law = pid(0.1 * 10**kp, 0.05 * 10**kd, 0.05 if integral else 0.0, filter_hz)
    found = sc.margins(MEASURED, law, delay=delay)
    assert isinstance(found, sc.MeasuredMargins)
    try:
        exact = sc.margins(PLANT, law, delay=delay)
    except sc.UnstableLoopError:
        assert found.stable is not True
        return
    assume(exact.modulus.value > 1e-3)
    assert found.stable is not False
    if exact.modulus.value > 0.02 and not found.doubts:
        assert found.stable
    for name in ("gain_db", "gain_reduction_db", "phase_deg", "delay_s", "modulus"):
        margin, true = getattr(found, name), getattr(exact, name).value
        where = getattr(exact, name).frequency_hz
        if where is not None and HZ[0] < where < HZ[-1]:
            assert margin.low * (1 - 1e-6) <= true <= margin.high * (1 + 1e-6), name
            assert margin.value == pytest.approx(true, rel=2e-2, abs=2e-3), name
        assert margin.low <= margin.value <= margin.high, name


@pytest.mark.parametrize("damping", [1e-4, 1e-2])
def test_a_notch_narrower_than_the_points_are_apart_is_seen(damping: float) -> None:
    # Of a controller that is known everywhere: it needs no point in the notch.
    w = 2 * np.pi * 1.2345678
    notch = ct.tf([1, 2e-6 * w, w * w], [1, 2 * damping * w, w * w])
    law = pid(0.3, 0.1, 0.0, 20.0) * notch
    found, exact = sc.margins(MEASURED, law), sc.margins(PLANT, law)
    assert found.stable
    for name in ("gain_db", "phase_deg", "delay_s", "modulus"):
        margin, true = getattr(found, name), getattr(exact, name).value
        assert margin.low * (1 - 1e-6) <= true <= margin.high * (1 + 1e-6), name
    assert found.crossings_hz == pytest.approx(exact.gain_crossings_hz, rel=1e-6)


def test_no_figure_depends_on_where_the_places_are(monkeypatch: pytest.MonkeyPatch) -> None:
    coarse, law = response(PLANT, np.geomspace(0.05, 100, 150)), pid(0.3, 0.1, 0.02, 20.0)
    found = [sc.margins(coarse, law, delay=0.004)]
    for places, of_disk in ((7, 0.02), (4, 1e-3)):
        monkeypatch.setattr("slewctl.loop.measured_loop._PLACES", places)
        monkeypatch.setattr("slewctl.loop.measured_loop._OF_DISK", of_disk)
        found.append(sc.margins(coarse, law, delay=0.004))
    *plain, fine = found
    for one in plain:
        assert one.crossings_hz == pytest.approx(fine.crossings_hz, rel=1e-12)
        for name in ("gain_db", "phase_deg", "delay_s", "modulus"):
            mine, its = getattr(one, name), getattr(fine, name)
            assert mine.value == pytest.approx(its.value, rel=1e-9), name
            # Never narrower than with places far closer, and hardly wider.
            assert mine.low <= its.low * (1 + 1e-3), name
            assert mine.high >= its.high * (1 - 1e-3), name
            width = its.high - its.low
            if np.isfinite(width):
                assert mine.high - mine.low <= 1.1 * width + 1e-3 * its.value, name


def test_a_resonance_narrower_than_the_points_are_apart_is_told() -> None:
    # Half-power width 1 % at 0.5 Hz, points 5 % apart: the loop is unstable, and no curve shows it.
    s = ct.tf("s")
    plant = 1 / s**2
    for w, z, c in ((1.93186281, 0.04629625, 0.35983865), (3.19001914, 0.00979354, -0.18031007)):
        plant = plant + c / (s**2 + 2 * z * w * s + w**2)
    w = 0.43629
    law, hz = ct.tf([1.2 * w, w * w], [1 / (10 * w), 1]), np.geomspace(0.005, 100, 200)
    with pytest.raises(sc.UnstableLoopError):
        sc.margins(plant, law, delay=0.05)
    found = sc.measured_margins(response(plant, hz), law, delay=0.05, poles_at_zero=2)
    assert found.stable is None
    assert found.modulus.low == 0
    assert "−1 lies within the uncertainty" in " ".join(found.doubts)
    # With points as close as the resonance asks for, it is decided.
    fine = response(plant, np.geomspace(0.005, 100, 8000))
    assert sc.measured_margins(fine, law, delay=0.05, poles_at_zero=2).stable is False


@pytest.mark.parametrize("order", [1, 2])
def test_a_crossing_below_the_first_point_is_not_taken_for_none(order: int) -> None:
    hz = np.geomspace(0.02, 20, 800)
    plant = ct.tf([1e-4], [1, *[0] * order])
    found = sc.measured_margins(response(plant, hz), 1.0, poles_at_zero=order)
    assert abs(1e-4 / (2 * np.pi * hz[0]) ** order) < 1
    assert found.stable is None
    assert "below the first point" in " ".join(found.doubts)
    for name in ("phase_deg", "delay_s", "modulus"):
        assert getattr(found, name).low == 0, name
    assert found.phase_deg.value < np.inf or found.phase_deg.low < found.phase_deg.value


def test_the_interval_of_a_crossing_is_where_the_strip_may_cross() -> None:
    # An integrator with dead time, in disks of a tenth: |L| may be one from 0.9 to 1.1 rad/s.
    hz = np.geomspace(0.01, 10, 400)
    relative = 0.1
    level = relative / np.sqrt(chdtri(2, 0.05))
    values = 1 / (2j * np.pi * hz) * np.exp(-2j * np.pi * hz * 0.3)
    found = sc.measured_margins(sc.Response(hz, values, np.full(len(hz), level)), 1.0)
    lag = np.degrees(np.arcsin(relative))
    late = 0.3 * np.array([1 + relative, 1 - relative])
    low, high = 90 - np.degrees(late)
    assert found.phase_deg.value == pytest.approx(90 - np.degrees(0.3), rel=1e-4)
    # The farthest of L + e on the circle is between the angle alone and both together.
    assert low - lag - 0.1 < found.phase_deg.low < low
    assert high < found.phase_deg.high < high + lag + 0.1
    # |L| where it is real is known to a tenth, and where that is to the angle of its disk.
    omega = np.pi / 2 / 0.3
    exact = 20 * np.log10(omega)
    assert found.gain_db.value == pytest.approx(exact, rel=1e-4)
    assert found.gain_db.low < exact + 20 * np.log10(1 / 1.1) + 1e-6
    assert found.gain_db.high > exact + 20 * np.log10(1 / 0.9) - 1e-6


@pytest.mark.parametrize(
    ("system", "unstable", "stable"),
    [
        (ct.tf([2], [1, -1]), 1, True),
        (ct.tf([0.5], [1, -1]), 1, False),
        (ct.tf([1, 1], [1, 0, 0]), 0, True),
        (ct.tf([1], [1, 1, 0, 0]), 0, False),
        (ct.tf([1, 2, 1], [1, 0, 0, 0]) * 3, 0, True),
        (ct.tf([1, 2, 1], [1, 0, 0, 0]) * 0.1, 0, False),
        (ct.tf([-0.5], [1, 1]), 0, True),
        (ct.tf([-2.0], [1, 1]), 0, False),
        (ct.tf([-1.0], [1, 1, 0]), 0, False),
        (ct.tf([9.0], [1, 3, 3, 1]), 0, False),
        (ct.tf([0.02], [1, -1], 0.01) * ct.tf([1], [1, -0.5], 0.01), 0, True),
        (ct.tf([0.6], [1, -1], 0.01) * ct.tf([1], [1, -0.5], 0.01), 0, False),
    ],
)
def test_encirclements_count_what_the_poles_say(
    system: ct.TransferFunction, unstable: int, stable: bool
) -> None:
    radius = np.abs(ct.feedback(system, 1).poles())
    poles = np.log(radius) if system.dt else ct.feedback(system, 1).poles().real
    assert (poles.max() < 0) == stable
    hz = np.geomspace(1e-3, 49.9 if system.dt else 1e3, 800)
    order = int(np.sum(np.abs(system.poles() - (1 if system.dt else 0)) < 1e-4))
    known = {"unstable_poles": unstable, "poles_at_zero": order}
    found = sc.measured_margins(response(system, hz), 1.0, **known)
    assert found.stable is stable
    count = int(np.sum(poles > 0))
    assert found.encirclements == count - unstable
    if system.dt == 0 and order:  # the controller's integrators are known without being told
        bare = ct.minreal(system * ct.tf([1, 0], [1]), verbose=False)
        again = sc.measured_margins(
            response(bare, hz), ct.tf([1], [1, 0]), unstable_poles=unstable, poles_at_zero=order - 1
        )
        assert again.stable is stable


@pytest.mark.slow
def test_coarse_points_leave_more_open_and_never_lie() -> None:
    law = pid(0.3, 0.1, 0.0, 20.0)
    exact = sc.margins(PLANT, law).modulus.value
    width = []
    for count in (1000, 200, 60):
        hz = np.geomspace(0.05, 100, count)
        found = sc.margins(response(PLANT, hz), law)
        width.append(found.modulus.high - found.modulus.low)
        assert found.stable is not False
        if count > 60:
            assert found.modulus.low <= exact <= found.modulus.high
    assert width[0] < width[1]


def test_noise_widens_the_interval_and_the_truth_is_in_it() -> None:
    law = sc.given(
        pid={"kp": 0.3, "kd": 0.1, "filter_hz": 20.0}, sample_time=0.01, discretise="tustin"
    )
    exact = sc.margins(PLANT, law)
    u = sc.prbs(6000, amplitude=0.2, hold=2, seed=2)
    widths = []
    for noise in (1e-4, 3e-3):
        log = sc.simulated_log(ARM, u, 0.01, modes=6, noise=noise)
        found = sc.margins(sc.estimate_response(log, segment_s=10.0), law)
        assert found.modulus.low <= exact.modulus.value <= found.modulus.high
        assert found.phase_deg.low <= exact.phase_deg.value * 1.01
        assert "measured" in str(found)
        assert len(found.assumptions) >= 5
        widths.append(found.modulus.high - found.modulus.low)
    assert widths[1] > widths[0]


@pytest.mark.slow
def test_what_was_not_measured_is_refused() -> None:
    sampled = response(PLANT.sample(0.02), HZ[HZ < 24])
    tip = ct.ss([], [], [], [[1.0]], inputs=["tip"], outputs=["torque"])
    for plant, law, expected in (
        (sampled, pid(1, 1, 0, 10), "has the clock 0.02 s, the controller 0 s"),
        (MEASURED, tip, "it has the signal tip; measured is theta"),
        (MEASURED, ct.tf([1], [1, 1], 0.1), "beyond half of the controller's clock"),
        (MEASURED.at_points([0, 5]), 1.0, "2 points"),
    ):
        with pytest.raises(sc.InputError, match=expected):
            sc.margins(plant, law)
    with pytest.raises(sc.InputError, match="no disk margin"):
        sc.margins(MEASURED, 1.0, skew=1.0)  # type: ignore[call-overload]
