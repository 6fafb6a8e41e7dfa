"""What leaves slewctl, and comes back: controllers as data, to the last bit."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.export.formats import SUFFIXES, read_data, write_data
    from slewctl.export.toml import toml_text

__all__ = ["SUFFIXES", "read_data", "toml_text", "write_data"]

__getattr__, __dir__ = attach(__name__, __file__)
