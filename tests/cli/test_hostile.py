"""Input that nobody would write on purpose, or only with bad intent, on the command line."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path
from xml.etree import ElementTree

import pytest
from command_line import slewctl
from heed_signals import heed_signals
from quick_design import QUICK

from slewctl.cli import of_an_interruption

COMMANDS = [["check"], ["ladder"], ["modes", "-n", "2"], ["compare", "--out", "out"]]
FOUR = pytest.mark.parametrize("command", COMMANDS, ids=[c[0] for c in COMMANDS])


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def design(name: str, *changes: tuple[str, str]) -> Path:
    """Write a quick design in which some of the text is replaced."""
    text = QUICK + '[compare]\nbases = ["clamped-free"]\norders = [2]\n'
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = Path(f"{name}.toml")
    path.write_text(text, encoding="utf-8")
    return path


def rows(table: str | Path) -> list[dict[str, str]]:
    return list(csv.DictReader(Path(table).read_text("utf-8").splitlines()))


UNREADABLE = {
    "hex": "title = 0x" + "f" * 3600,
    "deep": "title" + ".a" * 990 + " = 1",
    "long": "title = 3\n" + "x" * 900_000 + " = 1",
}


@FOUR
@pytest.mark.parametrize("kind", [*UNREADABLE, "pipe", "zero", "folder"])
def test_what_cannot_be_read_is_refused_in_one_line(command: list[str], kind: str) -> None:
    path = Path("x.toml")
    if kind in UNREADABLE:
        path.write_text(UNREADABLE[kind])
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "zero":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    done = slewctl(command[0], path, *command[1:])
    assert done.returncode == 2
    assert all(line.startswith("slewctl: x.toml") for line in done.stderr.splitlines())
    assert len(done.stderr) < 3000
    assert not Path("out").exists()


@pytest.mark.slow
@pytest.mark.parametrize("command", ["check", "compare"])
def test_the_other_designs_of_a_folder_are_judged(command: str) -> None:
    Path("d").mkdir()
    design("d/good")
    Path("d/hex.toml").write_text(UNREADABLE["hex"])
    os.mkfifo("d/pipe.toml")
    design("d/wild", ('"lqg"', '"lqg"\nintegral_limit = 1e-200'))
    done = slewctl(command, "d", *(["--out", "out"] if command == "compare" else []))
    assert done.returncode == 2
    assert "good" in done.stdout
    words = done.stderr.splitlines()
    assert sorted(re.findall(r"slewctl: d/(\w+)\.toml", done.stderr)) == ["hex", "pipe", "wild"]
    assert len(words) == 3
    if command == "compare":
        assert {row["case"] for row in rows("out/designs.csv")} == {"good"}


WILD = {
    "torque": ("torque = 1.0 }", "torque = 1e-200 }"),
    "noise": ("theta = 0.01", "theta = 1e-200"),
    "integral": ('"lqg"', '"lqg"\nintegral_limit = 1e-200'),
    "tip": ("tip = 0.03", "tip = 1e-200"),
    "endless": ("duration_s = 2", "duration_s = 1e300"),
    "instant": ("duration_s = 2", "duration_s = 1e-300"),
    "short": ('catalogue = "paper-beam"', "beam = { length = 1e-150, mass_per_length = 1, bending_stiffness = 1 }"),
}  # fmt: skip


@FOUR
@pytest.mark.parametrize("kind", WILD)
def test_arithmetic_that_breaks_down_names_the_file(command: list[str], kind: str) -> None:
    """Whatever the packages raise or warn of, one line comes of it or a verdict."""
    path = design(kind, WILD[kind])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        done = slewctl(command[0], path, *command[1:])
    assert caught == []
    assert done.returncode in (0, 1, 2)
    assert "Warning" not in done.stderr
    if done.returncode == 2:
        assert done.stderr.startswith(f"slewctl: {path}")
        assert done.stderr.count("\n") == 1
    else:
        assert done.stderr == ""


@pytest.mark.parametrize("kind", ["pipe", "zero"])
def test_a_baseline_is_an_ordinary_file(kind: str) -> None:
    if kind == "pipe":
        os.mkfifo("b.json")
    else:
        Path("b.json").symlink_to("/dev/zero")
    done = slewctl("check", design("good"), "--baseline", "b.json")
    assert done.returncode == 2
    assert done.stderr.startswith("slewctl: --baseline b.json: cannot be read: it is not an")


HOSTILE = "x\x1b[2J\x00\n::error file=a::b ##[add-mask]c"


def test_names_and_keys_command_neither_terminal_nor_log() -> None:
    title = "\\u001b]0;x\\u0007\\n::error::y"
    good = design("a\x1b[31m\n::error::b", ("[arm]", f'title = "{title}"\n[arm]\nname = "{title}"'))
    Path("bad.toml").write_text(QUICK + '"\\n::warning file=x::\\u001b[31m" = 1\n')
    for arguments in (
        ["check", good, "bad.toml", "--all", "--junit", "j.xml", "--json", "j.json"],
        ["ladder", good],
        ["modes", good, "-n", "1"],
        ["modes", HOSTILE.replace("\x00", "")],
        ["compare", good, "--out", "o\x1b[31m\n::error::p"],
        ["compare", good, "--out", "/dev/null/\x1b\n::error::p"],
        ["\x1b[31m\n::error::c"],
        ["check", "--\x1b[31m\n::error::c"],
        ["check", "x\x1b\n::error::y"],
    ):
        done = slewctl(*arguments)
        for text in (done.stdout, done.stderr):
            assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", text), arguments
            assert not re.search(r"^\s*::|##\[", text, re.M), arguments
    (page,) = Path().rglob("index.html")
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", page.read_text("utf-8"))
    ElementTree.parse("j.xml")
    json.loads(Path("j.json").read_text())


def test_annotations_are_the_only_commands() -> None:
    Path("bad.toml").write_text(QUICK + '"\\n::warning file=x::y" = 1\n')
    done = slewctl("check", "bad.toml", "--github")
    (command,) = [line for line in done.stdout.splitlines() if line.startswith("::")]
    assert command.startswith("::error file=bad.toml,line=19,")


def test_reports_hold_titles_and_names_as_text() -> None:
    title = "<script>alert(1)</script> [x](http://y) | # h\\u0000\\u001b"
    path = design("=cmd", ("[arm]", f'title = "{title}"\n[arm]\nname = "# *a* [b](c)"'))
    assert slewctl("compare", path, "--out", "out").returncode == 0
    page = Path("out/index.md").read_text()
    assert r"\<script>alert(1)\</script> \[x\](http://y) \| # h\\x00\\x1b" in page
    assert r"\=cmd" in page
    assert "[b](c)" not in page
    html = Path("out/index.html").read_text()
    assert "<script>alert" not in html
    assert "\x00" not in html
    assert "\x1b" not in html
    for table in Path("out").glob("*.csv"):
        assert {row["case"] for row in rows(table)} == {"'=cmd"}


@pytest.mark.parametrize("more", ["[[grid]]\norders = [1]\n", ""], ids=["a study", "an arm alone"])
def test_what_is_no_design_is_none_for_the_hook(more: str) -> None:
    Path("study.toml").write_text(f'[arm]\ncatalogue = "paper-beam"\n{more}')
    done = slewctl("check", "--quiet", "study.toml")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    alone = slewctl("check", "study.toml")
    told = (
        "only studies or arms, no design: nothing was judged (a design has a [controller]; "
        "slewctl study runs a study)\n"
    )
    assert (alone.returncode, alone.stdout, alone.stderr) == (0, told, "")
    done = slewctl("check", "study.toml", design("good"))
    assert done.returncode == 0
    assert "study" not in done.stdout
    assert slewctl("compare", "study.toml", "--out", "out").returncode == 2


def test_a_folder_to_write_to_is_refused_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    path = design("good")
    Path("file").write_text("")
    monkeypatch.setattr("slewctl.cli.comparing.compare", lambda *_: pytest.fail("worked"))
    monkeypatch.setattr("slewctl.cli.paper.reproduce", lambda *_: pytest.fail("worked"))
    for out in ("", "  ", "file", "file/out", "/dev/null/out", "x" * 300, "/proc/out"):
        for command in (["compare", path], ["paper"], ["study", path]):
            done = slewctl(*command, "--out", out)
            assert done.returncode == 2, (out, command)
            assert done.stderr.count("\n") == 1, (out, done.stderr)
            assert "Traceback" not in done.stderr
    assert {path.name for path in Path().iterdir()} == {"file", "good.toml"}


def test_the_mode_of_a_file_stays() -> None:
    path = design("good")
    Path("o.json").write_text("")
    Path("o.json").chmod(0o600)
    Path("new.xml").unlink(missing_ok=True)
    assert slewctl("check", path, "--json", "o.json", "--junit", "new.xml").returncode == 0
    assert Path("o.json").stat().st_mode & 0o777 == 0o600
    umask = os.umask(0)
    os.umask(umask)
    assert Path("new.xml").stat().st_mode & 0o777 == 0o666 & ~umask


def test_nothing_is_cut_or_wrapped_in_a_pipe() -> None:
    done = slewctl("modes", "paper-beam", "-m", "20", "-n", "3")
    assert done.returncode == 0
    assert "…" not in done.stdout
    rows = done.stdout.splitlines()
    assert len(rows) == 1 + 3 * len({row.split()[0] for row in rows[1:-2]}) + 2
    assert len(re.findall(r"\d+\.\d{6}", rows[-2])) == 20
    path = design("x" * 200, ("gain_margin_db = 6", "gain_margin_db = 60"))
    words = slewctl("check", path).stdout.splitlines()
    assert len(words) == 3
    assert words[1].startswith("x" * 200 + "  FAIL")


# What a process of its own shows: exit codes, streams and signals.
PROGRAM = [sys.executable, "-m", "slewctl"]
# A line on standard output says that the package has begun to load.
COMMAND = "import sys; sys.argv[0] = 'bin/slewctl'; import slewctl; print(flush=True); from slewctl.cli import main; main()"
UNIX = pytest.mark.skipif(os.name == "nt", reason="signals and devices of Unix")


@UNIX
def test_a_full_device_for_errors_changes_no_exit_code() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*PROGRAM, "check", "nothing.toml"], stdout=subprocess.PIPE, stderr=full, check=False
        )
    assert (done.returncode, done.stdout) == (2, b"")


@pytest.mark.slow
@UNIX
def test_closed_streams_change_no_exit_code() -> None:
    def close() -> None:
        os.close(1)
        os.close(2)

    done = subprocess.run([*PROGRAM, "check", "nothing.toml"], preexec_fn=close, check=False)
    assert done.returncode == 2


@UNIX
@pytest.mark.slow
@pytest.mark.parametrize("after", [0.0, 0.2, 1.0])
def test_ctrl_c_ends_in_one_line_at_any_moment(after: float) -> None:
    """From when the package begins to load; no moment is too late for what takes ten seconds."""
    ready = [sys.executable, "-c", COMMAND, "paper", "--out", "out"]
    process = subprocess.Popen(
        ready, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heed_signals
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert err.startswith("slewctl: interrupted")
    assert err.count("\n") == 1
    assert not Path("out").exists()


# Where Python or a library lets no exception out, but goes on.
NOWHERE = {
    "weak reference": "found = weakref.ref(item := Item(), stop); del item",
    "finaliser": "Item.__del__ = stop; Item()",
    "callback of C": "ctypes.CFUNCTYPE(None)(stop)()",
    "collector": "gc.callbacks.append(stop); gc.collect(); gc.callbacks.clear()",
    # As a library of C may: nothing is printed either.
    "dropped": "exec('try: stop(); time.sleep(9)\\nexcept BaseException: pass')",
}
STOPPED = """
import ctypes, gc, os, signal, sys, time, weakref
sys.argv[0] = "bin/slewctl"
import slewctl.cli
class Item: pass
def stop(*_): os.kill(os.getpid(), signal.SIGINT)
def run():
    {}
    time.sleep(60)
slewctl.cli._run = run
slewctl.cli.main()
"""


@UNIX
@pytest.mark.parametrize("place", NOWHERE)
def test_ctrl_c_ends_in_one_line_at_any_place(place: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", STOPPED.format(NOWHERE[place])],
        capture_output=True, text=True, timeout=50, check=False, preexec_fn=heed_signals,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "slewctl: interrupted; no file was half-written\n"


def test_an_interruption_that_became_another_error_is_still_one() -> None:
    """Python 3.11 makes a RuntimeError of whatever comes out of a ``__set_name__``."""

    class Interrupted:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    with pytest.raises((RuntimeError, KeyboardInterrupt)) as caught:
        type("Owner", (), {"x": Interrupted()})
    assert of_an_interruption(caught.value)
    assert not of_an_interruption(ValueError("another"))
