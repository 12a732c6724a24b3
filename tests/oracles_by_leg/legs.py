"""Legs, read from the graph: a driven crank or carriage with rods to the end effector, a strut, or a leg that guides.

Only the joints tell what a leg is: how `decompose` writes it does not matter. Its first rod tells its branches, further
rods (the other one of a parallelogram) are placed beside it and must close as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pfabrik.decomposition.decompose import SubChain, decompose
from pfabrik.description.graph import cone_line, opposite
from pfabrik.description.joints import Joint
from pfabrik.description.mechanism import Mechanism
from pfabrik.tolerances import TOLERANCES

from .facts import Array, is_parallel, require
from .rods import TIP, Passage, Rod, passage, read_rod


@dataclass(frozen=True, eq=False)
class Line:
    """What a cone limits, by the bodies that carry its ends, and the body that its axis turns with."""

    joint: Joint
    start: tuple[str, Array]
    end: tuple[str, Array]
    axis_on: str


@dataclass(frozen=True, eq=False)
class Leg:
    """One leg.

    Attributes
    ----------
    driver : the driven joint on the base; None where a rod is driven, or nothing.
    rods : those of the way from base (or driver) to end effector first. A leg that guides the end effector without a
        rod has none.
    guide : the joints of a leg that drives nothing, outward: a universal or ball joint, and perhaps a slide.
    cones : what its cones limit.
    """

    driver: Passage | None
    rods: tuple[Rod, ...]
    guide: tuple[Passage, ...]
    cones: tuple[Line, ...]

    @property
    def passages(self) -> tuple[Passage, ...]:
        """All its joints."""
        driver = () if self.driver is None else (self.driver,)
        return driver + self.guide + tuple(each for rod in self.rods for each in rod.passages)

    @property
    def actuated(self) -> Joint | None:
        """The joint that drives it."""
        return next((each.joint for each in self.passages if each.joint.actuated), None)

    @property
    def turns(self) -> bool:
        """Whether it is driven by an angle."""
        return self.actuated is not None and self.actuated.type == "revolute"


def read_legs(mechanism: Mechanism) -> tuple[Leg, ...]:
    """The legs of a mechanism, in the order of its sub-chains; `Unsuitable` if one of them is none of these."""
    weld = _welded(mechanism)
    return tuple(_read_leg(mechanism, weld, chain) for chain in decompose(mechanism))


def _welded(mechanism: Mechanism) -> dict[str, str]:
    """The body that stands for each: one for all that fixed joints hold together, the base before any other."""
    group = {body: {body} for body in mechanism.bodies}
    for joint in mechanism.joints:
        if joint.type == "fixed" and joint.name != mechanism.end_effector:
            first, second = (group[body] for body in joint.connects)
            first |= second
            group |= dict.fromkeys(second, first)
    chosen = (mechanism.base, mechanism.end_effector)
    return {body: next((one for one in chosen if one in own), min(own)) for body, own in group.items()}


def _read_leg(mechanism: Mechanism, weld: dict[str, str], chain: SubChain) -> Leg:
    ways = [_way(mechanism, weld, mechanism.joint(name), chain) for name in dict.fromkeys(chain.joints)]
    end = TIP if mechanism.end_effector_is_joint else weld[mechanism.end_effector]
    main = _path(mechanism, ways, [weld[mechanism.base]], [end])
    require(bool(main), f"{chain} does not lead from base to end effector")
    driven = [name for name in dict.fromkeys(chain.joints) if mechanism.joint(name).actuated]
    require(len(driven) <= 1, f"{', '.join(driven)} drive one leg")
    if not driven:
        require(len(ways) == len(main), f"{chain} is not driven")
        guide = _guide(mechanism, main)
        return Leg(None, (), guide, _cones(mechanism, weld, guide))
    driver = main[0] if main[0].joint.actuated and len(main) > 2 else None
    rods = [read_rod(mechanism, main if driver is None else main[1:])]
    rods += _further_rods(mechanism, ways, main)
    slides = [each.joint for rod in rods for each in rod.slides]
    require(all(joint.actuated for joint in slides), f"{', '.join(joint.name for joint in slides)} is not driven")
    require(driver is not None or len(slides) == 1, f"{driven[0]} is neither on the base nor along a strut")
    require(driver is None or driver.joint.type in ("revolute", "prismatic"), f"{driven[0]} is no crank or carriage")
    passages = [*([] if driver is None else [driver]), *(each for rod in rods for each in rod.passages)]
    _require_exact(passages)
    cones = _cones(mechanism, weld, passages)
    spinning = frozenset[str]().union(*(rod.spinning for rod in rods))
    for cone in cones:
        require(cone.axis_on not in spinning, f"the cone of {cone.joint.name} turns with a rod that is free to spin")
    for rod in rods:
        require(
            not {rod.start, rod.end} & spinning, f"{rod.passages[0].joint.name} hangs on a rod that is free to spin"
        )
    return Leg(driver, tuple(rods), (), cones)


def _require_exact(passages: Sequence[Passage]) -> None:
    """Hinges of one leg that are nearly parallel must be so exactly: else they only close at home."""
    hinges = [each for each in passages if each.is_hinge]
    for one, other in combinations(hinges, 2):
        (a,), (b,) = one.axes, other.axes
        sound = is_parallel(a, b, TOLERANCES.rotation) or not is_parallel(a, b)
        require(sound, f"{one.joint.name} and {other.joint.name} are not quite parallel")


def _way(mechanism: Mechanism, weld: dict[str, str], joint: Joint, chain: SubChain) -> tuple[Joint, str, str]:
    """A joint and the bodies it connects; of the joint that is the end effector, the tip instead of the other leg's."""
    first, second = (weld[body] for body in joint.connects)
    if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
        others = [mechanism.joint(name) for name in chain.joints if name != joint.name]
        own = {weld[body] for other in others for body in other.connects}
        return (joint, TIP, second) if second in own else (joint, first, TIP)
    return joint, first, second


