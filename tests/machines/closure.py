"""Machines with chains that positions cannot express, and some that they can; dimensions are arbitrary."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pfabrik import Cone, Joint, Mechanism
from pfabrik.machine.description.home_mobility import universal_axes

from .positions import five_bar, ring

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
TURNS = (0.0, 120.0, 240.0)
POSITION = ("x", "y", "z")
_TYPES = {each[0].upper(): each for each in ("revolute", "prismatic", "universal", "spherical", "cylindrical", "fixed")}
Step = tuple[Any, ...]


def joint(kind: str, name: str, bodies: tuple[str, str], at: Any, direction: Any = None, **more: Any) -> Joint:
    """A joint by the letter of its type, `*` if it is actuated; `direction` is its axis, its two axes, or None."""
    field = {"U": "axes", "R": "axis", "P": "axis", "C": "axis"}.get(kind[0])
    if field and direction is not None:
        more[field] = direction
    return Joint(name, _TYPES[kind[0]], bodies, at=at, actuated=kind.endswith("*"), **more)  # type: ignore[arg-type]


def chain(leg: object, *steps: Step, start: str = "base", end: str = "platform") -> list[Joint]:
    """A serial leg: joints (kind, at, direction, {more}) one after the other."""
    bodies, joints = [start, *(f"{leg}.{k}" for k in range(1, len(steps))), end], []
    for k, (kind, at, *rest) in enumerate(steps):
        direction, more = [*rest, None, {}][:2] if len(rest) < 2 else rest
        joints.append(joint(kind, f"{kind[0]}{leg}.{k + 1}", (bodies[k], bodies[k + 1]), at, direction, **(more or {})))
    return joints


def around(*steps: Step, angles: Sequence[float] = TURNS, start: str = "base", end: str = "platform") -> list[Joint]:
    """Copies of a serial leg, turned about z by angles [deg]: described at 0, where x points outward."""
    joints = []
    for leg, angle in enumerate(angles, 1):
        R = Rotation.from_euler("z", angle, degrees=True).as_matrix()
        joints += chain(leg, *(_turned(R, *step) for step in steps), start=start, end=end)
    return joints


def _turned(R: np.ndarray, kind: str, at: Any, direction: Any = None, more: dict[str, Any] | None = None) -> Step:
    more = dict(more or {})
    if "cone" in more:
        more["cone"] = dataclasses.replace(more["cone"], axis=R @ more["cone"].axis)
    return kind, at if at is None else R @ at, direction if direction is None else np.array(direction) @ R.T, more


def strut(at: Any, end: Any, lower: Any, upper: Any, **slide: Any) -> tuple[Step, Step, Step]:
    """A driven strut whose coordinate at home is its length, with joints (kind, direction, {more}) at both ends."""
    line = np.subtract(end, at)
    drive = ("P*", None, line, {"home": float(np.linalg.norm(line))} | slide)
    return (lower[0], at, *lower[1:]), drive, (upper[0], end, *upper[1:])


def pairs(
    elbow: Any, wrist: Any, across: Any, bodies: tuple[str, str], leg: int, kinds: str = "SS", cone: float | None = None
) -> list[Joint]:
    """Two rods side by side between a body and another; their joints are B and C."""
    joints, across = [], np.array(across)
    for sign, name in ((-1, f"L{leg}"), (1, f"R{leg}")):
        b, c, rod = elbow + sign * across, wrist + sign * across, f"rod{name}"
        axes = (across, np.cross(c - b, across))
        more = {} if cone is None else {"cone": Cone(c - b, cone, bodies[0])}
        joints.append(joint(kinds[0], f"B{name}", (bodies[0], rod), b, axes if kinds[0] == "U" else None, **more))
        joints.append(joint(kinds[1], f"C{name}", (rod, bodies[1]), c, axes[::-1] if kinds[1] == "U" else None))
    return joints


def out(angle: float) -> np.ndarray:
    """The direction outward at an angle [deg]."""
    return np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])


def upu(radial: bool = False, stroke: Any = (120, 260)) -> Mechanism:
    """3-UPU: a translating platform with tangential outer axes; with radial ones it wanders at home."""
    a, c = np.array([100, 0, 0]), np.array([100 if radial else 60, 0, 180])
    outer = X if radial else Y
    inner = np.cross(c - a, outer)
    joints = around(*strut(a, c, ("U", (outer, inner)), ("U", (inner, outer)), home=190.0, range=stroke))
    return Mechanism("wandering 3-UPU" if radial else "3-UPU", joints, "platform", (0, 0, 180))


def tricept() -> Mechanism:
    """3-UPS/UP: a passive centre leg carries the platform."""
    joints = chain(0, ("U", (0, 0, 0), (X, Y)), ("P", None, Z, {"range": (-70, 80)}))
    for leg, angle in enumerate(TURNS, 1):
        a, c = 120 * out(angle + 10), 40 * out(angle) + [0, 0, 200]
        lower = ("U", (np.cross(Z, out(angle)), out(angle)), {"cone": Cone(c - a, 0.8, "base")})
        joints += chain(leg, *strut(a, c, lower, ("S",), range=(150, 290)))
    return Mechanism("3-UPS/UP", joints, "platform", (0, 0, 230))


def delta_legs(
    hip: float, elbow: tuple[float, float], wrist: tuple[float, float], spread: float, swing: tuple[float, float],
    end: str, kinds: str = "SS", cone: float | None = None,
) -> list[Joint]:  # fmt: skip
    """Three arms with two rods each, between points at a radius from the axis and a height."""
    joints = []
    for leg, angle in enumerate(TURNS, 1):
        side = np.cross(Z, out(angle))
        b, c = (radius * out(angle) + [0, 0, height] for radius, height in (elbow, wrist))
        joints.append(joint("R*", f"A{leg}", ("base", f"arm{leg}"), hip * out(angle), side, range=swing))
        joints += pairs(b, c, spread * side, (f"arm{leg}", end), leg, kinds, cone)
    return joints


def delta(kinds: str = "SS", cone: float | None = 0.9) -> Mechanism:
    """A delta whose rods have ball or universal joints at their ends."""
    joints = delta_legs(100, (160, -60), (40, -240), 20, (-1.0, 1.2), "platform", kinds, cone)
    return Mechanism(f"rotary delta, {kinds} rods", joints, "platform", (0, 0, -240))


def _pin_parallelogram(leg: int, arm: str, b: np.ndarray, c: np.ndarray, side: np.ndarray, end: str) -> list[Joint]:
    """Two rods between two bars, pinned: the bars hinged about `side` to the arm and to the platform."""
    normal = np.cross(c - b, side)
    joints = [joint("R", f"B{leg}", (arm, f"top{leg}"), b, side), joint("R", f"C{leg}", (f"low{leg}", end), c, side)]
    for mark, offset in (("l", -20 * side), ("r", 20 * side)):
        limit = {"range": (-1.2, 1.2)} if mark == "l" else {}
        joints += [
            joint("R", f"D{leg}{mark}", (f"top{leg}", f"rod{leg}{mark}"), b + offset, normal, **limit),
            joint("R", f"E{leg}{mark}", (f"rod{leg}{mark}", f"low{leg}"), c + offset, normal),
        ]
    return joints


def pinned_delta() -> Mechanism:
    """A rotary delta whose forearms are parallelograms of pins."""
    joints = []
    for leg, angle in enumerate(TURNS, 1):
        side, elbow, wrist = np.cross(Z, out(angle)), 160 * out(angle) - [0, 0, 60], 40 * out(angle) - [0, 0, 240]
        joints.append(joint("R*", f"A{leg}", ("base", f"arm{leg}"), 100 * out(angle), side, range=(-1.0, 1.2)))
        joints += _pin_parallelogram(leg, f"arm{leg}", elbow, wrist, side, "platform")
    return Mechanism("delta with pins", joints, "platform", (0, 0, -240))


def orthoglide() -> Mechanism:
    """3-PRPaR: three carriages along x, y and z."""
    joints = []
    for leg, (rail, side) in enumerate(((X, Y), (Y, Z), (Z, X)), 1):
        rail, side = np.array(rail), np.array(side)
        joints.append(joint("P*", f"A{leg}", ("base", f"carriage{leg}"), None, rail, range=(-90, 90)))
        joints += _pin_parallelogram(leg, f"carriage{leg}", -250 * rail, -40 * rail, side, "platform")
    return Mechanism("orthoglide", joints, "platform", (0, 0, 0))


def puu() -> Mechanism:
    """3-PUU: a translating platform on three vertical rails."""
    inner = np.cross((-100, 0, -160), Y)
    upper, lower = ("U", (150, 0, 0), (Y, inner)), ("U", (50, 0, -160), (inner, Y))
    return Mechanism("3-PUU", around(("P*", None, Z, {"range": (-80, 100)}), upper, lower), "platform", (0, 0, -160))


def exechon() -> Mechanism:
    """2-UPR/SPR."""
    joints = []
    for leg, y in ((1, -80.0), (2, 80.0)):
        limits = {"range": (-1.2, 1.2)}
        joints += chain(leg, *strut((0, y, 0), (0, 0.4 * y, 180), ("U", (Y, X)), ("R", X, limits), home=200.0,
                                    range=(130, 280)))  # fmt: skip
    a, c = np.array([110.0, 0, 0]), np.array([40.0, 0, 180.0])
    joints += chain(3, ("S", a, None, {"cone": Cone(c - a, 0.7, "base")}), ("P*", None, c - a), ("R", c, Y))
    return Mechanism("2-UPR/SPR", joints, "platform", (0, 0, 180))


def pru_upr() -> Mechanism:
    """2-PRU/UPR: two rails in a plane and a strut across; it rises and tilts. Half of its constraints are implied."""
    joints = []
    for leg, x in ((1, 250.0), (2, -250.0)):
        joints += chain(
            leg,
            ("P*", None, np.sign(x) * np.array(X), {"range": (-120, 120)}),
            ("R", (x, 0.0, 0.0), Y, {"range": (-0.9, 0.9)}),
            ("U", (0.32 * x, 0.0, 300.0), (Y, X), {"range": ((-1.0, 1.0), (-0.8, 0.8))}),
        )
    lower, upper = ("U", (Y, X), {"range": ((-0.8, 0.8), (-0.8, 0.8))}), ("R", X, {"range": (-1.0, 1.0)})
    joints += chain(3, *strut((0, -220, 0), (0, -80, 300), lower, upper, home=331.0, range=(230, 420)))
    return Mechanism("2-PRU/UPR", joints, "platform", (0, 0, 300), task=("z", "tilt"))


def rotopod() -> Mechanism:
    """3-RRS on a circular rail: all motors turn about the platform's own axis."""
    joints = around(
        ("R*", (0, 0, 0), Z, {"range": (-0.9, 0.9)}),
        ("R", (200, 0, 0), Y, {"range": (-0.9, 0.9)}),
        ("S", (80, 0, 180), None, {"cone": Cone((120, 0, -180), 0.8, "platform")}),
    )
    return Mechanism("rotopod", joints, "platform", (0, 0, 180), task=("z", "tilt"))


