"""Deltas as firmwares know them, by few numbers: their tables, as of a mechanism file, with these as dimensions.

A firmware knows nothing of platform and rod pairs: the joints are drawn `platform_radius` farther out, and the rods of
a pair `apart`. No position depends on either.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ....errors import Fault, InvalidMechanism

TOWERS = "abc"

LOOPLESS = "a printer without closed loops, or with others than a delta's"

SHOWN = 0.2
"""Platform's radius, as drawn, over the delta's."""

Table = dict[str, Any]

Three = Mapping[str, Sequence[float]]
"""A number of each of three towers, or arms, by name."""


def fault(place: str, found: str, expected: str) -> InvalidMechanism:
    """The error of one wrong setting."""
    return InvalidMechanism([Fault(place, found, expected)])


def linear_delta(radius: float, towers: Three, lowest: float = 0.0) -> Table:
    """Carriages on upright towers, with the nozzle at the origin at home.

    A carriage at (r cos angle, r sin angle) is at sqrt(arm_length² - (x - its x)² - (y - its y)²) + z.

    Parameters
    ----------
    radius : from the middle to the joints of a tower, less the platform's [mm].
    towers : "angle" [deg], "arm_length" and "position_endstop" [mm], of the nozzle in the middle with this carriage at
        its endstop; "radius_trim" [mm], what the tower is farther out, if any is.
    lowest : of carriages [mm].
    """
    dimensions: Table = {"delta_radius": radius} | _drawn(radius)
    joints: list[Table] = []
    for k, letter in enumerate(TOWERS):
        dimensions |= {f"{name}_{letter}": float(values[k]) for name, values in towers.items()}
        _require_rail(radius, letter, {name: values[k] for name, values in towers.items()}, lowest)
        out = f"(delta_radius + radius_trim_{letter})" if "radius_trim" in towers else "delta_radius"
        height, stop = f"height_{letter}", f"position_endstop_{letter}"
        dimensions[height] = f"sqrt(arm_length_{letter}**2 - {out}**2)"
        rail = {"home": height, "range": [lowest, f"{height} + {stop}"]}
        carriage = {"type": "prismatic", "actuated": True, "connects": ["base", f"slide_{letter}"], "axis": [0, 0, 1]}
        joints.append({"name": f"carriage_{letter}"} | carriage | rail)
        joints += _pair(letter, f"slide_{letter}", (f"({out} + platform_radius)", height), "0")
    return _machine("Delta printer", dimensions, joints, 0)


def rotary_delta(radius: float, arms: Three) -> Table:
    """Arms that turn about level axes, counted upward from level, with the nozzle in the middle at home.

    Parameters
    ----------
    radius : from the middle to an arm's axis, less the platform's [mm].
    arms : "angle" [deg], "upper_arm_length", "lower_arm_length", "shoulder_height" [mm]; "position_endstop", of the
        nozzle in the middle with this arm at its endstop [mm], or "lowest" and "highest", of the arm's angle [deg].
    """
    dimensions: Table = {"shoulder_radius": radius} | _drawn(radius)
    shared = "shoulder_height" if len(set(arms["shoulder_height"])) == 1 else None
    if shared:
        dimensions[shared] = arms[shared][0]
    first = {name: values[0] for name, values in arms.items()}
    dimensions["home_height"] = _level_height(radius, first)
    joints: list[Table] = []
    for k, letter in enumerate(TOWERS):
        dimensions |= {f"{name}_{letter}": float(values[k]) for name, values in arms.items() if name != shared}
        height = shared or f"shoulder_height_{letter}"
        arm = {name: values[k] for name, values in arms.items()}
        if "position_endstop" in arms:
            _require_reach(radius, f"position_endstop of arm {letter}", arm, arm["position_endstop"])
        _require_reach(radius, f"nozzle's height with arm {letter} at home", arm, dimensions["home_height"])
        dimensions |= _arm_angle(letter, "home", height, "home_height")
        if "position_endstop" in arms:
            dimensions |= _arm_angle(letter, "highest", height, f"position_endstop_{letter}")
        angle, upper, raised = f"angle_{letter}", f"upper_arm_length_{letter}", f"home_{letter}"
        out = "(shoulder_radius + platform_radius)"
        joints.append(
            {"name": f"arm_{letter}", "type": "revolute", "actuated": True}
            | {"connects": ["base", f"upper_arm_{letter}"]}
            | {"at": [f"{out}*cos({angle})", f"{out}*sin({angle})", height]}
            | {"axis": [f"sin({angle})", f"-cos({angle})", 0], "home": raised}
            | {"range": [f"lowest_{letter}" if "lowest" in arms else -180, f"highest_{letter}"]}
        )
        elbow = (f"({out} + {upper}*cos({raised}))", f"{height} + {upper}*sin({raised})")
        across = [f"sin({raised})*cos({angle})", f"sin({raised})*sin({angle})", f"-cos({raised})"]
        joints += _pair(letter, f"upper_arm_{letter}", elbow, "home_height", across)
    return _machine("Rotary delta printer", dimensions, joints, "home_height")


def deltesian(arms: Mapping[str, Sequence[float]], lowest: float, y: tuple[float, float]) -> Table:
    """Two carriages on upright towers, left and right, and a slide along y, with the nozzle in the middle at home.

    A carriage is at sqrt(arm_length² - (x ± arm_x_length)²) + z. The left arm is a parallelogram, which keeps the
    platform level; in the firmware nothing tells which arm is.

    Parameters
    ----------
    arms : "arm_x_length", "arm_length" and "position_endstop" [mm], of the left arm, and of the right one.
    lowest : of carriages [mm].
    y : range of the slide [mm].
    """
    width = max(arms["arm_x_length"])
    at_y = min(max(0.0, y[0]), y[1])
    dimensions: Table = {"platform_radius": round(SHOWN * width, 1), "apart": round(2.0 * SHOWN * width, 1)}
    joints: list[Table] = []
    for k, (side, sign) in enumerate((("left", "-"), ("right", ""))):
        dimensions |= {f"{name}_{side}": float(values[k]) for name, values in arms.items()}
        out, arm, height = f"arm_x_length_{side}", f"arm_length_{side}", f"height_{side}"
        _require_rail(arms["arm_x_length"][k], side, {name: values[k] for name, values in arms.items()}, lowest)
        dimensions[height] = f"sqrt({arm}**2 - {out}**2)"
        rail = {"home": height, "range": [lowest, f"{height} + position_endstop_{side}"]}
        slide = {"type": "prismatic", "actuated": True, "connects": ["gantry", f"slide_{side}"], "axis": [0, 0, 1]}
        joints.append({"name": f"carriage_{side}"} | slide | rail)
        for rod, above in (("", "0"), ("_upper", "apart"))[: 2 if side == "left" else 1]:
            ends = [f"slide_{side}", f"rod_{side}{rod}", "platform"]
            places = [(f"{sign}({out} + platform_radius)", f"{height} + {above}"), (f"{sign}platform_radius", above)]
            hinges = [
                {"name": f"{end}_{side}{rod}", "type": "revolute", "connects": ends[n : n + 2], "at": [x, at_y, z]}
                for n, (end, (x, z)) in enumerate(zip(("upper", "lower"), places, strict=True))
            ]
            turn = {"axis": [0, 1 if side == "left" else -1, 0]}
            leaning = {"home": f"atan2({out}, {height})", "range": [-90, 90]} if not rod else {}
            joints += [hinges[0] | turn, hinges[1] | turn | leaning]
    along = {"type": "prismatic", "actuated": True, "connects": ["base", "gantry"], "axis": [0, 1, 0]}
    joints.append({"name": "carriage_y"} | along | {"home": at_y, "range": [*y]})
    return _machine("Deltesian printer", dimensions, joints, 0) | {"reference_point": [0, at_y, 0]}


def counted_from_endstops(table: Table, tops: Mapping[str, float]) -> Table:
    """The same machine with its actuators counted as steps are: at its endstop each has a value that never changes.

    A machine's own actuators count from the bed, or from level: where the endstop then is follows from its dimensions.

    Parameters
    ----------
    tops : an actuator's value at its endstop, by name [mm or deg].
    """
    joints = []
    for joint in table["joint"]:
        if joint.get("actuated"):
            lowest, highest = joint["range"]
            top = tops[joint["name"]]
            joint = joint | {"home": f"{top:.17g} - (({highest}) - ({joint['home']}))", "range": [lowest, top]}
        joints.append(joint)
    return table | {"joint": joints}


def _require_rail(radius: float, letter: str, tower: Mapping[str, float], lowest: float) -> None:
    out, arm = radius + tower.get("radius_trim", 0.0), tower["arm_length"]
    if not 0.0 < out < arm:
        raise fault(f"tower {letter}", f"rods of {arm:g} at a radius of {out:g}", "a radius above 0, and longer rods")
    height = math.sqrt(arm - out) * math.sqrt(arm + out)
    top = height + tower["position_endstop"]
    if not lowest <= height <= top:
        found = f"a carriage from {lowest:g} to {top:g}, and at {height:g} with the nozzle on the bed"
        raise fault(f"tower {letter}", found, "an endstop above, and a lowest z below")


def _require_reach(radius: float, place: str, arm: Mapping[str, float], nozzle: float) -> None:
    upper, lower = arm["upper_arm_length"], arm["lower_arm_length"]
    far = math.hypot(radius, arm["shoulder_height"] - nozzle)
    if not abs(upper - lower) < far < upper + lower:
        found = f"{nozzle:g}, {far:g} from the shoulder of arms {upper:g} and {lower:g}"
        raise fault(place, found, "a height where the arms reach the middle")


def _drawn(radius: float) -> Table:
    return {"platform_radius": round(SHOWN * radius, 1), "apart": round(2.0 * SHOWN * radius, 1)}


def _level_height(radius: float, arm: Mapping[str, float]) -> float:
    """Height of the nozzle in the middle with an arm level; half its endstop's where the arm cannot be level."""
    below = arm["lower_arm_length"] ** 2 - (radius + arm["upper_arm_length"]) ** 2
    if below > 0.0:
        return float(arm["shoulder_height"] - below**0.5)
    return float(arm.get("position_endstop", 0.0)) / 2.0


