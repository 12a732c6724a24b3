"""Machines for tests that are in no catalogue: other leg types, mixed legs, serial arms; dimensions are arbitrary."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pfabrik import Cone, Joint, Mechanism

Point = Sequence[float]


def ring(radius: float, height: float, angles: Sequence[float]) -> list[list[float]]:
    """Points on a horizontal circle; angles in degrees."""
    return [[radius * np.cos(a), radius * np.sin(a), height] for a in np.radians(angles)]


def _pairs(spread: float) -> list[float]:
    return [120 * leg + side * spread for leg in range(3) for side in (-1, 1)]


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def struts(feet: Sequence[Point], heads: Sequence[Point], lower: str = "universal", **drive: Any) -> list[Joint]:
    """Driven struts U-P-S (or S-P-S) from base to platform, numbered from 1."""
    joints = []
    for i, (foot, head) in enumerate(zip(feet, heads, strict=True), 1):
        joints += [
            Joint(f"A{i}", lower, ("base", f"c{i}"), at=foot),  # type: ignore[arg-type]
            Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", f"C{i}"), actuated=True, **drive),
            Joint(f"C{i}", "spherical", (f"r{i}", "platform"), at=head),
        ]
    return joints


def five_bar(feet: Sequence[Point], elbows: Sequence[Point], at: Point, **limits: Any) -> Mechanism:
    """A 5-bar in the plane z = 0 (points of two numbers), driven at its feet A1 and A2; ranges by name."""
    z, joints = (0, 0, 1), []
    for i, (foot, elbow) in enumerate(zip(feet, elbows, strict=True), 1):
        joints += [
            Joint(
                f"A{i}", "revolute", ("base", f"a{i}"), at=(*foot, 0), axis=z, actuated=True, range=limits.get(f"A{i}")
            ),
            Joint(f"B{i}", "revolute", (f"a{i}", f"c{i}"), at=(*elbow, 0), axis=z, range=limits.get(f"B{i}")),
        ]
    joints.append(Joint("tip", "revolute", ("c1", "c2"), at=(*at, 0), axis=z, range=limits.get("tip")))
    return Mechanism("5-bar", joints, "tip", task=limits.get("task"))


def hexapod_ups(stroke: tuple[float, float] = (150.0, 260.0)) -> Mechanism:
    """6-UPS, unsymmetric on purpose, cones on both sides."""
    joints = []
    bases, tops = ring(100, 0, _pairs(14)), ring(62, 180, _pairs(46))
    for i, (a, c) in enumerate(zip(bases, tops, strict=True), 1):
        a, c = np.array(a) + [i, -i, 0.5 * i], np.array(c) + [0.3 * i, i, -i]
        joints += [
            Joint(f"A{i}", "universal", ("base", f"cylinder{i}"), at=a, cone=Cone(c - a, 0.8, "base")),
            Joint(
                f"B{i}", "prismatic", (f"cylinder{i}", f"rod{i}"), along=(f"A{i}", f"C{i}"), actuated=True, range=stroke
            ),
            Joint(f"C{i}", "spherical", (f"rod{i}", "platform"), at=c, cone=Cone(a - c, 0.7, "platform")),
        ]
    return Mechanism("unsymmetric 6-UPS", joints, "platform", (1.0, 2.0, 180.0))


def hexapod_rus() -> Mechanism:
    """6-RUS servo hexapod: horns of 30, rods about 130, ball joints whose cones are fixed to horn and platform."""
    joints = []
    for i, (a, c) in enumerate(zip(ring(100, 0, _pairs(20)), ring(70, 125, _pairs(40)), strict=True), 1):
        side = 1 if i % 2 else -1
        outward = np.array([np.cos(np.radians(_pairs(0)[i - 1])), np.sin(np.radians(_pairs(0)[i - 1])), 0.0])
        along = side * np.cross([0, 0, 1.0], outward)
        a, c = np.array(a), np.array(c)
        b = a + 30 * along
        joints += [
            Joint(f"A{i}", "revolute", ("base", f"horn{i}"), at=a, axis=outward, actuated=True, range=(-1.5, 1.5)),
            Joint(f"B{i}", "spherical", (f"horn{i}", f"rod{i}"), at=b, cone=Cone(c - b, 0.9, f"horn{i}")),
            Joint(f"C{i}", "spherical", (f"rod{i}", "platform"), at=c, cone=Cone(b - c, 0.9, "platform")),
        ]
    return Mechanism("6-RSS servo hexapod", joints, "platform", (0, 0, 125))


def hexaglide() -> Mechanism:
    """6-PUS: carriages on inclined rails, rigid rods."""
    joints = []
    for i, (a, c) in enumerate(zip(ring(120, 0, _pairs(15)), ring(60, 190, _pairs(40)), strict=True), 1):
        axis = _unit(np.array([-a[0] / 300, -a[1] / 300, 1.0]))
        joints += [
            Joint(f"P{i}", "prismatic", ("base", f"carriage{i}"), axis=axis, actuated=True, range=(-60, 80)),
            Joint(
                f"U{i}",
                "universal",
                (f"carriage{i}", f"rod{i}"),
                at=a,
                cone=Cone(np.subtract(c, a), 0.8, f"carriage{i}"),
            ),
            Joint(f"S{i}", "spherical", (f"rod{i}", "platform"), at=c),
        ]
    return Mechanism("6-PUS", joints, "platform", (0, 0, 190))


def tripod_rps() -> Mechanism:
    """3-RPS: three freedoms; a general pose is out of its reach."""
    joints = []
    for i, (a, c) in enumerate(zip(ring(80, 0, [0, 120, 240]), ring(80, 200, [0, 120, 240]), strict=True), 1):
        axis = np.cross([0, 0, 1], _unit(np.array(a)))
        joints += [
            Joint(f"R{i}", "revolute", ("base", f"cylinder{i}"), at=a, axis=axis, range=(-0.6, 0.6)),
            Joint(
                f"P{i}",
                "prismatic",
                (f"cylinder{i}", f"rod{i}"),
                along=(f"R{i}", f"S{i}"),
                actuated=True,
                range=(150, 250),
            ),
            Joint(f"S{i}", "spherical", (f"rod{i}", "platform"), at=c, cone=Cone((0, 0, -1), 0.6, "platform")),
        ]
    return Mechanism("3-RPS", joints, "platform", (0, 0, 200))


def tripod_prs() -> Mechanism:
    """3-PRS: vertical rails, then a revolute, then a rigid rod."""
    joints = []
    for i, (a, c) in enumerate(zip(ring(110, 0, [0, 120, 240]), ring(60, 150, [0, 120, 240]), strict=True), 1):
        axis = np.cross([0, 0, 1], _unit(np.array(a)))
        joints += [
            Joint(
                f"P{i}", "prismatic", ("base", f"carriage{i}"), axis=(0, 0, 1), actuated=True, range=(-80, 80), home=0.0
            ),
            Joint(f"R{i}", "revolute", (f"carriage{i}", f"rod{i}"), at=a, axis=axis, range=(-0.5, 0.5)),
            Joint(f"S{i}", "spherical", (f"rod{i}", "platform"), at=c),
        ]
    return Mechanism("3-PRS", joints, "platform", (0, 0, 150))


def planar(chain: str) -> Mechanism:
    """3-RRR, 3-RPR or 3-PRR in the x-y plane; centres at different heights along the axes."""
    joints: list[Joint] = []
    z = (0, 0, 1)
    for i, angle in enumerate((90, 210, 330), 1):
        a = np.array([*(200 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])), 5.0 * i])
        turned = np.radians(angle + 25)  # legs through one point would be singular
        c = np.array([*(50 * np.array([np.cos(turned), np.sin(turned)])), 30.0])
        if chain == "RRR":
            b = 0.5 * (a + c) + 70 * np.cross([0, 0, 1], _unit((c - a) * [1, 1, 0]))
            joints += [
                Joint(f"A{i}", "revolute", ("base", f"crank{i}"), at=a, axis=z, actuated=True, range=(-1.2, 1.2)),
                Joint(f"B{i}", "revolute", (f"rod{i}", f"crank{i}"), at=b, axis=z, range=(-1.0, 1.0)),
                Joint(f"C{i}", "revolute", (f"rod{i}", "platform"), at=c, axis=z, range=(-2.0, 2.0)),
            ]
        elif chain == "RPR":
            a[2] = c[2] = 0.0
            joints += [
                Joint(f"A{i}", "revolute", ("base", f"cylinder{i}"), at=a, axis=z),
                Joint(
                    f"B{i}",
                    "prismatic",
                    (f"cylinder{i}", f"rod{i}"),
                    axis=c - a,
                    actuated=True,
                    home=150,
                    range=(90, 230),
                ),
                Joint(f"C{i}", "revolute", (f"rod{i}", "platform"), at=c, axis=(0, 0, -1)),
            ]
        else:
            rail = np.cross([0, 0, 1], _unit(a * [1, 1, 0]))
            joints += [
                Joint(f"A{i}", "prismatic", (f"carriage{i}", "base"), axis=rail, actuated=True, range=(-70, 70)),
                Joint(f"B{i}", "revolute", (f"carriage{i}", f"rod{i}"), at=a + 90 * rail, axis=z),
                Joint(f"C{i}", "revolute", (f"rod{i}", "platform"), at=c, axis=z),
            ]
    return Mechanism(f"planar 3-{chain}", joints, "platform", (0, 0, 30) if chain != "RPR" else (0, 0, 0))


def serial_planar(n: int = 4) -> Mechanism:
    """A planar arm of n revolutes with a point tip, bent at home; a gripper hangs on the tip."""
    points = [np.array([0.0, 0.0, 0.0])]
    for k in range(n):
        points.append(points[-1] + 100 * np.array([np.cos(0.3 * k), 0, np.sin(0.3 * k)]))
    joints = [
        Joint(
            f"j{k + 1}",
            "revolute",
            ("base" if k == 0 else f"link{k}", f"link{k + 1}"),
            at=points[k],
            axis=(0, 1, 0),
            actuated=True,
            range=(-1.4, 1.4),
        )
        for k in range(n)
    ]
    tip = Joint("tip", "revolute", (f"link{n}", "gripper"), at=points[n], axis=(0, 1, 0))
    return Mechanism("planar arm", [*joints, tip], "tip")


def serial_spherical(n: int = 3) -> Mechanism:
    """A chain of ball joints on a slide, each with a cone about the link before it; for plain FABRIK in space."""
    joints = [Joint("slide", "prismatic", ("base", "carriage"), axis=(1, 0, 0), actuated=True, range=(-50, 50))]
    before, height = "carriage", 0.0
    for k in range(1, n + 1):
        joints.append(
            Joint(f"s{k}", "spherical", (before, f"link{k}"), at=(0, 0, height), cone=Cone((0, 0, 1), 0.9, before))
        )
        before, height = f"link{k}", height + 80
    joints.append(Joint("tip", "spherical", (before, "tool"), at=(0, 0, height)))
    return Mechanism("ball-joint chain", joints, "tip")


def mixed() -> Mechanism:
    """Three UPS legs (one described from the platform down), one SPR and one RUS."""
    joints = [
        Joint("A1", "universal", ("base", "c1"), at=(100, 0, 0)),
        Joint("B1", "prismatic", ("c1", "r1"), along=("A1", "C1"), actuated=True, range=(140, 260)),
        Joint("C1", "spherical", ("r1", "platform"), at=(60, 10, 180)),
        Joint("A2", "universal", ("base", "c2"), at=(-20, 90, 0)),
        Joint("B2", "prismatic", ("c2", "r2"), along=("A2", "C2"), actuated=True, range=(140, 260)),
        Joint("C2", "spherical", ("r2", "platform"), at=(-30, 50, 185)),
        Joint("A3", "spherical", ("base", "c3"), at=(-80, -60, 0)),
        Joint("B3", "prismatic", ("c3", "r3"), along=("A3", "C3"), actuated=True, range=(140, 260)),
        Joint("C3", "revolute", ("r3", "platform"), at=(-40, -40, 180), axis=(1, -2, 0), range=(-0.7, 0.7)),
        Joint("A4", "revolute", ("base", "k4"), at=(30, -100, 0), axis=(1, 0, 0), actuated=True, range=(-1, 1)),
        Joint("B4", "universal", ("k4", "r4"), at=(32, -130, 20)),
        Joint("C4", "spherical", ("r4", "platform"), at=(20, -55, 175)),
        Joint("A5", "universal", ("c5", "base"), at=(60, 90, 10)),
        Joint("B5", "prismatic", ("r5", "c5"), along=("C5", "A5"), actuated=True, range=(140, 260)),
        Joint("C5", "spherical", ("platform", "r5"), at=(30, 60, 190)),
    ]
    return Mechanism("mixed legs", joints, "platform", (0, 0, 180))


MACHINES: dict[str, Callable[[], Mechanism]] = {
    "hexapod_ups": hexapod_ups,
    "hexapod_rus": hexapod_rus,
    "hexaglide": hexaglide,
    "tripod_rps": tripod_rps,
    "tripod_prs": tripod_prs,
    "planar_rrr": lambda: planar("RRR"),
    "planar_rpr": lambda: planar("RPR"),
    "planar_prr": lambda: planar("PRR"),
    "serial_planar": serial_planar,
    "serial_spherical": serial_spherical,
    "mixed": mixed,
}