def angled_prr() -> Mechanism:
    """Planar 3-PRR, its rails 27 degrees from square to the radii, with room for its rods to turn over."""
    joints = around(
        ("P*", None, (0.5, 1, 0), {"range": (-100, 100)}),
        ("R", (180, 30, 0), Z, {"range": (-1.2, 1.2)}),
        ("R", (60, 0, 0), Z),
    )
    return Mechanism("angled 3-PRR", joints, "platform", (0, 0, 0), task=("x", "y", "rotation"))


def cru() -> Mechanism:
    """3-CRU: guides with cylindrical joints, limited in slide and turn, elbows driven."""
    joints = around(
        ("C", (120, 0, 0), Y, {"home": (0.2, 5.0), "range": ((-0.8, 1.1), (-60, 70))}),
        ("R*", (170, 0, 90), Y, {"home": 0.5, "range": (-0.8, 1.8)}),
        ("U", (50, 0, 170), (Y, np.cross((-120, 0, 80), Y))),
    )
    return Mechanism("3-CRU", joints, "platform", (0, 0, 170))


def planar_4rpr() -> Mechanism:
    """A planar platform on four driven struts: one more than it has freedoms."""
    joints = []
    tops = [(-30, -20, 0), (30, -20, 0), (30, 20, 0), (-30, 20, 0)]
    feet = [(-150, -130, 0), (160, -120, 0), (150, 140, 0), (-140, 120, 0)]
    for leg, (a, c) in enumerate(zip(feet, tops, strict=True), 1):
        home = float(np.linalg.norm(np.subtract(c, a)))
        joints += chain(leg, *strut(a, c, ("R", Z), ("R", Z), range=(home - 60, home + 60)))
    return Mechanism("4-RPR", joints, "platform", (0, 0, 0))


