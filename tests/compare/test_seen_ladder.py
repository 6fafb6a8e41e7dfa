"""What a ladder shows at once, beside what is proved of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slewctl.compare import Judge
from slewctl.compare.ladder import climb, steps
from slewctl.compare.seen_ladder import climb_at_once, sparse
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
    ladder = steps(judge), judge.case, judge.case.origin, own
    # The optima of what is seen, before those that are proved are known.
    seen = {
        rung.modes: (rung.value("disk_margin"), rung.value("h2_loss"))
        for rung in climb_at_once(*ladder).rungs
    }
    for proved in climb(*ladder).rungs:
        if proved.modes not in seen:
            continue
        disk, loss = seen.pop(proved.modes)
        if not proved.stable:
            assert (disk, loss) == (None, None)
            continue
        assert disk == pytest.approx(proved.value("disk_margin"), rel=1e-4)
        assert disk >= proved.value("disk_margin") * (1 - 1e-6)
        assert loss == pytest.approx(proved.value("h2_loss"), rel=1e-5, abs=2e-6)
    assert not seen


@dataclass(frozen=True)
class Told:
    """Of a rung what is asked of it, and whether it is."""

    modes: int
    stable: bool
    margin: float
    loss: float

    def value(self, name: str) -> float | None:
        found = {"disk_margin": self.margin, "h2_loss": self.loss}[name]
        return found if self.stable else None


@given(
    st.integers(1, 60),
    st.lists(
        st.tuples(st.integers(1, 60), st.sampled_from(["margin", "loss", "lost"])), max_size=4
    ),
)
def test_no_step_of_a_ladder_is_passed_over(size: int, events: list[tuple[int, str]]) -> None:
    """What a mode does lasts: each such mode stands beside the one below it, and few others do."""
    rungs = []
    for k in range(size):
        met = [what for at, what in events if at <= k]
        margin, loss = 0.8 * 0.7 ** met.count("margin"), 1e-3 * 2.0 ** met.count("loss")
        rungs.append(Told(k, "lost" not in met, margin, loss))
    seen = [rung.modes for rung in sparse(size, lambda place, _: rungs[place])]
    assert seen == sorted(set(seen))
    assert {0, size - 1} <= set(seen)
    # After the loop is lost nothing is told any more.
    end = min((at for at, what in events if what == "lost"), default=size)
    for at, _ in events:
        if at < size and at <= end:
            assert {at - 1, at} <= set(seen)
    most = 1 + 3 * math.log2(size + 1) + len({at for at, _ in events}) * (2 + math.log2(size + 1))
    assert len(seen) <= most


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
