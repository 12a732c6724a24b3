"""The C functions for all legs together: placing them, and moving what is open of a pose until they close."""

from __future__ import annotations

from collections.abc import Iterator

from .equations import units
from .legs import PivotShape
from .machine import Machine


def solving(machine: Machine, forward: bool, solves: bool, completes: bool) -> str:
    """Place all legs; fill all equations (`solves`); move what is open of a pose (`completes`, or forward)."""
    lines = [*_place(machine, forward)]
    if solves:
        lines += _equations(machine, forward)
    if forward or completes:
        lines += [*_motions(machine, forward), *_settle(forward)]
    return "\n".join([*lines, ""])


def _given(forward: bool) -> str:
    return ", const pfk_real *given" if forward else ""


def _leg_arguments(machine: Machine, leg: int) -> list[str]:
    """What the functions of a leg are given, up to the frame."""
    code = machine.codes[leg]
    kind = "pivots" if isinstance(code.shape, PivotShape) else "rods"
    arguments = [f"&pfk_{kind}[{machine.table_place(leg)}]"]
    if not isinstance(code.shape, PivotShape) and code.shape.is_shared:
        arguments += [f"&pfk_rods[{machine.table_place(code.main)}]", f"&leg[{code.main}]"]
    return [*arguments, "&back" if code.shape.is_reversed else "&forward"]


def _place(machine: Machine, forward: bool) -> Iterator[str]:
    yield "/* Places all legs; 0, or the number of the leg that is farthest from reaching. */"
    yield f"static int pfk_place(const pfk_pose *pose{_given(forward)}, pfk_leg leg[PFK_LEGS])"
    yield "{"
    yield "    pfk_frame forward, back;"
    yield "    pfk_real gap, worst = PFK_CLOSE;"
    yield "    int missing = 0;"
    yield "    pfk_frames(pose, &forward, &back);"
    for leg, code in enumerate(machine.codes):
        arguments = _leg_arguments(machine, leg)
        if machine.needs(code.shape, forward).given:
            drivers = [i for i, each in enumerate(machine.driven) if each.leg == leg and each.drive.what == "carrier"]
            arguments.append(f"given ? &given[{drivers[0]}] : 0" if drivers else "0")
        arguments.append(f"&leg[{leg}]")
        yield f"    gap = pfk_place_{machine.letters[code.shape]}({', '.join(arguments)});"
        yield "    if (!(gap <= worst)) {"
        yield "        worst = gap;"
        yield f"        missing = {leg + 1};"
        yield "    }"
    if forward:
        yield "    (void)given;"
    yield "    return missing;"
    yield "}"
    yield ""


def _equations(machine: Machine, forward: bool) -> Iterator[str]:
    rows = [*machine.rows, *(machine.drive_rows if forward else [])]
    values = ", ".join("PFK_SIZE" if row.unit == "length" else "1.0" for row in rows)
    yield "/* Fills the equations of all legs [L or rad], and their derivatives by the velocity [length] and the"
    yield "   angular velocity of the platform; the leg whose equation is farthest from closed, and how far it is. */"
    yield (
        f"static int pfk_equations(const pfk_pose *pose{_given(forward)}, pfk_leg leg[PFK_LEGS], "
        "pfk_real row[PFK_ROWS],"
    )
    yield "                         pfk_real slope[PFK_ROWS][6], pfk_real *worst)"
    yield "{"
    yield f"    static const pfk_real unit[PFK_ROWS] = {{{values}}};"
    yield f"    static const int owner[PFK_ROWS] = {{{', '.join(str(row.leg + 1) for row in rows)}}};"
    yield "    pfk_frame forward, back;"
    yield f"    int i, j, open = 0, rows = {'given ? PFK_ROWS : PFK_OWN_ROWS' if forward else 'PFK_OWN_ROWS'};"
    yield "    pfk_frames(pose, &forward, &back);"
    first = 0
    for leg, code in enumerate(machine.codes):
        count = len(units(code.shape))
        if not count:
            continue
        arguments = [*_leg_arguments(machine, leg), f"&leg[{leg}]", f"&row[{first}]", f"&slope[{first}]"]
        yield f"    pfk_equations_{machine.letters[code.shape]}({', '.join(arguments)});"
        first += count
    if forward and machine.drive_rows:
        yield "    if (given) {"
        for place, each in enumerate(machine.driven):
            if each.drive.what == "carrier":
                continue
            code = machine.codes[each.leg]
            name = f"pfk_drive_{machine.letters[code.shape]}_{each.drive.what.replace(' ', '_')}_{each.drive.place}"
            arguments = [*_leg_arguments(machine, each.leg), f"&leg[{each.leg}]", f"given[{place}]"]
            yield f"        {name}({', '.join(arguments)}, &row[{first}], slope[{first}]);"
            first += 1
        yield "    }"
    yield "    *worst = 0.0;"
    yield "    for (i = 0; i < rows; ++i) {"
    yield "        row[i] /= unit[i];"
    yield "        for (j = 0; j < 6; ++j)"
    yield "            slope[i][j] /= unit[i];"
    yield "        if (!(fabs(row[i]) <= 1e6)) {"
    yield "            *worst = 1e6;"
    yield "            return owner[i];"
    yield "        }"
    yield "        if (fabs(row[i]) > *worst) {"
    yield "            *worst = fabs(row[i]);"
    yield "            open = owner[i];"
    yield "        }"
    yield "    }"
    yield "    return open;"
    yield "}"
    yield ""


