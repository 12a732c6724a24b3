"""A machine in the browser: the same skeleton as in pictures, with thickness. One unit of the scene is L."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ...answers.tracked import Track
from ...arrays import Floats
from ...clearance.solid_meshes import SolidMesh
from ...description.mechanism import Mechanism
from ...drawn_parts import Part
from ...skeleton import Mark, Skeleton
from ..looks import ACHIEVED, ACTUATED, ASKED, EDGE, HELD, of_a_body, rgb
from .shapes import SHAPES, cylinder, fan, quaternion, upright_to

if TYPE_CHECKING:
    import viser

    from .border_patches import Patch

RADIUS = 0.0125
"""Of a usual bar [L]."""

PASSIVE, BASE = "#8f8f8f", "#9f9f9f"
"""Of joints that nobody drives, and of the base: darker than on paper, as light is added to them."""

JOINT = 0.034
"""Size of a joint [L]."""

FRAME = 0.12
"""Length of the axes at the reference point [L]."""

GIZMO = 0.35
"""Size of the handles to drag [L]."""

PLAIN: dict[str, Any] = {"lod": "off", "cast_shadow": False, "receive_shadow": False}
"""Settings of many small meshes that save the time of computers without a graphics card."""

MACHINE = "/machine"


class Scene:
    """The nodes of one machine; a new configuration moves them.

    The machine's L is 1 in the scene: its camera sees from a hundredth to a thousand.
    """

    def __init__(self, server: viser.ViserServer, mechanism: Mechanism, skeleton: Skeleton) -> None:
        self._scene, self._length = server.scene, mechanism.characteristic_length
        self._labels: dict[str, Any] = {}
        self._border: list[Any] = []
        self._add_lines(skeleton)
        self._faces = [
            self._scene.add_mesh_simple(
                f"{MACHINE}/bodies/{place}",
                *fan(line.corners / self._length),
                color=_colour_of(line.part),
                opacity=0.45,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            for place, line in enumerate(skeleton.parts)
            if line.part.kind == "plate"
        ]
        self._solids = [
            self._scene.add_mesh_simple(
                f"{MACHINE}/solids/{place}",
                *_triangles(solid, self._length),
                color=_colour_of_solid(solid),
                opacity=0.5,
                cast_shadow=False,
                receive_shadow=False,
            )
            for place, solid in enumerate(skeleton.solids)
        ]
        kinds = sorted({mark.joint.type for mark in skeleton.marks})
        self._joints = {kind: self._add_joints(kind, skeleton) for kind in kinds}
        if len(skeleton.rails):
            rails = (skeleton.rails / self._length).astype(np.float32)
            self._scene.add_line_segments(f"{MACHINE}/rails", rails, rgb(EDGE), thickness=1.5)
        self._frame = self._scene.add_frame(
            f"{MACHINE}/reference", axes_length=FRAME, axes_radius=0.05 * FRAME, origin_radius=0.08 * FRAME
        )

    def show(self, skeleton: Skeleton, pose: Floats) -> None:
        """Move everything to a configuration."""
        positions, turns, scales, colours = self._cylinders(skeleton)
        self._lines.batched_positions, self._lines.batched_wxyzs = positions, turns
        self._lines.batched_scales, self._lines.batched_colors = scales, colours
        corners = (line.corners for line in skeleton.parts if line.part.kind == "plate")
        for face, face_corners in zip(self._faces, corners, strict=True):
            face.vertices = fan(face_corners / self._length)[0]
        for mesh, solid in zip(self._solids, skeleton.solids, strict=True):
            mesh.vertices, mesh.color = _triangles(solid, self._length)[0], _colour_of_solid(solid)
        for kind, joints in self._joints.items():
            marks = _of_kind(skeleton, kind)
            joints.batched_positions, joints.batched_colors = self._places(marks), _colours(marks)
        self._frame.position, self._frame.wxyz = pose[:3, 3] / self._length, quaternion(pose[:3, :3])
        self._name(skeleton)

    def show_path(self, track: Track) -> None:
        """Show the target path and the achieved path."""
        for name, poses, colour in (("asked", track.targets, ASKED), ("taken", track.pose, ACHIEVED)):
            places = (poses[:, :3, 3] / self._length).astype(np.float32)
            places = places[np.isfinite(places).all(axis=1)]
            if len(places) > 1:
                segments = np.stack([places[:-1], places[1:]], axis=1)
                self._scene.add_line_segments(f"{MACHINE}/path/{name}", segments, rgb(colour), thickness=2.0)

    def show_border(self, patches: Sequence[Patch]) -> None:
        """Show the border of a workspace, in place of the one before."""
        self.hide_border()
        for place, patch in enumerate(patches):
            name, corners = f"{MACHINE}/workspace/{place}", (patch.corners / self._length).astype(np.float32)
            if corners.shape[1] == 2:
                self._border.append(self._scene.add_line_segments(name, corners, rgb(patch.colour), thickness=3.0))
                continue
            faces = np.arange(3 * len(corners)).reshape(-1, 3)
            style: dict[str, Any] = {"color": rgb(patch.colour), "opacity": 0.4, "side": "double"}
            style |= {"cast_shadow": False, "receive_shadow": False, "flat_shading": True}
            self._border.append(self._scene.add_mesh_simple(name, corners.reshape(-1, 3), faces, **style))

    def hide_border(self) -> None:
        """Hide the border."""
        for part in self._border:
            part.remove()
        self._border = []

    def _add_lines(self, skeleton: Skeleton) -> None:
        positions, turns, scales, colours = self._cylinders(skeleton)
        self._lines = self._scene.add_batched_meshes_simple(
            f"{MACHINE}/lines",
            *cylinder(),
            batched_wxyzs=turns,
            batched_positions=positions,
            batched_scales=scales,
            batched_colors=colours,
            **PLAIN,
        )

    def _add_joints(self, kind: str, skeleton: Skeleton) -> Any:
        marks = _of_kind(skeleton, kind)
        upright = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (len(marks), 1))
        vertices, faces = SHAPES[kind]()
        return self._scene.add_batched_meshes_simple(
            f"{MACHINE}/joints/{kind}",
            (JOINT * vertices).astype(np.float32),
            faces,
            batched_wxyzs=upright,
            batched_positions=self._places(marks),
            batched_colors=_colours(marks),
            flat_shading=True,
            **PLAIN,
        )

    def _places(self, marks: list[Mark]) -> Any:
        return (np.array([mark.place for mark in marks]) / self._length).astype(np.float32)

    def _cylinders(self, skeleton: Skeleton) -> tuple[Any, Any, Any, Any]:
        """Every line as a cylinder: its middle, its turn from upright, radii and length, and its colour."""
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
        scales = np.stack([radii, radii, np.maximum(lengths, 1e-9)], axis=1)
        placements = (lines.mean(axis=1), upright_to(along), scales)
        middles, turns, scales = (values.astype(np.float32) for values in placements)
        return middles, turns, scales, np.array(colours, np.uint8)

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


def _colour_of(part: Part) -> tuple[int, int, int]:
    return rgb(BASE if part.role == "base" else of_a_body(part.role))


def _triangles(solid: SolidMesh, length: float) -> tuple[Any, Any]:
    """Vertices and faces in the scene."""
    return (solid.vertices / length).astype(np.float32), solid.faces.astype(np.uint32)


def _colour_of_solid(solid: SolidMesh) -> tuple[int, int, int]:
    """Dark for the two links that are nearest to each other, orange where they stop it or overlap, light elsewhere."""
    return rgb(HELD if solid.is_stopped else ACTUATED if solid.is_nearest else BASE)


def _of_kind(skeleton: Skeleton, kind: str) -> list[Mark]:
    return [mark for mark in skeleton.marks if mark.joint.type == kind]


def _colours(marks: list[Mark]) -> Any:
    """Of joints: orange where a limit holds, dark where they are actuated, light elsewhere."""
    names = (HELD if mark.held_by else ACTUATED if mark.joint.actuated else PASSIVE for mark in marks)
    return np.array([rgb(name) for name in names], np.uint8)
