"""Results as JUnit XML, which every CI system shows.

One suite per design file and one case per requirement; a design that could not be judged is
an error, an unchanged one is skipped.  What is proved of a margin is its output.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from slewctl.check.result import DesignResult, Finding
from slewctl.check.words import GONE, proof_text, sentence, title
from slewctl.escape import xml


def to_junit(results: Sequence[DesignResult]) -> str:
    """Return results as the text of a JUnit XML file.

    Parameters
    ----------
    results : sequence of DesignResult

    Returns
    -------
    str

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import DesignResult, to_junit
    >>> broken = DesignResult("arm", Path("designs/arm.toml"), error="no such basis")
    >>> "no such basis" in to_junit([broken])
    True
    """
    root = ET.Element("testsuites", name="slewctl check")
    for result in results:
        root.append(_suite(result))
    for key in ("tests", "failures", "errors", "skipped"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in root)))
    ET.indent(root, " ")
    return ET.tostring(root, encoding="unicode", xml_declaration=False).join(
        ('<?xml version="1.0" encoding="utf-8"?>\n', "\n")
    )


def _suite(result: DesignResult) -> ET.Element:
    suite = ET.Element("testsuite", name=xml(result.name))
    for found in result.findings:
        _case(suite, result, title(found), found.line, found)
    if result.error:
        case = _case(suite, result, "can be judged", result.error_line)
        ET.SubElement(case, "error", message=xml(result.error))
    elif result.missing:
        case = _case(suite, result, "in the baseline", None)
        ET.SubElement(case, "failure", message=GONE, type="baseline").text = GONE
    elif result.unchanged:
        case = _case(suite, result, "unchanged", None)
        ET.SubElement(case, "skipped", message="unchanged since the last accepted run")
    elif not result.findings:
        case = _case(suite, result, "can be judged", None)
        ET.SubElement(case, "error", message="nothing was judged")
    counts = {
        "tests": "testcase",
        "failures": "testcase/failure",
        "errors": "testcase/error",
        "skipped": "testcase/skipped",
    }
    for key, path in counts.items():
        suite.set(key, str(len(suite.findall(path))))
    suite.set("time", f"{result.seconds:.3f}")
    return suite


def _case(
    suite: ET.Element,
    result: DesignResult,
    name: str,
    line: int | None,
    finding: Finding | None = None,
) -> ET.Element:
    case = ET.SubElement(
        suite,
        "testcase",
        classname=xml(result.name),
        name=xml(name),
        file=xml(result.file.as_posix()),
        line=str(line or 1),
    )
    proof = "" if finding is None else proof_text(finding.verdict)
    if finding is not None and not finding.verdict.passed:
        text = xml(sentence(finding))
        ET.SubElement(case, "failure", message=text, type=finding.against).text = text
    if proof:
        ET.SubElement(case, "system-out").text = proof
    return case