def agile_eye(reference: Sequence[float] = (0, 0, 0)) -> Mechanism:
    """A spherical 3-RRR: every axis passes through one point, neighbours at right angles."""
    axes = (((1, 0, 0), (0, 0, -1), (0, 1, 0)), ((0, 1, 0), (-1, 0, 0), (0, 0, 1)), ((0, 0, 1), (0, -1, 0), (1, 0, 0)))
    joints, at = [], (0, 0, 0)
    for leg, (base, elbow, top) in enumerate(axes, 1):
        joints += chain(leg, ("R*", at, base, {"range": (-1.5, 1.5)}), ("R", at, elbow), ("R", at, top))
    return Mechanism("agile eye", joints, "platform", tuple(reference))


def coaxial_rrr() -> Mechanism:
    """Spherical 3-RRR whose motors all turn about the vertical, with links of less than a right angle."""
    cranks, ends = np.radians(60.0), np.radians(65.0)
    b = np.sin(cranks) * out(0.0) - np.cos(cranks) * np.array(Z)
    c = np.sin(ends) * out(57.0) + np.cos(ends) * np.array(Z)
    joints = around(
        ("R*", (0, 0, -100), Z),
        ("R", 100 * b, b, {"range": (-1.7, 1.7)}),
        ("R", 100 * c, c, {"range": (-1.5, 1.5)}),
    )
    return Mechanism("coaxial spherical 3-RRR", joints, "platform", (0, 0, 0), task=("rotation",))


