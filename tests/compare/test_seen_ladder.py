"""What a ladder shows at once, beside what is proved of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slewctl.compare import Judge
from slewctl.compare.ladder import climb, steps
from slewctl.compare.seen_ladder import climb_at_once
from slewctl.files import read_design
from slewctl.loop.closed_response import ClosedResponse

DESIGNS = Path(__file__).parents[2] / "designs"


@pytest.mark.parametrize(
    "name",
    [
        "02-hub-as-heavy-as-the-beam",
        pytest.param("08-pd-notch", marks=pytest.mark.slow),
        pytest.param("rigs/elastic-joint", marks=pytest.mark.slow),
    ],
)
def test_what_is_seen_is_what_is_proved(name: str) -> None:
    judge = Judge(read_design(DESIGNS / f"{name}.toml").case)
    own = judge.judge(judge.own[1])
    given = steps(judge), judge.case, judge.case.origin, own
    # The optima of what is seen, before those that are proved are known.
    seen = [
        (rung.value("disk_margin"), rung.value("h2_loss")) for rung in climb_at_once(*given).rungs
    ]
    for (disk, loss), proved in zip(seen, climb(*given).rungs, strict=True):
        if not proved.stable:
            assert (disk, loss) == (None, None)
            continue
        assert disk == pytest.approx(proved.value("disk_margin"), rel=1e-4)
        assert disk >= proved.value("disk_margin") * (1 - 1e-6)
        assert loss == pytest.approx(proved.value("h2_loss"), rel=1e-5, abs=2e-6)


@pytest.mark.parametrize("name", ["02-hub-as-heavy-as-the-beam", "06-sampled-lqg-with-delay"])
def test_poles_of_the_closed_loop_say_what_the_open_one_does(name: str) -> None:
    judge = Judge(read_design(DESIGNS / f"{name}.toml").case)
    loop = judge.judge(judge.own[1]).loop
    top = min(loop.nyquist_rad_s, 1e3)
    omega = np.geomspace(1e-3 * top, 0.999 * top, 400)
    found, true = ClosedResponse(loop), loop.response(omega)
    np.testing.assert_allclose(1 / (1 + found(omega)), 1 / (1 + true), rtol=1e-6, atol=1e-8)
    middle = float(omega[200])
    off = abs(found(omega)[200] - true[200]) / abs(1 + true[200])
    assert found.off(middle) == pytest.approx(off, abs=1e-9)
    assert found.off(middle) < 1e-8
