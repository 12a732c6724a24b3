"""Options of the paper's method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..common.checks import require_choice, require_count
from ..errors import InvalidArgument
from ..options import Options


@dataclass(frozen=True)
class PassOptions(Options):
    """Options of `pfabrik.passes`, in addition to the fields of `pfabrik.Options`.

    Attributes
    ----------
    method : {"plain", "accelerated", "centroid"}
        "plain", the paper's passes and its projection to the centroid of the chains' ends; "accelerated", closed-form
        intersections, half-spaces in place of points, and projection to the nearest pose in these; "centroid", the
        paper's projection alone, of targets that `solve_ik` does not reach, exact to rounding.
    max_iterations : int
        K, most iterations (forward and backward pass) of a chain for one target.
    max_rounds : int
        Most revisions of a target by the projection.
    """

    method: Literal["plain", "accelerated", "centroid"] = "plain"
    max_iterations: int = 100
    max_rounds: int = 12

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.most_steps is not None:
            expected = "None: passes are bounded by max_iterations and max_rounds"
            raise InvalidArgument("options.most_steps", repr(self.most_steps), expected)
        require_choice("options.method", self.method, ("plain", "accelerated", "centroid"))
        for name in ("max_iterations", "max_rounds"):
            require_count(f"options.{name}", getattr(self, name))

    @classmethod
    def paper(cls) -> PassOptions:
        """Options of the paper: K = 100 and E = 1e-2 [length]."""
        return cls(tolerance=1e-2, max_rounds=1000)

    @classmethod
    def accelerated(cls) -> PassOptions:
        """Options of P-FABRIK with closed-form intersections and half-spaces, to the usual tolerances."""
        return cls(method="accelerated", max_rounds=200)

    @classmethod
    def centroid(cls) -> PassOptions:
        """Options for `solve_ik` within reach and the paper's projection beyond it, exact to rounding."""
        return cls(method="centroid")
