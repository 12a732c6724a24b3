"""Bodies with masses at the places that an exported file computes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Floats
from ...kinematics import cut_loops, inertias_of
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of
from ...machine.moved_bodies import FIRST_MOVED, WITH_BASE_END, Motion, MovedBodies
from ...tolerances import TOLERANCES


def frames_on_bodies(mechanism: Mechanism, bodies: MovedBodies) -> list[int]:
    """The number of the body that shows each frame of `cut_loops`.

    A unit motion's axis and point are those of the body before its joint, or of the body after it: a frame between two
    unit motions of a joint may stand for the latter.
    """
    cut = cut_loops(mechanism, tuple(drive.column for drive in mechanism.drives))
    numbers = {frame: bodies.numbers[body] for body, frame in cut.frames.items()}
    numbers |= {int(one): numbers[int(other)] for one, other, rows, *_ in cut.cuts[:-1] if rows == 6}
    for unit in range(len(cut.units) - 1, -1, -1):  # after what is beyond it
        parent = int(cut.units[unit, 1])
        numbers.setdefault(parent, numbers[unit + 2])
    return [numbers[frame] for frame in range(len(cut.units) + 2)]


def unplaced_masses(mechanism: Mechanism, bodies: MovedBodies) -> list[str]:
    """Why places of bodies are not enough for their forces; none where they are."""
    return list(_faults(mechanism, bodies))


def _faults(mechanism: Mechanism, bodies: MovedBodies) -> Iterator[str]:
    if mechanism.end_effector_is_joint and mechanism.end_effector_body not in bodies.numbers:
        yield f"the place of body '{mechanism.end_effector_body}' follows from no leg"
        return
    known = inertias_of(mechanism, metres_of(mechanism.length_unit))
    for body in mechanism.bodies:
        if body not in bodies.numbers:
            yield f"the place of body '{body}' follows from no leg"
            continue
        number = bodies.numbers[body]
        if number < FIRST_MOVED or bodies.motions[number - FIRST_MOVED].kind < WITH_BASE_END:
            continue
        rod, weight = bodies.motions[number - FIRST_MOVED], known.get(body)
        near = TOLERANCES.alignment * mechanism.characteristic_length
        points = [joint.at for joint in mechanism.joints if body in joint.connects and joint.at is not None]
        if weight is not None and weight.mass > 0.0:
            points.append(tuple(weight.centre))
        is_round = weight is None or _is_round(np.reshape(weight.inertia, (3, 3)), rod)
        if not is_round or max((_off(rod, np.array(point)) for point in points), default=0.0) > near:
            yield f"body '{body}' spins in a way that follows from no leg, and its mass is not round about its line"


def _off(rod: Motion, point: Floats) -> float:
    return float(np.linalg.norm(np.cross(point - rod.point, rod.axis)))


def _is_round(inertia: Floats, rod: Motion) -> bool:
    """True if an inertia is the same about all axes square to a rod, of which its line is one of its own."""
    line = np.asarray(rod.axis)
    along, square = line @ inertia @ line, np.eye(3) - np.outer(line, line)
    across = 0.5 * (np.trace(inertia) - along)
    left = inertia - along * np.outer(line, line) - across * square
    return bool(np.abs(left).max() <= TOLERANCES.alignment * max(float(np.abs(inertia).max()), np.finfo(float).tiny))
