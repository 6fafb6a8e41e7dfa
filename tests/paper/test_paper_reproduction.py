"""The whole reproduction in one object that can be written as JSON."""

import json
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from slewctl.paper import PARTS, PaperReproduction, reproduce


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


@pytest.fixture(scope="module")
def said_and_done():
    said: list[str] = []
    return said, reproduce(said.append)


@pytest.mark.slow
def test_reproduction_is_plain_data(said_and_done):
    _, result = said_and_done
    assert isinstance(result, PaperReproduction)
    text = json.dumps(_plain(result), allow_nan=False)
    assert len(text) > 10_000


@pytest.mark.slow
def test_progress_is_told_before_each_part(said_and_done):
    said, _ = said_and_done
    assert tuple(said) == PARTS


@pytest.mark.slow
def test_reproduction_repeats_itself(said_and_done):
    _, first = said_and_done
    assert json.dumps(_plain(first)) == json.dumps(_plain(reproduce()))
