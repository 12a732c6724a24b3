"""An answer in words and as a table, in degrees and the mechanism's own unit of length."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Floats
from ..common.printed import ResultTable, error_text, plain
from ..common.rotations import to_rotvec, to_rpy
from ..engines.joints.assemble import is_over_determined
from ..engines.joints.first_order import is_at_dead_point
from ..machine.decomposition.leg_table import DEAD_POINTS
from ..machine.description.joints import KINDS
from ..machine.description.mechanism_table import bound_text
from ..machine.description.readouts import Readout, readouts
from ..machine.description.sketch import sketch
from ..machine.description.task import task_of
from ..machine.model import model_of
from ..machine.motion.fitting_task import has_dependent_coordinates, motions_at, task_remark, tilt_axis, what_follows
from ..tolerances import TOLERANCES

if TYPE_CHECKING:
    from ..machine.description.mechanism import Joint, Mechanism
    from .active_limits import ActiveLimit
    from .answer_fields import Answer


STRETCHED, NO_FREEDOM = "the links are stretched out or folded", "the mechanism has no freedom that way"
DEAD_POINT = "the drive is at a dead point, where the linkage may go on in either of two modes"
"""Causes that stop an end effector if no limit does."""

CONTRADICTORY, MODE_ENDS = (
    "the values contradict each other",
    "the assembly mode ends at a dead point, a parallel singularity",
)
"""Causes that keep actuators from their values if no limit does: elsewhere they could go on towards these."""


def as_sentence(answer: Answer) -> str:
    """The status of an answer to a single target, or to actuator values, in one sentence.

    For instance ``projected: 12.3 mm from the target; strut B3 at its maximum 250 mm; joint C1's cone at 45 deg``: the
    distance, the part of the target that is not held although it should be, and the limits that block it, the largest
    multiplier first.
    """
    status = str(answer.status).lower()
    if status == "reached":
        return "reached"
    if status == "projected":
        away = [f"{distance(answer)} from the target"] if answer._values is None else []
        return "projected: " + "; ".join([*away, *what_blocks(answer)])
    if status == "exceeded":
        return f"exceeded: assembled, but beyond limits: {by_bound(exceeded(answer))}"
    return f"{status}: no feasible configuration found; {what_is_wrong(answer)}"


def what_blocks(answer: Answer) -> list[str]:
    """Phrases for why a projected answer is not where it should be; first the distance from the values asked for."""
    if answer._values is None:
        return [*given_up(answer), *causes(answer)]
    return [f"{actuator_distance(answer, answer._values[0])} from the values asked for", *causes(answer)]


def causes(answer: Answer) -> list[str]:
    """Phrases for the active limits of a projected answer, or for another cause if no limit is active."""
    limits = answer._limits[0]
    if not limits:
        return [f"no limit is active: {why_without_limits(answer)}"]
    blocks_all = limits[0].bound not in DEAD_POINTS or why_without_limits(answer) != NO_FREEDOM
    return reasons(answer) if blocks_all else [*reasons(answer), NO_FREEDOM]


def given_up(answer: Answer) -> list[str]:
    """A phrase for the part of the target that a projected answer should hold and does not; empty if there is none."""
    from ..engines.joints.projection import modes_of
    from ..kernels.rows import HOLD_NOTHING

    request = answer._request
    if request is None or answer.held is not None:
        return []
    options = request.options
    if modes_of(model_of(answer.mechanism).path_closure, options)[0].hold == HOLD_NOTHING:
        return []
    unit = "rad" if options.hold == "orientation" else "L"
    return [f"to hold the {options.hold} would cost more than {options.hold_price:g} L per {unit}, so both differ"]


def why_without_limits(answer: Answer) -> str:
    """A phrase for the cause, to first order, that keeps an answer without active limits from its target."""
    mechanism, request = answer.mechanism, answer._request
    if request is None:
        return CONTRADICTORY if is_over_determined(model_of(mechanism).closure) else MODE_ENDS
    if has_dependent_coordinates(mechanism):
        return task_remark(mechanism)
    if is_at_dead_point(model_of(mechanism), answer._coordinates):
        return DEAD_POINT
    pose, target = answer.pose, request.targets[0]
    offset, turn = (target - pose)[:3, 3], to_rotvec(target[:3, :3] @ pose[:3, :3].T)
    is_off = answer.rotation_error > TOLERANCES.rotation
    has_way = has_freedom(mechanism, answer._coordinates, pose, offset / mechanism.characteristic_length, turn * is_off)
    return "nothing nearer was found" if has_way else NO_FREEDOM


def has_freedom(mechanism: Mechanism, q: Floats, pose: Floats, velocity: Floats, turn: Floats) -> bool:
    """True if a motion of the end effector at a pose (4, 4), in what its task sets, is one it can make at home or here.

    Parameters
    ----------
    q : joint coordinates here, (1, c).
    velocity, turn : of the reference point [L] and angular, (3,) each.
    """
    task = task_of(mechanism)
    axes, about = list(task.axes), np.zeros((0, 3))
    if not mechanism.end_effector_is_joint:
        about = task.turning_axes(pose) if tilt_axis(mechanism) is None else np.eye(3)
    motions = np.hstack([motions_at(mechanism, place) for place in (0.0 * q, q)])
    able = np.concatenate([motions[:3][axes], about @ motions[3:] if len(about) else motions[:0]])
    wanted = np.concatenate([velocity[axes], about @ turn])
    wanted = wanted / (np.abs(wanted).max(initial=0.0) or 1.0)  # so that no square is too large
    across = wanted - able @ np.linalg.lstsq(able, wanted, rcond=TOLERANCES.alignment)[0]
    return bool(np.linalg.norm(across) <= TOLERANCES.stretched * np.linalg.norm(wanted))


def what_is_wrong(answer: Answer) -> str:
    """A phrase for open loops or, if they are closed, for the limits that are exceeded."""
    if answer.residual <= TOLERANCES.position * answer.mechanism.characteristic_length:
        return f"limits exceeded: {by_bound(exceeded(answer))}"
    return f"loops open by {loop_gap(answer)}"


def distance(answer: Answer) -> str:
    """Those of position error and rotation error that exceed the tolerance, with units."""
    return error_words(answer.mechanism, float(answer.position_error), float(answer.rotation_error))


def error_words(mechanism: Mechanism, position: float, rotation: float) -> str:
    """Those of two errors [length], [rad] that exceed the tolerance, each with its unit: ``12.3 mm and 4 deg``."""
    parts = []
    if position > TOLERANCES.position * mechanism.characteristic_length:
        parts.append(f"{position:.3g} {mechanism.length_unit}")
    if rotation > TOLERANCES.rotation:
        parts.append(f"{math.degrees(rotation):.3g} deg")
    return " and ".join(parts) or "a hair"


def actuator_distance(answer: Answer, values: Floats) -> str:
    """The largest differences between actuated coordinates and their target values: ``up to 12.3 mm and 4 deg``."""
    worst: dict[str, float] = {}
    for readout, error in zip(readouts(answer.mechanism), np.abs(answer.actuators - values), strict=True):
        worst[readout.unit] = max(float(readout.display(error)), worst.get(readout.unit, 0.0))
    off = [f"{error_text(error, '.3g')} {unit}" for unit, error in worst.items() if error > 0.0]
    return f"actuators up to {' and '.join(off)}"


def loop_gap(answer: Answer) -> str:
    """The largest loop gap with its unit."""
    mechanism = answer.mechanism
    return f"{error_text(float(answer.residual), '.1g', mechanism.characteristic_length)} {mechanism.length_unit}"


def reasons(answer: Answer) -> list[str]:
    """Phrases for the limits that block a projected answer, the largest multiplier first, one per kind and value."""
    names: dict[tuple[str, str], list[str]] = {}
    for limit in answer._limits[0]:
        # length or angle: the bound's unit tells
        is_plain = limit.bound == "clearance" or answer.mechanism.joint(limit.joint).type != "universal"
        names.setdefault(in_words(limit, answer.mechanism), []).append(limit.joint if is_plain else name_of(limit))
    return [as_phrase(noun, list(dict.fromkeys(joints)), bound) for (noun, bound), joints in names.items()]


def in_words(limit: ActiveLimit, mechanism: Mechanism) -> tuple[str, str]:
    """The kind of joint and the bound: ``("strut", "maximum 250 mm")``; no kind for a pair of bodies."""
    if limit.bound == "clearance":
        return "", f"clearance {limit.limit:.6g} {mechanism.length_unit}"
    joint = mechanism.joint(limit.joint)
    if limit.bound in DEAD_POINTS:
        return "", limit.bound
    noun = "joint" if joint.type != "prismatic" else "strut" if joint.along else "slider"
    angle = math.degrees(limit.limit)
    if limit.bound == "cone":
        return noun, f"cone at {angle:.6g} deg"
    bound = "maximum" if limit.bound == "max" else "minimum"
    value = f"{limit.limit:.6g} {mechanism.length_unit}" if is_length(limit, joint) else f"{angle:.6g} deg"
    return noun, f"{bound} {value}"


def is_length(limit: ActiveLimit, joint: Joint) -> bool:
    """True if the limited coordinate is a length."""
    return limit.bound != "cone" and KINDS[joint.type].coordinates[limit.coordinate] == "length"


def name_of(limit: ActiveLimit) -> str:
    """The joint's name, with the coordinate if it is not the first."""
    return f"{limit.joint} (second coordinate)" if limit.coordinate else limit.joint


