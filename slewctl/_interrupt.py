"""Ctrl-C ends the command line, whatever it comes into: one line, and nothing is printed beside it.

While the packages are still loading, which takes a second, an exception hook says the line.
Later too an interruption may come into a function from which Python lets no exception out, such
as a callback of a weak reference (every import has one), of ctypes, or a ``__del__``: Python would
print a traceback there and go on as if nothing had happened.  Or it comes into a library of C
that drops every error, and is gone without a word.  Such an interruption is raised again.

Loaded first of all.  In a program that only imports slewctl it does nothing.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
import weakref
from types import TracebackType
from typing import NoReturn

# The exit status of a shell: 128 + SIGINT.
_INTERRUPTED = 130
# Seconds until an interruption that went nowhere is raised again, elsewhere.
_LATER = 0.01


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
    stop()


def stop(told: str = "interrupted") -> NoReturn:
    """Say it in one line and leave, whatever state the process is in.

    What was being loaded is left as it is: to load it again, or to let Python take down what is
    half-loaded, makes libraries of C complain or crash.
    """
    try:
        sys.stderr.write(f"slewctl: {told}\n")
        sys.stderr.flush()
        sys.stdout.flush()
    finally:
        os._exit(_INTERRUPTED)


class _Interruption(KeyboardInterrupt):
    """Of which a weak reference tells whether it is still on its way."""


def _interrupting(_: int, __: object) -> NoReturn:
    error = _Interruption()
    there = weakref.ref(error)

    def look() -> None:
        """Interrupt once more if the error has vanished, and nobody is ending the command."""
        while signal.getsignal(signal.SIGINT) is _interrupting:
            time.sleep(_LATER)
            if there() is None:
                _interrupt_main()
                return

    # No `threading.Thread`: what was interrupted may hold its lock.
    _thread.start_new_thread(look, ())
    try:
        raise error
    finally:
        del error  # or its own traceback would keep it


def _again(caught: sys.UnraisableHookArgs) -> None:
    """Raise an interruption once more that came where it could not end anything."""
    error = caught.exc_value
    if not isinstance(error, KeyboardInterrupt):
        sys.__unraisablehook__(caught)
        return
    if sys.is_finalizing():  # Python itself ends, and nothing is raised any more
        stop()

    def raising(_: int, __: object) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not disturb the end
        raise error

    signal.signal(signal.SIGINT, raising)
    later = threading.Timer(_LATER, _interrupt_main)
    later.daemon = True
    later.start()


def _interrupt_main() -> None:
    """Interrupt the main thread, even where it only waits."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()


if _is_command():
    sys.excepthook = _end
    sys.unraisablehook = _again
    # Who has the command ignore Ctrl-C, as nohup does, is heeded.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupting)
