"""What the commands that start from one pose share: ``--position``, ``--rpy`` and ``--joint``."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

import click

import pfabrik as pf

from ..errors import counted
from .finite import FINITE, is_finite

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism
    from ..targets import Target

Triple: TypeAlias = tuple[float, float, float]

position_option = click.option(
    "--position", type=FINITE, nargs=3, metavar="X Y Z", help="Of the reference point. Default: at home."
)
rpy_option = click.option(
    "--rpy", type=FINITE, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0."
)
joint_option = click.option(
    "--joint",
    metavar="NAME=VALUE[,VALUE...]",
    help="Coordinates [deg or length] of the joint between base and end effector, in place of the others.",
)


def targeted(command: Callable[..., Any]) -> Callable[..., Any]:
    """All three options, in this order."""
    return position_option(rpy_option(joint_option(command)))


def target_of(mechanism: Mechanism, position: Triple | None, rpy: Triple | None, joint: str | None) -> Target:
    """The target that the options give; home's pose where they give none."""
    if joint is not None:
        if position is not None or rpy is not None:
            raise click.UsageError("--joint says it all: it does not go with --position or --rpy")
        return joint_target(mechanism, joint)
    return pf.pose(position or mechanism.reference_point, rpy=rpy or (0, 0, 0), degrees=True)


def joint_target(mechanism: Mechanism, words: str) -> dict[str, float | list[float]]:
    """Joint name -> coordinates [rad or length], from words such as ``pivot=5,10``."""
    from ..description.joint_types import KINDS

    name, equals, listed = words.partition("=")
    values = listed.split(",")
    if not equals or not all(map(is_finite, values)):
        raise click.UsageError(f"--joint: found '{words}'; expected NAME=VALUE[,VALUE...] with finite numbers")
    kinds = KINDS[mechanism.joint(name).type].coordinates
    if len(values) != len(kinds):
        raise click.UsageError(f"--joint {words}: found {counted(len(values), 'value')}; expected {len(kinds)}")
    in_order = zip(map(float, values), kinds, strict=True)
    read = [math.radians(value) if kind == "angle" else value for value, kind in in_order]
    return {name: read if len(read) > 1 else read[0]}
