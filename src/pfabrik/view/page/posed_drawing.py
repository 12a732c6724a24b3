"""The drawing of a machine that a page moves by itself: points on bodies, and the motions that place the bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...capabilities.clearance.solid_meshes import solids_of
from ...common.arrays import Floats
from ...kinematics import links_of, plane_of
from ...machine.common_centre import common_centre
from ...machine.description.mechanism import Joint, Mechanism
from ...machine.description.sketch import joint_places, joints_on
from ...machine.moved_bodies import MovedBodies
from ..drawn_parts import Part, Place, hangs, home_rail, parts_of, role_of, size_of

THICKNESS = 0.0125
"""Radius of a usual bar, as a share of the machine's size."""

AZIMUTH, ELEVATION = -62.0, 20.0
"""Direction from which a machine in space is seen at first [deg]."""

PAINTS = {"base": "base", "platform": "platform", "link": "link"}
"""Colours of roles, by their names in the page."""


class _Drawing:
    """Points and frames by their indices, as they are needed."""

    def __init__(self, mechanism: Mechanism, answers_itself: bool) -> None:
        self.mechanism, self.length = mechanism, mechanism.characteristic_length
        self.home = joint_places(self.mechanism, None, self.mechanism.home_pose[:3, 3])
        self.bodies = {body: k for k, body in enumerate(_first_bodies(mechanism))}
        self.frames: list[list[Any]] = []
        if not answers_itself:
            self.bodies |= {body: 2 + k for k, body in enumerate(other_bodies(mechanism))}
        else:
            moved = MovedBodies(mechanism)
            self.bodies = {body: moved.number(body) for body in mechanism.bodies if moved.is_placed(body)}
            self.frames = [[each.on, [each.column, each.sign, *each.screw(self.length)]] for each in moved.motions]
        self.points: list[dict[str, Any]] = []
        self.indices: dict[Any, int] = {}
        for joint in sorted(self.mechanism.joints, key=lambda joint: joint.at is None):
            self.indices[joint.name] = self._add(self._joint(joint) | {"joint": joint.name})

    def _joint(self, joint: Joint) -> dict[str, Any]:
        """A point of a body, or amid others."""
        if joint.name == self.mechanism.end_effector:
            return self._on(1, self.home[joint.name])
        frame = next((self.bodies[body] for body in joint.connects if body in self.bodies), None)
        if joint.at is not None or joint.along is None:
            moving = [body for body in joint.connects if body in self.bodies and body != self.mechanism.base]
            if joint.at is None and moving:
                frame = self.bodies[moving[0]]
            if frame is not None:
                return self._on(frame, self.home[joint.name])
        amid = joint.along or [name for body in joint.connects for name in joints_on(self.mechanism, body)]
        return {"amid": [self.indices[name] for name in amid if name in self.indices]}

    def _on(self, frame: int, point: Floats) -> dict[str, Any]:
        return {"frame": frame, "at": (point / self.length).tolist()}

    def _add(self, point: dict[str, Any]) -> int:
        self.points.append(point)
        return len(self.points) - 1

    def place(self, place: Place) -> int:
        """The index of a place."""
        if isinstance(place, np.ndarray):
            key: Any = ("base", *place.tolist())
            point = self._on(0, place)
        elif len(place) == 1:
            return self.indices[place[0]]
        else:
            key = place
            point = {"amid": [self.indices[name] for name in place]}
            if not place:
                point = self._on(1, self.mechanism.home_pose[:3, 3])
        if key not in self.indices:
            self.indices[key] = self._add(point)
        return self.indices[key]

    def part(self, part: Part) -> dict[str, Any]:
        """A part as data; its lengths in L."""
        out: dict[str, Any] = {"kind": part.kind, "role": part.role, "paint": self._paint(part), "radius": part.radius}
        out["joints"] = list(part.joints)
        if part.kind == "rail":
            return out | {"line": [(np.asarray(end) / self.length).tolist() for end in part.ends]}
        out["ends"] = [self.place(end) for end in part.ends]
        if part.kind in ("plate", "carriage"):
            out["frame"] = self.bodies.get(part.body, 0)
        if part.kind == "plate" and part.role == "base" and plane_of(self.mechanism) is not None:
            out["behind"] = True
        if part.kind == "barrel":
            out["length"] = part.length / self.length
        if part.kind == "arc":
            out["centre"] = (np.asarray(common_centre(self.mechanism)) / self.length).tolist()
        axis = _normal([self._point(end) for end in part.ends]) if part.kind == "plate" else part.axis
        return out if axis is None else out | {"axis": np.asarray(axis).tolist()}

    def _point(self, place: Place) -> Floats:
        return place if isinstance(place, np.ndarray) else self.home[place[0]]

    def _paint(self, part: Part) -> str:
        if part.kind in ("barrel", "carriage", "rail"):
            return "steel"
        if part.kind == "ball" and part.role == "link":
            is_actuated = any(self.mechanism.joint(name).actuated for name in part.joints)
            return "drive" if is_actuated else "steel"
        return PAINTS[part.role]

    def solids(self) -> list[dict[str, Any]]:
        """The shapes of bodies that are placed, as triangles; capsules between two joints as bars."""
        mechanism, out = self.mechanism, list[dict[str, Any]]()
        if not mechanism.shapes:
            return out
        links = links_of(mechanism)
        shapes = zip(mechanism.shapes, links.joints, solids_of(mechanism, None), strict=True)
        for number, (shape, joints, solid) in enumerate(shapes):
            common = {"role": "link", "paint": PAINTS[role_of(mechanism, shape.body)], "joints": [], "shape": number}
            if joints:
                radius = 0.5 * shape.thickness / (THICKNESS * size_of(mechanism))
                ends = [self.indices[name] for name in joints]
                out.append(common | {"kind": "bar", "radius": radius, "ends": ends})
            elif shape.body in self.bodies:
                vertices = np.round(solid.vertices / self.length, 4).ravel().tolist()
                frame = self.bodies[shape.body]
                mesh = {"kind": "mesh", "frame": frame, "vertices": vertices, "faces": solid.faces.ravel().tolist()}
                out.append(common | mesh | {"radius": 1.0})
        return out


