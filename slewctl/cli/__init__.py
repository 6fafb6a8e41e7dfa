"""The command line."""

import sys

import click

from slewctl.cli.commands import cli
from slewctl.cli.terminal import ERR
from slewctl.errors import SlewctlError

BAD_INPUT = 2
INTERRUPTED = 130


def main() -> None:
    """Run the command line; a known error becomes one line and status 2."""
    try:
        status = cli.main(prog_name="slewctl", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except SlewctlError as error:
        ERR.print(f"slewctl: {error}", soft_wrap=True)
        sys.exit(BAD_INPUT)
    except (KeyboardInterrupt, click.Abort):
        ERR.print("slewctl: interrupted; no file was half-written")
        sys.exit(INTERRUPTED)
    sys.exit(status or 0)
