"""Options of the paper's method."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ..common.checks import require_choice, require_count
from ..errors import InvalidArgument
from ..machine.description.mechanism import Mechanism
from ..machine.files.units import METRES
from ..options import Options

MOST_ERROR, OF_LENGTH, LARGEST_SHARE = 1e-5, 1e-4, 1e-3
"""E of the paper's passes: 0.01 mm [m]; where the machine's unit is no length, and at most, in small machines [L]."""


@dataclass(frozen=True)
class PassOptions(Options):
    """Options of `pfabrik.passes`, in addition to the fields of `pfabrik.Options`; the paper's by default.

    Attributes
    ----------
    tolerance : float, optional
        E, the largest distance of a chain's end from its target, and of an answer that is REACHED [length]. Default:
        0.01 mm in the machine's unit for "paper" and "extended", but at most 1e-3 L, and 1e-4 L where that unit is no
        length (m, dm, cm, mm, um, in, ft are); else 1e-9 L.
    method : {"paper", "extended", "accelerated", "centroid"}
        "paper", the passes of the paper's text and its projection to the centroid of the chains' ends; "extended",
        these with two rules of ours and another clamp (`extended`); "accelerated", closed-form intersections,
        half-spaces in place of points, and projection to the nearest pose in these; "centroid", the paper's projection
        alone, of targets that `solve_ik` does not reach, by least-squares fits, which are no passes, exact to rounding.
    max_iterations : int
        K, most iterations (forward and backward pass) of a chain for one target.
    max_rounds : int
        Most revisions of a target by the projection.
    """

    method: Literal["paper", "extended", "accelerated", "centroid"] = "paper"
    max_iterations: int = 100
    max_rounds: int = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.most_steps is not None:
            expected = "None: passes are bounded by max_iterations and max_rounds"
            raise InvalidArgument("options.most_steps", repr(self.most_steps), expected)
        require_choice("options.method", self.method, ("paper", "extended", "accelerated", "centroid"))
        for name in ("max_iterations", "max_rounds"):
            require_count(f"options.{name}", getattr(self, name))

    @classmethod
    def paper(cls) -> PassOptions:
        """Options of the paper's text: K = 100 and E = 0.01 mm.

        Every branch of a trunk counts in its mean. The cones of joints on the base, a trunk or a link restrict the
        outward pass alone, those of joints on the platform both. A clamp to a cone keeps the length of the segment.
        """
        return cls()

    @classmethod
    def extended(cls) -> PassOptions:
        """Options of the paper with two rules and a clamp that are ours, for machines with trunks and cones.

        A trunk goes to the mean of those branches that ask for a motion; cones restrict both passes; a clamp to a cone
        or a hinge's range takes the nearest vector there, which is shorter by the cosine of the turn.
        """
        return cls(method="extended")

    @classmethod
    def accelerated(cls) -> PassOptions:
        """Options of P-FABRIK with closed-form intersections and half-spaces, to the usual tolerances."""
        return cls(method="accelerated", max_rounds=200)

    @classmethod
    def centroid(cls) -> PassOptions:
        """Options for `solve_ik` within reach and the paper's projection beyond it, exact to rounding."""
        return cls(method="centroid", max_rounds=12)

    def of(self, mechanism: Mechanism) -> PassOptions:
        """The options with the tolerance that E has in the unit of a machine."""
        if self.tolerance is not None or self.method not in ("paper", "extended"):
            return self
        length, metres = mechanism.characteristic_length, METRES.get(mechanism.length_unit)
        error = MOST_ERROR / metres if metres else OF_LENGTH * length
        return replace(self, tolerance=min(error, LARGEST_SHARE * length))


PAPER = PassOptions.paper()
