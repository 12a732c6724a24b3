"""Joints said more plainly: what is welded is one body, two balls are a hinge, two hinges a universal joint."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..description.graph import welded
from ..description.joint_types import JointType
from ..description.joints import Cone, Joint
from ..tolerances import TOLERANCES
from .opened import Note

SKEW = 0.1
"""Least sine between the axes of what is called a universal joint."""


def without_twins(joints: Sequence[Joint], base: str, end_effector: str) -> list[Joint]:
    """Balls that two bodies share as the one joint that they are together, and welded bodies as one.

    Parameters
    ----------
    base, end_effector : names that stay.
    """
    return _without_welds(_hinged(joints), base, end_effector)


def simplified(
    joints: Sequence[Joint], base: str, end_effector: str, cones: Mapping[str, Cone], told: list[Note]
) -> list[Joint]:
    """The same machine in fewer joints.

    Parameters
    ----------
    base, end_effector : names that stay.
    cones : joint -> the cone that limits it.
    """
    single = _grouped(joints, {base, end_effector}, told)
    return [dataclasses.replace(each, cone=cones[each.name]) if each.name in cones else each for each in single]


def _hinged(joints: Sequence[Joint]) -> list[Joint]:
    """Balls that share their two bodies: two make a hinge, three that are not in line hold all."""
    between: dict[frozenset[str], list[Joint]] = defaultdict(list)
    for joint in joints:
        if joint.type == "spherical":
            between[frozenset(joint.connects)].append(joint)
    replaced: dict[str, Joint | None] = {}
    for balls in between.values():
        points = np.array([ball.at for ball in balls])
        spread, axes = np.linalg.svd(points - points[0])[1:] if len(balls) > 1 else (np.zeros(3), np.eye(3))
        directions = int((spread > TOLERANCES.alignment * max(1e-300, float(np.abs(points).max()))).sum())
        if directions == 0:
            continue
        kind: JointType = "revolute" if directions == 1 else "fixed"
        axis = axes[0] if directions == 1 else None
        replaced |= {ball.name: None for ball in balls}
        replaced[balls[0].name] = dataclasses.replace(balls[0], type=kind, axis=axis)
    left = [replaced.get(joint.name, joint) for joint in joints]
    return [joint for joint in left if joint is not None]


def _without_welds(joints: Sequence[Joint], *kept: str) -> list[Joint]:
    """Bodies that are fixed to each other as one, but for those that are kept."""
    weld = welded([joint for joint in joints if joint.type == "fixed"], *kept)
    ends = [(weld.get(a, a), weld.get(b, b)) for a, b in (joint.connects for joint in joints)]
    moved = [dataclasses.replace(joint, connects=pair) for joint, pair in zip(joints, ends, strict=True)]
    return [joint for joint in moved if joint.connects[0] != joint.connects[1]]


def _grouped(joints: Sequence[Joint], kept: set[str], told: list[Note]) -> list[Joint]:
    """Two joints with nothing else on the body between them, as the one that they are together.

    Two passive hinges whose axes cross are a universal joint. J[0] and J[1], a hinge and a slide along it, are a
    cylindrical joint J: as this library writes it.
    """
    on_body: dict[str, list[Joint]] = defaultdict(list)
    for joint in joints:
        for body in joint.connects:
            on_body[body].append(joint)
    made = {joint.name: joint for joint in joints}
    crossing = []
    for between, pair in on_body.items():
        if len(pair) != 2 or between in kept or not all(made.get(joint.name) is joint for joint in pair):
            continue
        first, second = sorted(pair, key=lambda joint: joint.name.endswith("[1]"))
        one = _one(first, second, between)
        if one is not None:
            made = {name: one if joint is first else joint for name, joint in made.items() if joint is not second}
            if one.name not in (stem_of(first), stem_of(second)):
                crossing.append(one.name)
    if crossing:
        told.append(Note("hinges whose axes cross are a universal joint", tuple(crossing)))
    return list(made.values())


def _one(first: Joint, second: Joint, between: str) -> Joint | None:
    """The joint that two are together, or None where they are not."""
    kinds = (first.type, second.type)
    if kinds not in (("revolute", "revolute"), ("revolute", "prismatic")):
        return None
    ranges = (first.range, second.range)
    if (first.range is None) != (second.range is None):
        return None
    signs = (1.0 if first.connects[1] == between else -1.0), (1.0 if second.connects[0] == between else -1.0)
    axes = np.array([first.axis, second.axis]) * np.reshape(signs, (2, 1))
    ends = [next(body for body in joint.connects if body != between) for joint in (first, second)]
    ours = stem_of(first) if stem_of(first) == stem_of(second) else None
    both: dict[str, Any] = {"home": (first.home, second.home), "range": None if first.range is None else ranges}
    driven = (first.actuated is True, second.actuated is True)
    if kinds[1] == "prismatic":
        along = np.linalg.norm(np.cross(*axes)) < TOLERANCES.alignment and axes[0] @ axes[1] > 0.0
        if ours is None or not along:
            return None
        return Joint(ours, "cylindrical", ends, first.at, axes[0], actuated=driven, **both)
    if any(driven) or (ours is None and (stem_of(first) or stem_of(second) or not _cross(first, second))):
        return None
    return Joint(ours or f"{first.name}+{second.name}", "universal", ends, first.at, axes=axes, **both)


def stem_of(joint: Joint) -> str | None:
    """The name of the joint of which this one is a coordinate, as `coordinate_names` writes it: J of J[0]."""
    return joint.name[:-3] if joint.name.endswith(("[0]", "[1]")) else None


def _cross(first: Joint, second: Joint) -> bool:
    """Whether two hinges are at one place and not nearly parallel."""
    points, axes = np.array([first.at, second.at]), np.array([first.axis, second.axis])
    apart, sine = np.linalg.norm(points[1] - points[0]), np.linalg.norm(np.cross(*axes))
    return bool(apart <= TOLERANCES.alignment * np.abs(points[0]).max() and sine >= SKEW)