def ankle() -> Mechanism:
    """2-UPS/U: a universal joint straight between base and platform."""
    joints = [joint("U", "ankle", ("base", "platform"), (0, 0, 100), (X, Y), range=((-0.6, 0.7), (-0.5, 0.5)))]
    for leg, (a, c) in enumerate((((-60, 40, 0), (-50, 35, 110)), ((-60, -40, 0), (-50, -35, 110))), 1):
        upper = ("S", None, {"cone": Cone((0, 0, -1), 0.7, "platform")})
        joints += chain(leg, *strut(a, c, ("U", (X, Y)), upper, home=110.0, range=(80, 150)))
    return Mechanism("2-UPS/U", joints, "platform", (10, 0, 110))


def four_bar_driven() -> Mechanism:
    """A two-link arm whose first link is the rocker of a four-bar, its second driven by itself."""
    joints = [
        joint("R*", "crank", ("base", "wheel"), (0, 0, 0), Z),
        joint("R", "pin", ("wheel", "coupler"), (0, 30, 0), Z),
        joint("R", "pin2", ("coupler", "rocker"), (100, 70, 0), Z),
        joint("R", "pivot", ("base", "rocker"), (110, 0, 0), Z, range=(-0.9, 0.9)),
        joint("R*", "elbow", ("rocker", "arm"), (100, 180, 0), Z, home=0.4, range=(-1.5, 2.0)),
        joint("R", "tip", ("arm", "tool"), (190, 210, 0), Z),
    ]
    return Mechanism("arm on a four-bar", joints, "tip")


def ranged_stewart() -> Mechanism:
    """A 6-UPS whose universal joints have ranges."""
    joints = []
    bases = ring(100, 0, [a + s for a in TURNS for s in (-14, 14)])
    tops = ring(62, 180, [a + s for a in TURNS for s in (-46, 46)])
    for leg, (a, c) in enumerate(zip(bases, tops, strict=True), 1):
        lower = ("U", (X, Y), {"range": ((-0.35, 0.35), (-0.3, 0.4))})
        upper = ("S", None, {"cone": Cone(np.subtract(a, c), 0.3, "platform")})
        joints += chain(leg, *strut(a, c, lower, upper, home=200.0, range=(150, 260)))
    return Mechanism("ranged 6-UPS", joints, "platform", (0, 0, 180))


def five_bar_with_tool() -> Mechanism:
    """The tool is on one of the two upper bars, beyond the hinge between them: the bar turns where it goes."""
    joints = [
        joint("R*", "A1", ("base", "a1"), (-40, 0, 0), Z),
        joint("R", "B1", ("a1", "c1"), (-80, 90, 0), Z, range=(-1.8, 2.0)),
        joint("R*", "A2", ("base", "a2"), (55, -10, 0), Z, range=(-1.4, 1.1)),
        joint("R", "B2", ("a2", "c2"), (95, 70, 0), Z, range=(-1.8, 0.7)),
        joint("R", "P", ("c1", "c2"), (10, 180, 0), Z),
    ]
    return Mechanism("5-bar with a tool", joints, "c1", (35, 215, 10), task=("x", "y"))


