"""Trees that positions express: a shoulder, a slide and an elbow that carry two branches of many kinds, and a ball."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pfabrik import Cone, Joint, Mechanism

from .positions import ring


def arm_with_elbow(leg: Callable[[str, Any, Any], list[Joint]]) -> Mechanism:
    """A trunk of shoulder, slide and elbow that carries two branches; four struts more hold the platform."""
    joints = [
        Joint("shoulder", "revolute", ("base", "arm"), at=(100, 0, 0), axis=(0, 1, 0), actuated=True, range=(-1, 1)),
        Joint("slide", "prismatic", ("slider", "arm"), axis=(-1, 0, 3), actuated=True, range=(-20, 20)),
        Joint("elbow", "revolute", ("bar", "slider"), at=(90, 0, 40), axis=(1, 1, 0), actuated=True, range=(-1, 1)),
    ]
    joints += leg("1", (80, 20, 60), (50, 30, 150)) + leg("2", (80, -20, 60), (50, -30, 150))
    ends = zip(ring(100, 0, (80, 120, 200, 260)), ring(50, 150, (90, 140, 180, 270)), strict=True)
    for i, (foot, head) in enumerate(ends):
        joints += _strut(f"s{i}", "base", foot, head)
    return Mechanism("arm with elbow", joints, "platform", (0, 0, 150))


def _strut(
    name: str, body: str, foot: Any, head: Any, cone: float = 0.3, stroke: tuple[float, float] = (0.95, 1.05)
) -> list[Joint]:
    """A driven strut from a body to the platform; its stroke relative to its length at home."""
    line = np.subtract(head, foot)
    limits = tuple(share * float(np.linalg.norm(line)) for share in stroke)
    bodies, ends = (f"c{name}", f"r{name}"), (f"C{name}", f"E{name}")
    return [
        Joint(ends[0], "universal", (body, bodies[0]), at=foot, cone=Cone(line, cone, body)),
        Joint(f"D{name}", "prismatic", bodies, along=ends, actuated=True, range=limits),
        Joint(ends[1], "spherical", (bodies[1], "platform"), at=head, cone=Cone(-line, cone, "platform")),
    ]


def bar_strut(name: str, foot: Any, head: Any) -> list[Joint]:
    return _strut(name, "bar", foot, head)


def bar_dyad(name: str, foot: Any, head: Any) -> list[Joint]:
    """Crank, rod and ball joint, with a cone that is fixed to the crank."""
    knee = np.add(foot, (0, 30, 50))
    aside = np.subtract(head, knee) + (3, 2, 1)
    return [
        Joint(f"C{name}", "revolute", ("bar", f"c{name}"), at=foot, axis=(1, 0, 0), range=(-0.2, 0.2)),
        Joint(f"D{name}", "spherical", (f"c{name}", f"r{name}"), at=knee, cone=Cone(aside, 0.3, f"c{name}")),
        Joint(f"E{name}", "spherical", (f"r{name}", "platform"), at=head),
    ]


def bar_ball(name: str, foot: Any, head: Any) -> list[Joint]:
    """A strut, and on the other side the platform's ball joint on the crossbar itself."""
    if name == "1":
        return [Joint("ball", "spherical", ("bar", "platform"), at=head)]
    return bar_strut(name, foot, head)


def bar_planar(name: str, foot: Any, head: Any) -> list[Joint]:
    knee = np.add(foot, (0, 30, 50))
    return [
        Joint(f"C{name}", "revolute", ("bar", f"c{name}"), at=foot, axis=(1, 0, 0)),
        Joint(f"D{name}", "revolute", (f"c{name}", f"r{name}"), at=knee, axis=(1, 0, 0)),
        Joint(f"E{name}", "revolute", (f"r{name}", "platform"), at=head, axis=(1, 0, 0)),
    ]


def pivoted() -> Mechanism:
    """A platform on a ball joint that is fixed to the base, with three struts."""
    joints = [Joint("pivot", "spherical", ("base", "platform"), at=(0, 0, 140))]
    ends = zip(ring(100, 0, (0, 120, 240)), ring(60, 150, (10, 120, 250)), strict=True)
    for i, (foot, head) in enumerate(ends):
        joints += _strut(f"{i}", "base", foot, head)
    return Mechanism("pivoted", joints, "platform", (0, 0, 150))


def arms(
    angles: tuple[float, ...],
    crossbars: tuple[tuple[float, ...], ...],
    *,
    tilt: float = 0.0,
    reach: float = 130.0,
    elbows: bool = False,
) -> Mechanism:
    """A platform on arms that swing and extend, each with a crossbar that carries struts at some places along it.

    Parameters
    ----------
    angles : of the arms about z [deg].
    crossbars : places of each arm's struts along its crossbar.
    tilt : of the hinges of the arms against their crossbars [deg].
    reach : distance of the arms from the centre.
    elbows : crossbars turn about the arms' extensions too.
    """
    joints, z = [], np.array([0.0, 0.0, 1.0])
    for i, (angle, places) in enumerate(zip(np.radians(angles), crossbars, strict=True)):
        outward = np.array([np.cos(angle), np.sin(angle), 0.0])
        bar = np.cross(z, outward)
        axis = np.cos(np.radians(tilt)) * bar + np.sin(np.radians(tilt)) * outward
        foot = reach * outward
        joints += [
            Joint(f"A{i}", "revolute", ("base", f"arm{i}"), at=foot, axis=axis, actuated=True, range=(-0.6, 0.7)),
            Joint(f"B{i}", "prismatic", (f"arm{i}", f"bar{i}"), axis=z, actuated=True, range=(-30.0, 35.0)),
        ]
        carrier = f"bar{i}"
        if elbows:
            carrier = f"turned{i}"
            joints.append(Joint(f"T{i}", "revolute", (f"bar{i}", carrier), at=foot + 80 * z, axis=z, range=(-0.4, 0.4)))
        for k, place in enumerate(places):
            at, head = foot + place * bar + 80 * z, 0.45 * foot + 1.3 * place * bar + 170 * z
            joints += _strut(f"{i}{k}", carrier, at, head, 0.75, (0.75, 1.4))
    return Mechanism("arms", joints, "platform", (0, 0, 170))


ARMS: dict[str, Callable[[], Mechanism]] = {
    "three arms of other dimensions": lambda: arms((0, 110, 250), ((-25, 20), (-40, 30), (-20, 35)), reach=110),
    "hinges not parallel to the crossbar": lambda: arms((0, 120, 240), ((-30, 30),) * 3, tilt=35),
    "three struts on an arm": lambda: arms((0, 180), ((-40, 5, 45), (-45, -5, 40)), tilt=10),
    "four struts on an arm, and two": lambda: arms((0, 180), ((-45, -15, 15, 45), (-25, 30))),
    "crossbars that turn": lambda: arms((0, 120, 240), ((-30, 30),) * 3, elbows=True),
}
"""Arms whose joints the pose leaves open; struts on intermediate platforms, with cones at either end."""

TRUNKS: dict[str, Callable[[], Mechanism]] = {
    "pivoted": pivoted,
    "trunk with struts": lambda: arm_with_elbow(bar_strut),
    "trunk with cranks": lambda: arm_with_elbow(bar_dyad),
    "trunk with a ball joint": lambda: arm_with_elbow(bar_ball),
    "trunk with planar legs": lambda: arm_with_elbow(bar_planar),
}
