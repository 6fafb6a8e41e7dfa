"""Children that heed Ctrl-C, which those of a shell in the background are told to ignore."""

from __future__ import annotations

import signal


def heed_signals() -> None:
    """Let SIGINT interrupt: to be called in a child before it becomes another program."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
