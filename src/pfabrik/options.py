"""Options of questions: tolerances, iterations, the working mode, what projections keep, and what wrong rows do."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Literal

from .checks import require_positive
from .errors import InvalidArgument, UnknownName
from .tolerances import TOLERANCES

_CHOICES: dict[str, tuple[object, ...]] = {
    "working_mode": (None, "any", "keep"),
    "hold": (None, "orientation", "position"),
    "projection": ("nearest", "centroid"),
    "passes": ("plain", "accelerated"),
    "on_invalid": ("raise", "mark"),
}


@dataclass(frozen=True)
class Options:
    """How `solve_ik` and `track` work, and `solve_fk`, for which only `working_mode` and the last two count.

    Attributes
    ----------
    tolerance : E, how close the end effector must come to be REACHED [length]; None is 1e-9 of the mechanism's
        characteristic length.
    rotation_tolerance : the same for the orientation [rad].
    max_iterations : K, forward and backward passes a chain may take for one target; of the paper's method alone.
    max_rounds : how often its projection may revise a target.
    working_mode : "keep" stays in the start's working mode (home's without a start), "any" may change it to reach;
        None keeps it if there is a start. `solve_fk` keeps the assembly mode, of home too, but with "any".
    hold : what a projection keeps: "orientation" (the paper's choice) or "position" if a feasible pose has it that is
        not much farther from the target than the start, None nothing. `Solution.held` tells what was kept.
    projection : which feasible pose answers a target that is not reached: the "nearest" that local searches from
        several starts find; or the "centroid" of where the chains end, which is the paper's, where joint positions
        express the mechanism.
    rotation_length : how a rotation counts beside a distance: by the angle times this [length per rad], in
        sqrt(distance^2 + (rotation_length angle)^2). None is `Mechanism.rotation_length`.
    exact : True for answers as exact as can be; False for passes and their projection alone, which end within
        `tolerance`; then the loops are closed. Where joint positions do not express the mechanism it changes nothing.
    passes : of `exact=False`: "plain", the paper's; or "accelerated", with exact meetings and half-spaces in place of
        points, and a projection to where these hold, as near as it can be, in place of the centroid.
    actuator_tolerance : how close actuated coordinates must come to the asked values to be REACHED [L or rad]. Readings
        of more encoders than the mechanism has freedoms never agree better than they are exact.
    on_invalid : what a row of a batch that is no pose does: "raise", or "mark" the row INVALID.
    """

    tolerance: float | None = None
    rotation_tolerance: float = TOLERANCES.rotation
    max_iterations: int = 100
    max_rounds: int = 12
    working_mode: Literal["any", "keep"] | None = None
    hold: Literal["orientation", "position"] | None = "orientation"
    projection: Literal["nearest", "centroid"] = "nearest"
    rotation_length: float | None = None
    exact: bool = True
    passes: Literal["plain", "accelerated"] = "plain"
    actuator_tolerance: float = TOLERANCES.position
    on_invalid: Literal["raise", "mark"] = "raise"

    def __new__(cls, *args: object, **given: object) -> Options:
        for name in given:
            if name not in cls.__dataclass_fields__:
                raise UnknownName("option", name, cls.__dataclass_fields__)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        for name, choices in _CHOICES.items():
            if getattr(self, name) not in choices:
                raise InvalidArgument(f"options.{name}", repr(getattr(self, name)), f"one of {choices}")
        if not isinstance(self.exact, bool):
            raise InvalidArgument("options.exact", repr(self.exact), "True or False")
        for name in ("tolerance", "rotation_tolerance", "rotation_length", "actuator_tolerance"):
            value = getattr(self, name)
            if value is not None or name in ("rotation_tolerance", "actuator_tolerance"):
                require_positive(f"options.{name}", value)
        for name in ("max_iterations", "max_rounds"):
            value = getattr(self, name)
            if isinstance(value, bool) or not (isinstance(value, Integral) and 1 <= int(value) <= 1_000_000):
                raise InvalidArgument(f"options.{name}", repr(value), "an integer from 1 to 1000000")

    @classmethod
    def paper(cls) -> Options:
        """The paper's K = 100 and E = 1e-2 [length], by passes alone."""
        return cls(tolerance=1e-2, max_iterations=100, max_rounds=1000, exact=False, projection="centroid")

    @classmethod
    def accelerated(cls) -> Options:
        """P-FABRIK with exact meetings and half-spaces, by passes alone, to the usual tolerances."""
        return cls(max_rounds=200, exact=False, passes="accelerated")


def checked_options(options: Options | None) -> Options:
    """The options to use, the usual ones for None; InvalidArgument for anything else."""
    if options is None:
        return USUAL
    if not isinstance(options, Options):
        raise InvalidArgument("options", type(options).__name__, "Options, or None")
    return options


USUAL = Options()
