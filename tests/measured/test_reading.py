"""Logs and responses from files: every form says the same, every flaw is told, in one line."""

from __future__ import annotations

from pathlib import Path

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.export import write_data
from slewctl.measured.flaws import clipping, quantum
from slewctl.measured.response import as_response

PERIOD = 0.005
N = 400
U = sc.prbs(N, amplitude=2.0, hold=4, seed=3)
Y = np.cumsum(np.cumsum(U)) * 1e-4
TIME = PERIOD * np.arange(N) + 0.25


def csv(path: Path, columns: dict[str, np.ndarray], delimiter: str = ",") -> Path:
    rows = [delimiter.join(columns)]
    rows += [
        delimiter.join("" if np.isnan(x) else repr(float(x)) for x in row)
        for row in zip(*columns.values(), strict=True)
    ]
    path.write_text("# a rig\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def written(folder: Path, suffix: str, columns: dict[str, np.ndarray]) -> Path:
    path = folder / f"data{suffix}"
    if suffix in (".csv", ".txt"):
        return csv(path, columns, "," if suffix == ".csv" else " ")
    write_data(path, columns)
    return path


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".mat", ".npz", ".json"])
def test_every_form_and_unit_of_a_log_says_the_same(tmp_path: Path, suffix: str) -> None:
    columns = {"t": 1e3 * TIME, "u": 1e3 * U, "enc": Y * 2048 / (2 * np.pi), "r": U}
    path = written(tmp_path, suffix, columns)
    names = {"time_ms": "t", "voltage_mv": "u", "theta_counts": "enc", "reference": "r"}
    log = sc.read_log(path, names, counts_per_turn=2048, sample_time=PERIOD)
    np.testing.assert_allclose(log.input, U, rtol=1e-14)
    np.testing.assert_allclose(log.output, Y, rtol=1e-13)
    assert (log.actuator, log.sensor, log.sample_time, log.closed_loop) == (
        "voltage",
        "theta",
        PERIOD,
        True,
    )
    assert any("enc: theta in encoder counts" in remark for remark in log.remarks)


def test_names_behind_a_mark_and_columns_without_names(tmp_path: Path) -> None:
    rows = "\n".join(f"{t!r}\t{u!r}\t{y!r}" for t, u, y in np.column_stack([TIME, U, Y]).tolist())
    marked, bare = tmp_path / "marked.txt", tmp_path / "bare.txt"
    marked.write_text(f"# a rig\n#t\tdrive\tenc\n{rows}\n", encoding="utf-8")
    bare.write_text(f"# a rig, three signals\n{rows}\n", encoding="utf-8")
    one = sc.read_log(marked, {"time_s": "t", "torque": "drive", "theta": "enc"})
    two = sc.read_log(bare, {"time_s": "1", "torque": "2", "theta": "3"})
    for log in (one, two):
        np.testing.assert_array_equal(log.input, U)
        np.testing.assert_array_equal(log.output, Y)
    with pytest.raises(sc.InputError, match="no column 'drive': it holds 1, 2, 3"):
        sc.read_log(bare, {"time_s": "1", "torque": "drive", "theta": "3"})
    bare.write_text("t,u,u\n1,2,3\n", encoding="utf-8")
    with pytest.raises(sc.InputError, match=r"two columns are called 'u'"):
        sc.read_log(bare, {"time_s": "t"})
    bare.write_text("t, 2.0, x\n1, 2, 3\n", encoding="utf-8")
    with pytest.raises(sc.InputError, match=r"bare\.txt:1: its first line holds names and numbers"):
        sc.read_log(bare, {"time_s": "t"})


def test_decimal_commas_and_semicolons(tmp_path: Path) -> None:
    text = csv(tmp_path / "a.csv", {"time_s": TIME, "torque": U, "theta": Y}, ";").read_text()
    (tmp_path / "a.csv").write_text(text.replace(".", ","), encoding="utf-8")
    np.testing.assert_allclose(sc.read_log(tmp_path / "a.csv").output, Y, rtol=1e-13)


def test_a_gap_ends_a_stretch_and_is_told(tmp_path: Path) -> None:
    keep = np.r_[0:100, 103:N]
    broken = Y.copy()
    broken[N - 5] = np.nan
    path = csv(
        tmp_path / "gap.csv", {"time_s": TIME[keep], "torque": U[keep], "theta": broken[keep]}
    )
    log = sc.read_log(path)
    np.testing.assert_array_equal(log.input, U[103 : N - 5])
    assert "4 samples are missing or no numbers" in str(log)
    assert "0.515 to 1.975 s" in str(log)