ARM = (
    ("R*", (0, 0, 100), Z, {"range": (-2.9, 2.9)}),
    ("R*", (30, 0, 100), Y, {"range": (-1.9, 1.9), "home": 0.3}),
    ("R*", (30, 0, 350), Y, {"range": (-2.4, 2.4)}),
    ("R*", (200, 0, 380), X),
    ("R*", (260, 0, 380), Y, {"range": (-2.0, 2.0)}),
    ("R*", (300, 0, 370), Z),
)


def arm() -> Mechanism:
    """A serial arm of six revolutes with a wrist that is none: no two last axes meet."""
    return Mechanism("6R arm", chain(1, *ARM), "platform", (300, 0, 340))


def wrist_arm(**more: Any) -> Mechanism:
    """A serial arm of six revolutes with a spherical wrist, upright at home, the forearm level; `more` is of each."""
    wrist = (395, 0, 630)
    points = [(0, 0, 0), (75, 0, 330), (75, 0, 630), wrist, wrist, wrist]
    steps = [("R*", at, axis, more) for at, axis in zip(points, (Z, Y, Y, X, Y, X), strict=True)]
    return Mechanism("6R arm with a wrist", chain(1, *steps, end="tool"), "tool", (475, 0, 630))


def welded_tricept() -> Mechanism:
    """The tricept with bodies welded together: the foot to the base, two plates to one."""
    joints = [
        joint("F", "foot", ("plinth", "base"), (0, 0, 0)),
        joint("F", "flange", ("platform", "plate"), (0, 0, 210)),
    ]
    for each in tricept().joints:
        welds = {} if each.type == "spherical" else {"base": "plinth", "platform": "plate"}
        cone = each.cone and dataclasses.replace(each.cone, fixed_to="plinth")
        joints.append(dataclasses.replace(each, connects=tuple(welds.get(b, b) for b in each.connects), cone=cone))
    return Mechanism("welded 3-UPS/UP", joints, "platform", (0, 0, 230))


def carried_tip(kind: str) -> Mechanism:
    """The pinned delta with a tool: the joint between platform and tool is the end effector."""
    direction = (X, Y) if kind == "U" else None
    joints = [*pinned_delta().joints, joint(kind, "tip", ("platform", "tool"), (5, 0, -260), direction)]
    return Mechanism(f"delta with a {_TYPES[kind]} tip", joints, "tip")


def _fingers(body: str, x: float, z: float, step: float) -> list[Joint]:
    """A driven four-bar on a body."""
    return [
        joint("R*", "g1", (body, "finger1"), (x - 10, 0, z), Y, range=(-0.4, 0.4)),
        joint("R", "g2", (body, "finger2"), (x + 10, 0, z), Y, range=(-0.5, 0.5)),
        joint("R", "g3", ("finger1", "tie"), (x - 10, 0, z + step), Y),
        joint("R", "g4", ("finger2", "tie"), (x + 10, 0, z + step), Y),
    ]


def with_gripper() -> Mechanism:
    """An arm whose gripper is a loop of its own, beyond the end effector, with a motor and limits."""
    tip = joint("R", "tip", ("hand", "palm"), (300, 0, 340), Z, range=(-0.5, 0.5))
    joints = [*chain(1, *ARM, end="hand"), tip, *_fingers("palm", 300, 340, -30)]
    return Mechanism("arm with a gripper", joints, "tip")


def gripper_on_platform() -> Mechanism:
    """A tricept whose platform carries a driven four-bar that no path to it passes."""
    joints = [*tricept().joints, *_fingers("platform", 0, 230, 30)]
    return Mechanism("3-UPS/UP with a gripper", joints, "platform", (0, 0, 230))


def hinge() -> Mechanism:
    driven = joint("R*", "R", ("base", "platform"), (10, 0, 0), Z, home=0.3, range=(-1, 2))
    return Mechanism("hinge", [driven], "platform", (50, 0, 0))


def slider() -> Mechanism:
    driven = joint("P*", "P", ("platform", "base"), None, X, home=7, range=(-50, 90))
    return Mechanism("slider", [driven], "platform", (50, 0, 0))


def crooked_upr() -> Mechanism:
    """A leg U-P-R of arbitrary axes and one R-U-P-U, between three of UPS."""
    ends = ((100, 0, 0), (60, 10, 180)), ((-20, 90, 0), (-30, 50, 185)), ((-80, -60, 0), (-40, -40, 180))
    joints = []
    for leg, (a, c) in enumerate(ends, 1):
        joints += chain(leg, ("U", a, (X, Y)), ("P*", None, np.subtract(c, a), {"range": (-60, 70)}), ("S", c))
    joints += chain(
        4,
        ("R*", (30, -100, 0), (1, 0.2, 0.1), {"range": (-1, 1)}),
        ("U", (32, -130, 40), (X, (0, 1, 0.5))),
        ("P*", None, (0.1, 0.5, 1.0), {"range": (-60, 60)}),
        ("U", (20, -55, 175), (Y, X)),
    )
    return Mechanism("crooked legs", joints, "platform", (0, 0, 180))


