"""Columns of a table that are coordinates of joints in series: the target of a row by the joints that place it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..kinematics import JointPath, joint_path

UNITS = ("_deg", "_rad")
"""Endings of columns of angles; without one they are in degrees, as roll, pitch and yaw are."""


class JointColumns(NamedTuple):
    """The columns of a header that are coordinates of joints in series, and what they give."""

    path: JointPath
    columns: tuple[str, ...]

    def poses(self, values: Mapping[str, Floats]) -> Floats:
        """Targets (n, 4, 4) of the cells of the columns, (n,) each."""
        q = [
            np.radians(values[name]) if is_angle and not name.endswith("_rad") else values[name]
            for name, is_angle in zip(self.columns, self.path.is_angle, strict=True)
        ]
        return self.path.poses(np.stack(q, axis=1))


def joint_columns(mechanism: Mechanism, header: Sequence[str]) -> JointColumns | None:
    """The columns that are named after coordinates of a mechanism; None if they are not joints in series to its end."""
    angles = {each.name: each.kind == "angle" for each in mechanism.coordinates}
    known = {name: name for name in angles}
    known |= {name + unit: name for name, is_angle in angles.items() if is_angle for unit in UNITS}
    columns = tuple(name for name in header if name in known)
    try:
        path = joint_path(mechanism, tuple(known[name] for name in columns))
    except InvalidArgument:
        return None
    return JointColumns(path, columns)