def as_phrase(noun: str, joints: Sequence[str], bound: str) -> str:
    """``strut B3 at its maximum 250 mm``, ``struts B1, B3 at their maximum 250 mm``, ``joint C1's cone at 45 deg``.

    Of bodies, ``BC1–BC3, BC2–BC4 at their clearance 2 mm``.
    """
    if bound == "stretched":
        return f"{STRETCHED} at joint{'s' * (len(joints) > 1)} {', '.join(joints)}"
    if bound == "level":
        rod = "the rods at {} are" if len(joints) > 1 else "the rod at {} is"
        return f"{rod.format(', '.join(joints))} level, and {'reach' if len(joints) > 1 else 'reaches'} no farther"
    if bound.startswith("clearance"):
        return f"{', '.join(joints)} at their {bound}"
    subject = f"{noun}{'s' * (len(joints) > 1)} {', '.join(joints)}"
    if bound.startswith("cone"):
        return (
            f"{subject}'s {bound}" if len(joints) == 1 else f"the cones of {subject} at{bound.removeprefix('cone at')}"
        )
    return f"{subject} at {'their' if len(joints) > 1 else 'its'} {bound}"


def short_names(limits: Iterable[ActiveLimit]) -> str:
    """Active limits for a cell of a table: ``B3 max; C1 cone; BC1–BC3 clearance``."""
    return "; ".join(dict.fromkeys(limit_name(name_of(limit), limit.bound) for limit in limits))


