"""The solids that a mechanism is drawn with, as data: bars, plates, struts and joints, by rules that pictures share."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Literal, TypeAlias

import numpy as np

from ..common.arrays import Floats
from ..machine.common_centre import common_centre, is_around
from ..machine.description.mechanism import Joint, Mechanism
from ..machine.description.plane import plane_of
from ..machine.description.sketch import Places, joint_places, joints_on, middle
from ..machine.description.task import task_of
from ..machine.motion.fitting_task import tilt_axis

Role: TypeAlias = Literal["base", "platform", "link"]
Kind: TypeAlias = Literal["bar", "arc", "barrel", "plate", "rail", "carriage", "ball"]
Place: TypeAlias = tuple[str, ...] | Floats
"""The middle of some joints, the reference point where none is named, or a point of the base (3,) [length]."""

BARREL = 0.58
"""Length of the cylinder of a strut, as a share of the strut at home."""

SAME_ANGLE = 6
"""Digits to which angles about a body's middle count [rad]: equal ones keep the order of the description."""

FLAT = 0.02
"""Distance of joints from a plane up to which their body is a plate, as a share of the machine's size."""

ACROSS = 0.7
"""Cosine of the angle to the direction across a body, or to the vertical, up to which a direction counts as that."""

WITHIN_PLANE = 0.3
"""The same cosine up to which a direction counts as one within the plane of a body."""

HANGS = 0.3
"""Share of a machine's height below which the end effector is at home where the machine hangs from its base."""


@dataclass(frozen=True)
class Part:
    """A solid of a drawing.

    Attributes
    ----------
    kind : "bar" between two places, "arc" between two places about the common centre of a spherical linkage, "barrel"
        from the first of two places towards the other, "plate" around all its places, "rail" between two points of the
        base, "carriage" and "ball" at one place.
    ends : its places.
    joints : whose limits light it up.
    radius : its thickness, as a multiple of the usual one.
    length : of a barrel [length].
    axis : of a carriage at home, unit vector (3,).
    """

    kind: Kind
    body: str
    role: Role
    ends: tuple[Place, ...]
    joints: tuple[str, ...] = ()
    radius: float = 1.0
    length: float = 0.0
    axis: Floats | None = None


def role_of(mechanism: Mechanism, body: str) -> Role:
    """Shape in which a body is drawn."""
    if body == mechanism.base:
        return "base"
    return "platform" if body == mechanism.end_effector else "link"


def hangs(mechanism: Mechanism) -> bool:
    """True if the end effector hangs below the base."""
    heights = [place[2] for place in _home_places(mechanism).values()]
    return bool(mechanism.home_pose[2, 3] < min(heights) + HANGS * np.ptp(heights)) and "z" in mechanism.task


def free_axes(mechanism: Mechanism) -> tuple[list[int], list[int]]:
    """Axes of the base along and about which one moves the end effector: those of the task, of a plane those in it."""
    task, plane, only = task_of(mechanism), plane_of(mechanism), tilt_axis(mechanism)
    if only is not None:
        return [k for k in range(3) if task.axes[k]], [int(np.argmax(np.abs(only)))]
    is_flat = np.zeros(3, bool) if plane is None else np.abs(np.cross(*plane)) > ACROSS
    slides = [k for k in range(3) if task.axes[k] and not is_flat[k]]
    return slides, [k for k in range(3) if task.turns[k] and (plane is None or is_flat[k])]


def size_of(mechanism: Mechanism) -> float:
    """The diagonal of the box around all joints and the reference point at home [length]."""
    return float(np.linalg.norm(np.ptp([*_home_places(mechanism).values(), mechanism.home_pose[:3, 3]], axis=0)))


