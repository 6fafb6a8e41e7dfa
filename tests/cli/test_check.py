"""`slewctl check` as a person and as a CI system meet it: table, files, annotations, status."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from quick_design import QUICK

from slewctl import cli
from slewctl.check import baseline_record, read_baseline
from slewctl.report.export import json_text

FAST = QUICK
FAILING = FAST.replace("gain_margin_db = 6", "stable = true\n\ngain_margin_db = 60")
BROKEN = FAST.replace("n = 2", "n = -2")


@dataclass(frozen=True)
class Done:
    """What a run of the command line left behind."""

    status: int
    out: str
    err: str


Run = Callable[..., Done]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run ``slewctl check`` in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)

    def run(*arguments: str | Path) -> Done:
        monkeypatch.setattr(sys, "argv", ["slewctl", "check", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return Done(int(str(stopped.value.code)), out, err)

    return run


def write(**designs: str) -> None:
    for name, text in designs.items():
        path = Path("designs") / f"{name}.toml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")


def test_a_design_that_passes_is_one_row_with_its_tightest_requirement(run: Run) -> None:
    write(good=FAST + "phase_margin_deg = 30\n")
    done = run("designs")
    assert (done.status, done.err) == (0, "")
    heading, row, last = done.out.splitlines()
    assert heading.split() == ["design", "verdict", "requirement", "value", "limit"]
    assert re.match(r"good +ok +phase_margin_deg +[\d.]+ deg +>= 30 deg *$", row)
    assert last == "all requirements hold (3 in 1 design; the tightest of each is shown)"


def test_all_shows_every_requirement(run: Run) -> None:
    write(good=FAST)
    done = run("designs", "--all")
    assert re.findall(r"^good +ok +(\w+)", done.out, re.M) == ["stable", "gain_margin_db"]
    assert done.out.endswith("all requirements hold (2 in 1 design)\n")


def test_failures_stand_out_and_the_summary_counts_them(run: Run) -> None:
    write(good=FAST, bad=FAILING)
    done = run("designs")
    assert done.status == 1
    assert re.search(
        r"^bad +FAIL +gain_margin_db +[\d.]+ dB +>= 60 dB +at [\d.]+ Hz", done.out, re.M
    )
    assert done.out.count("FAIL") == 1
    assert done.out.endswith("1 of 4 requirements failed\n")


def test_variations_have_rows_of_their_own(run: Run) -> None:
    text = FAST + "[variations.heavy]\npayload_mass = 0.1\nrequirements.gain_margin_db = 70\n"
    write(varied=text)
    done = run("designs")
    assert done.status == 1
    assert re.search(r"^varied +ok +gain_margin_db", done.out, re.M)
    assert re.search(
        r"^varied \[heavy\] +FAIL +gain_margin_db +[\d.]+ dB +>= 70 dB", done.out, re.M
    )


def test_a_broken_file_hides_nothing_of_the_others(run: Run) -> None:
    write(a_broken=BROKEN, b_good=FAST, c_bad=FAILING)
    done = run("designs", "--junit", "o.xml", "--json", "o.json")
    assert done.status == 2
    assert re.search(r"^a_broken +BROKEN", done.out, re.M)
    assert re.search(r"^b_good +ok", done.out, re.M)
    assert re.search(r"^c_bad +FAIL", done.out, re.M)
    assert "1 of 4 requirements failed, 1 design could not be judged" in done.out
    assert done.err == (
        "slewctl: designs/a_broken.toml:7: model.n: -2 is not allowed; "
        "give a value greater than or equal to 1\n"
    )
    record = json.loads(Path("o.json").read_text())
    assert record["status"] == 2
    assert [design["status"] for design in record["designs"]] == ["broken", "passed", "failed"]
    assert ET.parse("o.xml").getroot().get("errors") == "1"


def test_quiet_prints_what_failed_and_nothing_else(run: Run) -> None:
    write(good=FAST)
    assert run("designs", "--quiet") == Done(0, "", "")
    write(bad=FAILING)
    done = run("designs", "--quiet")
    assert done.status == 1
    assert "good" not in done.out
    assert "bad" in done.out


def test_annotations_stand_at_the_line_of_the_failed_requirement(run: Run) -> None:
    write(bad=FAILING, broken="\n\n[arm\n")
    done = run("designs", "--github", "--quiet")
    assert done.status == 2
    broken, bad = [line for line in done.out.splitlines() if line.startswith("::")]
    assert broken.startswith(
        "::error file=designs/broken.toml,line=3,title=slewctl%3A cannot be judged::"
    )
    assert re.fullmatch(
        r"::error file=designs/bad\.toml,line=20,title=slewctl%3A gain_margin_db"
        r"::bad: gain_margin_db: [\d.]+ dB at [\d.]+ Hz.*, required >= 60 dB",
        bad,
    )


def test_annotations_name_files_from_the_workspace(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(broken=BROKEN)
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path))
    monkeypatch.chdir(tmp_path / "designs")
    assert "::error file=designs/broken.toml,line=7," in run("broken.toml", "--github").out


def test_outputs_are_the_same_bytes_from_run_to_run(run: Run) -> None:
    write(good=FAST, broken=BROKEN)
    texts = []
    for _ in range(2):
        run("designs", "--json", "out/o.json", "--baseline", "out/b.json", "--update-baseline")
        texts.append((Path("out/o.json").read_bytes(), Path("out/b.json").read_bytes()))
    assert texts[0] == texts[1]
    assert sorted(os.listdir("out")) == ["b.json", "o.json"]  # nothing half-written beside


def accepted(run: Run) -> None:
    done = run("designs", "--baseline", "b.json", "--update-baseline")
    assert done.status == 0, done


def edit_baseline(old: str, factor: float) -> None:
    """Change a value as if it had been measured: the file is sealed anew."""
    before = read_baseline(Path("b.json"))
    entry = before.designs["designs/good.toml"]
    nominal = dict(entry.arms["nominal"])
    nominal[old] *= factor
    designs = {"designs/good.toml": replace(entry, arms={**entry.arms, "nominal": nominal})}
    text = json_text(baseline_record(replace(before, designs=designs)))
    Path("b.json").write_text(text, encoding="utf-8")


def test_a_margin_that_fell_fails_whether_required_or_not(run: Run) -> None:
    write(good=FAST)
    accepted(run)
    assert run("designs", "--baseline", "b.json").status == 0
    edit_baseline("disk_margin", 1.02)
    done = run("designs", "--baseline", "b.json", "--github", "--junit", "o.xml")
    assert done.status == 1
    assert re.search(
        r"^good +FAIL +disk_margin \(baseline\) .*at .*; accepted: 0\.\d+ *$", done.out, re.M
    )
    assert "1 quantity worse than in the baseline" in done.out
    assert (
        "::error file=designs/good.toml,line=17,title=slewctl%3A disk_margin (baseline)::"
        in done.out
    )
    assert ET.parse("o.xml").getroot().get("failures") == "1"
    assert run("designs", "--baseline", "b.json", "--tolerance", "0.03").status == 0
    # A margin that rose is no failure.
    edit_baseline("disk_margin", 0.5)
    assert run("designs", "--baseline", "b.json").status == 0


def test_updating_accepts_what_passes_and_not_what_fails(run: Run) -> None:
    write(good=FAST)
    accepted(run)
    edit_baseline("disk_margin", 2)
    kept = Path("b.json").read_bytes()
    write(good=FAILING, new=FAST)
    done = run("designs", "--baseline", "b.json", "--update-baseline")
    assert done.status == 1
    assert "baseline: good: not accepted, since it fails a requirement" in done.out
    before, after = json.loads(kept)["designs"], json.loads(Path("b.json").read_text())["designs"]
    assert after["designs/good.toml"] == before["designs/good.toml"]
    assert set(after) == {"designs/good.toml", "designs/new.toml"}
    write(good=FAST)
    accepted(run)
    assert run("designs", "--baseline", "b.json").status == 0


@pytest.mark.parametrize("more", ["", "[[grid]]\norders = [1]\n"], ids=["an arm", "a study"])
def test_an_accepted_design_that_is_none_any_more_is_missing(run: Run, more: str) -> None:
    write(good=FAST, other=FAST + "phase_margin_deg = 30\n")
    accepted(run)
    write(other=f'[arm]\ncatalogue = "paper-beam"\ndamping_ratio = 0.01\n{more}')
    done = run("designs", "--baseline", "b.json")
    assert done.status == 1
    assert re.search(r"designs/other.toml +MISSING", done.out)
    assert run("designs/other.toml", "--baseline", "b.json").status == 1
    done = run("designs", "--baseline", "b.json", "--update-baseline")
    assert "designs/other.toml: dropped, since it is no design any more" in done.out
    assert run("designs", "--baseline", "b.json").status == 0


def test_a_new_design_is_told_and_passes(run: Run) -> None:
    write(good=FAST)
    accepted(run)
    write(new=FAST)
    done = run("designs", "--baseline", "b.json")
    assert done.status == 0
    assert "new: not in the baseline: judged by its requirements alone" in done.out
    assert "good: not in" not in done.out


def test_changed_only_judges_what_changed(run: Run) -> None:
    write(good=FAST, other=FAST)
    accepted(run)
    done = run("designs", "--baseline", "b.json", "--changed-only")
    assert done.status == 0
    assert done.out.count("unchanged") == 3
    assert "nothing to judge, 2 designs unchanged" in done.out
    write(other=FAILING)
    done = run("designs", "--baseline", "b.json", "--changed-only", "--json", "o.json")
    assert done.status == 1
    states = {d["name"]: d["status"] for d in json.loads(Path("o.json").read_text())["designs"]}
    assert states == {"good": "unchanged", "other": "failed"}


REFUSED = [
    (["--baseline", "none.json"], "none.json: no such baseline; make it with --update-baseline"),
    (["--baseline", "junk.json"], "junk.json: not valid JSON"),
    (["--baseline", "junk.json", "--update-baseline"], "junk.json: not valid JSON"),
    (["--baseline", "designs/good.toml", "--update-baseline"], "--baseline names the same file as a design"),
    (["--json", "designs/good.toml"], "--json names the same file as a design"),
    (["--json", "x", "--junit", "./x"], "--json names the same file as --junit"),
    (["--json", "designs"], "is a directory"),
    (["--changed-only"], "--changed-only needs --baseline FILE"),
    (["--update-baseline"], "--update-baseline needs --baseline FILE"),
    (["--tolerance", "0.01"], "--tolerance needs --baseline FILE"),
    (
        ["--baseline", "b.json", "--update-baseline", "--tolerance", "0.1"],
        "--tolerance means nothing with --update-baseline",
    ),
    (
        ["--baseline", "b.json", "--update-baseline", "--changed-only"],
        "--changed-only means nothing with --update-baseline",
    ),
    (["--all", "--quiet"], "--all means nothing with --quiet"),
    (["--baseline", "none.json", "--tolerance", "nan"], "--tolerance: nan is not a finite number"),
    (["--baseline", "none.json", "--tolerance", "-1"], "--tolerance: -1 is negative"),
    (["--baseline", "none.json", "--tolerance", "5"], "--tolerance: 5 would let every margin go"),
    (["nothing.toml"], "nothing.toml: no such file or folder"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "words"), REFUSED, ids=[" ".join(o) for o, _ in REFUSED])
def test_refusals_come_before_any_work(run: Run, options: list[str], words: str) -> None:
    write(good=FAST)
    Path("junk.json").write_text("{")
    done = run("designs", *options)
    assert (done.status, done.out) == (2, "")
    assert words in done.err
    assert Path("designs/good.toml").read_text() == FAST
    assert Path("junk.json").read_text() == "{"
    assert sorted(os.listdir()) == ["designs", "junk.json"]


def test_a_file_that_cannot_be_written_spoils_no_other(run: Run) -> None:
    write(good=FAST)
    Path("plain").write_text("")
    done = run("designs", "--json", "plain/o.json", "--junit", "o.xml")
    assert done.status == 2
    assert "good" in done.out
    assert done.err.startswith("slewctl: --json plain/o.json: ")
    assert "cannot be written" in done.err
    assert done.err.count("\n") == 1
    assert ET.parse("o.xml").getroot().get("tests") == "2"


def test_links_are_followed_and_devices_refused(run: Run) -> None:
    write(good=FAST)
    Path("real.json").write_text("")
    Path("link.json").symlink_to("real.json")
    assert run("designs", "--json", "link.json").status == 0
    assert Path("link.json").is_symlink()
    assert json.loads(Path("real.json").read_text())["status"] == 0
    done = run("designs", "--json", os.devnull)
    assert done.status == 2
    assert "not an ordinary file" in done.err
    assert Path(os.devnull).is_char_device()


def test_help_tells_the_exit_status(run: Run) -> None:
    done = run("--help")
    assert done.status == 0
    for words in ("0  all requirements hold", "1  a requirement failed", "2  bad input"):
        assert words in done.out


@pytest.mark.slow
def test_in_a_process_of_its_own(tmp_path: Path) -> None:
    """Status, streams and a terminal that knows no unicode."""
    (tmp_path / "π.toml").write_text(FAST + "torque_peak_max = 9\n", encoding="utf-8")
    (tmp_path / "broken.toml").write_text(BROKEN)
    done = subprocess.run(
        [sys.executable, "-m", "slewctl", "check", tmp_path, "--all"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 2
    assert "N\\xb7m" in done.stdout
    assert "\\u03c0" in done.stdout
    assert done.stderr.startswith("slewctl: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="pipes and devices of Unix")
def test_a_reader_that_stops_reading_is_no_failed_requirement(tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(FAST)
    code = "import os, subprocess, sys; p = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE); p.stdout.close(); sys.exit(p.wait())"
    command = [sys.executable, "-m", "slewctl", "check", "good.toml", "--json", "o.json"]
    done = subprocess.run(
        [sys.executable, "-c", code, *command],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (141, "")
    assert json.loads((tmp_path / "o.json").read_text())["status"] == 0


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_full_disk_is_told_in_one_line(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "slewctl", "arms"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == "slewctl: input or output failed: No space left on device\n"


def test_designs_in_folders_of_a_folder_are_told_of(run: Run) -> None:
    write(good=FAST)
    inside = Path("designs/rigs")
    inside.mkdir()
    (inside / "bad.toml").write_text(FAILING, encoding="utf-8")
    (inside / "pyproject.toml").write_text("[project]\nname = 'x'\n", encoding="utf-8")
    done = run("designs")
    assert done.status == 0
    assert done.out.splitlines()[-1] == f"1 more design is in {inside}: name it too"
    assert "rigs" not in run("designs", "--quiet").out
    both = run("designs", inside / "bad.toml")
    assert both.status == 1
    assert "more design" not in both.out
