"""What the benchmarks take from folders beside them, which are not installed: the yardstick, one core, kernels."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from paper import geometric
from paper.timing import one_core
from tools.kernels.on_call import kernel, routine

__all__ = ["geometric", "kernel", "one_core", "routine"]
