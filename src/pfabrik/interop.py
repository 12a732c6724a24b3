"""Mechanisms from and for other programs: the public names of `pfabrik.interop`."""

from .exchange.interop import *  # noqa: F403
from .exchange.interop import __all__ as __all__
