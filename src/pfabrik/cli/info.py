"""``pfabrik info``: what a mechanism is made of and how it is solved."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..joint_types import KINDS
from .table import aligned

if TYPE_CHECKING:
    from ..decompose import SubChain
    from ..differential import Mobility
    from ..mechanism import Joint, Mechanism


@click.command()
@click.argument("mech")
def info(mech: str) -> int:
    """Show what a mechanism is made of.

    Its joints, limits, actuators, mobility and task, and its sub-chains with the engine that each of them needs.
    """
    mechanism = pf.load(mech)
    click.echo(summary(mechanism) + "\n")
    click.echo(joint_table(mechanism) + "\n")
    click.echo(chain_table(pf.decompose(mechanism)))
    return 0


def summary(mechanism: Mechanism) -> str:
    """Name, size, what is moved and by what."""
    kind = "joint" if mechanism.end_effector_is_joint else "body"
    point = ", ".join(f"{value:.6g}" for value in mechanism.reference_point)
    return "\n".join(
        [
            mechanism.name,
            f"end effector           {kind} {mechanism.end_effector}, reference point ({point})",
            f"task                   {' '.join(mechanism.task)}",
            f"actuators              {' '.join(mechanism.actuators)}",
            *freedom(pf.mobility(mechanism)),
            f"characteristic length  {mechanism.characteristic_length:.6g} {mechanism.length_unit}",
        ]
    )


def freedom(counted: Mobility) -> list[str]:
    """What moves, what drives it, and what nothing holds; in general, where home may be special."""
    parts = f"{counted.platform} of the end effector, {counted.internal} internal, {counted.idle} idle"
    lines = [
        f"mobility               {counted.mobility}: {parts}",
        f"redundancy             {counted.redundancy}: actuators {counted.actuators}, freedoms {counted.platform}",
    ]
    if counted.uncontrolled:
        lines.append(f"uncontrolled           {counted.uncontrolled} of the freedoms, with all actuators locked")
    return lines


def joint_table(mechanism: Mechanism) -> str:
    """Every joint with what it connects, its coordinate and its limits; ``*`` marks the actuated ones."""
    rows = [
        (
            joint.name + "*" * joint.actuated,
            joint.type,
            " - ".join(joint.connects),
            coordinate(joint),
            limits(joint, mechanism.length_unit),
        )
        for joint in mechanism.joints
    ]
    return aligned(("joint", "type", "connects", "coordinate", "limits"), rows)


def coordinate(joint: Joint) -> str:
    """What the joint's coordinate measures."""
    if joint.along:
        return f"distance {joint.along[0]} to {joint.along[1]}"
    if joint.axis is None:
        return ""
    measured = " and ".join(
        {"angle": "angle", "length": "displacement"}[kind] for kind in KINDS[joint.type].coordinates
    )
    return (
        f"{measured} about {vector(joint.axis)}" if joint.type == "revolute" else f"{measured} on {vector(joint.axis)}"
    )


def limits(joint: Joint, unit: str) -> str:
    """The joint's range and cone, in degrees and the mechanism's length unit."""
    kinds = KINDS[joint.type].coordinates
    parts = [interval(pair, unit, kind == "angle") for pair, kind in zip(ranges(joint), kinds, strict=False)]
    if joint.cone:
        half_angle = math.degrees(joint.cone.half_angle)
        parts.append(f"cone {half_angle:.6g} deg about {vector(joint.cone.axis)} of {joint.cone.fixed_to}")
    return "; ".join(parts)


def ranges(joint: Joint) -> list[Sequence[float]]:
    """The joint's ranges, one pair for each limited coordinate."""
    if joint.range is None:
        return []
    first = joint.range[0]
    return [joint.range] if isinstance(first, int | float) else list(joint.range)  # type: ignore[list-item, arg-type]


def interval(pair: Sequence[float], unit: str, is_angle: bool) -> str:
    """``140 to 250 mm``."""
    low, high = (math.degrees(bound) if is_angle else bound for bound in pair)
    return f"{low:.6g} to {high:.6g} {'deg' if is_angle else unit}"


def vector(components: Iterable[float]) -> str:
    """``(0, 0, 1)``."""
    return f"({', '.join(f'{component:.4g}' for component in components)})"


def chain_table(chains: Sequence[SubChain]) -> str:
    """The distinct sub-chains in the field's notation, how often each occurs, and which engine solves it."""
    counts = Counter((str(chain), chain.engine, chain.reason or "positions alone express it") for chain in chains)
    rows = [(str(count), notation, engine, reason) for (notation, engine, reason), count in counts.items()]
    return aligned(("count", "sub-chain", "engine", "why"), rows)
