"""``pfabrik ik``: one target, one answer; or all working modes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..printed import aligned
from ..printed import plain as plain_number
from ..tolerances import TOLERANCES
from .arguments import MECH, TargetOptions, load, note_left_out, note_unused_projection, projecting, targeted
from .printing import json_option, note, print_answer

if TYPE_CHECKING:
    from ..description.joints import Vector
    from ..targets import Target


@click.command()
@click.argument("mech", type=MECH)
@targeted
@projecting
@click.option("--margins", "with_margins", is_flag=True, help="List how far off every limit is, nearest first.")
@click.option("--force", "force", type=float, nargs=3, help="A force on the end effector: what do actuators exert?")
@click.option("--moment", "moment", type=float, nargs=3, help="A moment beside it, in units of force times length.")
@click.option("--all", "list_all", is_flag=True, help="List every working mode, limits kept or not.")
@json_option()
def ik(
    mech: str,
    target: TargetOptions,
    options: pf.Options,
    with_margins: bool,
    force: Vector | None,
    moment: Vector | None,
    list_all: bool,
    as_json: bool,
) -> int:
    """Solve for one target.

    A target out of reach gets the feasible answer nearest to it, with the limits that hold it back, the hardest first.

    A margin is a share of the room there is: 1 in the middle of a range, 0 on the limit. Where links have a
    thickness, a line says how far apart they are, and the clearance that is kept.

    With --force, or --moment, it also says what the actuators exert to hold it: positive drives a coordinate up.

    With --all only what reaches the target is listed, and the exit code is 0 if some mode keeps all limits.
    """
    if list_all and with_margins:
        raise click.UsageError("--margins is of one answer: it does not go with --all")
    if list_all and (force or moment):
        raise click.UsageError("--force and --moment are of one answer: they do not go with --all")
    if not target.is_given:
        raise click.UsageError("no target: give --position, --rpy or both, or --joint")
    mechanism = load(mech)
    pose = target.of(mechanism)
    note_left_out(ignored(mechanism, target), mechanism)
    note_only_tilt(mechanism, pose)
    if list_all:
        note_unused_projection("--all")
        from .report import print_modes

        return print_modes(lambda: pf.working_modes(mechanism, pose), as_json)
    solution = pf.solve_ik(mechanism, pose, options=options)
    from .report import clearance_line, margins_table

    wrench = (force or (0.0, 0.0, 0.0)) + (moment or ()) if force or moment else None
    held = None if wrench is None else pf.forces(solution, wrench)

    def in_words() -> str:
        tables = [str(solution.table()), *([] if held is None else [forces_table(solution, held)])]
        return "\n\n".join(tables + ([margins_table(solution), *clearance_line(solution)] if with_margins else []))

    print_answer(as_json, lambda: as_object(solution, with_margins, held), in_words)
    return 0 if solution else 1


def note_only_tilt(mechanism: pf.Mechanism, target: Target) -> None:
    """Note what does not count of a tilt where the end effector tilts about one axis alone."""
    from ..motion.tilt_axis import tilt_axis
    from ..poses import as_poses
    from ..targets import as_targets
    from .info_report import vector

    axis = tilt_axis(mechanism)
    if axis is not None and abs(as_targets(mechanism, target)[0] - as_poses(target)[0]).max() > TOLERANCES.alignment:
        note(f"of the tilt only the angle about {vector(axis)} counts, about which alone the end effector tilts")


def ignored(mechanism: pf.Mechanism, target: TargetOptions) -> Iterator[str]:
    """Options, or parts of them, that the task leaves out."""
    task, position, rpy = set(mechanism.task), target.position, target.rpy
    if position and not task & set("xyz"):
        yield "--position"
    elif position:
        for axis, value, home in zip("xyz", position, mechanism.reference_point, strict=True):
            if axis not in task and value != home:
                yield f"{axis} of --position"
    if rpy and not task & {"rotation", "tilt", "yaw"}:
        yield "--rpy"
    elif rpy and "yaw" in task and any(rpy[:2]):
        yield "the tilt in --rpy"
    elif rpy and "tilt" in task and any(rpy) and not any(rpy[:2]):
        yield "the yaw of --rpy"


def as_object(solution: pf.Solution, with_margins: bool, held: pf.Forces | None) -> dict[str, object]:
    """An answer as plain numbers, lists and dicts, with the reason where it is not reached."""
    plain = solution.to_dict() | ({} if solution else {"reason": solution.reason})
    if held is not None:
        from ..answers.solution import as_plain

        plain["forces"] = {"actuators": as_plain(held.actuators), "reason": held.reason}
    if with_margins:
        from ..answers.margins import nearest_first
        from ..description.links import has_pairs

        names = ("joint", "bound", "margin")
        if has_pairs(solution.mechanism):
            apart = pf.clearance(solution)
            plain["clearance"] = {"distance": apart.distance, "links": apart.links, "points": apart.points.tolist()}
        plain["margins"] = [dict(zip(names, limit, strict=True)) for limit in nearest_first(solution)]
    return plain


def forces_table(solution: pf.Solution, held: pf.Forces) -> str:
    """What each actuator exerts, or why no forces hold the load."""
    if held.reason:
        return f"no forces: {held.reason}"
    mechanism = solution.mechanism
    units = ["force" if drive.kind == "length" else f"force {mechanism.length_unit}" for drive in mechanism.drives]
    least = 1e-9 * max(map(abs, held.actuators.tolist()))
    values = [plain_number(float(value), least) for value in held.actuators]
    return aligned(["actuator", "exerts", "unit"], zip(mechanism.actuator_names, values, units, strict=True))