MACHINES: dict[str, Callable[[], Mechanism]] = {
    "upu": upu,
    "wandering_upu": lambda: upu(radial=True),
    "tricept": tricept,
    "delta_ss": delta,
    "delta_su": lambda: delta("SU"),
    "delta_uu": lambda: delta("UU", cone=None),
    "delta_small_cones": lambda: delta(cone=0.15),
    "pinned_delta": pinned_delta,
    "orthoglide": orthoglide,
    "puu": puu,
    "exechon": exechon,
    "cru": cru,
    "planar_4rpr": planar_4rpr,
    "agile_eye": agile_eye,
    "agile_eye_offset": lambda: agile_eye((0, 0, 50)),
    "ankle": ankle,
    "four_bar_driven": four_bar_driven,
    "ranged_stewart": ranged_stewart,
    "limited_tip": lambda: five_bar([(-50, 0), (50, 0)], [(-120, 60), (120, 60)], (0, 130), tip=(-0.5, 0.3)),
    "arm": arm,
    "welded_tricept": welded_tricept,
    "spherical_tip": lambda: carried_tip("S"),
    "universal_tip": lambda: carried_tip("U"),
    "fixed_tip": lambda: carried_tip("F"),
    "gripper": with_gripper,
    "platform_gripper": gripper_on_platform,
    "hinge": hinge,
    "slider": slider,
    "crooked": crooked_upr,
}


def scara(task: Sequence[str] | None = ("x", "y", "z", "yaw")) -> Mechanism:
    """Two arms, a quill and a turning tool: all axes upright."""
    steps = (
        ("R*", (0, 0, 0), Z, {"range": (-2.5, 2.5)}),
        ("R*", (200, 0, 0), Z, {"range": (-2.4, 2.4)}),
        ("P*", None, Z, {"range": (-50, 50)}),
        ("R*", (350, 50, 0), Z),
    )
    return Mechanism("SCARA", chain(1, *steps, end="tool"), "tool", (350, 50, 0), task=task)


def h4(task: Sequence[str] = ("x", "y", "z", "yaw")) -> Mechanism:
    """Four arms with pairs of rods on two half platforms, hinged to a third that turns as these shift: x, y, z, yaw."""
    joints = []
    for leg, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1)), 1):
        # the arm of a quadrant points outward, 30 degrees from the plane of the hinges; its rods are square to it
        outward = np.array([x * np.sin(np.radians(30.0)), y * np.cos(np.radians(30.0)), 0.0])
        across, foot = np.cross(Z, outward), np.array([100.0 * x, 173.20508075688772 * y, 0.0])
        half = "front" if y > 0 else "back"
        joints.append(joint("R*", f"A{leg}", ("base", f"arm{leg}"), foot, across, range=(-1.22, 1.57)))
        joints += pairs(foot + 250.0 * outward, [60.0 * x, 90.0 * y, -500.0], 40 * across, (f"arm{leg}", half), leg)
    joints.append(joint("R", "Q1", ("front", "platform"), (0, 90, -500), Z, range=(-1.4, 1.4)))
    joints.append(joint("R", "Q2", ("back", "platform"), (0, -90, -500), Z))
    return Mechanism("H4", joints, "platform", (0, 0, -500), task=tuple(task))


def rrrs() -> Mechanism:
    """Three legs like those of a walking robot: a hip that swings, a thigh, a shank, and a ball at the end."""
    joints = around(
        ("R*", (120, 0, 0), Z, {"range": (-0.7, 0.7)}),
        ("R*", (150, 0, 0), Y, {"range": (-0.9, 0.9)}),
        ("R", (210, 0, 80), Y, {"range": (-1.2, 1.2)}),
        ("S", (70, 0, 190)),
    )
    return Mechanism("3-RRRS", joints, "platform", (0, 0, 190))


