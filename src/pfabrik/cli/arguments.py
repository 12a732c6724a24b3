"""Arguments and options that several commands have: MECH, numbers, a target, projection."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

import pfabrik as pf

from ..cells import is_finite
from ..errors import counted
from .printing import note

if TYPE_CHECKING:
    from ..targets import Target

STANDARD_INPUT = "-"

Triple: TypeAlias = tuple[float, float, float]


class MechanismName(click.types.StringParamType):
    """A text that completes to names of the catalogue, and to files."""

    name = "mech"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Names that begin so; else the shell's own completion of files."""
        names = [name for name in pf.catalog() if name.startswith(incomplete)]
        return [CompletionItem(name) for name in names] or [CompletionItem(incomplete, type="file")]


MECH = MechanismName()


def load(mech: str) -> pf.Mechanism:
    """The mechanism of an argument MECH: a catalogue name, a file, or ``-`` for standard input."""
    if mech != STANDARD_INPUT:
        return pf.load(mech)
    from ..files import loads

    return loads(sys.stdin.read(), "standard input")


class Finite(click.types.FloatParamType):
    """A float that is neither infinite nor NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a failure that names the option."""
        if isinstance(value, str) and not is_finite(value):
            self.fail(f"found '{value}'; expected a finite number", param, ctx)
        number: float = super().convert(value, param, ctx)
        return number


FINITE = Finite()


@dataclass(frozen=True)
class TargetOptions:
    """The values of ``--position`` [length], ``--rpy`` [deg] and ``--joint``; None or empty where one is not given."""

    position: Triple | None
    rpy: Triple | None
    joints: tuple[str, ...]

    @property
    def is_given(self) -> bool:
        """True if any of the options is given."""
        return (self.position, self.rpy, self.joints) != (None, None, ())

    def of(self, mechanism: pf.Mechanism) -> Target:
        """The target that the options give; home's pose where they give none."""
        if not self.joints:
            position = self.position or mechanism.reference_point
            return pf.pose(position, rpy=self.rpy or (0, 0, 0), degrees=True)
        if self.position is not None or self.rpy is not None:
            raise click.UsageError("--joint says it all: it does not go with --position or --rpy")
        return joint_target(mechanism, self.joints)


rpy_option = click.option(
    "--rpy", type=FINITE, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0."
)


def targeted(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--position``, ``--rpy`` and ``--joint``, which the command gets as one `target`."""

    @click.option("--position", type=FINITE, nargs=3, metavar="X Y Z", help="Of the reference point. Default: at home.")
    @rpy_option
    @click.option(
        "--joint",
        multiple=True,
        metavar="NAME=VALUE[,VALUE...]",
        help="Coordinates [deg or length] of each joint from base to end effector, in place of the others.",
    )
    @functools.wraps(command)
    def with_target(*, position: Triple | None, rpy: Triple | None, joint: tuple[str, ...], **parameters: Any) -> Any:
        return command(target=TargetOptions(position, rpy, joint), **parameters)

    return with_target


def joint_target(mechanism: pf.Mechanism, options: tuple[str, ...]) -> dict[str, float | list[float]]:
    """Joint name -> coordinates [rad or length], from options such as ``pivot=5,10``."""
    target: dict[str, float | list[float]] = {}
    for words in options:
        name, coordinates = joint_coordinates(mechanism, words)
        if name in target:
            raise click.UsageError(f"--joint {words}: found '{name}' twice; expected each joint once")
        target[name] = coordinates
    return target


def joint_coordinates(mechanism: pf.Mechanism, words: str) -> tuple[str, float | list[float]]:
    """A joint's name and coordinates [rad or length], from words such as ``pivot=5,10``."""
    from ..description.joints import KINDS

    name, equals, listed = words.partition("=")
    values = listed.split(",")
    if not equals or not all(map(is_finite, values)):
        raise click.UsageError(f"--joint: found '{words}'; expected NAME=VALUE[,VALUE...] with finite numbers")
    kinds = KINDS[mechanism.joint(name).type].coordinates
    if len(values) != len(kinds):
        raise click.UsageError(f"--joint {words}: found {counted(len(values), 'value')}; expected {len(kinds)}")
    numbers = zip(map(float, values), kinds, strict=True)
    coordinates = [math.radians(number) if kind == "angle" else number for number, kind in numbers]
    return name, coordinates if len(coordinates) > 1 else coordinates[0]


def numbers_of(option: str, words: str, counts: Sequence[int], between: str = ",") -> list[float]:
    """The numbers of an option such as ``0,0,200``; as many as one of `counts`."""
    values = words.split(between)
    if len(values) not in counts or not all(map(is_finite, values)):
        expected = " or ".join(map(str, counts))
        raise click.UsageError(
            f"{option}: found '{words}'; expected {expected} finite numbers with '{between}' between"
        )
    return [float(value) for value in values]


def comma_separated(context: click.Context, parameter: click.Parameter, value: str | None) -> list[str] | None:
    """Names separated by commas."""
    return None if value is None else [word.strip() for word in value.split(",") if word.strip()]


def named_joints(option: tuple[str, ...], words: tuple[str, ...]) -> tuple[str, ...]:
    """The names of --joints in their order: with commas between, or apart, and then the later ones are `words`."""
    if len(option) > 1 and words:
        raise click.UsageError(f"found {' '.join(words)}; expected --joints once with all names, or once for each")
    return tuple(name for word in (*option, *words) for name in word.split(",") if name)


def projecting(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--hold``, which the command gets as `options` for the solver."""

    @click.option(
        "--hold",
        type=click.Choice(["orientation", "position", "none"]),
        default="orientation",
        show_default=True,
        help="What an answer to a target out of reach keeps exactly, if any pose does.",
    )
    @functools.wraps(command)
    def with_options(*, hold: Literal["orientation", "position", "none"], **parameters: Any) -> Any:
        return command(options=pf.Options(hold=None if hold == "none" else hold), **parameters)

    return with_options


def note_left_out(given: Iterable[str], mechanism: pf.Mechanism) -> None:
    """Note that the task leaves out what was given."""
    for option in given:
        note(f"{option} has no effect: the task is {' '.join(mechanism.task)}")


def note_unused_projection(reason: str) -> None:
    """Note that ``--hold`` is given where nothing is projected."""
    if click.get_current_context().get_parameter_source("hold") is ParameterSource.COMMANDLINE:
        note(f"--hold has no effect with {reason}: nothing is projected")
