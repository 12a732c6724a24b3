"""A machine in the browser: the same skeleton as in pictures, with thickness. One unit of the scene is L.

Meshes are vertices (n, 3) and faces (k, 3), of about the size 1; turns are quaternions, scalar first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ...answers.solution import Solution
from ...answers.tracked import Track
from ...capabilities.clearance.clearance import clearance
from ...capabilities.clearance.solid_meshes import SolidMesh
from ...common.arrays import Floats
from ...common.drawing import ACHIEVED
from ...common.rotations import shortest_turns, to_quaternion, to_rotvec
from ...kinematics import links_of
from ...machine.description.mechanism import Mechanism
from ..drawn_parts import Part, role_of
from ..looks import ASKED, EDGE, HELD, rgb
from ..skeleton import Mark, Skeleton, skeleton_of

if TYPE_CHECKING:
    import viser

Mesh = tuple[NDArray[np.float32], NDArray[np.int32]]
Colour = tuple[int, int, int]

RADIUS = 0.0125
"""Of a usual bar [L]."""

PASSIVE, BODIES = "#8f8f8f", {"base": "#9f9f9f", "platform": "#79b4d9", "link": "#4d4d4d"}
"""Colours of joints that nobody drives, and of bodies by role: darker than on paper, as light is added to them."""

JOINT = 0.034
"""Size of a joint [L]."""

FRAME = 0.12
"""Length of the axes at the reference point [L]."""

NO_SHADOW: dict[str, Any] = {"cast_shadow": False, "receive_shadow": False}
PLAIN: dict[str, Any] = {"lod": "off", **NO_SHADOW}
"""Settings of many small meshes that save the time of computers without a graphics card."""

MACHINE = "/machine"

SIDES = 16
"""Sides of what is round."""


@dataclass(frozen=True)
class Patch:
    """A part of a border that has one colour: of a workspace, or between its parts.

    Attributes
    ----------
    words : str
        What it is.
    colour : str
        As "#d55e00".
    corners : array (k, 3, 3) or (k, 2, 3)
        Of its triangles, or both ends of its segments, in the base frame [length].
    """

    words: str
    colour: str
    corners: Floats


class Scene:
    """The nodes of one machine; a new configuration moves them.

    The machine's L is 1 in the scene: its camera sees from a hundredth to a thousand.
    """

    def __init__(self, server: viser.ViserServer, mechanism: Mechanism, skeleton: Skeleton) -> None:
        self._scene, self._length = server.scene, mechanism.characteristic_length
        self._labels: dict[str, Any] = {}
        self._borders: dict[str, list[Any]] = {}
        self._distance: tuple[Any, ...] = ()
        self._shows_solids = True
        self._lines = self._add_many("lines", cylinder(), **self._cylinders(skeleton))
        self._faces = [
            self._add_mesh(
                f"bodies/{place}", fan(line.corners / self._length), _colour_of(line.part), 0.45, side="double"
            )
            for place, line in enumerate(skeleton.parts)
            if line.part.kind == "plate"
        ]
        self._solids = [
            self._add_mesh(
                f"solids/{place}", self._triangles(solid), _colour_of_solid(mechanism, solid), 0.4, side="front"
            )
            for place, solid in enumerate(skeleton.solids)
        ]
        kinds = sorted({mark.joint.type for mark in skeleton.marks})
        self._joints = {kind: self._add_joints(kind, skeleton) for kind in kinds}
        if len(skeleton.rails):
            rails = (skeleton.rails / self._length).astype(np.float32)
            self._add_lines("rails", rails, EDGE, 1.5)
        self._frame = self._scene.add_frame(
            f"{MACHINE}/reference", axes_length=FRAME, axes_radius=0.05 * FRAME, origin_radius=0.08 * FRAME
        )

    def show(self, solution: Solution) -> None:
        """Move everything to a configuration."""
        skeleton, pose = skeleton_of(solution), solution.pose
        for name, values in self._cylinders(skeleton).items():
            setattr(self._lines, name, values)
        corners = (line.corners for line in skeleton.parts if line.part.kind == "plate")
        for face, face_corners in zip(self._faces, corners, strict=True):
            face.vertices = fan(face_corners / self._length)[0]
        for mesh, solid in zip(self._solids, skeleton.solids, strict=True):
            mesh.vertices, mesh.color = self._triangles(solid)[0], _colour_of_solid(skeleton.mechanism, solid)
        for kind, joints in self._joints.items():
            marks = _of_kind(skeleton, kind)
            joints.batched_positions, joints.batched_colors = self._places(marks), _colours(marks)
        self._frame.position, self._frame.wxyz = pose[:3, 3] / self._length, quaternion(pose[:3, :3])
        self._name(skeleton)
        self._show_distance(solution)

    def show_solids(self, visible: bool) -> None:
        """Show the shapes of bodies and the least distance between them, or hide them."""
        self._shows_solids = visible
        for node in (*self._solids, *self._distance):
            node.visible = visible

    def show_path(self, track: Track) -> None:
        """Show the target path and the achieved path."""
        for name, poses, colour in (("asked", track.targets, ASKED), ("taken", track.pose, ACHIEVED)):
            places = (poses[:, :3, 3] / self._length).astype(np.float32)
            places = places[np.isfinite(places).all(axis=1)]
            if len(places) > 1:
                self._add_lines(f"path/{name}", np.stack([places[:-1], places[1:]], axis=1), colour, 2.0)

    def show_border(self, name: str, patches: Sequence[Patch]) -> None:
        """Show a border in place of the one of that name before; none without patches."""
        for part in self._borders.pop(name, []):
            part.remove()
        self._borders[name] = [
            self._add_patch(f"{name}/{place}", patch) for place, patch in enumerate(patches) if len(patch.corners)
        ]

    def _add_patch(self, name: str, patch: Patch) -> Any:
        corners = (patch.corners / self._length).astype(np.float32)
        if corners.shape[1] == 2:
            return self._add_lines(name, corners, patch.colour, 3.0)
        mesh = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
        return self._add_mesh(name, mesh, rgb(patch.colour), 0.4, flat_shading=True)

    def _add_lines(self, name: str, ends: Any, colour: str, width: float) -> Any:
        """Segments (k, 2, 3) in the scene, so wide [pixels]."""
        style: dict[str, Any] = {"thickness": width, "thickness_units": "screen"}
        return self._scene.add_line_segments(f"{MACHINE}/{name}", ends, rgb(colour), **style)

    def _show_distance(self, solution: Solution) -> None:
        """A line between the two links that are nearest to each other, and how far apart these are."""
        for node in self._distance:
            node.remove()
        self._distance = ()
        if not self._solids or not len(links_of(solution.mechanism).pairs):
            return
        found = clearance(solution)
        ends = np.asarray(found.points) / self._length
        words = f"{float(found.distance):.3g} {solution.mechanism.length_unit}"
        label = self._scene.add_label(f"{MACHINE}/distance/words", words, position=cast(Any, ends.mean(axis=0)))
        colour = HELD if found.distance <= (solution.mechanism.clearance or 0.0) else EDGE
        self._distance = (self._add_lines("distance/line", ends[None].astype(np.float32), colour, 4.0), label)
        self.show_solids(self._shows_solids)

    def _add_mesh(self, name: str, mesh: tuple[Any, Any], colour: Colour, opacity: float, **style: Any) -> Any:
        style = {"color": colour, "opacity": opacity, "side": "double", **NO_SHADOW, **style}
        return self._scene.add_mesh_simple(f"{MACHINE}/{name}", *mesh, **style)

    def _add_many(self, name: str, mesh: Mesh, **style: Any) -> Any:
        return self._scene.add_batched_meshes_simple(f"{MACHINE}/{name}", *mesh, **(style | PLAIN))

    def _add_joints(self, kind: str, skeleton: Skeleton) -> Any:
        marks, (vertices, faces) = _of_kind(skeleton, kind), SHAPES[kind]()
        return self._add_many(
            f"joints/{kind}",
            ((JOINT * vertices).astype(np.float32), faces),
            batched_wxyzs=np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (len(marks), 1)),
            batched_positions=self._places(marks),
            batched_colors=_colours(marks),
            flat_shading=True,
        )

    def _places(self, marks: list[Mark]) -> Any:
        return (np.array([mark.place for mark in marks]) / self._length).astype(np.float32)

    def _triangles(self, solid: SolidMesh) -> tuple[Any, Any]:
        """Vertices and faces in the scene."""
        return (solid.vertices / self._length).astype(np.float32), solid.faces.astype(np.uint32)

    def _cylinders(self, skeleton: Skeleton) -> dict[str, Any]:
        """Every line as a cylinder: its middle, its turn from upright, its colour, and its radii and length."""
        ends, radii, colours, held = [], [], [], skeleton.held
        for line in skeleton.parts:
            colour = rgb(HELD) if held & set(line.part.joints) else _colour_of(line.part)
            edges = np.stack([line.outline[:-1], line.outline[1:]], axis=1)
            ends += list(edges)
            radii += [RADIUS * line.part.radius] * len(edges)
            colours += [colour] * len(edges)
        lines = np.reshape(ends, (-1, 2, 3)) / self._length
        along = lines[:, 1] - lines[:, 0]
        lengths = np.linalg.norm(along, axis=1)
        return {
            "batched_positions": lines.mean(axis=1).astype(np.float32),
            "batched_wxyzs": upright_to(along).astype(np.float32),
            "batched_scales": np.stack([radii, radii, np.maximum(lengths, 1e-9)], axis=1).astype(np.float32),
            "batched_colors": np.array(colours, np.uint8),
        }

    def _name(self, skeleton: Skeleton) -> None:
        """Labels at the joints whose limits hold."""
        wanted = {f"{mark.joint.name} {bound}": mark.place for mark in skeleton.marks for bound in mark.held_by}
        for name in set(self._labels) - set(wanted):
            self._labels.pop(name).remove()
        for name, place in wanted.items():
            at = cast(Any, place / self._length)
            if name in self._labels:
                self._labels[name].position = at
            else:
                self._labels[name] = self._scene.add_label(f"{MACHINE}/held/{name}", name, position=at)


def _colour_of(part: Part) -> Colour:
    return rgb(BODIES[part.role])


def _colour_of_solid(mechanism: Mechanism, solid: SolidMesh) -> Colour:
    """Dark for the two links that are nearest to each other, orange where they stop it or overlap, else of its body."""
    return rgb(HELD if solid.is_stopped else EDGE if solid.is_nearest else BODIES[role_of(mechanism, solid.body)])


def _of_kind(skeleton: Skeleton, kind: str) -> list[Mark]:
    return [mark for mark in skeleton.marks if mark.joint.type == kind]


def _colours(marks: list[Mark]) -> Any:
    """Of joints: orange where a limit holds, dark where they are actuated, light elsewhere."""
    names = (HELD if mark.held_by else EDGE if mark.joint.actuated else PASSIVE for mark in marks)
    return np.array([rgb(name) for name in names], np.uint8)


def _from_trimesh(make: str, **size: Any) -> Mesh:
    """A mesh that trimesh makes, which is imported when it is needed."""
    from trimesh import creation

    made = getattr(creation, make)(**size)
    return np.asarray(made.vertices, np.float32), np.asarray(made.faces, np.int32)


def cylinder(sides: int = SIDES, height: float = 1.0) -> Mesh:
    """Upright, about its middle, of radius 1: a prism where it has few sides."""
    return _from_trimesh("cylinder", radius=1.0, height=height, sections=sides)


def octahedron() -> Mesh:
    """With corners on the axes, 1.1 from its middle."""
    vertices = 1.1 * np.vstack([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return vertices.astype(np.float32), np.array(faces, np.int32)


def tetrahedron() -> Mesh:
    """With corners 1.2 from its middle."""
    vertices = 0.7 * np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    return vertices.astype(np.float32), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)


SHAPES: dict[str, Callable[[], Mesh]] = {
    "revolute": lambda: _from_trimesh("uv_sphere", radius=0.8, count=(9, SIDES)),
    "prismatic": lambda: _from_trimesh("box", extents=(1.6, 1.6, 1.6)),
    "universal": octahedron,
    "spherical": tetrahedron,
    "cylindrical": lambda: cylinder(6, 1.6),
    "fixed": lambda: cylinder(3, 1.6),
}
"""Shapes of joints, those of the markers in pictures: round, square, diamond, triangle, hexagon."""


def fan(corners: Floats) -> Mesh:
    """A face through corners (k, 3) in order, as triangles about their middle."""
    here = np.arange(len(corners))
    middle = np.full(len(corners), len(corners))
    vertices = np.vstack([corners, corners.mean(axis=0)]).astype(np.float32)
    return vertices, np.stack([here, np.roll(here, -1), middle], axis=1).astype(np.int32)


def upright_to(directions: Floats) -> Floats:
    """The quaternions (n, 4) of the shortest turns of the z axis to directions (n, 3); none for no direction."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    upright = np.broadcast_to((0.0, 0.0, 1.0), directions.shape)
    along = np.divide(directions, lengths, out=upright.copy(), where=lengths > 0.0)
    return quaternion(shortest_turns(upright, along))


def quaternion(rotations: Floats) -> Floats:
    """The quaternions (..., 4) of rotation matrices (..., 3, 3)."""
    return np.roll(to_quaternion(to_rotvec(rotations)), 1, axis=-1)