def offset_cardans() -> Mechanism:
    """A hexapod whose cardan joints at the base have axes that pass each other 12 mm apart."""
    joints = []
    feet, heads = ring(150, 0, (-8, 8, 112, 128, 232, 248)), ring(90, 200, (-40, 40, 80, 160, 200, 280))
    for leg, (foot, head) in enumerate(zip(np.array(feet), np.array(heads), strict=True), 1):
        outward = foot / np.linalg.norm(foot)
        joints += chain(
            leg,
            ("R", foot - 12 * np.cross(Z, outward) - [0.0, 0.0, 12.0], outward, {"range": (-0.8, 0.8)}),
            ("R", foot, np.cross(outward, head - foot), {"range": (-0.9, 0.9)}),
            ("P*", None, (head - foot) / np.linalg.norm(head - foot), {"range": (-45, 60)}),
            ("S", head),
        )
    return Mechanism("6-RRPS", joints, "platform", (0, 0, 200))


def par4() -> Mechanism:
    """Four arms with pairs of rods on two half platforms; two bars keep these parallel, and one carries the tool."""
    joints = []
    for leg, angle in enumerate((45, 135, 225, 315), 1):
        outward, across = out(angle), np.cross(Z, out(angle))
        half, wrist = "front" if outward[1] > 0 else "back", np.sign(outward) * (70, 80, 0) - [0, 0, 800]
        joints.append(joint("R*", f"A{leg}", ("base", f"arm{leg}"), 275 * outward, across, range=(-1.0, 1.4)))
        joints += pairs(635 * outward - [0, 0, 110], wrist, 50 * across, (f"arm{leg}", half), leg)
    for bar, x in ((1, -60.0), (2, 60.0)):
        limit = {"range": (-1.5, 1.5)} if bar == 1 else {}
        joints.append(joint("R", f"P{bar}", ("front", f"bar{bar}"), (x, 80, -800), Z, **limit))
        joints.append(joint("R", f"Q{bar}", ("back", f"bar{bar}"), (x, -80, -800), Z))
    return Mechanism("Par4", joints, "bar1", (-60, 0, -800), task=("x", "y", "z", "yaw"))


def ruu() -> Mechanism:
    """4-RUU: upright cranks, and rods whose cardan joints let the platform shift and yaw."""
    joints = []
    for leg, angle in enumerate((20, 100, 200, 290), 1):
        sense = 1 if leg % 2 else -1
        across = out(angle) + 0.8 * sense * np.cross(Z, out(angle))
        foot, head = 150 * out(angle), 40 * out(angle + 15 * sense) + [0, 0, 130]
        elbow = foot + (60 + 5 * leg) * across / np.linalg.norm(across)
        level = np.cross(Z, head - elbow)
        joints += chain(
            leg,
            ("R*", foot, Z, {"range": (-1.0, 1.3)}),
            ("U", elbow, (Z, level), {"range": ((-1.5, 1.2), (-0.5, 0.6))}),
            ("U", head, (level, Z)),
        )
    return Mechanism("4-RUU", joints, "platform", (0, 0, 130), task=("x", "y", "z", "yaw"))


def rrur() -> Mechanism:
    """4-RRUR: upright elbows below a platform that shifts and yaws, its hinges held level."""
    joints = []
    for leg, (angle, turned) in enumerate(((20, 15), (110, -30), (200, 15), (290, -30)), 1):
        sense = np.sign(turned)
        shoulder, wrist = 150 * out(angle), 90 * out(angle + 10 * sense)
        across = out(angle) + 0.8 * sense * np.cross(Z, out(angle))
        elbow, head = shoulder + 60 * across / np.linalg.norm(across), 40 * out(angle + turned) + [0, 0, 60]
        level = np.cross(Z, head - wrist)
        joints += chain(
            leg,
            ("R*", shoulder, Z, {"range": (-1.0, 1.3)}),
            ("R", elbow, Z),
            ("U", wrist, (Z, level), {"range": ((-1.5, 1.2), (-0.8, 0.6))}),
            ("R", head, level),
        )
    return Mechanism("4-RRUR", joints, "platform", (0, 0, 60), task=POSITION)


def hybrid() -> Mechanism:
    """A turntable below, three sliding legs with hinges at their feet in between, and a wrist of two hinges above."""
    line = np.array([-50, 0, 180]) / np.hypot(50, 180)
    joints = [
        joint("R*", "turntable", ("base", "table"), (0, 0, -40), Z, range=(-1.0, 1.0)),
        *around(
            ("R", (120, 0, 0), Y, {"range": (-0.7, 0.7)}),
            ("P*", None, line, {"range": (-50, 60)}),
            ("S", (70, 0, 180), None, {"cone": Cone((0, 0, -1), 1.0, "plate")}),
            start="table",
            end="plate",
        ),
    ]
    wrist = ("R*", (0, 0, 200), X, {"range": (-1.2, 1.2)}), ("R*", (0, 0, 220), Y, {"range": (-1.2, 1.2)})
    joints += chain("w", *wrist, start="plate", end="tool")
    return Mechanism("R + 3-RPS + RR", joints, "tool", (0, 0, 260))


