"""A robot on its feet as a parallel mechanism, from any file of a robot."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from ...errors import InvalidArgument
from ...machine.description.contact import ContactLike
from ...machine.description.form_faults import shown
from ...machine.description.mechanism import Mechanism
from ...machine.files import load
from ..interop.mjcf_reading import from_mjcf
from ..interop.own_robots import mechanism_on_feet
from ..interop.urdf_reading import from_urdf
from ..interop.xml_reading import read_xml


def stand(
    robot: str | os.PathLike[str] | Mechanism,
    feet: Mapping[str, ContactLike] | Sequence[str],
    *,
    body: str | None = None,
    at: str | ArrayLike | Mapping[str, float] | None = None,
    loops: str | os.PathLike[str] | Mapping[str, object] | None = None,
    actuated: Iterable[str] | None = None,
    fixed: Iterable[str] = (),
    length_unit: str | None = None,
    task: Sequence[str] | None = None,
    within: float | None = None,
) -> Mechanism:
    """A robot on its feet: an ordinary mechanism, whose end effector is the trunk and whose base is the ground.

    What held the trunk, or let it float, goes; joints keep their names and the signs of their coordinates. Contacts
    hold both ways: a foot neither slides nor lifts, whatever the load; `forces` with `friction` tells how near it is to
    that. `interop.from_mjcf` and `from_urdf` do the same (`feet=`), and tell what was left out or changed.

    Parameters
    ----------
    robot : str or PathLike or Mechanism
        A MuJoCo model, a URDF or an SDF, its path or its text, or a mechanism, or the path of its file.
    feet : mapping of str to str or sequence of str
        Body, link, site or named geom -> how it touches: "point" (its origin, or the middle of a geom, stays and turns
        freely), "flat" (it stays as it is), "pinned" (it turns about the vertical), or a mapping with `type`, `at`
        (where, in the part's own frame [length of the mechanism]), and `axis` (of "edge", about which it rolls, or of
        "pinned"). Names alone are points.
    body : str, optional
        The trunk. Default: the body from which the ways to the feet part.
    at : str or array (nq,) or mapping of str to float, optional
        Home: the name of a keyframe or `qpos` of a MuJoCo model; or joint -> its value [rad, m; of a mechanism in its
        unit], others as by default: the keyframe "home" if there is one, else as the file has it. Joints that are
        beyond their ranges are moved into them before the feet touch the ground.
    loops : str or PathLike or mapping, optional
        As in `interop.from_urdf`.
    actuated : iterable of str, optional
        As in `interop.from_mjcf`. Default: as the file says; where it drives no joint of a leg, all of them.
    fixed : iterable of str, optional
        As in `interop.from_mjcf`.
    length_unit : str, optional
        As in `interop.from_mjcf`; of a mechanism its own.
    task : sequence of str, optional
        As in `interop.from_mjcf`.
    within : float, optional
        As in `interop.from_mjcf`.

    Raises
    ------
    InvalidArgument
        A foot that is fixed to the trunk, or a contact that is none.
    UnknownName
        A foot, a body, a joint or a keyframe that the robot does not have.
    InvalidMechanism
        As in `interop.from_mjcf`.
    """
    if not isinstance(robot, str | os.PathLike | Mechanism):
        raise InvalidArgument("robot", type(robot).__name__, "a path, the text of a model, or a Mechanism")
    shared: dict[str, Any] = {"actuated": actuated, "fixed": fixed, "task": task, "within": within, "feet": feet}
    if isinstance(robot, Mechanism) or _is_own(robot):
        machine = robot if isinstance(robot, Mechanism) else load(robot)
        if at is not None and not isinstance(at, Mapping):
            raise InvalidArgument("at", shown(at), "values by the names of joints")
        for name, value in (("loops", loops), ("length_unit", length_unit)):
            if value is not None:
                raise InvalidArgument(name, repr(value), "none, for a mechanism has its own")
        return mechanism_on_feet(machine, body, at, **shared)
    shared |= {"end_effector": body, "length_unit": "m" if length_unit is None else length_unit}
    if read_xml(robot, "mjcf", "urdf", "sdf").tag != "mujoco":
        if at is not None and not isinstance(at, Mapping):
            raise InvalidArgument("at", shown(at), "values by the names of joints, as a description has no keyframes")
        return from_urdf(robot, loops, configuration=at, **shared).mechanism
    if loops is not None:
        raise InvalidArgument("loops", repr(loops), "none, for a MuJoCo model tells its own")
    return from_mjcf(robot, configuration=at, **shared).mechanism


def _is_own(robot: str | os.PathLike[str]) -> bool:
    """True for the path of a mechanism's file, or a name of the catalogue."""
    return not str(robot).lstrip().startswith("<") and Path(robot).suffix.lower() not in (
        ".xml",
        ".mjcf",
        ".urdf",
        ".sdf",
    )
