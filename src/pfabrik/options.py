"""Options of questions: tolerances, the working mode, what projections keep, and what wrong rows do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeVar

from .common.checks import require_choice, require_count, require_positive
from .errors import InvalidArgument
from .tolerances import TOLERANCES

Chosen = TypeVar("Chosen", bound="Options")

_CHOICES: dict[str, tuple[str | None, ...]] = {
    "working_mode": (None, "any", "keep"),
    "hold": (None, "orientation", "position"),
    "on_invalid": ("raise", "mark"),
}


@dataclass(frozen=True)
class Options:
    """Options of `solve_ik` and `track`, and of `solve_fk`, which uses only `working_mode` and the last two.

    Attributes
    ----------
    tolerance : float or None
        E, how close the end effector must come to be REACHED [length]; None is 1e-9 of the mechanism's characteristic
        length.
    rotation_tolerance : float
        The same for the orientation [rad].
    working_mode : {"any", "keep"} or None
        "keep" stays in the start's working mode (home's without a start), "any" may change it to reach; None keeps it
        if there is a start. `solve_fk` keeps the assembly mode, of home too, but with "any".
    hold : {"orientation", "position"} or None
        What a projection holds, up to a price: "orientation" (the paper's choice), "position", or None, nothing.
        `Solution.held` tells what was held, exactly.
    hold_price : float
        What is held is given way where holding it costs more than this of the distance, per unit by which it gives way
        [L per rad; of a position L per L]. A hundred is strict: what can be held is held. Ten holds all but what
        is nearly singular, so that a stream of targets does not leap for it.
    rotation_length : float or None
        How a rotation counts beside a distance: by the angle times this [length per rad], in sqrt(distance^2 +
        (rotation_length angle)^2). None is `Mechanism.rotation_length`.
    actuator_tolerance : float
        How close actuated coordinates must come to the asked values to be REACHED [L or rad]. Readings of more encoders
        than the mechanism has freedoms never agree better than they are exact.
    most_steps : int or None
        How many configurations the search for a projection may linearise in all; None for no bound. What it finds until
        then is feasible, the start itself at worst, and `Solution.is_complete` is False. For control loops: from a near
        start, answers are good. Where legs have no closed form, steps that close loops on a target count too.
    on_invalid : {"raise", "mark"}
        What a row of a batch that is no pose does: "raise", or "mark" the row INVALID.
    """

    tolerance: float | None = None
    rotation_tolerance: float = TOLERANCES.rotation
    working_mode: Literal["any", "keep"] | None = None
    hold: Literal["orientation", "position"] | None = "orientation"
    hold_price: float = 10.0
    rotation_length: float | None = None
    actuator_tolerance: float = TOLERANCES.position
    most_steps: int | None = None
    on_invalid: Literal["raise", "mark"] = "raise"

    def __post_init__(self) -> None:
        for name, choices in _CHOICES.items():
            require_choice(f"options.{name}", getattr(self, name), choices)
        for name in ("tolerance", "rotation_tolerance", "hold_price", "rotation_length", "actuator_tolerance"):
            value = getattr(self, name)
            if value is not None or name in ("rotation_tolerance", "hold_price", "actuator_tolerance"):
                require_positive(f"options.{name}", value)
        if self.most_steps is not None:
            require_count("options.most_steps", self.most_steps)


def options_or(usual: Chosen, options: Chosen | None) -> Chosen:
    """The options to use, the usual ones for None; InvalidArgument for any of another class."""
    if options is None:
        return usual
    if type(options) is not type(usual):
        raise InvalidArgument("options", type(options).__name__, f"{type(usual).__name__}, or None")
    return options


def checked_options(options: Options | None) -> Options:
    """`options_or` the usual ones."""
    return options_or(USUAL, options)


USUAL = Options()