def limit_name(joint: str, bound: str) -> str:
    """The limit of a joint, or of two bodies, for a cell of a table: ``B3 max``, ``BC1–BC3 clearance``.

    Every border has this name, whichever verb meets it; ``links stretched`` where no joint tells.
    """
    return f"{joint or 'links'} {bound}"


BOUND_NOTES = {
    "stretched": "stretched: the links of this joint are in line, or square to a slide, and reach no farther",
    "level": "level: the rod of this joint is square to its slide, and reaches no farther",
    "not closed": "not closed: the hinges and rods of a leg do not come together beyond",
}
"""Bounds that are no limits of a joint, explained."""


def bound_notes(limits: Iterable[tuple[str, str]]) -> str:
    """A line for each bound among limits, by joint and bound, that is no limit of a joint; empty where all are."""
    bounds = {bound for _, bound in limits}
    return "\n".join(line for bound, line in BOUND_NOTES.items() if bound in bounds)


def exceeded(answer: Answer) -> list[ActiveLimit]:
    """The limits that an answer exceeds, without those that it only lies on."""
    return [limit for limit in answer._limits[0] if is_exceeded(limit, answer.mechanism)]


def is_exceeded(limit: ActiveLimit, mechanism: Mechanism) -> bool:
    """True if the coordinate is beyond its bound by more than the tolerance."""
    is_distance = limit.bound == "clearance" or is_length(limit, mechanism.joint(limit.joint))
    scale = mechanism.characteristic_length if is_distance else 1.0
    is_least = limit.bound in ("min", "clearance")
    excess = limit.limit - limit.value if is_least else limit.value - limit.limit
    return excess > TOLERANCES.limit * scale


