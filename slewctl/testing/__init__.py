"""For the tests of a control project: margins asserted, and design files collected by pytest."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.testing.assertions import assert_margins

__all__ = ["assert_margins"]

__getattr__, __dir__ = attach(__name__, __file__)
