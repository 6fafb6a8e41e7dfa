"""The command line."""

import os
import sys
from io import TextIOWrapper

import click
from threadpoolctl import threadpool_limits

from slewctl.cli.commands import cli
from slewctl.cli.terminal import ERR
from slewctl.errors import SlewctlError

BAD_INPUT = 2
INTERRUPTED = 130


def main() -> None:
    """Run the command line; a known error becomes one line and status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a terminal without N·m shows an escape instead
            stream.reconfigure(errors="backslashreplace")
    try:
        # On matrices this small more threads only wait for each other, and the last digits of
        # a report would depend on their number.
        with threadpool_limits(1):
            status = cli.main(prog_name="slewctl", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except SlewctlError as error:
        ERR.print(f"slewctl: {error}", soft_wrap=True)
        sys.exit(BAD_INPUT)
    except OSError as error:
        sys.exit(_refused(error))
    except (KeyboardInterrupt, click.Abort):
        ERR.print("slewctl: interrupted; no file was half-written")
        sys.exit(INTERRUPTED)
    sys.exit(status or 0)


def _refused(error: OSError) -> int:
    """Say what the system refused, such as to print to a full disk; return the status."""
    # Python would try again at exit to write what it still holds.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    ERR.print(f"slewctl: input or output failed: {error.strerror or error}", soft_wrap=True)
    return BAD_INPUT
