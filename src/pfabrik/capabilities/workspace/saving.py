"""Workspaces as files: a mesh for other programs, or all arrays."""

from __future__ import annotations

import io
from collections.abc import Callable
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from ...common.arrays import Ints
from ...common.cells import CsvWriter
from ...common.checks import require_ending
from ...common.whole_files import whole_path
from ...errors import InvalidArgument
from .surface import face_normals

if TYPE_CHECKING:
    from .region import Region


def save(region: Region, path: str | PathLike[str]) -> None:
    """Write a workspace in the format of the ending; the file appears whole, or not at all."""
    content = _FORMATS[require_ending(path, ENDINGS)](region)
    with whole_path(path) as part:
        part.write_bytes(content)


def _as_npz(region: Region) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        coordinates=np.array(region.names),
        units=np.array(region.units),
        resolution=region.resolution,
        vertices=region.vertices,
        faces=region.faces,
        face_limit=region.face_limit,
        limits=np.array(region.limits),
        size=region.size,
        uncertainty=region.uncertainty,
    )
    return buffer.getvalue()


def _as_stl(region: Region) -> bytes:
    """Binary STL: triangles with their normals, in the mechanism's unit."""
    corners = region.vertices[_triangles(region)]
    normals = face_normals(corners)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["normal"], rows["corners"] = normals, corners
    header = f"workspace of {region.mechanism.name}".encode("ascii", "replace")[:80].ljust(80)
    return header + len(rows).to_bytes(4, "little") + rows.tobytes()


def _as_ply(region: Region) -> bytes:
    """Binary PLY: vertices, and triangles with the number of the limit that forms each; comments name it."""
    faces = _triangles(region)
    vertices = np.asarray(region.vertices, "<f8")
    rows = np.zeros(len(faces), [("n", "u1"), ("places", "<i4", 3), ("limit", "<i4")])
    rows["n"], rows["places"], rows["limit"] = 3, faces, region.face_limit
    limits = [f"comment limit {i}: {' '.join(region.limits[i])}" for i in np.unique(region.face_limit).tolist()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *limits,
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(rows)}",
        "property list uchar int vertex_indices",
        "property int limit",
        "end_header",
    ]
    return "\n".join([*header, ""]).encode("utf-8") + vertices.tobytes() + rows.tobytes()


def _triangles(region: Region) -> Ints:
    if len(region.names) != 3:
        raise InvalidArgument("path", "a format for triangles", ".npz or .csv: a workspace in a plane has none")
    return region.faces


def _as_csv(region: Region) -> bytes:
    """Points of the border, one a row, with the limit that forms it there; angles in radians, named so."""
    text = io.StringIO()
    writer = CsvWriter(text)
    named = [f"{name}_rad" if unit == "rad" else name for name, unit in zip(region.names, region.units, strict=True)]
    writer.writerow([*named, "joint", "bound"])
    for point, limit in zip(region.vertices.tolist(), region.vertex_limit.tolist(), strict=True):
        writer.writerow([*map(repr, point), *region.limits[limit]])
    return text.getvalue().encode("utf-8")


_FORMATS: dict[str, Callable[[Region], bytes]] = {".npz": _as_npz, ".stl": _as_stl, ".ply": _as_ply, ".csv": _as_csv}

ENDINGS = tuple(_FORMATS)
