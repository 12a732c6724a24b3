"""An open machine as a mechanism: closed, pruned to what matters, and told what was found on the way."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from ..description.home_mobility import column_joints
from ..description.joint_types import KINDS
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..errors import Fault, InvalidArgument, InvalidMechanism, MobilityWarning
from ..motion.displacements import centres, columns, displacements, screws
from ..tolerances import TOLERANCES
from .closing import CLOSED, Closer, Placed, bounds, closed
from .digits import worst
from .opened import ROWS, Note, OpenMechanism, noting
from .simplify import simplified, without_twins
from .straighten import straightened


@dataclass(frozen=True)
class Imported:
    """A mechanism that was described elsewhere.

    Attributes
    ----------
    mechanism : closed at home.
    gap : how far the loops of the description were open, before they were closed [length; an angle times the size].
    notes : what was left out, changed or found, each with the names of what it is about.
    """

    mechanism: Mechanism
    gap: float
    notes: tuple[Note, ...]

    def __str__(self) -> str:
        return "\n".join([repr(self.mechanism), *map(str, self.notes)])


def assemble(opened: OpenMechanism, notes: Iterable[Note] = ()) -> Imported:
    """The mechanism of a description whose loops may be open at its home values.

    The passive joints are moved until all loops meet; where that does not do, the actuated ones too. Joints stay within
    their ranges. What the end effector does not depend on is not checked here: see `prune`.

    Parameters
    ----------
    notes : what is known already, to be told first.

    Raises
    ------
    InvalidMechanism : the loops cannot be closed, with how far they stay open, or what they make is no mechanism.
    """
    if not isinstance(opened, OpenMechanism):
        raise InvalidArgument("opened", type(opened).__name__, "an OpenMechanism")
    told = list(notes)
    with noting(told):
        return _assembled(opened, told)


def _assembled(opened: OpenMechanism, told: list[Note]) -> Imported:
    closer = Closer(opened)
    gap = closer.gap(np.zeros(closer.count))
    placed, opened = _placed(opened, closer, told)
    if gap > CLOSED:
        told.append(Note(f"loops were open by {gap * closer.length:.3g} {opened.length_unit}, and are closed"))
    implied = _implied(closer, placed)
    if implied:
        told.append(Note("some of what these ask for follows from the others", implied))
    if placed.gap > CLOSED:
        left = f"{placed.gap * closer.length:.2g} {opened.length_unit}"
        told.append(Note(f"the digits of the file do not fit together: joints are put midway in gaps of up to {left}"))
    moved = [*_moved(opened, placed), *_met(opened, closer, placed)]
    reference = _reference(opened, placed)
    slack = max(placed.gap, CLOSED) if gap > CLOSED else 0.0
    return Imported(_built(opened, moved, reference, slack, told), gap * closer.length, tuple(told))


def _placed(opened: OpenMechanism, closer: Closer, told: list[Note]) -> tuple[Placed, OpenMechanism]:
    """Where the joints go, and the machine without the ranges that cannot be kept there."""
    low, high = bounds(opened)
    owners = column_joints(closer.tree)
    driven = np.array([joint.actuated for joint in opened.joints])[owners]
    everything = np.ones(len(owners), bool)
    outside = [joint.name for joint, at in _outside(opened, np.zeros(len(owners))) if at]
    if outside:
        told.append(Note("home was outside the range, and is moved into it", tuple(outside)))
    rounded = _rounded(opened, closer)
    most = max(rounded, TOLERANCES.file_gap)
    tried = [closed(closer, ~driven | (low > 0.0) | (high < 0.0), low, high)]
    if tried[-1].gap > max(rounded, CLOSED):  # motors are not moved for what rounding leaves
        tried.append(closed(closer, everything, low, high))
    if min(each.gap for each in tried) > most:
        tried.append(closed(closer, everything, np.full_like(low, -np.inf), np.full_like(high, np.inf)))
    best = next((each for each in tried if each.gap <= CLOSED), min(tried, key=lambda each: each.gap))
    if best.gap > most:
        raise InvalidMechanism(_faults(opened, closer, best, most))
    beyond = {joint.name for joint, at in _outside(opened, best.q) if at}
    if beyond:
        told.append(Note("home is outside the range, which is left out", tuple(sorted(beyond))))
    joints = [dataclasses.replace(j, range=None) if j.name in beyond else j for j in opened.joints]
    return best, dataclasses.replace(opened, joints=tuple(joints))


def _outside(opened: OpenMechanism, q: Floats) -> list[tuple[Joint, bool]]:
    """Every joint, and whether it is beyond its range."""
    tree, (low, high) = opened.tree(), bounds(opened)
    beyond = (q < low - TOLERANCES.home_slack) | (q > high + TOLERANCES.home_slack)
    return [(joint, bool(beyond[columns(tree)[joint.name]].any())) for joint in opened.joints]


def _rounded(opened: OpenMechanism, closer: Closer) -> float:
    """How far the digits of a file let its loops be open [L or rad], where these are known."""
    digits = worst(opened.roundings.values())
    return min(digits.length / closer.length + digits.angle, TOLERANCES.file_digits)


def _faults(opened: OpenMechanism, closer: Closer, best: Placed, most: float) -> list[Fault]:
    """What stays open, the worst first."""
    begin = closer.openings(np.zeros(closer.count))
    found = []
    for loop, before, after in zip(opened.loops, begin, closer.openings(best.q), strict=True):
        (far, turn), (was, _) = (tuple(float(np.linalg.norm(part)) for part in each) for each in (after, before))
        if max(far, turn) > most:
            by = f"{far * closer.length:.3g} {opened.length_unit} and {np.degrees(turn):.3g} deg"
            found.append(
                (far + turn, f"open by {by} at best, from {was * closer.length:.3g} {opened.length_unit}", loop)
            )
    order = sorted(found, key=lambda each: -each[0])
    return [Fault(f"loop '{loop.name}'", text, "bodies that its joints let meet") for _, text, loop in order]


def _implied(closer: Closer, placed: Placed) -> tuple[str, ...]:
    """Names of the loops with more conditions than they add to the rank of those before them."""
    _, slopes = closer.linearised(placed.q)
    rank, end, names = 0, 0, []
    for loop in closer.loops:
        begin, end = end, end + ROWS[loop.type]
        now = int(np.linalg.matrix_rank(slopes[:end], TOLERANCES.alignment))
        names += [loop.name] if now - rank < end - begin else []
        rank = now
    return tuple(names)


def _moved(opened: OpenMechanism, placed: Placed) -> list[Joint]:
    """The tree's joints where they have been moved to, which is their home from now on."""
    tree, q = opened.tree(), placed.q[None]
    places, directions, moved = centres(tree, q), screws(tree, q)[0], []
    for joint in opened.joints:
        span = columns(tree)[joint.name]
        own, values = directions[span], placed.q[span]
        changes: dict[str, Any] = {"at": places[joint.name][0]} if joint.at is not None else {}
        kind = KINDS[joint.type]
        if kind.direction == "axis":
            changes["axis"] = own[0, 3:] if joint.type == "prismatic" else own[0, :3]
        if kind.direction == "axes":
            changes["axes"] = own[:, :3]
        if kind.ranged and values.any():
            home = np.ravel(tree.home_coordinate(joint.name)) + values
            changes["home"] = home[0] if len(home) == 1 else home
        moved.append(dataclasses.replace(joint, **changes))
    return moved


