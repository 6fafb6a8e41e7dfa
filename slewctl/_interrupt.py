"""The command line while its packages are still loading, which takes a second: Ctrl-C ends it.

Loaded first of all.  In a program that only imports slewctl it does nothing.
"""

from __future__ import annotations

import os
import sys
from types import TracebackType

# The exit status of a shell: 128 + SIGINT.
_INTERRUPTED = 130


def _is_command() -> bool:
    """Return whether this process is the command ``slewctl``, or ``python -m slewctl``."""
    name = sys.argv[0] if sys.argv else ""
    if name == "-m":  # so it is called until the module is found
        return sys.orig_argv[sys.orig_argv.index("-m") + 1 :][:1] == ["slewctl"]
    return os.path.splitext(os.path.basename(name))[0] == "slewctl"


def _end(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)
        return
    try:
        sys.stderr.write("slewctl: interrupted\n")
        sys.stderr.flush()
    finally:
        os._exit(_INTERRUPTED)


if _is_command():
    sys.excepthook = _end