def _normal(points: list[Floats]) -> Floats:
    """The direction across points of a plane, upward."""
    normal = np.linalg.svd(np.array(points) - np.mean(points, axis=0))[2][2]
    return np.asarray(normal if normal[2] >= 0.0 else -normal)


def _first_bodies(mechanism: Mechanism) -> list[str]:
    """The base, and the platform where the end effector is a body."""
    return [mechanism.base] + [mechanism.end_effector_body] * (not mechanism.end_effector_is_joint)


def other_bodies(mechanism: Mechanism) -> list[str]:
    """All bodies beside base and platform, in the order of the frames that an answer of Python's has."""
    return [body for body in mechanism.bodies if body not in _first_bodies(mechanism)]


def drawing_of(mechanism: Mechanism, answers_itself: bool, box: Floats) -> dict[str, Any]:
    """The drawing as data, lengths in L.

    Parameters
    ----------
    answers_itself : the page places bodies itself; else answers bring the frames of all of them.
    box : lowest and highest positions of the end effector [length].
    """
    drawing = _Drawing(mechanism, answers_itself)
    parts = [drawing.part(part) for part in parts_of(mechanism)]
    end = joints_on(mechanism, mechanism.end_effector) or [mechanism.end_effector]
    plane = plane_of(mechanism)
    return {
        "points": drawing.points,
        "frames": drawing.frames,
        "parts": parts + drawing.solids(),
        "platform": [drawing.indices[name] for name in end],
        "end": drawing.bodies.get(mechanism.end_effector_body, 1),
        "normal": None if plane is None else np.cross(*plane).tolist(),
        "thickness": THICKNESS * size_of(mechanism) / mechanism.characteristic_length,
        **_view(mechanism, plane, box),
    }


def _view(mechanism: Mechanism, plane: Floats | None, box: Floats) -> dict[str, Any]:
    """Where the floor is, and what the camera looks at from where at first."""
    places = list(joint_places(mechanism, None, mechanism.home_pose[:3, 3]).values())
    rails = [rail for joint in mechanism.joints if (rail := home_rail(mechanism, joint)) is not None]
    solids = [solid.vertices for solid in solids_of(mechanism, None)] if mechanism.shapes else []
    points = np.vstack([places, mechanism.home_pose[None, :3, 3], *rails, *solids]) / mechanism.characteristic_length
    low, high = points.min(axis=0), points.max(axis=0)
    size, centre = float(np.linalg.norm(high - low)), 0.5 * (low + high)
    floor, azimuth, elevation = low[2] - 0.06 * size, AZIMUTH, ELEVATION
    if hangs(mechanism):
        floor = min(box[0, 2] / mechanism.characteristic_length, low[2]) - 0.03 * size
        centre[2], elevation = 0.5 * (floor + high[2]), ELEVATION - 5.0
    across = 2
    if plane is not None:
        normal = np.cross(*plane)
        across, size = int(np.argmax(np.abs(normal))), 1.2 * size
        azimuth, elevation = np.degrees(np.arctan2(normal[1], normal[0])) + 16.0, 9.0
        if across == 2:
            azimuth, elevation = -90.0, 70.0
    return {
        "size": size,
        "floor": float(floor),
        "centre": centre.tolist(),
        "view": np.radians([azimuth, elevation]).tolist(),
        "sliceAxes": [*(k for k in range(3) if k != across), across],
    }
