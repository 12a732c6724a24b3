"""Machines for tests that are in no catalogue: other leg types, mixed legs, serial arms; dimensions are arbitrary."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pfabrik import Cone, Joint, Mechanism

from .redescribed import reversed_joint

Point = Sequence[float]


def ring(radius: float, height: float, angles: Sequence[float]) -> list[list[float]]:
    """Points on a horizontal circle; angles in degrees."""
    return [[radius * np.cos(a), radius * np.sin(a), height] for a in np.radians(angles)]


def _pairs(spread: float) -> list[float]:
    return [120 * leg + side * spread for leg in range(3) for side in (-1, 1)]


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
            Joint(f"A{i}", "revolute", ("base", f"a{i}"), (*foot, 0), z, actuated=True, range=limits.get(f"A{i}")),
            Joint(f"B{i}", "revolute", (f"a{i}", f"c{i}"), (*elbow, 0), z, range=limits.get(f"B{i}")),
        ]
    joints.append(Joint("tip", "revolute", ("c1", "c2"), at=(*at, 0), axis=z, range=limits.get("tip")))
    return Mechanism("5-bar", joints, "tip", task=limits.get("task"))


def hexapod_ups(stroke: tuple[float, float] = (150.0, 260.0)) -> Mechanism:
    """6-UPS, unsymmetric on purpose, cones on both sides."""
    i = np.arange(1, 7)
    return Mechanism.from_legs(
        "U-P*-S",
        base=np.array(ring(100, 0, _pairs(14))) + np.stack([i, -i, 0.5 * i], axis=1),
        platform=np.array(ring(62, 180, _pairs(46))) + np.stack([0.3 * i, i, -i], axis=1),
        stroke=stroke,
        A={"cone": {"half_angle": 0.8}},
        C={"cone": {"half_angle": 0.7}},
        name="unsymmetric 6-UPS",
        reference_point=(1.0, 2.0, 180.0),
    )


def hexapod_rus() -> Mechanism:
    """6-RUS servo hexapod: horns of 30, rods about 130, ball joints whose cones are fixed to horn and platform."""
    base, outward, cone = np.array(ring(100, 0, _pairs(20))), np.array(ring(1, 0, _pairs(0))), {"half_angle": 0.9}
    return Mechanism.from_legs(
        "R*-S-S",
        base=base,
        via=base + 30 * np.tile([[1], [-1]], (3, 1)) * np.cross([0, 0, 1.0], outward),
        platform=ring(70, 125, _pairs(40)),
        A={"axis": outward.tolist(), "range": (-1.5, 1.5)},
        B={"cone": cone},
        C={"cone": cone},
        name="6-RSS servo hexapod",
        reference_point=(0, 0, 125),
    )


def hexaglide() -> Mechanism:
    """6-PUS: carriages on inclined rails, rigid rods."""
    base = np.array(ring(120, 0, _pairs(15)))
    return Mechanism.from_legs(
        "P*-U-S",
        base=base,
        platform=ring(60, 190, _pairs(40)),
        A={"axis": (base / -300 + [0, 0, 1]).tolist(), "range": (-60, 80)},
        B={"cone": {"half_angle": 0.8}},
        name="6-PUS",
        reference_point=(0, 0, 190),
    )


THIRD = {"count": 3, "axis": (0, 0, 1)}


def tripod_rps() -> Mechanism:
    """3-RPS: three freedoms; a general pose is out of its reach."""
    return Mechanism.from_legs(
        "R-P*-S",
        base=(80, 0, 0),
        platform=(80, 0, 200),
        copies=THIRD,
        stroke=(150, 250),
        A={"axis": "tangential", "range": (-0.6, 0.6)},
        C={"cone": Cone((0, 0, -1), 0.6, "platform")},
        name="3-RPS",
        reference_point=(0, 0, 200),
    )


def tripod_prs() -> Mechanism:
    """3-PRS: vertical rails, then a revolute, then a rigid rod."""
    return Mechanism.from_legs(
        "P*-R-S",
        base=(110, 0, 0),
        platform=(60, 0, 150),
        copies=THIRD,
        A={"axis": "vertical", "range": (-80, 80)},
        B={"axis": "tangential", "range": (-0.5, 0.5)},
        name="3-PRS",
        reference_point=(0, 0, 150),
    )


def planar(chain: str) -> Mechanism:
    """3-RRR, 3-RPR or 3-PRR in the x-y plane, at different heights along the axes; some joints from their far body."""
    flat = chain == "RPR"
    a = np.array(ring(200, 0, (90, 210, 330))) + [[0, 0, 0.0 if flat else 5.0 * i] for i in (1, 2, 3)]
    c = np.array(ring(50, 0.0 if flat else 30.0, (115, 235, 355)))  # legs through one point would be singular
    parts: dict[str, Any] = {"platform": c, "axis": "z", "reference_point": (0, 0, 0 if flat else 30)}
    if chain == "RRR":
        across = np.cross([0, 0, 1], (c - a) * [1, 1, 0])
        parts |= {"base": a, "via": 0.5 * (a + c) + 70 * across / np.linalg.norm(across, axis=1)[:, None]}
        parts |= {"A": {"range": (-1.2, 1.2)}, "B": {"range": (-1.0, 1.0)}, "C": {"range": (-2.0, 2.0)}}
    elif flat:
        slide = {"axis": (c - a).tolist(), "home": 150, "range": (90, 230)}
        parts |= {"base": a, "B": slide, "C": {"axis": "-z"}}
    else:
        rails = np.cross([0, 0, 1], a * [1, 1, 0]) / 200
        parts |= {"base": a + 90 * rails, "A": {"axis": rails.tolist(), "range": (-70, 70)}}
    written = {"RRR": "R*-R-R", "RPR": "R-P*-R", "PRR": "P*-R-R"}[chain]
    machine = Mechanism.from_legs(written, name=f"planar 3-{chain}", **parts)
    far = {"RRR": "B", "RPR": "-", "PRR": "A"}[chain]
    joints = [reversed_joint(joint) if joint.name[0] == far else joint for joint in machine.joints]
    return dataclasses.replace(machine, joints=tuple(joints))


def serial_planar(n: int = 4) -> Mechanism:
    """A planar arm of n revolutes with a point tip, bent at home; a gripper hangs on the tip."""
    headings, hinge = 0.3 * np.arange(n), {"axis": (0, 1, 0)}
    links = 100 * np.stack([np.cos(headings), 0 * headings, np.sin(headings)], axis=1)
    points, bodies = np.vstack([np.zeros(3), np.cumsum(links, axis=0)]), ["base", *(f"link{k + 1}" for k in range(n))]
    joints = [
        Joint(f"j{k + 1}", "revolute", bodies[k : k + 2], at=points[k], actuated=True, range=(-1.4, 1.4), **hinge)
        for k in range(n)
    ]
    joints.append(Joint("tip", "revolute", (bodies[n], "gripper"), at=points[n], **hinge))
    return Mechanism("planar arm", joints, "tip")


def serial_spherical(n: int = 3) -> Mechanism:
    """A chain of ball joints on a slide, each with a cone about the link before it; for plain FABRIK in space."""
    joints = [Joint("slide", "prismatic", ("base", "carriage"), axis=(1, 0, 0), actuated=True, range=(-50, 50))]
    before, height = "carriage", 0.0
    for k in range(1, n + 1):
        cone = Cone((0, 0, 1), 0.9, before)
        joints.append(Joint(f"s{k}", "spherical", (before, f"link{k}"), at=(0, 0, height), cone=cone))
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
