"""The command's door: Ctrl-C is understood while the packages are still loading.

This module stands outside the package because importing slewctl takes a second.
"""

from __future__ import annotations

import sys

_INTERRUPTED = 130


def main() -> None:
    """Load slewctl and run its command line."""
    try:
        from slewctl.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("slewctl: interrupted\n")
        sys.exit(_INTERRUPTED)
    run()
