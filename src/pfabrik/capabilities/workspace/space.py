"""The coordinates that span a workspace, and the poses that they stand for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import require_finite, require_known, require_mapping, require_names
from ...common.rotations import from_rotvec
from ...errors import InvalidArgument, UnknownName
from ...kinematics import as_targets, carrying_joint, columns, generic_of, home_coordinates, task_of, tilt_axis
from ...machine.description.mechanism import Mechanism
from ...machine.poses import SupportsMatrix, is_rotation
from ...tolerances import TOLERANCES

POSITIONS = ("x", "y", "z")
TURNS = ("tilt_x", "tilt_y", "yaw")
"""Rotations: a tilt vector in the base's x, y plane, about which the platform is turned by its length [rad], after a
twist about z. R = from_rotvec([tilt_x, tilt_y, 0]) Rz(yaw) R_0, with R_0 the orientation held. Of an end effector that
tilts about one axis alone, the tilt about x or y that is nearer to it is the angle about this axis."""

MOST = 3
"""Largest number of coordinates of a workspace."""


@dataclass(frozen=True, eq=False)
class Space:
    """The coordinates of a map, and what is fixed.

    Attributes
    ----------
    names : of the coordinates that vary: of the pose, or "pivot[0]", "pivot[1]" of the joint `joint`.
    start : their values where the mechanism starts, (d,) [length or rad].
    held : every coordinate of the pose by name, those that vary at their values at the start.
    rotation : R_0, (3, 3).
    joint : the joint whose coordinates they are, or None for those of the pose.
    """

    mechanism: Mechanism
    names: tuple[str, ...]
    start: Floats
    held: Mapping[str, float]
    rotation: Floats
    joint: str | None = None

    @property
    def is_angle(self) -> tuple[bool, ...]:
        return tuple(self.joint is not None or name in TURNS for name in self.names)

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each coordinate: that of lengths, or "rad"."""
        return tuple("rad" if turns else self.mechanism.length_unit for turns in self.is_angle)

    def with_fixed(self, fixed: Mapping[str, float]) -> Space:
        """The space with some of its coordinates fixed."""
        checked = _checked_fixed(fixed, self.names)
        names = tuple(name for name in self.names if name not in checked)
        if self.joint is not None or not checked or len(names) < 2:
            raise InvalidArgument(
                "fixed", ", ".join(checked) or "nothing", "coordinates of a pose that leave two or more"
            )
        kept = [self.names.index(name) for name in names]
        return replace(self, names=names, start=self.start[kept], held={**self.held, **checked})

    def poses(self, coordinates: Floats) -> Floats:
        """Targets (n, 4, 4) in the base frame at coordinates (n, d)."""
        if self.joint is not None:
            return as_targets(self.mechanism, {self.joint: coordinates})[0]
        value = {name: np.full(len(coordinates), held) for name, held in self.held.items()}
        value |= dict(zip(self.names, coordinates.T, strict=True))
        poses = np.zeros((len(coordinates), 4, 4))
        poses[:, 3, 3] = 1.0
        poses[:, :3, 3] = np.stack([value[name] for name in POSITIONS], axis=1)
        if any(value[name].any() for name in TURNS):
            none = np.zeros(len(coordinates))
            tilts = np.stack([value["tilt_x"], value["tilt_y"], none], axis=1)
            axis = tilt_axis(self.mechanism)
            if axis is not None:  # a tilt is an angle about it
                tilts = (tilts @ np.sign(axis))[:, None] * axis
            tilted = from_rotvec(tilts)
            poses[:, :3, :3] = tilted @ from_rotvec(np.stack([none, none, value["yaw"]], axis=1)) @ self.rotation
        else:
            poses[:, :3, :3] = self.rotation
        return poses


def space_of(
    mechanism: Mechanism, over: Sequence[str] | None, fixed: Mapping[str, float] | None, orientation: Any, start: Floats
) -> Space:
    """The space that a question is about.

    Parameters
    ----------
    start : the pose (4, 4) that coordinates start from where they are not fixed.

    Raises
    ------
    UnknownName, InvalidArgument : unknown coordinates, or none left to vary; an orientation that is no rotation, or
        that the task leaves out.
    """
    joint = _pivot(mechanism)
    known = (*POSITIONS, *TURNS, *(_coordinate_names(joint) if joint else ()))
    try:
        fixed = _checked_fixed(fixed, known)
        chosen = _checked_over(over, known, fixed)
    except UnknownName as error:  # those that move are worth a try
        usable = (*_moving(mechanism), *known[len(POSITIONS) + len(TURNS) :])
        raise UnknownName(error.kind, error.name, usable) from None
    if joint is not None and _is_about(joint, chosen, fixed, orientation):
        return _of_joint(mechanism, joint, chosen, fixed)
    rotation = _rotation(mechanism, orientation, start)
    held = {name: float(value) for name, value in zip(POSITIONS, start[:3, 3], strict=True)} | dict.fromkeys(TURNS, 0.0)
    held |= fixed
    names = tuple(name for name in free_coordinates(mechanism) if name not in fixed) if chosen is None else chosen
    if chosen is None:
        places = tuple(name for name in names if name in POSITIONS)
        names = places if len(places) > 1 or len(names) > MOST else names
        if not places:
            names = tuple(name for name in names if name in TURNS)
    if not 2 <= len(names) <= MOST:
        expected = (
            f"two or three coordinates to look over, of those that move: {', '.join(free_coordinates(mechanism))}"
        )
        raise InvalidArgument("over", ", ".join(names) or "no coordinate", expected)
    if len(names) > (most := generic_of(mechanism).mobility.platform):
        expected = f"at most {most} coordinates: the end effector has no more freedoms, and more have no size"
        raise InvalidArgument("over", ", ".join(names), expected)
    _require_task(mechanism, "over", names)
    moving = _moving(mechanism)
    for name in names:
        if name not in moving:
            raise InvalidArgument("over", name, f"coordinates that the end effector can change, {', '.join(moving)}")
    _require_task(mechanism, "fixed", [name for name in fixed if name not in names])
    return Space(mechanism, names, np.array([held[name] for name in names]), held, rotation)


