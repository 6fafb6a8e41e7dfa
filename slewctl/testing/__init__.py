"""For the tests of a control project: margins asserted, and design files collected by pytest."""

from slewctl.testing.assertions import assert_margins

__all__ = ["assert_margins"]
