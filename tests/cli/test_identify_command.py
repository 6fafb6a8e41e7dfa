"""The command that fits an arm to a log: its report, its file, and one line for a mistake."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import slewctl as command

import slewctl as sc
from slewctl.files import find_arm, read_arm

ARM = sc.Arm(
    sc.Beam(0.6, 0.4, 0.5), sc.Hub(0.01, friction=0.02), damping_ratio=0.01, name="<rig> & arm"
)
TRUE = sc.vary(ARM, stiffness_factor=1.2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("identify")
    (folder / "arm.toml").write_text(ARM.to_toml(), encoding="utf-8")
    u = sc.prbs(2500, amplitude=0.2, hold=2, seed=1)
    log = sc.simulated_log(TRUE, u, 0.01, noise=1e-3)
    rows = zip(0.01 * np.arange(2500), u, np.degrees(log.output), strict=True)
    text = "\n".join(["t,u,enc", *(f"{t:.2f},{a:g},{y:.8g}" for t, a, y in rows)])
    (folder / "run.csv").write_text(text, encoding="utf-8")
    law = {"kp": 0.3, "kd": 0.1, "filter_hz": 20.0}
    sc.given(pid=law, sample_time=0.01, discretise="tustin").save(folder / "k.json")
    return folder


MAPPED = {"time_s": "t", "torque": "u", "theta_deg": "enc"}
COLUMNS = tuple(x for pair in MAPPED.items() for x in ("--column", "=".join(pair)))


@pytest.mark.slow
def test_a_log_becomes_a_report_and_an_arm(folder: Path) -> None:
    out = folder / "out"
    run = command(
        "identify", folder / "run.csv", "--arm", folder / "arm.toml", "--free",
        "beam.stiffness, gain", *COLUMNS, "--controller", folder / "k.json", "--out", out,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "enc: theta in deg" in run.stdout
    assert "measured: " in run.stdout
    fitted = find_arm(str(out / "fitted.toml"))
    factor = fitted.beam.bending_stiffness / ARM.beam.bending_stiffness
    assert factor == pytest.approx(1.2, rel=5e-3)
    assert read_arm(out / "fitted.toml") == fitted
    results = json.loads((out / "results.json").read_text())
    low, high = results["intervals_95"]["beam.stiffness"]
    assert low <= 1.2 * (1 + 1e-3)
    assert high >= 1.2 * (1 - 1e-3)
    assert len(results["margins"]) == 5
    page = (out / "index.html").read_text()
    assert "&lt;rig&gt; &amp; arm" in page
    assert "<rig>" not in page
    assert page.count("<svg") == 2  # the response, and what the controller makes of it
    header, first, *_ = (out / "response.csv").read_text().splitlines()
    assert len(header.split(",")) == len(first.split(",")) == 7
    # What it wrote is what a design file's [measured] reads.
    again = sc.read_response(out / "response.csv", sample_time=0.01)
    estimated = sc.estimate_response(sc.read_log(folder / "run.csv", MAPPED))
    np.testing.assert_allclose(again.values, estimated.values, rtol=1e-9)
    np.testing.assert_allclose(again.known_deviation, estimated.known_deviation, rtol=1e-9)


def test_a_response_is_between_the_signals_that_are_named(tmp_path: Path) -> None:
    """Of a motor's voltage, in degrees: taken for torque its back-EMF would be friction."""
    arm = sc.arms.quanser_flexible_link()
    path = sc.state_space(sc.truth(arm, 8), ["theta"], input="voltage")
    hertz = np.geomspace(0.5, 60, 80)
    values = [complex(path(2j * np.pi * f).item()) * 180 / np.pi for f in hertz]
    rows = [f"{f:.9g},{v.real:.9g},{v.imag:.9g}" for f, v in zip(hertz, values, strict=True)]
    file = tmp_path / "response.csv"
    file.write_text("\n".join(["frequency_hz,real,imag", *rows]), encoding="utf-8")
    fixed = ("identify", file, "--arm", "quanser-flexible-link", "--free", "hub.friction,gain",
             "--out", tmp_path / "out")  # fmt: skip
    run = command(*fixed, "--response", "--actuator", "voltage", "--sensor", "theta_deg")
    assert run.returncode == 0, run.stderr
    found = find_arm(str(tmp_path / "out" / "fitted.toml"))
    assert found.hub.friction == pytest.approx(arm.hub.friction, rel=1e-3)
    for options, told in (
        (("--response",), "--actuator: the arm has a motor, and nothing says"),
        (("--response", "--actuator", "theta"), "--actuator: 'theta' is none; give torque or"),
        (("--response", "--actuator", "voltage", "--sensor", "thet"), "--sensor: 'thet' is none"),
        (("--response", "--actuator", "voltage", "--counts", "4096"), "give --sensor theta_counts"),
        (("--sensor", "theta"), "--sensor is for --response"),
    ):
        run = command(*fixed, *options)
        assert run.returncode == 2
        assert told in run.stderr


def test_a_mistake_is_one_line(folder: Path) -> None:
    good = {"--arm": folder / "arm.toml", "--free": "gain", "--out": folder / "no"}
    wrong = (
        ({}, folder / "none.csv", (), "there is no such file"),
        (
            {},
            folder / "run.csv",
            (),
            "no actuator is known in it and no sensor is known in it: it holds t, u, enc; map both, as --column voltage=… --column theta=…",
        ),
        ({}, folder / "run.csv", ("--column", "voltage=u"), "map one, as --column theta=…"),
        ({"--free": "beam.stifness"}, folder / "run.csv", COLUMNS, "slewctl: --free: unknown"),
        ({}, folder / "run.csv", ("--column", "enc"), "maps nothing"),
        ({}, folder / "run.csv", (*COLUMNS, "--sample-time", "0.02"), "clocks disagree"),
        ({"--arm": "papr-beam"}, folder / "run.csv", COLUMNS, "did you mean"),
        ({}, folder / "run.csv", ("--response",), "no column is known as a frequency"),
    )
    for change, file, more, expected in wrong:
        options = [word for pair in {**good, **change}.items() for word in pair]
        run = command("identify", file, *options, *more)
        assert run.returncode == 2, expected
        assert expected in run.stderr
        assert len(run.stderr.strip().splitlines()) == 1
    assert not (folder / "no" / "index.html").exists()
