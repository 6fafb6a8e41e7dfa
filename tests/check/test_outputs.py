"""JUnit, JSON and annotations: read back by the parsers of those who will read them."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from gate_results import ALL, BROKEN, FAILED, MISSING, PASSED, UNCHANGED
from hypothesis import given
from hypothesis import strategies as st

from slewctl.check import DesignResult, Finding, exit_status, to_annotations, to_junit, to_record
from slewctl.escape import visible
from slewctl.report.export import json_text


@pytest.mark.parametrize(
    ("results", "status"),
    [
        ([], 0), ([PASSED], 0), ([PASSED, UNCHANGED], 0), ([PASSED, FAILED], 1),
        ([PASSED, MISSING], 1), ([FAILED, BROKEN, PASSED], 2), ([BROKEN], 2), ([DesignResult("empty", Path("x.toml"))], 1),
    ],
)  # fmt: skip
def test_exit_status_is_that_of_the_worst(results: list[DesignResult], status: int) -> None:
    assert exit_status(results) == status


def test_a_broken_design_keeps_the_findings_it_has() -> None:
    half = replace(FAILED, error="e")
    assert half.status == "broken"
    assert len(half.failures) == 2


def test_junit_counts_and_names_everything() -> None:
    root = ET.fromstring(to_junit(ALL))
    assert root.tag == "testsuites"
    assert {k: root.get(k) for k in ("tests", "failures", "errors", "skipped")} == {
        "tests": "9", "failures": "2", "errors": "1", "skipped": "1"
    }  # fmt: skip
    assert [suite.get("name") for suite in root] == ["good", "bad, 100%: <&>", "broken", "same"]
    for suite in root:
        assert suite.get("tests") == str(len(suite.findall("testcase")))
    names = [case.get("name") for case in root[1]]
    assert names == [
        "stable", "gain_margin_db", "stable [heavy]", "gain_margin_db [heavy]", "h2_loss_max [heavy]",
    ]  # fmt: skip
    failure = root[1][3].find("failure")
    assert failure is not None
    assert (
        failure.get("message")
        == "gain_margin_db [heavy]: 4 dB at 3.25 Hz, mode 1, required >= 6 dB"
    )
    assert root[1][3].get("line") == "8"
    assert root[1][3].get("file") == "designs/bad, 100%: x.toml"
    broken = root[2].find("testcase/error")
    assert broken is not None
    assert broken.get("message") == "designs/broken.toml:5: n: -2"
    assert root[0].get("time") == "1.250"


def test_a_design_without_findings_is_no_success() -> None:
    root = ET.fromstring(to_junit([DesignResult("empty", Path("x.toml"))]))
    assert (root.get("errors"), root.get("tests")) == ("1", "1")


@pytest.mark.slow
@given(st.text())
def test_junit_is_well_formed_whatever_the_names(text: str) -> None:
    result = replace(FAILED, name=text, error=text or "e", file=Path("x.toml"))
    root = ET.fromstring(to_junit([result]).encode("utf-8"))
    assert root.get("errors") == "1"


def test_record_holds_every_verdict_in_order() -> None:
    record = json.loads(json_text(to_record(ALL, "1.2")))
    assert (record["schema"], record["slewctl"], record["status"]) == ("slewctl-check/2", "1.2", 2)
    assert record["summary"] == {
        "designs": 4, "passed": 1, "failed": 1, "broken": 1, "missing": 0, "unchanged": 1,
        "verdicts": 7, "verdicts_failed": 2,
    }  # fmt: skip
    good, bad, broken, same = record["designs"]
    assert good["arms"] == [
        {
            "arm": "nominal",
            "requirements": [
                {"requirement": "stable", "passed": True, "value": 1.0, "limit": 1.0,
                 "sense": "at least", "unit": "", "frequency_hz": None, "mode": "", "line": 3,
                 "note": "", "seen": [{"modes": 20, "value": 1.0}, {"modes": 40, "value": 1.0}],
                 "at_least": None, "intervals": 0},
                {"requirement": "gain_margin_db", "passed": True, "value": 9.0, "limit": 6.0,
                 "sense": "at least", "unit": "dB", "frequency_hz": 3.25, "mode": "mode 1 (3.3 Hz)",
                 "line": 4, "note": "",
                 "seen": [{"modes": 20, "value": 9.0}, {"modes": 40, "value": 9.0}],
                 "at_least": 8.999, "intervals": 321},
            ],
            "baseline": [],
            "measured": {"gain_margin_db": {"value": 9.0, "frequency_hz": 3.25,
                                            "at_least": None, "intervals": 0},
                         "disk_margin": {"value": "inf", "frequency_hz": None,
                                         "at_least": None, "intervals": 0}},
        }
    ]  # fmt: skip
    assert [arm["arm"] for arm in bad["arms"]] == ["nominal", "heavy"]
    assert bad["arms"][1]["requirements"][2]["value"] is None
    assert (broken["status"], broken["line"], broken["arms"]) == ("broken", 5, [])
    assert (same["status"], same["error"]) == ("unchanged", None)


def test_junit_says_what_is_proved_of_a_margin() -> None:
    alone = replace(PASSED.findings[1].verdict, at_least=None, intervals=0)
    unproved = replace(PASSED, findings=(replace(PASSED.findings[1], verdict=alone),))
    suites = ET.fromstring(to_junit([PASSED, unproved]))
    assert [out.text for out in suites.iter("system-out")] == [
        "proved on 321 intervals of the axis to be at least 8.999 dB",
        "confirmed by the poles of closed loops alone, not on intervals of the axis",
    ]


def test_a_missing_design_is_told_in_every_output() -> None:
    (suite,) = ET.fromstring(to_junit([MISSING]))
    failure = suite.find("testcase/failure")
    assert failure is not None
    assert "in the baseline, not found" in str(failure.get("message"))
    assert to_record([MISSING], "1")["designs"][0]["status"] == "missing"
    (line,) = to_annotations([MISSING], Path())
    assert line.startswith("::error file=designs/gone.toml,line=1")
    assert "not found" in line


def test_record_is_alike_whenever_it_is_written() -> None:
    slower = replace(PASSED, seconds=99.0)
    assert json_text(to_record([PASSED], "1")) == json_text(to_record([slower], "1"))


def test_numbers_keep_ten_digits() -> None:
    third = replace(PASSED.findings[1].verdict, value=1 / 3)
    result = replace(PASSED, findings=(Finding(third),))
    assert '"value": 0.3333333333,' in json_text(to_record([result], "1"))


def test_annotations_are_exact(tmp_path: Path) -> None:
    lines = to_annotations(ALL, Path())
    assert lines == [
        "::error file=designs/broken.toml,line=5,title=slewctl%3A cannot be judged"
        "::designs/broken.toml:5: n: -2",
        "::error file=designs/bad%2C 100%25%3A x.toml,line=8,title=slewctl%3A gain_margin_db [heavy]"
        "::bad, 100%25: <&>: gain_margin_db [heavy]: 4 dB at 3.25 Hz, mode 1, required >= 6 dB",
        "::error file=designs/bad%2C 100%25%3A x.toml,line=1,title=slewctl%3A h2_loss_max [heavy]"
        "::bad, 100%25: <&>: h2_loss_max [heavy]: none, required <= 0.1 (not verified:%0Aline 2\\x00)",
    ]
    assert to_annotations([PASSED, UNCHANGED], tmp_path) == []


@pytest.mark.parametrize(
    ("file", "root", "named"),
    [
        ("/repo/designs/x.toml", "/repo", "designs/x.toml"),
        ("/repo/a/../designs/x.toml", "/repo", "designs/x.toml"),
        ("/elsewhere/x.toml", "/repo", "/elsewhere/x.toml"),
    ],
)
def test_files_are_named_from_the_repository(file: str, root: str, named: str) -> None:
    (line,) = to_annotations([replace(BROKEN, file=Path(file))], Path(root))
    assert line.startswith(f"::error file={named},")


@given(st.text(), st.text())
def test_annotations_are_one_line_and_give_the_text_back(name: str, note: str) -> None:
    verdict = replace(PASSED.findings[1].verdict, passed=False, note=note)
    result = replace(PASSED, name=name, findings=(Finding(verdict, "v"),))
    (line,) = to_annotations([result], Path())
    assert not re.search("[\r\n]", line)
    message = line.split("::", 2)[2]
    given_back = message.replace("%0A", "\n").replace("%25", "%")
    assert given_back.startswith(f"{visible(name)}: gain_margin_db [v]: 9 dB")
    assert visible(note) in given_back
