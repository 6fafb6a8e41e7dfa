"""Results made by hand, for the tests of everything that is written from them."""

from __future__ import annotations

import math
from pathlib import Path

from slewctl.check import NOMINAL, DesignResult, Finding, Verdict
from slewctl.compare import Reading

STABLE = Verdict("stable", 1.0, 1.0, None, True, "", seen=((20, 1.0), (40, 1.0)))


def gain(value: float, limit: float = 6.0) -> Verdict:
    return Verdict(
        "gain_margin_db",
        value,
        limit,
        3.25,
        value >= limit,
        "",
        "mode 1 (3.3 Hz)",
        ((20, value), (40, value)),
        value - 1e-3,
        321,
    )


PASSED = DesignResult(
    "good",
    Path("designs/good.toml"),
    (Finding(STABLE, line=3), Finding(gain(9.0), line=4)),
    {NOMINAL: {"gain_margin_db": Reading(9.0, 3.25), "disk_margin": Reading(math.inf)}},
    fingerprint="sha256:1",
    digest="sha256:a",
    seconds=1.25,
)
FAILED = DesignResult(
    "bad, 100%: <&>",
    Path("designs/bad, 100%: x.toml"),
    (
        Finding(STABLE, line=3),
        Finding(gain(9.0), line=4),
        Finding(STABLE, "heavy", 7),
        Finding(gain(4.0), "heavy", 8),
        Finding(
            Verdict("h2_loss_max", None, 0.1, None, False, "not verified:\nline 2\x00"), "heavy"
        ),
    ),
    {NOMINAL: {"gain_margin_db": Reading(9.0, 3.25)}, "heavy": {"gain_margin_db": Reading(4.0)}},
    fingerprint="sha256:2",
    digest="sha256:b",
)
BROKEN = DesignResult(
    "broken", Path("designs/broken.toml"), error="designs/broken.toml:5: n: -2", error_line=5
)
UNCHANGED = DesignResult("same", Path("same.toml"), unchanged=True, fingerprint="sha256:3")
MISSING = DesignResult("designs/gone.toml", Path("designs/gone.toml"), missing=True)
ALL = (PASSED, FAILED, BROKEN, UNCHANGED)
