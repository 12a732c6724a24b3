"""Kernels, which are a subset of Python, as C99: what they may use is in docs/subset.md."""

from .program import Program as Program
from .types import Unsupported as Unsupported