@given(st.integers(0, 10**6), st.floats(0.02, 0.2))
@settings(max_examples=20)
def test_an_irregular_clock_is_told_and_a_regular_one_is_not(seed: int, size: float) -> None:
    from slewctl.measured.flaws import clock_of

    noise = np.random.default_rng(seed).uniform(-1, 1, N)
    period, number, told = clock_of(TIME + size * PERIOD * noise, None, "log")
    assert period == pytest.approx(PERIOD, rel=1e-3)
    assert number[-1] == N - 1
    assert ("irregular" in "".join(told)) == (size * np.sqrt(2 / 3) > 0.01)
    assert clock_of(TIME, None, "log")[2] == []


@given(st.floats(1e-6, 1e3), st.floats(-1e3, 1e3), st.integers(1, 10**6))
@settings(max_examples=50)
def test_the_step_of_an_encoder_is_found(step: float, offset: float, seed: int) -> None:
    counts = np.cumsum(np.random.default_rng(seed).integers(-3, 4, 2000))
    assert quantum(offset * step + step * counts) == pytest.approx(step, rel=1e-6)
    assert quantum(np.random.default_rng(seed).normal(size=2000)) == 0


def test_a_clipped_input_is_told_and_a_binary_one_is_not() -> None:
    wave = np.random.default_rng(1).normal(size=N)
    assert clipping(U, "V") == ()
    assert clipping(wave, "V") == ()
    (told,) = clipping(np.clip(wave, -1, np.inf), "V")
    assert "clipped at -1 V" in told


OMEGA = 2 * np.pi * np.linspace(0.5, 20, 30)
VALUES = 1 / (1j * OMEGA) ** 2 - 0.01


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".npz"])
def test_every_form_of_a_response_says_the_same(tmp_path: Path, suffix: str) -> None:
    columns = {
        "frequency_rad_s": OMEGA[::-1],
        "mag": 20 * np.log10(abs(VALUES[::-1])),
        "ph": np.angle(VALUES[::-1], deg=True),
        "coherence": np.linspace(0.5, 1, 30),
    }
    path = written(tmp_path, suffix, columns)
    found = sc.read_response(path, {"gain_db": "mag", "phase_deg": "ph"}, averages=8)
    np.testing.assert_allclose(found.values, VALUES, rtol=1e-12)
    np.testing.assert_allclose(found.omega, OMEGA, rtol=1e-12)
    assert found.deviation is not None
    assert found.deviation[-1] == pytest.approx(np.sqrt(0.5 / (2 * 8 * 0.5)))
    parts = {"f": OMEGA / (2 * np.pi), "re": VALUES.real, "im": VALUES.imag}
    names = {"frequency_hz": "f", "real": "re", "imag": "im"}
    again = sc.read_response(written(tmp_path, suffix, parts), names)
    np.testing.assert_allclose(again.values, VALUES, rtol=1e-12)


def test_a_magnitude_in_decibels_is_not_taken_for_a_bare_one(tmp_path: Path) -> None:
    columns = {"frequency_hz": [1.0, 2.0, 3.0], "mag": [2.0, -4.0, -9.0], "phase_deg": [0.0] * 3}
    path = written(tmp_path, ".csv", {name: np.array(each) for name, each in columns.items()})
    with pytest.raises(sc.InputError, match=r"mag is negative at 2 Hz.*in decibels it is gain_db"):
        sc.read_response(path, {"gain": "mag"})


def test_python_controls_response_is_taken_with_its_names() -> None:
    frd = ct.FrequencyResponseData(VALUES, OMEGA, inputs=["voltage"], outputs=["tip"])
    found = as_response(frd, "response")
    np.testing.assert_allclose(found.values, VALUES)
    assert (found.actuator, found.sensor) == ("voltage", "tip")
    np.testing.assert_allclose(found.to_control()(1j * OMEGA), VALUES)


