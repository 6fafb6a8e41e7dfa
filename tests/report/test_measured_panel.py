"""What a controller meets on a measured response, beside the model, on the pages."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import slewctl as sc
from slewctl.cli.commands import cli
from slewctl.compare import QUANTITIES
from slewctl.loop.on_measured import gain_crossings, on_measured
from slewctl.measured.response_data import rig_response
from slewctl.measured.rig_model import Channel, modes_for
from slewctl.measured.rig_parameters import Rig

T = 0.01
ARM = sc.Arm(sc.Beam(0.6, 0.4, 0.5), sc.Hub(0.02, friction=0.03), damping_ratio=0.02)
RIG = Rig(ARM, 0.9, 0.017)
HZ = np.geomspace(0.1, 40, 400)
DESIGN = """\
title = "Judged on the rig itself"
[arm]
damping_ratio = 0.02
[arm.beam]
length = 0.6
mass_per_length = 0.4
bending_stiffness = 0.5
[arm.hub]
inertia = 0.02
friction = 0.03
[arm.actuator]
delay = 0.017
[controller]
method = "given"
pid = { kp = 0.3, kd = 0.05, filter_hz = 10.0 }
inputs = ["theta"]
output = "torque"
sample_time = 0.01
discretise = "tustin"
[truth]
modes = 5
[measured]
file = "rig.csv"
sample_time = 0.01
[requirements]
modulus_margin = 0.3
"""


def measured() -> sc.Response:
    values = rig_response(RIG, Channel("torque", "theta", T), modes_for(ARM, 40.0), 2 * np.pi * HZ)
    return sc.Response(HZ, values, np.full(len(HZ), 1e-3), np.ones(len(HZ)), T)


def test_model_and_measurement_agree_where_they_are_the_same_rig() -> None:
    law = sc.given(
        pid={"kp": 0.3, "kd": 0.05, "filter_hz": 10.0}, sample_time=T, discretise="tustin"
    )
    met = on_measured(measured(), law, RIG, poles_at_zero=1)
    np.testing.assert_allclose(met.computed, met.response.values, rtol=1e-9)
    # At the points themselves; between them one is interpolated.
    at = np.isin(met.hz, HZ)
    assert np.count_nonzero(at) == len(HZ)
    np.testing.assert_allclose(met.loop[at], met.modelled_loop[at], rtol=1e-9)
    assert len(met.crossings) == len(met.margins.crossings_hz)
    for one, other in zip(met.crossings, met.modelled_crossings, strict=True):
        assert one.frequency_hz == pytest.approx(other.frequency_hz, rel=1e-3)
        assert one.phase_deg == pytest.approx(other.phase_deg, abs=0.5)
    assert {root.kind for root in met.roots} == {"pole", "zero"}
    least = min(abs(each.phase_deg) for each in met.crossings)
    assert met.margins.phase_deg.value == pytest.approx(least, rel=1e-9)


def test_crossings_of_an_integrator_are_where_they_must_be() -> None:
    hz = np.geomspace(0.01, 10, 300)
    (only,) = gain_crossings(lambda f: 0.5 / (1j * f), hz)
    assert only.frequency_hz == pytest.approx(0.5, rel=1e-12)
    assert only.phase_deg == pytest.approx(90.0)
    assert gain_crossings(lambda f: 1e-3 / (1 + 1j * f), hz) == ()


@pytest.mark.slow
def test_a_design_without_a_slew_has_a_page_with_its_measurement(tmp_path: Path) -> None:
    response = measured()
    rows = zip(HZ, response.values.real, response.values.imag, strict=True)
    text = "\n".join(["frequency_hz,real,imag", *(f"{f!r},{a!r},{b!r}" for f, a, b in
                                                  (map(float, row) for row in rows))])  # fmt: skip
    (tmp_path / "rig.csv").write_text(text)
    (tmp_path / "x.toml").write_text(DESIGN)
    out = tmp_path / "report"
    ran = CliRunner().invoke(cli, ["compare", str(tmp_path / "x.toml"), "--out", str(out)])
    assert ran.exit_code == 0, ran.output
    page = (out / "index.html").read_text()
    assert "On the measured response" in page
    assert "measured: stable" in page
    assert "settling" not in page.lower()
    assert "On the measured response" in (out / "index.md").read_text()
    (case,) = json.loads((out / "results.json").read_text())["cases"]
    assert case["measured"]["stable"] is True
    by_name = {row["margin"]: row for row in case["measured"]["margins"]}
    phase = by_name["phase (deg)"]
    # The arm of the file has a gain of one, the rig one of 0.9.
    assert phase["low"] <= phase["measured"] <= phase["high"]
    assert phase["modelled"] == pytest.approx(phase["measured"], abs=5)
    told = case["evaluations"][0]["quantities"]
    assert not any(QUANTITIES[name].kind == "slew" for name in told)
