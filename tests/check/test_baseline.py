"""Baselines: what counts as worse, what is accepted, and what is refused."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from gate_results import BROKEN, FAILED, PASSED, UNCHANGED
from hypothesis import given
from hypothesis import strategies as st

from slewctl import InputError
from slewctl.check import (
    NOMINAL,
    Baseline,
    DesignResult,
    accept,
    baseline_record,
    compare_with,
    exit_status,
    missing,
    read_baseline,
)
from slewctl.check.baseline import SCHEMA, Accepted, _seal
from slewctl.compare import QUANTITIES, Reading
from slewctl.report.export import json_text

NAMES = [name for name in QUANTITIES if name != "stable"]
ROOT = Path("baseline.json")


def compared(name: str, old: float, new: float, tolerance: float = 0.01) -> DesignResult:
    """Return a passing result with one quantity, beside a baseline of that quantity."""
    baseline = Baseline(ROOT, {PASSED.file.as_posix(): Accepted("x", "y", {NOMINAL: {name: old}})})
    result = replace(PASSED, recorded={NOMINAL: {name: Reading(new, 1.0)}})
    return compare_with(baseline, result, tolerance)


@given(
    st.sampled_from(NAMES),
    st.floats(1e-3, 1e6),
    st.floats(-0.5, 0.5).filter(lambda change: abs(abs(change) - 0.01) > 1e-6),
)
def test_worse_by_more_than_the_tolerance_fails(name: str, old: float, change: float) -> None:
    new = old * (1 + change)
    worse = -change if QUANTITIES[name].better == "greater" else change
    # A loss has a noise floor of its own, which is above one per cent of the smallest.
    assert (compared(name, old, new).status == "failed") == (worse > 0.01)


@given(st.sampled_from(NAMES), st.floats(1e-3, 1e6))
def test_the_same_value_rounded_never_fails(name: str, value: float) -> None:
    rounded = float(f"{value:.9e}")
    assert compared(name, rounded, value, tolerance=0.0).status == "passed"


@pytest.mark.parametrize("name", NAMES)
def test_infinite_and_missing_values(name: str) -> None:
    margin = QUANTITIES[name].better == "greater"
    assert compared(name, math.inf, math.inf).status == "passed"
    assert compared(name, math.inf, 1e9).status == ("failed" if margin else "passed")
    assert compared(name, 1.0, math.inf).status == ("passed" if margin else "failed")
    assert compared(name, 1.0, math.nan).status == "failed"
    unknown = compared(name, math.nan, 1.0)
    assert unknown.status == "passed"
    assert unknown.notes == (f"{name} is not in the baseline",)


def test_a_loss_below_the_accuracy_of_costs_is_noise() -> None:
    assert compared("h2_loss", 1e-9, 5e-7).status == "passed"
    assert compared("h2_loss", 1e-9, 2e-6).status == "failed"


def test_a_finding_says_what_was_accepted() -> None:
    result = compared("gain_margin_db", 10.0, 9.0)
    (finding,) = result.failures
    assert (finding.against, finding.line) == ("baseline", 4)
    assert finding.verdict.limit == pytest.approx(9.9, rel=1e-15)
    assert finding.verdict.note == "accepted: 10 dB"
    # A quantity that the file does not require stands at the arm's first requirement.
    assert compared("disk_margin", 1.0, 0.5).failures[0].line == 3


def test_what_the_baseline_does_not_know_is_told() -> None:
    old = Accepted("x", "y", {NOMINAL: {"disk_margin": 1.0}})
    new = {NOMINAL: {"disk_margin": Reading(1.0), "delay_margin_s": Reading(0.1)}, "new": {}}
    baseline = Baseline(ROOT, {PASSED.file.as_posix(): old})
    result = compare_with(baseline, replace(PASSED, recorded=new), 0.01)
    assert result.status == "passed"
    assert result.notes == (
        "delay_margin_s is not in the baseline",
        "variation new is not in the baseline",
    )


def test_a_variation_that_the_file_no_longer_has_fails() -> None:
    old = Accepted("x", "y", {NOMINAL: {"disk_margin": 1.0}, "heavy": {"disk_margin": 0.5}})
    baseline = Baseline(ROOT, {PASSED.file.as_posix(): old})
    result = compare_with(
        baseline, replace(PASSED, recorded={NOMINAL: {"disk_margin": Reading(1.0)}}), 0.01
    )
    (finding,) = result.failures
    assert (finding.arm, finding.against) == ("heavy", "baseline")
    assert "in the baseline, and not in the file" in finding.verdict.note


def test_a_design_whose_file_is_gone_is_missing_unless_renamed(tmp_path: Path) -> None:
    results = folder_with(tmp_path, PASSED, FAILED)
    path = tmp_path / "b.json"
    entry = Accepted("f", PASSED.digest, {NOMINAL: {"gain_margin_db": 9.0}})
    both = Baseline(
        path, {"designs/good.toml": entry, "designs/gone.toml": replace(entry, digest="d")}
    )
    (gone,) = missing(both, results)
    assert (gone.status, gone.name) == ("missing", "designs/gone.toml")
    assert exit_status([PASSED, gone]) == 1
    assert missing(both, [*results, replace(PASSED, digest="d")]) == ()
    # Under its new name it is compared with what was accepted under the old one.
    moved = replace(PASSED, file=tmp_path / "designs" / "new.toml", digest="d")
    assert both.accepted(moved.file, "d") == both.designs["designs/gone.toml"]
    worse = replace(moved, recorded={NOMINAL: {"gain_margin_db": Reading(8.0)}})
    assert compare_with(both, worse, 0.01).status == "failed"
    # A copy of a design that is still there is a new one.
    assert both.accepted(tmp_path / "designs" / "copy.toml", PASSED.digest) is None


def test_of_designs_with_the_same_text_one_that_is_gone_is_missing(tmp_path: Path) -> None:
    """Its twin was accepted under its own name: it is no other one renamed."""
    results = folder_with(tmp_path, PASSED)
    entry = Accepted("f", PASSED.digest, {NOMINAL: {}})
    twins = Baseline(tmp_path / "b.json", {f"designs/{n}.toml": entry for n in ("gone", "good")})
    assert [result.name for result in missing(twins, results)] == ["designs/gone.toml"]
    new = replace(PASSED, file=tmp_path / "designs" / "new.toml")
    assert missing(twins, [*results, new]) == ()
    more = replace(twins, designs={**twins.designs, "designs/gone-too.toml": entry})
    assert len(missing(more, [*results, new])) == 1  # one new file is one of them renamed


def test_a_design_that_moved_is_compared_though_another_file_took_its_place(tmp_path: Path) -> None:
    """Such as the arm alone, which is no design any more."""
    (result,) = folder_with(tmp_path, PASSED)
    entry = Accepted("f", PASSED.digest, {NOMINAL: {"gain_margin_db": 1e9}})
    old = tmp_path / "designs" / "old.toml"
    old.write_text("")
    before = Baseline(tmp_path / "b.json", {"designs/old.toml": entry}, lambda path: path != old)
    assert before.accepted(result.file, result.digest) == entry
    assert compare_with(before, result, 0.01).status == "failed"
    assert missing(before, [result]) == ()


def test_a_baseline_may_lie_in_a_folder_that_is_not_there_yet(tmp_path: Path) -> None:
    (result,) = folder_with(tmp_path, PASSED)
    after, notes = accept(Baseline(tmp_path / "ci" / "deep" / "b.json", {}), [result])
    assert list(after.designs) == ["../../designs/good.toml"]
    assert notes == []
    assert missing(after, []) == ()


def test_edited_values_are_not_taken_for_measured_ones(tmp_path: Path) -> None:
    path = tmp_path / "b.json"
    (result,) = folder_with(tmp_path, PASSED)
    after, _ = accept(Baseline(path, {}), [result])
    text = json_text(baseline_record(after))
    for old, new in (("9.0", "1.0"), ("sha256:1", "sha256:9"), ("good.toml", "bad.toml")):
        assert old in text
        path.write_text(text.replace(old, new))
        with pytest.raises(InputError, match="was edited after it was written"):
            read_baseline(path)
    path.write_text(text)
    assert read_baseline(path).designs


def test_no_infinity_lets_everything_pass(tmp_path: Path) -> None:
    path = tmp_path / "b.json"
    values = {"disk_margin": -math.inf, "settling_time": math.inf, "decay_rate_min": -math.inf}
    for name, value in values.items():
        entry = Accepted("f", "d", {NOMINAL: {name: value}})
        path.write_text(json_text(baseline_record(Baseline(path, {"x.toml": entry}))))
        with pytest.raises(InputError, match="is not a finite number"):
            read_baseline(path)


def test_a_path_through_a_link_is_the_design_behind_it(tmp_path: Path) -> None:
    """Through a link, ".." leads elsewhere than the text of the path says."""
    (tmp_path / "a" / "deep").mkdir(parents=True)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "link").symlink_to(tmp_path / "a" / "deep")
    baseline = Baseline(tmp_path / "base.json", {})
    assert baseline.key(tmp_path / "b" / "link" / ".." / "x.toml") == "a/x.toml"


def test_a_new_design_is_told_and_judged_by_its_requirements() -> None:
    result = compare_with(Baseline(ROOT, {}), PASSED, 0.01)
    assert result.status == "passed"
    assert "not in the baseline" in result.notes[0]
    assert compare_with(Baseline(ROOT, {}), FAILED, 0.01).status == "failed"


def test_broken_and_unchanged_designs_are_left_as_they_are() -> None:
    for result in (BROKEN, UNCHANGED):
        assert compare_with(Baseline(ROOT, {}), result, 0.01) is result


def folder_with(tmp_path: Path, *results: DesignResult) -> list[DesignResult]:
    found = []
    for result in results:
        path = tmp_path / "designs" / result.file.name
        path.parent.mkdir(exist_ok=True)
        path.write_text("")
        found.append(replace(result, file=path))
    return found


def test_accepting_keeps_what_failed_and_drops_what_is_gone(tmp_path: Path) -> None:
    results = folder_with(tmp_path, PASSED, FAILED, BROKEN, UNCHANGED)
    before = Accepted("sha256:0", "sha256:z", {NOMINAL: {"disk_margin": 0.5}})
    other = tmp_path / "designs" / "other.toml"
    other.write_text("")
    names = [r.file.name for r in results[1:]]
    old = {f"designs/{name}": before for name in [*names, "gone.toml", "other.toml"]}
    after, notes = accept(Baseline(tmp_path / "b.json", old), results)
    assert after.designs["designs/good.toml"].fingerprint == "sha256:1"
    assert after.designs["designs/good.toml"].arms[NOMINAL]["gain_margin_db"] == 9.0
    for name in [*names, "other.toml"]:
        assert after.designs[f"designs/{name}"] == before
    assert "designs/gone.toml" not in after.designs
    assert notes == [
        "bad, 100%: <&>: not accepted, since it fails a requirement",
        "broken: not accepted, since it could not be judged",
        "designs/gone.toml: dropped, since the file is gone",
    ]


def test_a_baseline_reads_back_and_is_sorted(tmp_path: Path) -> None:
    results = folder_with(tmp_path, replace(PASSED, file=Path("z.toml")), PASSED)
    path = tmp_path / "b.json"
    after, _ = accept(Baseline(path, {}), results)
    text = json_text(baseline_record(after))
    path.write_text(text)
    again = read_baseline(path)
    assert again == replace(after, designs=again.designs)
    assert dict(again.designs) == dict(after.designs)
    assert list(json.loads(text)["designs"]) == ["designs/good.toml", "designs/z.toml"]
    assert json_text(baseline_record(again)) == text
    for result in results:
        assert all(f.verdict.passed for f in compare_with(again, result, 0.0).findings)


def test_keys_do_not_depend_on_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "designs").mkdir()
    whole = Baseline(tmp_path / "b.json", {}).key(tmp_path / "designs" / "x.toml")
    monkeypatch.chdir(tmp_path)
    from_root = Baseline(Path("b.json"), {}).key(Path("designs/x.toml"))
    monkeypatch.chdir(tmp_path / "designs")
    from_inside = Baseline(Path("../b.json"), {}).key(Path("x.toml"))
    assert whole == from_root == from_inside == "designs/x.toml"


def sealed(values: object) -> str:
    """Return a baseline whose seal is right, whatever it holds."""
    said = {"fingerprint": "f", "digest": "d", "arms": {"nominal": values}}
    entry = said | {"seal": _seal("x", said)}
    return json.dumps({"schema": SCHEMA, "designs": {"x": entry}})


CORRUPT = [
    ("", "not valid JSON"),
    ("{", "not valid JSON"),
    ("[" * 100000, "not valid JSON"),
    ("[]", "[] is no table"),
    ("{}", "schema: its schema is None"),
    ('{"schema": "slewctl-baseline/1"}', "delete the file and accept the designs anew"),
    ('{"schema": "slewctl-baseline/2"}', "designs: None is no table"),
    ('{"schema": "slewctl-baseline/2", "designs": {"x": 3}}', "designs.x: 3 is no table"),
    ('{"schema": "slewctl-baseline/2", "designs": {"x": {"arms": {}}}}', "was edited after"),
    (sealed({"gain": 3}), "designs.x.arms.nominal: unknown name 'gain'"),
    (sealed({"disk_margin": math.nan}), "designs.x.arms.nominal.disk_margin: nan is not a finite number"),
    (sealed({"disk_margin": True}), "True is not a finite number"),
    (sealed({"disk_margin": "0.3"}), "'0.3' is not a finite number"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), CORRUPT, ids=[words for _, words in CORRUPT])
def test_corrupt_baselines_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "b.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_baseline(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)
    with pytest.raises(InputError):  # is not taken for a missing one
        read_baseline(path, may_be_missing=True)


def test_missing_and_unreadable_baselines(tmp_path: Path) -> None:
    path = tmp_path / "b.json"
    with pytest.raises(InputError, match="no such baseline; make it with --update-baseline"):
        read_baseline(path)
    assert read_baseline(path, may_be_missing=True).designs == {}
    with pytest.raises(InputError, match="cannot be read"):
        read_baseline(tmp_path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        read_baseline(path)
