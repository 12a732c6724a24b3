"""Options of the paper's method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..checks import require_choice, require_count
from ..errors import InvalidArgument
from ..options import Options


@dataclass(frozen=True)
class PassOptions(Options):
    """How `pfabrik.passes` works; further fields are those of `pfabrik.Options`.

    Attributes
    ----------
    method : "plain", the paper's passes and its projection to the centroid of the chains' ends; "accelerated", exact
        meetings, half-spaces in place of points, and a projection to where these hold, as near as it can be;
        "centroid", the paper's projection alone, of targets that `solve_ik` does not reach, exact to rounding.
    max_iterations : K, forward and backward passes a chain may take for one target.
    max_rounds : how often the projection may revise a target.
    """

    method: Literal["plain", "accelerated", "centroid"] = "plain"
    max_iterations: int = 100
    max_rounds: int = 12

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.most_steps is not None:
            found, expected = repr(self.most_steps), "None: passes are bounded by max_iterations and max_rounds"
            raise InvalidArgument("options.most_steps", found, expected)
        require_choice("options.method", self.method, ("plain", "accelerated", "centroid"))
        for name in ("max_iterations", "max_rounds"):
            require_count(f"options.{name}", getattr(self, name))

    @classmethod
    def paper(cls) -> PassOptions:
        """The paper's K = 100 and E = 1e-2 [length]."""
        return cls(tolerance=1e-2, max_rounds=1000)

    @classmethod
    def accelerated(cls) -> PassOptions:
        """P-FABRIK with exact meetings and half-spaces, to the usual tolerances."""
        return cls(method="accelerated", max_rounds=200)

    @classmethod
    def centroid(cls) -> PassOptions:
        """The usual answers within reach, and the paper's projection beyond it, finished exactly."""
        return cls(method="centroid")
