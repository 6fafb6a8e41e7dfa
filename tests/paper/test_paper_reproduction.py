"""The whole reproduction in one object that can be written as JSON."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from slewctl.paper import PARTS, PaperReproduction, conditioning, findings, reproduce

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]


def _plain(value):
    """Walk dataclasses, tuples and dicts; refuse anything else that JSON lacks."""
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        assert value.dtype == float
        return value.tolist()
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        assert all(isinstance(key, str) for key in value)
        return {key: _plain(item) for key, item in value.items()}
    assert value is None or type(value) in (str, int, float, bool)
    return value


def test_reproduction_is_plain_data(reproduction: PaperReproduction) -> None:
    assert isinstance(reproduction, PaperReproduction)
    text = json.dumps(_plain(reproduction), allow_nan=False)
    assert len(text) > 10_000


def test_reproduction_repeats_itself_and_tells_its_progress(
    reproduction: PaperReproduction, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Again with every third hub and fewer functions: each point is what it was among all."""
    monkeypatch.setattr(findings, "HUB_RATIOS", findings.HUB_RATIOS[::3])
    monkeypatch.setattr(conditioning, "MOST_FUNCTIONS", 3)
    said: list[str] = []
    again = reproduce(said.append)
    assert tuple(said) == PARTS
    first, second = _plain(reproduction), _plain(again)
    assert again.findings.hub.points
    first["findings"]["hub"]["points"] = first["findings"]["hub"]["points"][::3]
    before = {(p["hub_ratio"], p["basis"], p["n"]): p for p in first["conditioning"]["points"]}
    points = second["conditioning"]["points"]
    assert len(points) == 2 * 2 * 3
    for point in points:
        assert point == before[point["hub_ratio"], point["basis"], point["n"]]
    del first["conditioning"], second["conditioning"]
    assert json.dumps(first) == json.dumps(second)
