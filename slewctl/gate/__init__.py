"""The gate: design files in, findings out; a broken file hides nothing of the others."""

from slewctl.gate.fingerprint import version
from slewctl.gate.run import check_designs, check_file, examine, skip_unchanged

__all__ = [
    "check_designs",
    "check_file",
    "examine",
    "skip_unchanged",
    "version",
]
