"""Linkages written as MuJoCo models in frames of any orientation, as a drawing program does, to so many digits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation


class Hinge(NamedTuple):
    """A hinge between two bodies; or a ball, without an axis."""

    name: str
    parent: str
    child: str
    at: np.ndarray
    axis: np.ndarray | None


@dataclass
class Linkage:
    hinges: list[Hinge]
    drives: list[str]
    end_effector: str
    freedoms: int


def unit(vector: Sequence[float] | np.ndarray) -> np.ndarray:
    return np.asarray(vector, dtype=float) / np.linalg.norm(vector)


ANYWHERE = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
ORIGIN = np.array([0.11, -0.23, 0.31])


def spherical_three_legs() -> Linkage:
    """Three legs of three hinges, all of whose axes meet in one point."""
    hinges = []
    for leg in range(3):
        turn = Rotation.from_euler("z", 2.0 * np.pi * leg / 3.0).as_matrix()
        low, middle, high = (turn @ unit(each) for each in ([0.6, 0.1, -0.8], [0.7, 0.7, 0.1], [0.5, 0.0, 0.9]))
        axes = [ANYWHERE @ each for each in (low, middle, high)]
        hinges += [
            Hinge(f"m{leg}", "world", f"link{leg}a", ORIGIN + 0.06 * axes[0], axes[0]),
            Hinge(f"p{leg}", f"link{leg}a", f"link{leg}b", ORIGIN + 0.08 * axes[1], axes[1]),
            Hinge(f"q{leg}", f"link{leg}b", "platform", ORIGIN + 0.05 * axes[2], axes[2]),
        ]
    return Linkage(hinges, ["m0", "m1", "m2"], "platform", 3)


def planar_four_bar(base: str = "world", mark: str = "", at: np.ndarray = ORIGIN) -> Linkage:
    """Four parallel hinges, each somewhere along its axis."""
    corners = [[0.0, 0.0, 0.01], [0.03, 0.11, 0.04], [0.17, 0.13, -0.02], [0.15, 0.0, 0.03]]
    bodies = [base, f"crank{mark}", f"coupler{mark}", f"rocker{mark}", base]
    axis = ANYWHERE[:, 2]
    hinges = [
        Hinge(f"h{mark}{k}", *sorted(bodies[k : k + 2], key=bodies[:4].index), at + ANYWHERE @ corners[k], axis)
        for k in range(4)
    ]
    return Linkage(hinges, [f"h{mark}0"], f"coupler{mark}", 1)


def third_rod() -> Linkage:
    """A parallelogram with a rod more than it needs, as long as the others."""
    feet, up = [[0.0, 0.0, 0.0], [0.13, 0.02, 0.03], [0.07, -0.05, 0.01]], np.array([0.05, 0.12, 0.0])
    hinges = []
    for k, foot in enumerate(feet):
        at = ORIGIN + ANYWHERE @ foot
        hinges.append(Hinge(f"low{k}", "world", f"rod{k}", at, ANYWHERE[:, 2]))
        hinges.append(Hinge(f"high{k}", f"rod{k}", "top", at + ANYWHERE @ up, ANYWHERE[:, 2]))
    return Linkage(hinges, ["low0"], "top", 1)


def bennett() -> Linkage:
    """Four hinges, opposite links alike, lengths as the sines of the twists: no two axes are parallel or meet."""
    short, twist, long = 0.10, 0.7, 0.14
    other = np.arcsin(long * np.sin(twist) / short)

    def link(angle: float, length: float, alpha: float) -> np.ndarray:
        turn, lean = Rotation.from_euler("z", angle).as_matrix(), Rotation.from_euler("x", alpha).as_matrix()
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = turn @ lean, turn @ [length, 0.0, 0.0]
        return step

    links = [(short, twist), (long, other)] * 2

    def around(angles: np.ndarray) -> list[np.ndarray]:
        frames = [np.eye(4)]
        for angle, each in zip([1.1, *angles], links, strict=True):
            frames.append(frames[-1] @ link(angle, *each))
        return frames

    closing = least_squares(
        lambda x: (around(x)[-1] - np.eye(4))[:3].ravel(), [2.8, -1.1, -2.8], xtol=1e-15, gtol=1e-15
    )
    bodies = ["world", "a", "b", "c", "world"]
    hinges = []
    for k, frame in enumerate(around(closing.x)[:4]):
        at, axis = ORIGIN + ANYWHERE @ (frame[:3, 3] + 0.02 * frame[:3, 2]), ANYWHERE @ frame[:3, 2]
        hinges.append(Hinge(f"h{k}", *sorted(bodies[k : k + 2], key=bodies[:4].index), at, axis))
    return Linkage(hinges, ["h0"], "b", 1)


def mixture() -> Linkage:
    """A planar four-bar, on whose coupler there is a spherical one."""
    planar = planar_four_bar()
    axes = [ANYWHERE @ unit(each) for each in ([0.1, 0.0, 1.0], [0.7, 0.1, 1.0], [0.6, 1.0, 0.7], [-0.4, 0.9, 0.8])]
    bodies, centre = ["coupler", "d", "e", "f", "coupler"], ORIGIN + ANYWHERE @ [0.1, 0.3, 0.05]
    spherical = [
        Hinge(f"s{k}", *sorted(bodies[k : k + 2], key=bodies[:4].index), centre + 0.05 * axes[k], axes[k])
        for k in range(4)
    ]
    return Linkage([*planar.hinges, *spherical], ["h0", "s0"], "e", 2)


LINKAGES: dict[str, Callable[[], Linkage]] = {
    "spherical": spherical_three_legs,
    "planar": planar_four_bar,
    "third rod": third_rod,
    "bennett": bennett,
    "mixture": mixture,
}


def model_text(linkage: Linkage, digits: int = 17, turned: str = "quat", scale: float = 1.0, seed: int = 5) -> str:
    """The linkage as a model: a body hangs on the hinge that names it first as child, others become `connect`."""
    rng = np.random.default_rng(seed)
    frames: dict[str, tuple[np.ndarray, np.ndarray]] = {"world": (np.zeros(3), np.eye(3))}
    inside: dict[str, list[str]] = {"world": []}
    nested: dict[str, str] = {}
    equalities = []

    def numbers(values: np.ndarray) -> str:
        return " ".join(f"{value + 0.0:.{digits}g}" for value in np.ravel(values))

    def local(body: str, point: np.ndarray) -> str:
        origin, turn = frames[body]
        return numbers(scale * turn.T @ (point - origin))

    def rotation(turn: np.ndarray) -> str:
        if turned == "xyaxes":
            return f'xyaxes="{numbers(turn[:, :2].T)}"'
        if turned == "euler":
            return f'euler="{numbers(Rotation.from_matrix(turn).as_euler("XYZ", degrees=True))}"'
        return f'quat="{numbers(np.roll(Rotation.from_matrix(turn).as_quat(), 1))}"'

    for hinge in linkage.hinges:
        if hinge.child not in frames:
            turn = Rotation.random(random_state=rng).as_matrix()
            origin = hinge.at + rng.uniform(-0.02, 0.02, 3)
            parent = frames[hinge.parent]
            place = f'name="{hinge.child}" pos="{local(hinge.parent, origin)}" {rotation(parent[1].T @ turn)}'
            frames[hinge.child], inside[hinge.child] = (origin, turn), []
            assert hinge.axis is not None
            joint = f'pos="{local(hinge.child, hinge.at)}" axis="{numbers(turn.T @ hinge.axis)}"'
            nested[hinge.child] = f'<body {place}><joint name="{hinge.name}" {joint}/>'
            inside[hinge.parent].append(hinge.child)
        else:
            ends = [hinge.at] if hinge.axis is None else [hinge.at, hinge.at + 0.05 * hinge.axis]
            for k, end in enumerate(ends):
                names = [f"{hinge.name}_{k}_{side}" for side in range(2)]
                for body, name in zip((hinge.parent, hinge.child), names, strict=True):
                    inside[body].append(f'<site name="{name}" pos="{local(body, end)}"/>')
                equalities.append(f'<connect name="{hinge.name}_{k}" site1="{names[0]}" site2="{names[1]}"/>')

    def body(name: str) -> str:
        parts = [part if part.startswith("<") else body(part) for part in inside[name]]
        return "".join(parts) if name == "world" else f"{nested[name]}{''.join(parts)}</body>"

    motors = "".join(f'<motor joint="{name}"/>' for name in linkage.drives)
    return (
        '<mujoco><compiler angle="degree" boundmass="1" boundinertia="1"/>'
        f"<worldbody>{body('world')}</worldbody><equality>{''.join(equalities)}</equality>"
        f"<actuator>{motors}</actuator></mujoco>"
    )


BASE, ARM, ROD, PLATFORM, APART = 0.028, 0.05, 0.093, 0.02, 0.0125
"""A rotary delta [m]: radius of its motors, arms, rods, radius of the platform's balls, and half of what two rods of a
pair are apart."""


def delta_description(decimals: int) -> tuple[str, dict[str, list]]:
    """A delta as a robot description and its loops, with three slides on which the platform hangs; not closed at zero.

    Its rods are loops that are more than enough: six hold the platform's three turns, where three would do.
    """

    def numbers(values: Sequence[float] | np.ndarray) -> str:
        return " ".join(f"{value + 0.0:.{decimals}f}" for value in values)

    def joint(name: str, kind: str, parent: str, child: str, axis: str, at: Sequence[float], turn: float = 0.0) -> str:
        place = f'<origin xyz="{numbers(at)}" rpy="{numbers([0.0, 0.0, turn])}"/><axis xyz="{axis}"/>'
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        limit = f'<limit lower="-2" upper="{0 if name == "pz" else 2}" effort="1" velocity="1"/>'  # the platform hangs
        return f'<link name="{child}"/><joint name="{name}" type="{kind}">{ends}{place}{limit}</joint>'

    slides = [("pz", "base", "c1", "0 0 1"), ("px", "c1", "c2", "1 0 0"), ("py", "c2", "platform", "0 1 0")]
    parts = [joint(name, "prismatic", *ends, axis, [0.0] * 3) for name, *ends, axis in slides]
    loops = []
    for leg, angle in enumerate(np.radians([0.0, 120.0, -120.0])):
        outward, across = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
        parts.append(joint(f"motor{leg}", "revolute", "base", f"arm{leg}", "0 1 0", BASE * outward, angle))
        for side in (-1.0, 1.0):
            mark = f"{leg}{'ab'[side > 0.0]}"
            at = [ARM, side * APART, 0.0]
            parts.append(joint(f"u{mark}", "continuous", f"arm{leg}", f"cross{mark}", "0 1 0", at))
            parts.append(joint(f"v{mark}", "continuous", f"cross{mark}", f"rod{mark}", "0 0 1", [0.0] * 3))
            ball = [float(word) for word in numbers(PLATFORM * outward + side * APART * across).split()]
            loops.append({"name": f"ball{mark}", "type": "ball", "links": [f"rod{mark}", "platform"]})
            loops[-1]["at"] = [[ROD, 0.0, 0.0], ball]
    text = f'<robot name="delta"><link name="base"/>{"".join(parts)}</robot>'
    return text, {"loops": loops, "actuated": ["motor0", "motor1", "motor2"]}


def delta_position(angles: Sequence[float] | np.ndarray) -> np.ndarray:
    """Where the delta's platform is: the lower point where the spheres of its rods meet, moved in by the platform."""
    ways = np.radians([0.0, 120.0, -120.0])
    out = BASE - PLATFORM + ARM * np.cos(angles)
    centres = np.column_stack([out * np.cos(ways), out * np.sin(ways), -ARM * np.sin(angles)])
    planes, squares = 2.0 * (centres[1:] - centres[0]), (centres**2).sum(axis=1)
    way = np.cross(*planes)
    foot = np.linalg.lstsq(planes, squares[1:] - squares[0], rcond=None)[0]
    b, c = way @ (foot - centres[0]), (foot - centres[0]) @ (foot - centres[0]) - ROD**2
    ends = [foot + way * (-b + sign * np.sqrt(b**2 - way @ way * c)) / (way @ way) for sign in (1.0, -1.0)]
    return min(ends, key=lambda end: end[2])
