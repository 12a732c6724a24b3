"""What the benchmarks take from the folder `paper` beside them, which is not installed: its yardstick, and one core."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from paper import geometric
from paper.timing import one_core

__all__ = ["geometric", "one_core"]
