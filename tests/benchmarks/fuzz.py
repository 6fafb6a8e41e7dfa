"""Thousands of mistaken files through the reader and every command, and what became of them.

Run as ``python tests/benchmarks/fuzz.py [times] [seed] [command …]``: `times` as many files as
`FILES` names, ten by default.  What should not have been is told once for each kind, with the
number of files and one of them, which is kept in the folder that the last line names.
"""

from __future__ import annotations

import random
import re
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).parents[1] / "cli"))
from guarded_run import LIMITS_S, guarded_run
from mutated_files import QUICK, STUDY, mutated, small_designs, toml

from slewctl.compare.study import recommend
from slewctl.errors import SlewctlError
from slewctl.files import read_design

FILES = {"reader": 2000, **dict.fromkeys(LIMITS_S, 20), "check": 200}


def read(text: str, folder: Path) -> tuple[str, tuple[str, ...]]:
    """Read a design file; return what became of it, and what should not have been."""
    path = folder / "mistaken.toml"
    path.write_text(text, encoding="utf-8")
    try:
        read_design(path)
    except SlewctlError as error:
        told = str(error)
        faults = [
            f"no file named: {line[:200]}" for line in told.split("\n") if str(path) not in line
        ]
        if len(told) > 5000:
            faults.append(f"endless message: {len(told)} characters")
        return "refused", tuple(faults)
    except Exception as error:  # noqa: BLE001 -- whatever escapes is what is looked for
        return "escaped", (f"traceback: {type(error).__name__}: {str(error)[:200]}",)
    return "read", ()


def kind_of(fault: str, folder: str) -> str:
    """Return a fault without the numbers and names that differ from file to file."""
    plain = fault.replace(folder, "").split("; known:")[0]
    return re.sub(r"[\d.]+(e[+-]?\d+)?", "#", plain)[:120]


def fuzz(command: str, count: int, seed: int, kept: Path) -> None:
    """Run a command on so many files and print what was found."""
    rng, found = random.Random(f"{command} {seed}"), Counter[str]()
    ready = small_designs()
    bases = [STUDY] if command == "study" else [ready[number] for number in QUICK]
    kinds: dict[str, list[str]] = {}
    start, longest = time.process_time(), 0.0
    for _ in range(count):
        text = toml(mutated(rng.choice(bases), rng.choice))
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            if command == "reader":
                status, faults = read(text, Path(folder))
            else:
                run = guarded_run(command, text, Path(folder))
                status, faults = f"status {run.status}", run.faults
        longest = max(longest, time.monotonic() - begun)
        found[status] += 1
        found["with a fault"] += bool(faults)
        for fault in faults:
            key = kind_of(fault, folder)
            kinds.setdefault(key, []).append(fault)
            if len(kinds[key]) == 1:
                (kept / f"{command}-{len(kinds)}.toml").write_text(text, encoding="utf-8")
    told = ", ".join(f"{name} {number}" for name, number in sorted(found.items()))
    print(f"{command}: {count} files, {told}; {time.process_time() - start:.0f} s of CPU, "
          f"the longest {longest:.1f} s", flush=True)  # fmt: skip
    for place, (_, faults) in enumerate(kinds.items(), start=1):
        print(f"  {len(faults):5} × {faults[0][:240]} [{command}-{place}.toml]", flush=True)


def main() -> None:
    """Print what was found."""
    times = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    kept = Path(tempfile.mkdtemp(prefix="slewctl-fuzz-"))
    with patch.object(recommend, "ORDERS", (1, 2)), patch.object(recommend, "BANDWIDTHS", (0.3,)):
        for command in sys.argv[3:] or FILES:
            fuzz(command, round(times * FILES[command]), seed, kept)
    print(f"one file of each kind is in {kept}")


if __name__ == "__main__":
    main()
