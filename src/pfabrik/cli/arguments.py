"""Arguments and options that several commands have: MECH, numbers, a target, projection."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

import pfabrik as pf

from ..common.cells import is_finite
from ..errors import counted, near_miss
from ..tolerances import TOLERANCES
from .options import STANDARD_INPUT, named_values, series, together
from .printing import note

if TYPE_CHECKING:
    from ..kinematics import Target

Triple: TypeAlias = tuple[float, float, float]
Value = TypeVar("Value")


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
    from ..machine.files import loads

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
    joint: tuple[str, ...]

    @property
    def is_given(self) -> bool:
        """True if any of the options is given."""
        return self != TargetOptions(None, None, ())

    def of(self, mechanism: pf.Mechanism) -> Target:
        """The target that the options give; home's pose where they give none."""
        if not self.joint:
            position = self.position or mechanism.reference_point
            return pf.pose(position, rpy=self.rpy or (0, 0, 0), degrees=True)
        if self.position is not None or self.rpy is not None:
            raise click.UsageError("--joint says it all: it does not go with --position or --rpy")
        return joint_target(mechanism, self.joint)


rpy_option = click.option(
    "--rpy", type=FINITE, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0."
)


targeted = together(
    "target",
    TargetOptions,
    click.option("--position", type=FINITE, nargs=3, metavar="X Y Z", help="Of the reference point. Default: at home."),
    rpy_option,
    named_values(
        "--joint",
        "joint",
        series,
        "Coordinates [deg or length] of each joint from base to end effector, in place of the others.",
        "NAME=VALUE[,VALUE...]",
    ),
)
"""Adds ``--position``, ``--rpy`` and ``--joint``, which a command gets as one `target`."""


def at_a_pose(command: Callable[..., int | None]) -> Callable[..., int]:
    """Add MECH and the options of a target, home by default; the command gets the answer as `solution`.

    The exit code is 1 of a target out of reach, and where the command says so.
    """

    @click.argument("mech", type=MECH)
    @targeted
    @functools.wraps(command)
    def with_solution(*, mech: str, target: TargetOptions, **parameters: Any) -> int:
        solution = answered(load(mech), target)
        code = None if solution is None else command(solution=solution, **parameters)
        return code or int(not solution)

    return with_solution


def answered(mechanism: pf.Mechanism, options: TargetOptions) -> pf.Solution | None:
    """The answer to a target; a note says why it is not reached, and None that no pose is feasible."""
    solution = pf.solve_ik(mechanism, noted(mechanism, options))
    if not solution:
        from ..answers.words import as_sentence

        note(as_sentence(solution))
    return solution if solution.status <= pf.Status.PROJECTED else None


def noted(mechanism: pf.Mechanism, options: TargetOptions) -> Target:
    """The target that options give; notes say what of it the task, or an end effector that only tilts, leaves out."""
    from ..kinematics import as_targets, tilt_axis
    from ..machine.poses import as_poses
    from ..view.overview import vector

    target = options.of(mechanism)
    note_left_out(ignored(mechanism, options), mechanism)
    if options.rpy and "tilt" in mechanism.task and options.rpy[2] and any(options.rpy[:2]):
        note("the task sets the tilt: of --rpy the direction of the z axis counts, to which other angles may lead")
    axis = tilt_axis(mechanism)
    if axis is not None and abs(as_targets(mechanism, target)[0] - as_poses(target)[0]).max() > TOLERANCES.alignment:
        note(f"of the tilt only the angle about {vector(axis)} counts, about which alone the end effector tilts")
    return target


def ignored(mechanism: pf.Mechanism, target: TargetOptions) -> Iterator[str]:
    """Options, or parts of them, that the task leaves out."""
    task, position, rpy = set(mechanism.task), target.position, target.rpy
    if position and not task & set("xyz"):
        yield "--position"
    elif position:
        for axis, value, home in zip("xyz", position, mechanism.reference_point, strict=True):
            if axis not in task and value != home:
                yield f"{axis} of --position"
    if rpy and not task & {"rotation", "tilt", "yaw"}:
        yield "--rpy"
    elif rpy and "yaw" in task and any(rpy[:2]):
        yield "the tilt in --rpy"
    elif rpy and "tilt" in task and any(rpy) and not any(rpy[:2]):
        yield "the yaw of --rpy"


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
    from ..machine.description.joints import KINDS

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


def positive(words: str) -> float:
    """A positive number; a ValueError says what was expected."""
    if not is_finite(words) or float(words) <= 0.0:
        raise ValueError("a positive number")
    return float(words)


def by_name(
    option: str,
    words: Sequence[str],
    kind: str,
    known: Iterable[str],
    read: Callable[[str], Value],
    of_all: Iterable[str] | None = None,
) -> dict[str, Value]:
    """Name -> value, from words such as ``5`` or ``A1=5``; those with a name prevail.

    Those without one are for all of the known names, or for `of_all`.
    """
    names, values = tuple(known), dict[str, Value]()
    for word in sorted(words, key=lambda word: "=" in word):
        name, equals, said = word.rpartition("=")
        if not names or (equals and name not in names):
            hint = near_miss(name, names) or f" (known: {', '.join(names) or 'none'})"
            raise click.UsageError(f"{option} {word}: no {kind} '{name}'{hint}")
        try:
            value = read(said)
        except ValueError as expected:
            raise click.UsageError(f"{option} {word}: found '{said}'; expected {expected}") from None
        values |= dict.fromkeys([name] if equals else (names if of_all is None else of_all), value)
    return values


def comma_separated(context: click.Context, parameter: click.Parameter, value: str | None) -> list[str] | None:
    """Names separated by commas."""
    return None if value is None else [word.strip() for word in value.split(",") if word.strip()]


def named_joints(option: tuple[str, ...], words: tuple[str, ...]) -> tuple[str, ...]:
    """The names of --joints in their order: with commas between, or apart, and then the later ones are `words`."""
    if len(option) > 1 and words:
        raise click.UsageError(f"found {' '.join(words)}; expected --joints once with all names, or once for each")
    return tuple(name for word in (*option, *words) for name in word.split(",") if name)


def _options(hold: Literal["orientation", "position", "none"], hold_price: float) -> pf.Options:
    return pf.Options(hold=None if hold == "none" else hold, hold_price=hold_price)


projecting = together(
    "options",
    _options,
    click.option(
        "--hold",
        type=click.Choice(["orientation", "position", "none"]),
        default="orientation",
        show_default=True,
        help="Of a target out of reach: what to keep, up to a price.",
    ),
    click.option(
        "--hold-price",
        type=click.FloatRange(min=0.0, min_open=True),
        default=pf.Options().hold_price,
        show_default=True,
        metavar="L/RAD",
        help="How much farther, in sizes of the machine a radian, what is kept may bring the answer; 100 is strict.",
    ),
)
"""Adds ``--hold`` and ``--hold-price``, which a command gets as `options` for the solver."""


def note_left_out(given: Iterable[str], mechanism: pf.Mechanism) -> None:
    """Note that the task leaves out what was given."""
    for option in given:
        note(f"{option} has no effect: the task is {' '.join(mechanism.task)}")


def note_unused_projection(reason: str) -> None:
    """Note that an option of projections is given where nothing is projected."""
    for name in ("hold", "hold_price"):
        if click.get_current_context().get_parameter_source(name) is ParameterSource.COMMANDLINE:
            note(f"--{name.replace('_', '-')} has no effect with {reason}: nothing is projected")
