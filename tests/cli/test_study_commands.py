"""``study`` and ``recommend`` as a user meets them: resumed, interrupted, refused, on a cluster."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import distributed
import pyarrow.parquet
import pytest
from command_line import slewctl

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


def files(folder: Path) -> dict[str, bytes]:
    """Return the files of a report, but for the results as they came."""
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.suffix != ".jsonl"}


def test_study_answers_and_goes_on_where_it_was(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = slewctl("study", study, "--out", out, "--workers", "1", "--parquet")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "The basis matters in " in done.stdout
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
    start = time.monotonic()
    resumed = slewctl("study", study, "--out", out, "--resume", "--parquet")
    assert resumed.stdout == done.stdout
    assert files(out) == before
    assert time.monotonic() - start < 60
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


@pytest.mark.slow
def test_an_interrupted_study_says_how_to_go_on_and_ends_the_same(
    study: Path, tmp_path: Path
) -> None:
    study.write_text(STUDY.replace("[1, 2]", "[1, 2, 3]").replace("[0.0, 1.0]", "[0.0, 0.3, 1.0]"))
    out, whole = tmp_path / "out", tmp_path / "whole"
    command = [sys.executable, "-m", "slewctl", "study", str(study), "--out", str(out)]
    process = subprocess.Popen(command, env=dict(os.environ), stderr=subprocess.PIPE)
    results = out / "results.jsonl"
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not (
        results.exists() and results.read_text().count("\n") > 3
    ):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"Traceback" not in errors
    assert b"go on with --resume" in errors
    assert not (out / "index.html").exists()
    assert slewctl("study", study, "--out", out, "--resume").returncode == 0
    assert slewctl("study", study, "--out", whole).returncode == 0
    assert files(out) == files(whole)


@pytest.mark.slow
def test_a_dask_cluster_makes_the_same_report(study: Path, tmp_path: Path) -> None:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        done = slewctl("study", study, "--out", tmp_path / "d", "--dask", cluster.scheduler_address)
        assert done.returncode == 0, done.stderr
    assert slewctl("study", study, "--out", tmp_path / "p").returncode == 0
    assert files(tmp_path / "d") == files(tmp_path / "p")


def test_a_cluster_that_is_not_there_is_told(study: Path, tmp_path: Path) -> None:
    done = slewctl("study", study, "--out", tmp_path / "out", "--dask", "nonsense")
    assert done.returncode == 2
    assert "--dask" in done.stderr
    assert "Traceback" not in done.stderr


def test_recommend_refuses_what_it_cannot_use(tmp_path: Path) -> None:
    for arguments, told in (
        (("paper-beam", "--sensors", "thet"), "did you mean 'theta'"),
        (("papr-beam",), "did you mean 'paper-beam'"),
        ((tmp_path / "none.toml",), "cannot be read"),
        ((tmp_path,), "cannot be read: Is a directory"),
    ):
        done = slewctl("recommend", *arguments)
        assert done.returncode == 2, arguments
        assert told in done.stderr, (arguments, done.stderr)


@pytest.mark.slow
def test_recommend_gives_its_evidence_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slewctl.compare.advice.BANDWIDTHS", (0.1,))
    monkeypatch.setattr("slewctl.compare.advice.ORDERS", (1, 2))
    done = slewctl("recommend", "quanser-flexible-link", "--json")
    assert done.returncode == 0, done.stderr
    advice = json.loads(done.stdout)
    assert advice["n"] in (1, 2)
    assert advice["damping"].startswith("0.01 (assumed: ")
    chosen = [t for t in advice["trials"] if (t["basis"], t["n"]) == (advice["basis"], advice["n"])]
    assert all(trial["accepted"] for trial in chosen)