def parts_of(mechanism: Mechanism) -> tuple[Part, ...]:
    """The solids of a mechanism; bodies with shapes of their own are drawn beside."""
    rails = {joint.name: rail for joint in mechanism.joints if (rail := home_rail(mechanism, joint)) is not None}
    struts = [joint for joint in mechanism.joints if joint.along is not None]
    parts = [part for body in mechanism.bodies for part in _body(mechanism, body, rails)]
    parts += [part for joint in struts for part in _strut(mechanism, joint)]
    for name, rail in rails.items():
        joint = mechanism.joint(name)
        axis = np.array(mechanism.home_axis(name))
        carried = next(body for body in joint.connects if body != mechanism.base)
        parts.append(Part("rail", mechanism.base, "base", tuple(rail), (name,), 0.8))
        parts.append(Part("carriage", carried, "link", ((name,),), (name,), 2.0, axis=axis))
    if not mechanism.end_effector_is_joint:
        parts += _stem(mechanism)
    return (*parts, *(_ball(mechanism, joint) for joint in mechanism.joints if joint.along is None))


def home_rail(mechanism: Mechanism, joint: Joint) -> Floats | None:
    """Both ends (2, 3) of the travel of a prismatic joint on the base; None for any other, and without limits."""
    if joint.type != "prismatic" or joint.along or joint.range is None or mechanism.base not in joint.connects:
        return None
    bounds = np.array(joint.range, float)
    if not np.isfinite(bounds).all():
        return None
    outward = np.array(mechanism.home_axis(joint.name)) * (1.0 if joint.connects[0] == mechanism.base else -1.0)
    offsets = bounds - mechanism.home_coordinate(joint.name)
    return np.asarray(_home_places(mechanism)[joint.name] + offsets[:, None] * outward)


def _home_places(mechanism: Mechanism) -> Places:
    return joint_places(mechanism, None, mechanism.home_pose[:3, 3])


def _body(mechanism: Mechanism, body: str, rails: dict[str, Floats]) -> list[Part]:
    """A body through its joints: a plate, a frame to hang from, a bar, or a bar across with bars to its middle."""
    role, names = role_of(mechanism, body), joints_on(mechanism, body)
    if role == "link" and len(names) == 2 and any(mechanism.joint(name).along for name in names):
        return []
    points = _corners(mechanism, names, rails if role == "base" else {})
    ends: list[Place] = list(points) if role == "base" else [(name,) for name in names]
    lit = tuple(names) if role == "link" else ()
    if len(ends) < 2 or (role == "base" and _has_oblique_rails(mechanism, points, rails)):
        return []
    centre = common_centre(mechanism)
    if centre is not None and is_around(mechanism, names, centre):
        arcs = _cycle(ends) if len(ends) > 2 else [(ends[0], ends[1])]
        return [Part("arc", body, role, pair, lit, _thickness(mechanism, body)) for pair in arcs]
    if role != "link" and _is_plate(mechanism, role, points):
        return [Part("plate", body, role, tuple(ends[k] for k in order_around(points)))]
    if role == "base" and len({mechanism.joint(name).type for name in names}) == 1:
        bars = _cycle([ends[k] for k in order_around(points)])
    else:
        first, second = _farthest(mechanism, names, points)
        amid: Place = (names[first], names[second]) if role != "base" else middle([points[first], points[second]])
        bars = [(ends[first], ends[second]), *((end, amid) for k, end in enumerate(ends) if k not in (first, second))]
    return [Part("bar", body, role, pair, lit, _thickness(mechanism, body)) for pair in bars]


def _corners(mechanism: Mechanism, names: list[str], rails: dict[str, Floats]) -> list[Floats]:
    """Points of a body at its joints, at home: joint centres, the middles of rails, or far ends of those across."""
    home = _home_places(mechanism)
    points = [rails[name].mean(axis=0) if name in rails else home[name] for name in names]
    normal = np.linalg.svd(np.array(points) - middle(points))[2][2]
    for k, name in enumerate(names):
        if name in rails and len(points) > 2 and abs(np.array(mechanism.home_axis(name)) @ normal) > ACROSS:
            points[k] = max(rails[name], key=lambda end: float(np.linalg.norm(end - mechanism.home_pose[:3, 3])))
    return points


