"""What it costs to begin: CPU seconds of imports and commands, over those of their peers.

Run as ``python tests/benchmarks/startup.py [OTHER_CHECKOUT]``; each is run five times in turn
and the least is told.  Another checkout, such as an older version, stands beside.  Both are
compiled once, as installed packages are, whatever Python is told to leave behind elsewhere.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = """
import slewctl as sc
arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
o = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1})
K = sc.lqg(sc.generalised_plant(sc.assemble(arm, sc.ClampedFree(2)), o))
print(sc.close(sc.truth(arm), o, K).describe())
"""
DESIGN = "designs/01-paper-beam.toml"
PEERS = {"import click": ["-c", "import click"], "import control": ["-c", "import control"]}
OURS = {
    "import slewctl": ["-c", "import slewctl"],
    "slewctl --help": ["-m", "slewctl", "--help"],
    "a usage error": ["-m", "slewctl", "check", "--nope"],
    "a design script": ["-c", SCRIPT],
    "slewctl modes": ["-m", "slewctl", "modes", DESIGN],
    "slewctl check": ["-m", "slewctl", "check", DESIGN],
}
ROUNDS = 5


def environment(checkout: Path, compiled: str) -> dict[str, str]:
    """Of a run: one thread, the package of a checkout, and where its compiled modules are."""
    own = {
        "PYTHONPATH": str(checkout),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPYCACHEPREFIX": compiled,
    }
    return {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | own


def seconds(arguments: list[str], checkout: Path, compiled: str) -> float:
    """CPU seconds of one run."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *arguments],
        cwd=checkout,
        env=environment(checkout, compiled),
        capture_output=True,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(other: Path | None) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as compiled:
        measure(other, compiled)


def measure(other: Path | None, compiled: str) -> None:
    """Print the table, with compiled modules in a folder."""
    peers = {n: min(seconds(a, ROOT, compiled) for _ in range(ROUNDS)) for n, a in PEERS.items()}
    for name, value in peers.items():
        print(f"{name:<18}{value:6.2f} s")
    for name, arguments in OURS.items():
        own, old = [], []
        for _ in range(ROUNDS):
            own.append(seconds(arguments, ROOT, compiled))
            if other is not None:
                old.append(seconds(arguments, other, compiled))
        ratios = "  ".join(f"{min(own) / value:.2f} x {peer}" for peer, value in peers.items())
        beside = f"  {min(own) / min(old):.2f} x {other}" if old else ""
        print(f"{name:<18}{min(own):6.2f} s  {ratios}{beside}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