def free_coordinates(mechanism: Mechanism) -> tuple[str, ...]:
    """Coordinates of the task that the end effector can change."""
    names, directions = _moving(mechanism), generic_of(mechanism).directions
    places = [name for name in names if name in POSITIONS]
    rows = [POSITIONS.index(name) for name in places]
    rank = int((np.linalg.svd(directions[rows], compute_uv=False) > TOLERANCES.alignment).sum())
    if rank < len(places):
        raise InvalidArgument(
            "mechanism",
            f"an end effector of which {', '.join(places)} change in {rank} directions, across the axes of the base",
            "a base frame turned so that it moves along its axes",
        )
    return names


def _moving(mechanism: Mechanism) -> tuple[str, ...]:
    """Coordinates of the task that the end effector can change, be it together with others only."""
    task, directions = task_of(mechanism), generic_of(mechanism).directions
    moves = np.linalg.norm(directions, axis=1) > TOLERANCES.alignment
    axis = tilt_axis(mechanism)
    turned = moves[3:] if len(moves) > 3 else np.zeros(3, bool)
    if axis is not None:
        turned = np.arange(3) == np.abs(axis[:2]).argmax()
    counted = np.logical_and((*task.axes, *task.turns), (*moves[:3], *turned))
    return tuple(compress((*POSITIONS, *TURNS), counted))


def _require_task(mechanism: Mechanism, argument: str, names: Sequence[str]) -> None:
    task = task_of(mechanism)
    sets = tuple(compress((*POSITIONS, *TURNS), (*task.axes, *task.turns)))
    for name in names:
        if name not in sets:
            expected = f"coordinates within the task, {' '.join(mechanism.task)}: what it leaves out follows by itself"
            raise InvalidArgument(argument, f"'{name}'", expected)


def _rotation(mechanism: Mechanism, orientation: Any, start: Floats) -> Floats:
    if orientation is None:
        return np.ascontiguousarray(start[:3, :3])
    if isinstance(orientation, SupportsMatrix):
        orientation = orientation.as_matrix()
    matrix = array("orientation", orientation, "3 3", note=", a SciPy Rotation, or 'any'")
    if not is_rotation(matrix):
        raise InvalidArgument("orientation", "a matrix that is not a rotation", "R^T R = I and det R = 1")
    if not task_of(mechanism).rotations:
        raise InvalidArgument("orientation", "a rotation", "None: the task sets none, it follows from the mechanism")
    return matrix


def _checked_fixed(fixed: Mapping[str, float] | None, known: Sequence[str]) -> dict[str, float]:
    given = require_mapping("fixed", fixed, "coordinates by name, such as {'z': 200}")
    require_known("coordinate", given, known)
    return {name: require_finite(f"fixed['{name}']", value) for name, value in given.items()}


def _checked_over(
    over: Sequence[str] | None, known: Sequence[str], fixed: Mapping[str, float]
) -> tuple[str, ...] | None:
    if over is None:
        return None
    names = (over,) if isinstance(over, str) else require_names("over", over)
    require_known("coordinate", names, known)
    held = [name for name in names if name in fixed]
    if held:
        raise InvalidArgument("over", f"'{held[0]}', which is fixed", "coordinates that may vary")
    if len(set(names)) < len(names):
        raise InvalidArgument("over", ", ".join(names), "every coordinate once")
    return names


def _pivot(mechanism: Mechanism) -> str | None:
    """The universal joint that alone connects base and end effector, whose two angles then give the whole pose."""
    name = carrying_joint(mechanism)
    if name is None or any(task_of(mechanism).axes):
        return None
    return name if mechanism.joint(name).type == "universal" else None


def _coordinate_names(joint: str) -> tuple[str, ...]:
    return tuple(f"{joint}[{place}]" for place in range(2))


def _is_about(joint: str, over: Sequence[str] | None, fixed: Mapping[str, float], orientation: Any) -> bool:
    """True if a question is about the coordinates of the joint that carries the end effector."""
    if over is None:
        return orientation is None and not set(fixed) & {*POSITIONS, *TURNS}
    return all(name.startswith(f"{joint}[") for name in over)


def _of_joint(mechanism: Mechanism, joint: str, over: Sequence[str] | None, fixed: Mapping[str, float]) -> Space:
    names = _coordinate_names(joint)
    if fixed or (over is not None and set(over) != set(names)):
        raise InvalidArgument("over", ", ".join(over or fixed), f"all coordinates of '{joint}': {', '.join(names)}")
    home = home_coordinates(mechanism)[columns(mechanism)[joint]]
    return Space(mechanism, names, home, {}, np.eye(3), joint)
