"""The command line, run in this process."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

from slewctl.cli import main


def slewctl(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in this process; an error that escapes it fails the test."""
    command = ["slewctl", *map(str, arguments)]
    out, err, status = io.StringIO(), io.StringIO(), 0
    with patch.object(sys, "argv", command), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as stopped:
            status = int(str(stopped.code))
    return subprocess.CompletedProcess(command, status, out.getvalue(), err.getvalue())