def stretched_wrist(tool: tuple[float, float, float] = (0, 0, 270)) -> Mechanism:
    """Three sliding legs with hinges at their feet, and on their plate a wrist of two hinges: the first is in line with
    the tool at home, where both of its ways to point the tool meet."""
    upper = ("S", None, {"cone": Cone((45, 0, -160), 0.7, "plate")})
    leg = strut((100, 0, 0), (55, 0, 160), ("R", Y, {"range": (-0.5, 0.6)}), upper, range=(130, 210))
    wrist = ("R*", (0, 0, 190), Z, {"range": (-2.5, 2.9)}), ("R*", (0, 0, 220), X, {"range": (-0.3, 1.9)})
    joints = around(*leg, angles=(0, 125, 240), end="plate") + chain("w", *wrist, start="plate", end="tool")
    return Mechanism("3-RPS + RR", joints, "tool", tool, task=("x", "y", "z", "tilt"))


def picker() -> Mechanism:
    """A delta whose tool a shaft turns: from a motor on the base, through cardan joints and a slide between them."""
    joints = delta_legs(200, (535, -105), (45, -800), 50, (-1.2, 1.5), "plate")
    joints.append(joint("R", "bearing", ("plate", "tool"), (0, 0, -800), Z))
    joints += chain(
        "shaft",
        ("R*", (0, 0, 0), Z, {"range": (-3.0, 3.0)}),
        ("U", (0, 0, -20), (X, Y)),
        ("P", None, (0, 0, -1), {"range": (-300, 300)}),
        ("U", (0, 0, -780), (Y, X)),
        end="tool",
    )
    return Mechanism("delta with a shaft", joints, "tool", (0, 0, -820), task=("x", "y", "z", "yaw"))


def tricept_with_wrist() -> Mechanism:
    """Three sliding legs and a guide that cardan joints hold, and beyond the plate a wrist of three hinges."""
    joints, bodies = [*tricept().joints], ("platform", "wrist1", "wrist2", "tool")
    for k, (height, axis) in enumerate(((240, X), (260, Y), (280, Z))):
        joints.append(joint("R*", f"W{k}", bodies[k : k + 2], (0, 0, height), axis, range=(-1.2, 1.2)))
    return Mechanism("Tricept with a wrist", joints, "tool", (0, 0, 320))


def stretched_delta() -> Mechanism:
    """A delta whose cranks and rods are in line at home."""
    elbow = 0.65 * np.array((200, 0)) + 0.35 * np.array((45, -800))
    joints = delta_legs(200, (elbow[0], elbow[1]), (45, -800), 50, (-1.2, 1.5), "plate")
    return Mechanism("stretched delta", joints, "plate", (0, 0, -800), task=POSITION)


ON_ARMS: dict[str, Callable[[], Mechanism]] = {
    "H4": h4,
    "Par4": par4,
    "R + 3-RPS + RR": hybrid,
    "delta with a shaft": picker,
    "Tricept with a wrist": tricept_with_wrist,
    "SCARA": scara,
    "3-CRU": cru,
    "3-RRRS": rrrs,
    "6-RRPS": offset_cardans,
}
"""Machines with legs on arms that follow from their poses."""


def with_hinges_apart(delta: Mechanism) -> Mechanism:
    """A delta whose universal joints are two hinges, a hundredth of a millimetre apart: no closed forms answer it."""
    joints: list[Joint] = []
    for joint in delta.joints:
        if joint.type != "universal":
            joints.append(joint)
            continue
        at, (first, second), cross = np.array(joint.at), universal_axes(delta, joint), f"{joint.name}:cross"
        joints.append(Joint(f"{joint.name}a", "revolute", (joint.connects[0], cross), at=at, axis=first))
        off = at + [0.01, 0.0, 0.01]
        joints.append(Joint(f"{joint.name}b", "revolute", (cross, joint.connects[1]), at=off, axis=second))
    return Mechanism("apart", joints, "platform", delta.reference_point, length_unit="mm", task=delta.task)