def test_a_universal_file(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff", reason="the extra uff is not installed")
    path = tmp_path / "modal.uff"
    sets = [
        {"type": 58, "func_type": 4, "rsp_node": node, "rsp_dir": 3, "ref_node": 1, "ref_dir": 1,
         "data": node * VALUES, "x": OMEGA / (2 * np.pi), "id1": "rig", "binary": 0,
         "rsp_ent_name": "beam", "ref_ent_name": "hub", "orddenom_spec_data_type": 13,
         "abscissa_spec_data_type": 18, "ordinate_spec_data_type": 8, "z_axis_spec_data_type": 0}
        for node in (1, 2)
    ]  # fmt: skip
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    found = sc.read_response(path, {"response": "2z/1x"})
    np.testing.assert_allclose(found.values, 2 * VALUES, rtol=1e-4)
    with pytest.raises(sc.InputError, match=r"2 frequency responses: 1z/1x, 2z/1x"):
        sc.read_response(path)


def test_a_reference_that_does_not_move_is_none() -> None:
    log = sc.Log(0.005, U, Y, np.full(N, 0.3))
    assert log.reference is None
    assert not log.closed_loop
    assert "the reference does not move" in str(log)


def test_wrong_files_are_refused_in_one_line(tmp_path: Path) -> None:
    good = {"time_s": TIME, "torque": U, "theta": Y}
    log = csv(tmp_path / "log.csv", good)
    twice = csv(tmp_path / "twice.csv", {**good, "tip": Y})
    still = csv(tmp_path / "still.csv", {**good, "torque": 0 * U})
    back = csv(tmp_path / "back.csv", {**good, "time_s": TIME[::-1]})
    wild = csv(tmp_path / "wild.csv", {**good, "time_s": np.cumsum(np.geomspace(0.1, 9, N))})
    one = csv(tmp_path / "one.csv", {k: np.ones(1) for k in ("frequency_hz", "real", "imag")})
    text = tmp_path / "text.csv"
    text.write_text("time_s,torque,theta\n0,1,many\n1,1,1\n", encoding="utf-8")
    dead = csv(tmp_path / "dead.csv", {**good, "theta": 0 * Y})
    glitch = csv(tmp_path / "glitch.csv", {**good, "theta": np.where(np.arange(N) == 9, 1e300, Y)})
    late = csv(tmp_path / "late.csv", {**good, "time_s": 1e200 * TIME})
    lone = csv(tmp_path / "lone.csv", {name: column[:1] for name, column in good.items()})
    refusals = {
        "log.output: the output does not move": lambda: sc.read_log(dead),
        "1e+300 in row 10 is nothing that is measured": lambda: sc.read_log(glitch),
        "in row 1 is nothing that is measured": lambda: sc.read_log(late),
        "one sample makes no record": lambda: sc.read_log(lone),
        "all values are zero": lambda: sc.Response([1.0, 2.0], [0, 0]),
        "1e+300 in row 2 is nothing": lambda: sc.Response([1.0, 2.0], [1, 1e300]),
        "there is no such file": lambda: sc.read_log(tmp_path / "none.csv"),
        "no column 'enc': it holds time_s, torque, theta": lambda: sc.read_log(
            log, {"theta_deg": "enc"}
        ),
        "'thet' is no signal of an arm": lambda: sc.read_log(log, {"thet": "theta"}),
        "several sensors are in it": lambda: sc.read_log(twice),
        "the input does not move": lambda: sc.read_log(still),
        "the time does not increase at row 2": lambda: sc.read_log(back),
        "keep no clock": lambda: sc.read_log(wild),
        "clocks disagree: samples are 0.005 s apart": lambda: sc.read_log(log, sample_time=0.01),
        "needs the encoder's counts": lambda: sc.read_log(log, {"theta_counts": "theta"}),
        "one point makes no response": lambda: sc.read_response(one),
        "no column is known as a frequency": lambda: sc.read_response(log),
        "'many' under 'theta' is no number": lambda: sc.read_log(text),
        "unknown ending": lambda: sc.read_log(tmp_path / "log.xls"),
        "above half of the clock": lambda: sc.Response([1.0, 200.0], [1, 1], sample_time=0.01),
    }
    for expected, call in refusals.items():
        with pytest.raises(sc.InputError) as error:
            call()
        assert expected in str(error.value)
        assert "\n" not in str(error.value)
    np.testing.assert_array_equal(sc.read_log(twice, {"tip": "tip"}).sensor, "tip")
