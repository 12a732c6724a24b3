"""The plane that a planar machine moves in, from the directions of its joints."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats
from ...tolerances import TOLERANCES
from .mechanism import Mechanism
from .sketch import seen_along


def plane_of(mechanism: Mechanism) -> Floats | None:
    """The directions that a picture of a planar machine has to the right and up, unit vectors (2, 3); None in space.

    Planar is what cannot leave its plane: every hinge square to it, every slide within it, and no joint but these.
    """
    if any(joint.type not in ("revolute", "prismatic", "fixed") for joint in mechanism.joints):
        return None
    hinges = _axes(mechanism, "revolute")
    slides = _axes(mechanism, "prismatic")
    normal = hinges[0] if len(hinges) else _square_to(slides)
    if normal is None:
        return None
    off = [np.linalg.norm(np.cross(hinges, normal), axis=1), np.abs(slides @ normal)]
    if np.concatenate(off).max(initial=0.0) > TOLERANCES.alignment:
        return None
    return seen_along(normal)


def _axes(mechanism: Mechanism, kind: str) -> Floats:
    """Unit vectors (n, 3) of the axes of all joints of a kind at home."""
    return np.array([mechanism.home_axis(each.name) for each in mechanism.joints if each.type == kind]).reshape(-1, 3)


def _square_to(slides: Floats) -> Floats | None:
    """The unit vector square to slides that span a plane; None where they do not."""
    spreads, axes = np.linalg.svd(slides)[1:]
    spans = int((spreads > TOLERANCES.alignment).sum())
    return np.asarray(axes[2]) if spans == 2 else None