def _motions(machine: Machine, forward: bool) -> Iterator[str]:
    yield "/* Fills the motions of what is open of a pose: how many. */"
    yield (f"static int pfk_motions(const pfk_pose *pose{_given(forward)}, pfk_real motion[PFK_UNKNOWNS][6])")
    yield "{"
    yield "    int i, j, count = 0;"
    yield "    for (i = 0; i < PFK_UNKNOWNS; ++i)"
    yield "        for (j = 0; j < 6; ++j)"
    yield "            motion[i][j] = 0.0;"
    if forward:
        all_of = 3 if machine.mechanism.end_effector_is_joint else 6
        yield "    if (given) {"
        yield f"        for (i = 0; i < {all_of}; ++i)"
        yield "            motion[i][i] = i < 3 ? PFK_SIZE : 1.0;"
        yield f"        return {all_of};"
        yield "    }"
    if machine.unset:
        for axis, asked in enumerate(machine.task.axes):
            if not asked:
                yield f"    motion[count++][{axis}] = PFK_SIZE;"
        if machine.task.rotations == 0:
            for axis in range(3):
                yield f"    motion[count++][{3 + axis}] = 1.0;"
        elif machine.task.rotations == 2:
            yield "    for (i = 0; i < 3; ++i)"
            yield "        motion[count][3 + i] = pose->R[i][2];"
            yield "    ++count;"
    yield "    (void)pose;"
    yield "    return count;"
    yield "}"
    yield ""


def _settle(forward: bool) -> Iterator[str]:
    bound = "(!given && gone > PFK_FARTHEST)" if forward else "gone > PFK_FARTHEST"
    given = ", given" if forward else ""
    rows = "given ? PFK_ROWS : PFK_OWN_ROWS" if forward else "PFK_OWN_ROWS"
    yield "/* Moves what is open of a pose until all legs close, in no more than `most` steps, by Newton's method:"
    yield "   0, or the number of a leg that does not. Where it is strict all legs must reach at every step. */"
    own = f"pfk_pose *pose{_given(forward)}, int most, int strict, pfk_leg leg[PFK_LEGS], int *steps"
    yield f"static int pfk_settle({own})"
    yield "{"
    yield "    pfk_real row[PFK_ROWS], slope[PFK_ROWS][6], system[PFK_ROWS][PFK_UNKNOWNS + 1];"
    yield "    pfk_real motion[PFK_UNKNOWNS][6], x[PFK_UNKNOWNS], twist[6], worst, last = 0.0, gone = 0.0, size, share;"
    if forward:
        yield "    const pfk_pose start = *pose;"
    yield f"    int i, j, k, open, missing, count, {'turned = 0, ' if forward else ''}rows = {rows};"
    yield "    for (*steps = 0;; ++*steps) {"
    yield f"        missing = pfk_place(pose{given}, leg);"
    yield "        if (missing && strict)"
    yield "            return missing;"
    yield f"        open = pfk_equations(pose{given}, leg, row, slope, &worst);"
    yield "        if (worst <= PFK_CLOSED || (*steps && worst <= PFK_CLOSE && worst > 0.25 * last))"
    yield "            return missing;"
    yield f"        if (*steps == most || {bound})"
    yield "            return open;"
    yield "        last = worst;"
    yield f"        count = pfk_motions(pose{given}, motion);"
    yield "        for (i = 0; i < rows; ++i) {"
    yield "            for (j = 0; j < count; ++j) {"
    yield "                system[i][j] = 0.0;"
    yield "                for (k = 0; k < 6; ++k)"
    yield "                    system[i][j] += slope[i][k] * motion[j][k];"
    yield "            }"
    yield "            system[i][count] = -row[i];"
    yield "        }"
    yield "        if (pfk_least_squares(system, rows, count, x))"
    yield "            return open;"
    yield "        for (k = 0; k < 6; ++k) {"
    yield "            twist[k] = 0.0;"
    yield "            for (j = 0; j < count; ++j)"
    yield "                twist[k] += x[j] * motion[j][k];"
    yield "        }"
    yield "        size = pfk_norm(twist) / PFK_SIZE;"
    yield "        size = pfk_norm(twist + 3) > size ? pfk_norm(twist + 3) : size;"
    if forward:
        yield "        /* at rest but open, as more actuators than freedoms can be: once more, turned the other way */"
        yield "        if (given && !turned && size < 0.1 * worst) {"
        yield "            turned = 1;"
        yield "            pfk_turn_back(&start, pose);"
        yield "            continue;"
        yield "        }"
    yield "        share = size > PFK_LONGEST_STEP ? PFK_LONGEST_STEP / size : 1.0;"
    yield "        gone += share * size;"
    yield "        for (k = 0; k < 6; ++k)"
    yield "            twist[k] *= share;"
    yield "        pfk_along(pose->p, 1.0, twist, pose->p);"
    yield "        pfk_spin(pose, twist + 3);"
    yield "    }"
    yield "}"
    yield ""
