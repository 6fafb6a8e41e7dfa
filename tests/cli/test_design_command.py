"""The command that writes a controller."""

from __future__ import annotations

from pathlib import Path

from command_line import slewctl as command

import slewctl as sc


def test_design_writes_the_controller(tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    path.write_text(
        '[arm]\ncatalogue = "quanser-flexible-link"\n[controller]\nmethod = "given"\n'
        'pid = { kp = 14.0, kd = 0.6, filter_hz = 40.0 }\noutput = "voltage"\n'
    )
    out = tmp_path / "k.npz"
    run = command("design", str(path), "--out", str(out))
    assert run.returncode == 0, run.stderr
    K = sc.given(file=out)
    assert K.sensors == ("theta",)
    assert K.linear.output_labels == ("voltage",)
    wrong = command("design", str(path), "--out", str(tmp_path / "k.txt"))
    assert wrong.returncode == 2
    assert "unknown ending" in wrong.stderr
