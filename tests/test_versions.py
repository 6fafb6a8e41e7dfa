"""What the digits depend on is known by version."""

from __future__ import annotations

from slewctl.versions import PROGRAMS, difference, installed, versions


def test_every_program_is_known_under_the_name_it_is_installed_by() -> None:
    """An unknown version would let another one pass for the same."""
    assert versions().keys() == {"python", *PROGRAMS}
    assert "unknown" not in versions().values()


def test_another_version_is_told() -> None:
    theirs = {**versions(), "cvxpy-base": "0.1"}
    assert difference(theirs, versions()) == f"cvxpy-base 0.1 (here {installed('cvxpy-base')})"
    assert difference(versions(), versions()) == ""
