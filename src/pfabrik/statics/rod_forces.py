"""Rods: links between two joints that only pull or push, and the forces along them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..derived import derived
from ..description.mechanism import Mechanism


class Rods(NamedTuple):
    """The rods of a machine.

    Attributes
    ----------
    names : of their bodies.
    starts, ends : indices of their joints, (rods,).
    signs : 1 where the rod is the second body of its end joint, else -1, (rods,).
    """

    names: tuple[str, ...]
    starts: Ints
    ends: Ints
    signs: Floats


@derived
def rods_of(mechanism: Mechanism) -> Rods:
    """Bodies with two joints whose centres are apart and neither of which is driven, except base and end effector."""
    fixed = (mechanism.base, mechanism.end_effector)
    found = []
    for body in mechanism.bodies:
        places = [place for place, joint in enumerate(mechanism.joints) if body in joint.connects]
        places.sort(key=lambda place: mechanism.joints[place].name != mechanism.end_effector)  # its load is at that end
        joints = [mechanism.joints[place] for place in places]
        is_passive = all(joint.at is not None and not joint.driven for joint in joints)
        if len(joints) == 2 and is_passive and body not in fixed and joints[0].at != joints[1].at:
            sign = 1.0 if joints[1].connects[1] == body else -1.0
            found.append((body, *places, sign))
    names, starts, ends, signs = zip(*found, strict=True) if found else ((), (), (), ())
    return Rods(names, np.array(starts, np.int64), np.array(ends, np.int64), np.array(signs, float))


def tensions(rods: Rods, wrenches: Floats, centres: Floats) -> Floats:
    """Forces along rods, positive if they are pulled, (n, rods, k).

    Parameters
    ----------
    wrenches : what joints transmit from their first body to their second, [force; moment], (n, joints, 6, k).
    centres : of joints, (n, joints, 3) [length].
    """
    return np.asarray(np.einsum("nri,nrik->nrk", along(rods, centres), wrenches[:, rods.ends, :3]))


def along(rods: Rods, centres: Floats) -> Floats:
    """Displacements of the end joints' second bodies that make rods longer, (n, rods, 3)."""
    lines = centres[:, rods.ends] - centres[:, rods.starts]
    return np.asarray(lines * (rods.signs / np.linalg.norm(lines, axis=-1))[..., None])
