"""The command line."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from io import TextIOWrapper
from typing import TYPE_CHECKING, NoReturn

from slewctl._interrupt import stop

if TYPE_CHECKING:
    import click

# The exit status of click for errors of usage.
BAD_INPUT = 2


def main() -> NoReturn:
    """Run the command line; a known error becomes one line and status 2."""
    try:
        # What takes a second to load is imported here, where a Ctrl-C is understood.
        sys.exit(_run())
    except KeyboardInterrupt:
        interrupted()
    except Exception as error:
        if of_an_interruption(error):
            interrupted()
        raise


def of_an_interruption(error: BaseException | None) -> bool:
    """Whether an error is what Python or a library made of a Ctrl-C that came into it.

    Python 3.11 turns every exception in a ``__set_name__`` into a RuntimeError.
    """
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def interrupted() -> NoReturn:
    """Say that the user has stopped it, and stop; a second Ctrl-C changes nothing.

    What had to be undone was undone on the way here.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # `stop` ends at once: what a pool of processes holds would be told as leaked.
    if (pools := sys.modules.get("multiprocessing.util")) is not None:
        pools._run_finalizers(0)
    stop("interrupted; no file was half-written")


def _run() -> int:
    # On matrices this small more threads only wait for each other, and the last digits of a
    # report would depend on their number.  Read when numpy and scipy are loaded, which is later.
    os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")

    from slewctl.cli.startup import begin_sooner

    begin_sooner()
    import click

    from slewctl.cli.commands import cli
    from slewctl.cli.terminal import ERR, silence
    from slewctl.errors import SlewctlError

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a terminal without N·m shows an escape instead
            stream.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            if not sys.warnoptions:  # who asks Python for warnings gets them
                warnings.simplefilter("ignore")
            return int(cli.main(prog_name="slewctl", standalone_mode=False) or 0)
    except click.ClickException as error:
        _misused(error)
    except SlewctlError as error:
        if of_an_interruption(error):
            raise KeyboardInterrupt from None
        ERR.tell(error)
    except OSError as error:  # such as to print to a full disk
        silence(sys.stdout)
        ERR.tell(f"input or output failed: {error.strerror or error}")
    except click.Abort:
        raise KeyboardInterrupt from None
    return BAD_INPUT


def _misused(error: click.ClickException) -> None:
    """Say what is wrong with the command, and where to read how it is used."""
    from slewctl.cli.terminal import ERR

    context = getattr(error, "ctx", None)
    if type(error).__name__ == "NoArgsIsHelpError":  # click's from 8.2 on
        ERR.text(error.format_message())
    elif context is None:
        ERR.tell(error.format_message())
    else:
        ERR.tell(f"{error.format_message()} See '{context.command_path} --help'.")