def _met(opened: OpenMechanism, closer: Closer, placed: Placed) -> list[Joint]:
    """The loops as the joints that they have become."""
    return [
        Joint(loop.name, loop.type, loop.connects, at=point, axis=frame[:, 2] if loop.type == "revolute" else None)
        for loop, (point, frame) in zip(opened.loops, closer.meeting(placed.q), strict=True)
    ]


def _reference(opened: OpenMechanism, placed: Placed) -> Floats | None:
    """Where the reference point has been moved to; None for a joint end effector."""
    bodies = displacements(opened.tree(), placed.q[None])
    if opened.reference_point is None or opened.end_effector not in bodies:
        return None
    motion = bodies[opened.end_effector][0]
    return np.asarray(motion[:3, :3] @ opened.reference_point + motion[:3, 3])


def _built(
    opened: OpenMechanism, joints: Sequence[Joint], reference: Floats | None, slack: float, told: list[Note]
) -> Mechanism:
    """The mechanism of closed joints, as plain as it can be said."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", MobilityWarning)
        single = without_twins(joints, opened.base, opened.end_effector)
        exact = straightened(single, opened, reference, slack, told)
        made = simplified(exact, opened.base, opened.end_effector, opened.cones, told)
        mechanism = Mechanism(
            opened.name,
            made,
            opened.end_effector,
            reference,
            opened.base,
            length_unit=opened.length_unit,
            angle_unit="rad",
            task=opened.task,
        )
    told += [Note(str(each.message)) for each in found if issubclass(each.category, MobilityWarning)]
    return mechanism
