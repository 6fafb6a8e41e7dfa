"""``study`` and ``recommend`` as a user meets them: resumed, interrupted, refused, on a cluster."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir

import distributed
import psutil
import pyarrow.parquet
import pytest
from command_line import slewctl
from heed_signals import heed_signals
from held_study import GO_ON, LINES, RESULTS

STUDY = """\
title = "Two bases"
[arm]
catalogue = "paper-beam"
[truth]
modes = 6
[[grid]]
bases = ["clamped-free", "slewing"]
orders = [1, 2]
hub_ratios = [0.0, 1.0]
[[grid]]
bases = ["balanced-truncation"]
orders = [1, 2]
hub_ratios = [0.0, 1.0]
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "two-bases.toml"
    path.write_text(STUDY)
    return path


@pytest.fixture
def in_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a study that the command runs in this process work in threads: none has to start."""
    monkeypatch.setattr("slewctl.compare.study.sweep.Processes", ThreadPoolExecutor)


def files(folder: Path) -> dict[str, bytes]:
    """Return the files of a report, but for the results as they came."""
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.suffix != ".jsonl"}


@pytest.mark.slow
def test_maps_are_drawn_of_the_slice_that_is_named(
    study: Path, tmp_path: Path, in_threads: None
) -> None:
    out = tmp_path / "out"
    early = slewctl("study", str(study), "--out", str(out), "--slice", "sensors=theta")
    assert "--slice is for a study that is done; add --resume" in early.stderr
    named = ("study", str(study), "--out", str(out), "--resume", "--slice")
    assert slewctl(*named, "sensors").stderr == (
        "slewctl: --slice sensors: no value; as in sensors=0.1\n"
    )
    wrong = slewctl(*named, "basis=slewing")
    assert wrong.returncode == 2
    assert "--slice: unknown name 'basis'" in wrong.stderr
    assert not out.exists()
    assert slewctl("study", str(study), "--out", str(out), "--workers", "1").returncode == 0
    none = slewctl("study", str(study), "--out", str(out), "--resume", "--slice", "bandwidth=9")
    assert none.returncode == 2
    assert "--slice: no slice has bandwidth = '9'; there are " in none.stderr
    done = slewctl("study", str(study), "--out", str(out), "--resume", "--slice", "method=lqg")
    assert done.returncode == 0
    assert '<figure class="map">' in (out / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.usefixtures("in_threads")
def test_study_answers_and_goes_on_where_it_was(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = slewctl("study", study, "--out", out, "--workers", "1", "--parquet")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "the basis matters: " in done.stdout
    assert set(files(out)) == {
        "index.html", "index.md", "results.json", "rows.csv.gz", "rows.parquet"
    }  # fmt: skip
    table = pyarrow.parquet.read_table(out / "rows.parquet")
    assert table.num_rows == 12
    assert "## " in (out / "index.md").read_text()
    again = slewctl("study", study, "--out", out)
    assert again.returncode == 2
    assert "go on with it by --resume, or remove it" in again.stderr
    before = files(out)
    with pytest.MonkeyPatch.context() as patch:  # no design is tried a second time
        patch.setattr("slewctl.compare.study.point.evaluate_point", pytest.fail)
        resumed = slewctl("study", study, "--out", out, "--resume", "--parquet")
    assert resumed.stdout == done.stdout
    assert resumed.stderr == ""
    assert files(out) == before
    results = out / "results.jsonl"
    lines = results.read_text().splitlines(keepends=True)
    results.write_text("".join([*lines[:3], "null\n", *lines[4:-1]]))
    mended = slewctl("study", study, "--out", out, "--resume", "--parquet", "--workers", "1")
    assert mended.stderr == f"slewctl: {results}:4: damaged; what it told is done again\n"
    assert mended.stdout == done.stdout
    assert files(out) == before
    # A larger grid under another title is the same study: what was tried is not tried again.
    larger = STUDY.replace("orders = [1, 2]", "orders = [1, 2, 3]").replace("Two", "More")
    study.write_text(larger)
    grown = slewctl("study", study, "--out", out, "--resume", "--workers", "1", "--parquet")
    assert grown.returncode == 0, grown.stderr
    assert set(lines) <= set(results.read_text().splitlines(keepends=True))
    assert pyarrow.parquet.read_table(out / "rows.parquet").num_rows == 18
    study.write_text(STUDY.replace("modes = 6", "modes = 7"))
    other = slewctl("study", study, "--out", out, "--resume")
    assert "results of another study or version" in other.stderr


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("orders = [1, 2]", "orders = [1, 4]", "truth.modes: a truth of 6 modes"),
        ("orders = [1, 2]", "orders = []", "grid.0.orders"),
        ("orders = [1, 2]", "order = [1, 2]", "did you mean 'orders'"),
        ('"slewing"]', '"slewin"]', "did you mean 'slewing'"),
        ("hub_ratios = [0.0, 1.0]", "hub_ratios = [-1.0]", "grid.0.hub_ratios"),
        ("hub_ratios = [0.0, 1.0]", 'sensors = [["tipp"]]', "unknown name 'tipp'"),
        ("hub_ratios = [0.0, 1.0]", "bandwidths = [nan]", "grid.0.bandwidths"),
    ],
)
def test_impossible_studies_are_refused_with_their_key(
    study: Path, tmp_path: Path, old: str, new: str, told: str
) -> None:
    study.write_text(STUDY.replace(old, new, 1))
    done = slewctl("study", study, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert f"slewctl: {study}:" in done.stderr
    assert told in done.stderr
    assert done.stderr.count("\n") <= 2
    assert not (tmp_path / "out").exists()


def test_parquet_is_refused_before_the_work(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slewctl.report.export.find_spec", lambda _: None)
    done = slewctl("study", study, "--out", tmp_path / "out", "--parquet")
    assert done.returncode == 2
    assert "pip install 'slewctl[parquet]'" in done.stderr
    assert not (tmp_path / "out").exists()


HELD = "import sys; sys.argv[0] = 'bin/slewctl'; from held_study import run; run()"


class Running:
    """A study in a process of its own, which leads a group as that of a terminal does.

    It stands still when its results have so many lines, the first of which is their head.
    """

    def __init__(
        self, study: Path, out: Path, *options: str, lines: int, stderr: int = subprocess.PIPE
    ) -> None:
        self.results, self.lines = out / "results.jsonl", lines
        self.process = subprocess.Popen(
            [sys.executable, "-c", HELD,
             "study", str(study), "--out", str(out), *options],
            stderr=stderr, start_new_session=True, preexec_fn=heed_signals,
            env={**os.environ, RESULTS: str(self.results), LINES: str(lines),
                 "PYTHONPATH": os.pathsep.join((str(Path(__file__).parent), *sys.path))},
        )  # fmt: skip

    def wait(self) -> None:
        """Wait for the lines."""
        deadline = time.monotonic() + 120
        while not (self.results.exists() and self.results.read_bytes().count(b"\n") >= self.lines):
            assert time.monotonic() < deadline
            assert self.process.poll() is None
            time.sleep(0.02)

    def end(self, number: int) -> str:
        """Return what the study says when a signal ends it, and every process of it."""
        family = psutil.Process(self.process.pid).children(recursive=True)
        (os.killpg if number == signal.SIGINT else os.kill)(self.process.pid, number)
        _, errors = self.process.communicate(timeout=60)
        _, alive = psutil.wait_procs(family, timeout=30)
        assert not alive
        return (errors or b"").decode()


@pytest.mark.slow
@pytest.mark.usefixtures("in_threads")
def test_an_ended_study_says_how_to_go_on_and_ends_the_same(study: Path, tmp_path: Path) -> None:
    out, whole = tmp_path / "out", tmp_path / "whole"
    lines = 1
    for number, options in (
        (signal.SIGINT, ["--workers", "2"]),
        (signal.SIGTERM, ["--workers", "1", "--resume"]),
    ):
        running = Running(study, out, *options, lines=lines + 2)
        running.wait()
        told = running.end(number)
        assert "Traceback" not in told
        assert running.process.returncode == 128 + number
        assert told == (
            f"slewctl: interrupted; what was finished is in {running.results}: "
            "go on with --resume\n"
        )
        assert not (out / "index.html").exists()
        before, lines = lines, running.results.read_bytes().count(b"\n")
        assert lines >= before + 2
    assert slewctl("study", study, "--out", out, "--resume").returncode == 0
    assert slewctl("study", study, "--out", whole).returncode == 0
    assert files(out) == files(whole)


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.0, 0.9])
def test_an_interruption_while_workers_start_is_one_line(
    study: Path, tmp_path: Path, delay: float
) -> None:
    """Or while they have work: no delay is too long, or the one that a machine needs."""
    running = Running(study, tmp_path / "out", "--workers", "1", lines=1)
    running.wait()
    time.sleep(delay)
    assert running.end(signal.SIGINT).count("\n") == 1
    assert running.process.returncode == 130


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device")
def test_a_full_standard_error_does_not_change_the_status(study: Path, tmp_path: Path) -> None:
    with open("/dev/full", "wb") as full:
        running = Running(study, tmp_path / "out", "--workers", "1", lines=1, stderr=full.fileno())
        running.wait()
        running.end(signal.SIGTERM)
    assert running.process.returncode == 128 + signal.SIGTERM


def test_signals_mean_after_a_study_what_they_meant_before(study: Path, tmp_path: Path) -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    (tmp_path / "out").write_text("")
    assert slewctl("study", study, "--out", tmp_path / "out" / "deep").returncode == 2
    assert [signal.getsignal(number) for number in numbers] == before


def test_a_study_of_too_many_designs_is_refused_at_once(study: Path, tmp_path: Path) -> None:
    ratios = str([k / 7 for k in range(3000)])
    study.write_text(STUDY.replace("[0.0, 1.0]", ratios + "\npayload_ratios = " + ratios, 1))
    done = slewctl("study", study, "--out", tmp_path / "out")
    assert done.returncode == 2
    told = ": grid.0: 36,000,000 designs are too many for a study; keep at most 1,000,000"
    assert told in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
@pytest.mark.usefixtures("in_threads")
def test_a_dask_cluster_makes_the_same_report(study: Path, tmp_path: Path) -> None:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=True, dashboard_address=None
    ) as cluster:
        done = slewctl("study", study, "--out", tmp_path / "d", "--dask", cluster.scheduler_address)
        assert done.returncode == 0, done.stderr
    assert slewctl("study", study, "--out", tmp_path / "p").returncode == 0
    assert files(tmp_path / "d") == files(tmp_path / "p")


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("nonsense", "no Dask scheduler answers at 'nonsense'"),
        ("", "no Dask scheduler answers at ''"),
        ("inproc://x", "no Dask scheduler answers at 'inproc://x'"),
        ("tls://127.0.0.1:9", "distributed.comm.tls"),
    ],
)
def test_a_cluster_that_is_not_there_is_told(
    study: Path, tmp_path: Path, address: str, told: str
) -> None:
    done = slewctl("study", study, "--out", tmp_path / "out", "--dask", address)
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.count("\n") == 1


def test_dask_is_an_extra_that_is_named(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = slewctl("study", study, "--out", tmp_path / "out", "--dask", "tcp://a:1")
    assert done.returncode == 2
    assert done.stderr == "slewctl: --dask: Dask is not installed; pip install 'slewctl[dask]'\n"


def test_workers_of_a_cluster_are_not_counted_here(study: Path, tmp_path: Path) -> None:
    done = slewctl("study", study, "--out", tmp_path, "--dask", "tcp://a:1", "--workers", "2")
    assert done.returncode == 2
    assert "--dask has its own workers" in done.stderr


@contextmanager
def dask(
    kind: str, *arguments: str, path: Sequence[Path] = (), **environment: str
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a scheduler or a worker, with folders before all others on its path."""
    process = subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *arguments],
        env={**os.environ, **environment,
             "PYTHONPATH": os.pathsep.join([*map(str, path), *sys.path])},
        cwd=gettempdir(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.terminate()
        process.wait(30)


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A scheduler and its address."""
    file = tmp_path / "scheduler.json"
    with dask(
        "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)
    ) as process:
        deadline = time.monotonic() + 60
        while not (file.exists() and file.read_text().endswith("}")):  # it may be half-written
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield process, json.loads(file.read_text())["address"]


def alone(address: str) -> tuple[str, ...]:
    """Return the arguments of a worker that no second process watches over."""
    return address, "--nthreads", "1", "--no-nanny"


def started(address: str) -> None:
    """Wait for a worker."""
    with distributed.Client(address, set_as_default=False) as client:
        client.wait_for_workers(1, timeout=60)


@pytest.mark.slow
def test_clusters_that_cannot_do_the_work_are_refused(
    study: Path, tmp_path: Path, scheduler: tuple[subprocess.Popen[bytes], str]
) -> None:
    """Without a hang, and before a worker is lost to it."""
    _, address = scheduler
    command = ("study", study, "--out", tmp_path / "out", "--dask", address)
    done = slewctl(*command)
    assert done.returncode == 2
    assert f"has no worker; start one: dask worker {address}" in done.stderr
    (tmp_path / "bad/slewctl").mkdir(parents=True)
    (tmp_path / "bad/slewctl/__init__.py").write_text("raise ImportError('not here')")
    (tmp_path / "old/scipy-1.0.0.dist-info").mkdir(parents=True)
    (tmp_path / "old/scipy-1.0.0.dist-info/METADATA").write_text(
        "Metadata-Version: 2.1\nName: scipy\nVersion: 1.0.0\n"
    )
    for folder, told in (("bad", "cannot import slewctl"), ("old", "has scipy 1.0.0 (here ")):
        with dask("worker", *alone(address), path=[tmp_path / folder]) as worker:
            started(address)
            done = slewctl(*command)
            assert worker.poll() is None
        assert done.returncode == 2
        assert told in done.stderr
        assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("in_threads")
def test_a_scheduler_that_dies_is_told_and_costs_nothing_finished(
    study: Path, tmp_path: Path, scheduler: tuple[subprocess.Popen[bytes], str]
) -> None:
    process, address = scheduler
    out, whole = tmp_path / "out", tmp_path / "whole"
    held = {RESULTS: str(out / "results.jsonl"), LINES: "4"}
    with dask("worker", *alone(address), path=[Path(__file__).parent], **held):
        running = Running(study, out, "--dask", address, lines=4)
        running.wait()
        process.kill()
        _, errors = running.process.communicate(timeout=100)
        (out / GO_ON).touch()
    (out / GO_ON).unlink()
    assert running.process.returncode == 2
    assert errors.decode().count("\n") == 1
    assert "go on with --resume" in errors.decode()
    assert slewctl("study", study, "--out", out, "--resume").returncode == 0
    assert slewctl("study", study, "--out", whole).returncode == 0
    assert files(out) == files(whole)


def test_recommend_refuses_what_it_cannot_use(tmp_path: Path) -> None:
    for arguments, told in (
        (
            ("paper-beam", "--sensors", "thet"),
            "slewctl: --sensors: unknown name 'thet'; did you mean 'theta'",
        ),
        (("papr-beam",), "did you mean 'paper-beam'"),
        ((tmp_path / "none.toml",), "cannot be read"),
        ((tmp_path,), "cannot be read: Is a directory"),
    ):
        done = slewctl("recommend", *arguments)
        assert done.returncode == 2, arguments
        assert told in done.stderr, (arguments, done.stderr)


@pytest.mark.slow
def test_recommend_gives_its_evidence_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slewctl.compare.study.recommend.BANDWIDTHS", (0.1,))
    monkeypatch.setattr("slewctl.compare.study.recommend.ORDERS", (1, 2))
    done = slewctl("recommend", "quanser-flexible-link", "--json")
    assert done.returncode == 0, done.stderr
    advice = json.loads(done.stdout)
    assert advice["n"] in (1, 2)
    assert advice["damping"].startswith("0.01 (assumed: ")
    chosen = [t for t in advice["trials"] if (t["basis"], t["n"]) == (advice["basis"], advice["n"])]
    assert all(trial["accepted"] for trial in chosen)
