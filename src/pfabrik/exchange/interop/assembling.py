"""An open machine as a mechanism: closed at home, its geometry made exact, in as few joints as there are."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_type
from ...errors import Fault, InvalidMechanism, MobilityWarning
from ...kinematics import column_joints, columns, displacements
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism
from ...machine.description.structure import Structure
from ...machine.files.units import metres_of
from ...machine.motion.loops import loop_slopes
from ...machine.motion.other_home import joints_at
from ...tolerances import TOLERANCES
from .closed_home import ClosedHome, close_home
from .closing import CLOSED, OpenLoops
from .collision import Collision
from .digits import worst
from .imported_masses import heavy_bodies, with_masses
from .imported_shapes import with_collision
from .notes import Note, note_names, noting
from .opened import OpenMechanism
from .short_numbers import short_joint, shortened
from .simplify import combined, merged_balls, merged_bodies
from .straighten import straighten, unlocked

SHOWN = 0.01
"""Share of the largest component of a gap from which another is shown."""

ABOUT_AS_NEAR = 1.1
"""Times the distance of the closed pose that is taken up to which another one is noted."""

MENDED = 0.1
"""Gap [L or rad] up to which closing a loop midway is proposed: more is another machine."""


@dataclass(frozen=True)
class Imported:
    """A mechanism that was described elsewhere.

    Attributes
    ----------
    mechanism : Mechanism
        The machine, closed at home.
    gap : float
        How far the loops of the description were open, before they were closed [length; an angle times the size].
    notes : tuple of Note
        What was left out, changed or found, each with the names of what it is about.
    """

    mechanism: Mechanism
    gap: float
    notes: tuple[Note, ...]

    def __str__(self) -> str:
        return "\n".join([repr(self.mechanism), *map(str, self.notes)])


def assemble(opened: OpenMechanism, notes: Iterable[Note] = ()) -> Imported:
    """The mechanism of a description whose loops may be open at its home values.

    The passive joints are moved until all loops meet; where that does not do, the actuated ones too. Joints stay within
    their ranges. Joints that the end effector does not depend on stay. Of the closed poses that are found from where
    all bodies are drawn, and from mirror images, the nearest to the drawing is taken: the root mean square over bodies
    of how far the middle of their joints shifts [L], and of the chord of their turns, is least. A note says if another
    is about as near.

    Parameters
    ----------
    opened : OpenMechanism
        The description.
    notes : iterable of Note, optional
        Notes that come first.

    Raises
    ------
    InvalidMechanism
        The loops cannot be closed, with how far they stay open, or what they make is no mechanism.
    """
    require_type("opened", opened, OpenMechanism, "an OpenMechanism")
    noted = list(notes)
    with noting(noted):
        home = closed(opened, noted)
        mechanism = with_masses(home.mechanism, home.collision.masses, home.mechanism.bodies, noted)
        mechanism = with_collision(mechanism, home.collision, noted)
    return Imported(mechanism, home.gap, tuple(noted))


class Assembled(NamedTuple):
    """A mechanism without its shapes, how far its loops were open [length], and its collision geometry at home."""

    mechanism: Mechanism
    gap: float
    collision: Collision


def closed(opened: OpenMechanism, notes: list[Note]) -> Assembled:
    """Close the loops, make the geometry exact, then merge joints."""
    loops = OpenLoops(opened)
    gap = loops.gap(np.zeros(len(loops.low)))
    home, opened = _closed_home(opened, loops, notes)
    structure = closed_structure(opened, loops, home)
    _note_gaps(opened, loops, gap, home, _implied(structure, loops), notes)
    reference = _moved_reference(opened, loops.tree, home)
    slack = max(home.gap, CLOSED) if gap > CLOSED else 0.0
    rigid, stands_for = merged_bodies(merged_balls(structure.joints), opened.base, opened.end_effector)
    exact = straighten(rigid, opened, reference, slack, notes)
    collision = _moved_collision(opened, loops.tree, home).merged(stands_for)
    kept = {opened.base, opened.end_effector} | heavy_bodies(collision.masses)
    simple, within = combined(exact, kept, notes)
    masses = [dataclasses.replace(each, body=within.get(each.body, each.body)) for each in collision.masses]
    moving = unlocked(simple, opened, reference, slack, notes)
    limited = [short_joint(_told(joint, opened), loops.length) for joint in moving]
    reference = None if reference is None else shortened(reference, loops.length)
    collision = dataclasses.replace(collision, masses=tuple(masses))
    return Assembled(_mechanism(opened, limited, reference, notes), gap * loops.length, collision)


def _told(joint: Joint, opened: OpenMechanism) -> Joint:
    """A joint with its cone, or as the distance between two joints, where the description says so."""
    if joint.name in opened.spans:
        return dataclasses.replace(joint, axis=None, home=0.0, along=opened.spans[joint.name])
    return dataclasses.replace(joint, cone=opened.cones.get(joint.name, joint.cone))


def _closed_home(opened: OpenMechanism, loops: OpenLoops, notes: list[Note]) -> tuple[ClosedHome, OpenMechanism]:
    """Home with closed loops, and the machine without the ranges that cannot be kept there."""
    low, high = loops.low, loops.high
    is_driven = np.array([joint.actuated for joint in opened.joints])[column_joints(loops.tree)]
    note_names(notes, "home was outside the range, and is moved into it", _outside(loops, np.zeros_like(low)))
    rounding = _rounding(opened, loops)
    largest = max(rounding, TOLERANCES.file_gap)
    homes = [close_home(loops, ~is_driven | (low > 0.0) | (high < 0.0), low, high)]
    everything = np.ones_like(is_driven)
    if homes[-1].gap > max(rounding, CLOSED):  # motors are not moved for what rounding leaves
        homes.append(close_home(loops, everything, low, high))
    if min(home.gap for home in homes) > largest:
        homes.append(close_home(loops, everything, np.full_like(low, -np.inf), np.full_like(high, np.inf)))
    best = next((home for home in homes if home.gap <= CLOSED), min(homes, key=lambda home: home.gap))
    if best.gap > largest:
        raise InvalidMechanism(_faults(opened, loops, best, largest))
    if best.other <= ABOUT_AS_NEAR * best.distance:
        off = f"{best.other:.3g} L off for {best.distance:.3g} L"
        notes.append(
            Note(f"another pose closes the loops about as near to the drawing, {off}: draw the one that is meant")
        )
    beyond = _outside(loops, best.q)
    note_names(notes, "home is outside the range, which is left out", sorted(beyond))
    joints = [dataclasses.replace(each, range=None) if each.name in beyond else each for each in opened.joints]
    return best, dataclasses.replace(opened, joints=tuple(joints))


def _outside(loops: OpenLoops, q: Floats) -> list[str]:
    """Names of the joints that are beyond their ranges."""
    beyond = (q < loops.low - TOLERANCES.home_slack) | (q > loops.high + TOLERANCES.home_slack)
    return [joint.name for joint in loops.tree.joints if beyond[columns(loops.tree)[joint.name]].any()]


def _rounding(opened: OpenMechanism, loops: OpenLoops) -> float:
    """Gaps of loops that the digits of a file explain [L or rad], where these are known."""
    digits = worst(opened.roundings.values())
    most = np.inf if opened.is_asked else TOLERANCES.file_digits
    return float(min(digits.length / loops.length + digits.angle, most))


def _faults(opened: OpenMechanism, loops: OpenLoops, home: ClosedHome, largest: float) -> list[Fault]:
    """The loops that stay open, the worst first, each with its gap and with what would go on."""
    unit, faults = opened.length_unit, []
    openings = zip(loops.openings(np.zeros_like(loops.low)), loops.openings(home.q), strict=True)
    enough = up_to_digit(home.gap * loops.length * metres_of(unit))
    for loop, (before, after) in zip(opened.loops, openings, strict=True):
        distance, angle = (float(np.linalg.norm(part)) for part in after)
        if max(distance, angle) <= largest:
            continue
        gap = after[0] * loops.length
        begin = float(np.linalg.norm(before[0])) * loops.length
        vector = ", ".join(f"{value:.3g}" for value in np.where(np.abs(gap) > SHOWN * np.abs(gap).max(), gap, 0.0))
        by = f"{distance * loops.length:.3g} {unit} and {np.degrees(angle):.3g} deg"
        text = f"open by {by} at best, from {begin:.3g} {unit}; the gap is ({vector}) {unit}"
        ways = [f"--leave-out {loop.name} reads the rest"]
        if angle <= MENDED and loops.is_along_pin(loop, home.q, gap):
            text += ", along the pin"
            ways.insert(0, "`type: pin` in a file of loops, with `axis` along this gap, leaves it")
        if max(distance, angle) <= MENDED:
            ways.insert(0, f"--within {enough:g} closes it midway")
        expected = f"bodies that its joints let meet; to go on: {'; '.join(ways)}"
        faults.append((distance + angle, Fault(f"loop '{loop.name}'", text, expected)))
    return [fault for _, fault in sorted(faults, key=lambda each: -each[0])]


def up_to_digit(value: float) -> float:
    """The least number of one digit that is not below a value."""
    digit = 10.0 ** math.floor(math.log10(value))
    return float(math.ceil(value / digit) * digit)


def _note_gaps(
    opened: OpenMechanism, loops: OpenLoops, gap: float, home: ClosedHome, implied: tuple[str, ...], notes: list[Note]
) -> None:
    """Note how far the loops were open, which of them are redundant, and how far they stay open."""
    if gap > CLOSED:
        notes.append(Note(f"loops were open by {gap * loops.length:.3g} {opened.length_unit}, and are closed"))
    note_names(notes, "some of what these ask for follows from the others", implied)
    if home.gap > CLOSED:
        remaining = f"{home.gap * loops.length:.2g} {opened.length_unit}"
        what = f"the digits of the file do not fit together: joints are put midway in gaps of up to {remaining}"
        notes.append(Note(what))


def _implied(structure: Structure, loops: OpenLoops) -> tuple[str, ...]:
    """Names of the loops with more conditions than they add to the rank of those before them."""
    slopes = loop_slopes(structure, np.zeros((1, len(structure.coordinates))))[0]
    rank, names = 0, []
    for number, loop in enumerate(loops.loops):
        new_rank = int(np.linalg.matrix_rank(slopes[: 6 * number + 6], TOLERANCES.alignment))
        names += [loop.name] if new_rank - rank < 6 else []
        rank = new_rank
    return tuple(names)


def closed_structure(opened: OpenMechanism, loops: OpenLoops, home: ClosedHome) -> Structure:
    """The tree's joints where they are at a closed home, then the loops as joints."""
    joints = (*joints_at(loops.tree, home.q), *_closing_joints(loops, home))
    return dataclasses.replace(loops.tree, joints=joints)