def _path(
    mechanism: Mechanism, ways: Sequence[tuple[Joint, str, str]], starts: Iterable[str], ends: Iterable[str]
) -> list[Passage]:
    """The shortest way through some joints from any body of `starts` to one of `ends`, none if there is none."""
    ends = set(ends)
    open_paths: list[tuple[str, list[Passage]]] = [(start, []) for start in starts]
    passed = {start for start, _ in open_paths}
    while open_paths:
        body, path = open_paths.pop(0)
        for joint, first, second in ways:
            if body not in (first, second) or any(each.joint is joint for each in path):
                continue
            forward = body == first
            beyond = second if forward else first
            longer = [*path, passage(mechanism, joint, body, beyond, forward)]
            if beyond in ends and (len(longer) > 1 or beyond not in passed):
                return longer
            if beyond not in passed:
                passed.add(beyond)
                open_paths.append((beyond, longer))
    return []


def _further_rods(mechanism: Mechanism, ways: Sequence[tuple[Joint, str, str]], main: Sequence[Passage]) -> list[Rod]:
    """What is left of a leg beside its main way, as rods between bodies that are placed."""
    placed = [main[0].inner, *(each.outer for each in main)]
    left = [way for way in ways if all(way[0] is not each.joint for each in main)]
    rods = []
    while left:
        path = _path(mechanism, left, placed, placed)
        require(bool(path), f"{', '.join(joint.name for joint, *_ in left)} makes no rod")
        rods.append(read_rod(mechanism, path))
        placed += [each.outer for each in path[:-1]]
        left = [way for way in left if all(way[0] is not each.joint for each in path)]
    return rods


def _guide(mechanism: Mechanism, main: Sequence[Passage]) -> tuple[Passage, ...]:
    """The joints of a leg that is not driven: U or S, and behind it a slide."""
    types = tuple(each.joint.type for each in main)
    guides = (("universal",), ("spherical",), ("universal", "prismatic"))
    require(types in guides, f"{', '.join(each.joint.name for each in main)} is not driven")
    return tuple(main)


def _cones(mechanism: Mechanism, weld: dict[str, str], passages: Sequence[Passage]) -> tuple[Line, ...]:
    """The cones of some joints, whose lines must end within their leg, on the base or on the end effector."""
    known = {body for each in passages for body in (each.inner, each.outer)}
    found = []
    for joint in (each.joint for each in passages):
        if joint.cone is None:
            continue
        start, end = cone_line(mechanism, joint)
        if mechanism.end_effector_is_joint and end.name == mechanism.end_effector:
            on = TIP
        else:
            on = next((weld[body] for body in end.connects if weld[body] in known), "")
        require(on in known, f"the cone of {joint.name} looks at another leg")
        points = ((weld[opposite(joint)], np.array(start.at)), (on, np.array(end.at)))
        found.append(Line(joint, *points, weld[joint.cone.fixed_to]))
    return tuple(found)
