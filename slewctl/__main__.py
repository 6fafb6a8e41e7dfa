"""``python -m slewctl`` is the command line."""

from slewctl.cli import main

main()