def by_bound(limits: Iterable[ActiveLimit]) -> str:
    """Limits grouped by bound: ``B1, B2 max; C1 cone``."""
    names: dict[str, dict[str, None]] = {}
    for limit in limits:
        names.setdefault(limit.bound, {})[name_of(limit)] = None
    return "; ".join(limit_name(", ".join(joints), bound) for bound, joints in names.items())


def answer_table(answer: Answer, counts: dict[str, int]) -> ResultTable:
    """One answer; of a batch, the number of rows with each status."""
    name = answer.mechanism.name
    if answer.shape != ():
        rows = [(status, str(count)) for status, count in counts.items()]
        return ResultTable(name, [f"batch of shape {answer.shape}"], ("status", "rows"), rows)
    if not np.isfinite(answer.pose).all():
        return ResultTable(name, [str(answer.status).lower()])
    header, *rows = zip(*_actuators(answer), strict=True)
    held = {limit.joint for limit in answer._limits[0]}
    drawing = sketch(answer.mechanism, answer.points, answer.pose[:3, 3], held)
    return ResultTable(name, [as_sentence(answer), "", *_pose(answer)], header, rows, drawing=drawing)


def _pose(answer: Answer) -> list[str]:
    """Position and angles, aligned, and how far loops are open."""
    position, angles = pose_texts(answer)
    rows = [
        ("x y z", "   ".join(position), answer.mechanism.length_unit),
        ("roll pitch yaw", "   ".join(angles), "deg"),
    ]
    width, left_open = max(len(text) for _, text, _ in rows), what_follows(answer.mechanism)
    lines = [f"{name:<16}{text:<{width}}   [{unit}]" for name, text, unit in rows]
    return [*lines, f"{'loops closed to':<16}{loop_gap(answer)}", *([left_open] if left_open else [])]


def pose_texts(answer: Answer) -> tuple[list[str], list[str]]:
    """Position [length], and roll, pitch, yaw [deg]; half a turn is 180, whatever the sign that rounding gives it."""
    smallest = TOLERANCES.position * answer.mechanism.characteristic_length
    position = [plain(value, smallest) for value in answer.pose[:3, 3]]
    angles = (math.degrees(angle) for angle in to_rpy(answer.pose[:3, :3]))
    return position, [plain(180.0 if angle < 1e-7 - 180.0 else angle, 1e-7) for angle in angles]


def pose_cells(answer: Answer) -> list[str]:
    """Position and angles of a pose in one row."""
    position, angles = pose_texts(answer)
    return position + angles


def pose_columns(mechanism: Mechanism) -> list[str]:
    """The columns of `pose_cells`."""
    return [*(f"{name} [{mechanism.length_unit}]" for name in "xyz"), "roll [deg]", "pitch [deg]", "yaw [deg]"]


def actuator_columns(mechanism: Mechanism) -> list[str]:
    """The names of the actuators with their units for people."""
    return [f"{readout.name} [{readout.unit}]" for readout in readouts(mechanism)]


def _actuators(answer: Answer) -> list[Sequence[str]]:
    """Columns: the actuator values, the values asked for if they are not reached, and the limits."""
    shown, asked = readouts(answer.mechanism), answer._values
    columns = [["actuator", *(readout.name for readout in shown)], ["value", *in_units(shown, answer.actuators)]]
    if asked is not None and not answer:
        columns.append(["asked", *in_units(shown, asked[0])])
    for side, bound in enumerate(("min", "max")):
        columns.append([bound, *(bound_text(readout.limits[side]) for readout in shown)])
    return [*columns, ["unit", *(readout.unit for readout in shown)]]


def in_units(shown: Sequence[Readout], values: Floats) -> list[str]:
    """Actuator coordinates (n_a,) [length or rad] in the units for people."""
    return [plain(float(readout.display(value)), 1e-9) for readout, value in zip(shown, values, strict=True)]