def _closing_joints(loops: OpenLoops, home: ClosedHome) -> list[Joint]:
    """The loops as joints."""
    return [
        Joint(loop.name, loop.type, loop.connects, at=point, axis=frame[:, 2] if loop.type == "revolute" else None)
        for loop, (point, frame) in zip(loops.loops, loops.meetings(home.q), strict=True)
    ]


def _moved_reference(opened: OpenMechanism, tree: Structure, home: ClosedHome) -> Floats | None:
    """The reference point at the closed home; None for a joint end effector."""
    bodies = displacements(tree, home.q[None])
    if opened.reference_point is None or opened.end_effector not in bodies:
        return None
    motion = bodies[opened.end_effector][0]
    return np.asarray(motion[:3, :3] @ opened.reference_point + motion[:3, 3])


def _moved_collision(opened: OpenMechanism, tree: Structure, home: ClosedHome) -> Collision:
    """The collision geometry of the machine's bodies at the closed home."""
    collision = opened.collision.on({opened.base, *tree.bodies})
    if not (collision.solids or collision.masses) or not home.q.any():
        return collision
    return collision.moved({body: motion[0] for body, motion in displacements(tree, home.q[None]).items()})


def _mechanism(
    opened: OpenMechanism, joints: Iterable[Joint], reference: Floats | None, notes: list[Note]
) -> Mechanism:
    """The mechanism of closed joints; warnings of its freedom become notes."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MobilityWarning)
        mechanism = Mechanism(
            opened.name,
            joints,
            opened.end_effector,
            reference,
            opened.base,
            length_unit=opened.length_unit,
            angle_unit="rad",
            task=opened.task,
        )
    notes += [Note(str(each.message)) for each in caught if issubclass(each.category, MobilityWarning)]
    return mechanism