def _has_oblique_rails(mechanism: Mechanism, points: list[Floats], rails: dict[str, Floats]) -> bool:
    """True if rails run neither within nor across the plane through their middles: bars there would join nothing."""
    if not is_flat(mechanism, points):
        return False
    normal = np.linalg.svd(np.array(points) - middle(points))[2][2]
    return any(WITHIN_PLANE < abs(np.array(mechanism.home_axis(name)) @ normal) <= ACROSS for name in rails)


def _cycle(ends: list[Place]) -> list[tuple[Place, Place]]:
    """From each to the next, and from the last to the first; of two, once."""
    return list(zip(ends, [*ends[1:], ends[0]], strict=True))[: len(ends) if len(ends) > 2 else 1]


def _thickness(mechanism: Mechanism, body: str) -> float:
    """Thick for base and platform, less for links that are driven, least for rods."""
    role = role_of(mechanism, body)
    if role != "link":
        return 1.5
    return 1.25 if any(mechanism.joint(name).actuated for name in joints_on(mechanism, body)) else 0.8


def _strut(mechanism: Mechanism, joint: Joint) -> list[Part]:
    """The cylinder of a strut, and the rod that comes out of it."""
    assert joint.along is not None
    start, end = joint.along
    home = _home_places(mechanism)
    length = BARREL * float(np.linalg.norm(home[end] - home[start]))
    ends: tuple[Place, ...] = ((start,), (end,))
    first, second = joint.connects
    lit = (joint.name, start, end)
    return [Part("barrel", first, "link", ends, lit, 1.25, length), Part("bar", second, "link", ends, lit, 0.72)]


def _stem(mechanism: Mechanism) -> list[Part]:
    """From amid the joints of the platform to the reference point."""
    body = mechanism.end_effector_body
    return [
        Part("bar", body, "platform", (tuple(joints_on(mechanism, body)), ()), (), 0.8),
        Part("ball", body, "platform", ((),)),
    ]


def _ball(mechanism: Mechanism, joint: Joint) -> Part:
    is_end = joint.name == mechanism.end_effector
    body = joint.connects[0]
    radius = 2.5 if is_end else 2.0 if joint.actuated else 1.45
    return Part("ball", body, "platform" if is_end else "link", ((joint.name,),), (joint.name,), radius)


def _is_plate(mechanism: Mechanism, role: Role, points: list[Floats]) -> bool:
    """True if points are apart from each other in a plane, which of a base is level, and above which nothing hangs."""
    if not is_flat(mechanism, points):
        return False
    upright = np.linalg.svd(np.array(points) - middle(points))[2][2][2]
    return role == "platform" or (not hangs(mechanism) and bool(abs(upright) > ACROSS))


def is_flat(mechanism: Mechanism, points: list[Floats]) -> bool:
    """True if points are the corners of a plate: three or more, in a plane, and not on one line."""
    if len(points) < 3:
        return False
    sizes = np.linalg.svd(np.array(points) - middle(points), compute_uv=False)
    size = size_of(mechanism)
    return bool(sizes[1] > FLAT * size and (len(points) == 3 or sizes[2] <= FLAT * size))


def order_around(points: list[Floats]) -> list[int]:
    """The order of points about their middle, in the plane that they span most of."""
    offsets = np.array(points) - middle(points)
    first, second = np.linalg.svd(offsets, full_matrices=False)[2][:2]
    angles = np.arctan2(offsets @ second, offsets @ first).round(SAME_ANGLE)
    return [int(k) for k in np.argsort(angles, kind="stable")]


def _farthest(mechanism: Mechanism, names: list[str], points: list[Floats]) -> tuple[int, int]:
    """The two joints, of one type if there are such, that are farthest from each other."""

    def rank(pair: tuple[int, int]) -> tuple[bool, float]:
        a, b = pair
        is_alike = mechanism.joint(names[a]).type == mechanism.joint(names[b]).type
        return is_alike, float(np.linalg.norm(points[a] - points[b]))

    return max(combinations(range(len(names)), 2), key=rank)