def _arm_angle(letter: str, name: str, height: str, nozzle: str) -> Table:
    """Dimensions that end in the angle of an arm with the nozzle in the middle at a height, the elbow outside.

    By the cosine rule in the triangle of shoulder, elbow and nozzle: (upper² + reach² - lower²) / (2 upper reach).
    """
    upper, lower = f"upper_arm_length_{letter}", f"lower_arm_length_{letter}"
    reach, bend = f"{name}_reach_{letter}", f"{name}_bend_{letter}"
    return {
        reach: f"sqrt(shoulder_radius**2 + ({height} - {nozzle})**2)",
        bend: f"({upper}**2 + {reach}**2 - {lower}**2) / (2*{upper}*{reach})",
        f"{name}_{letter}": f"atan2({nozzle} - {height}, -shoulder_radius) + atan2(sqrt(1 - {bend}**2), {bend})",
    }


def _pair(
    letter: str, carrier: str, knee: tuple[str, str], foot: str, below: list[Any] | None = None
) -> Iterator[Table]:
    """Two parallel rods from a carrier, at a radius and a height, to the platform, at a height.

    A firmware knows one of the places that a carrier may have: the rods stand on the platform, at one side of an arm.

    Parameters
    ----------
    below : direction square to an arm, towards the side of its rods.
    """
    angle = f"angle_{letter}"
    for side, along_x, along_y in (("l", "-", "+"), ("r", "+", "-")):
        places = [
            [
                f"{radius}*cos({angle}) {along_x} apart/2*sin({angle})",
                f"{radius}*sin({angle}) {along_y} apart/2*cos({angle})",
                height,
            ]
            for radius, height in (knee, ("platform_radius", foot))
        ]
        rod = f"rod_{letter}{side}"
        upper = {"name": f"upper_{letter}{side}", "type": "spherical", "connects": [carrier, rod], "at": places[0]}
        lower = {"name": f"lower_{letter}{side}", "type": "spherical", "connects": [rod, "platform"], "at": places[1]}
        yield upper | ({"cone": {"axis": below, "half_angle": 90, "fixed_to": carrier}} if below else {})
        yield lower | {"cone": {"axis": [0, 0, 1], "half_angle": 90, "fixed_to": "platform"}}


def _machine(name: str, dimensions: Table, joints: list[Table], height: object) -> Table:
    return {
        "schema": 1,
        "name": name,
        "units": {"length": "mm", "angle": "deg"},
        "end_effector": "platform",
        "reference_point": [0, 0, height],
        "task": ["x", "y", "z"],
        "dimensions": dimensions,
        "joint": joints,
    }
