"""The functions that an exported file offers, but for those that are the same in all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..description.task import Task
from .machine import Machine
from .wording import literal, quoted


def functions(machine: Machine, parts: Sequence[str]) -> str:
    """The functions of the parts that are asked for."""
    lines = [*_what(machine, parts)]
    if "limits" in parts:
        lines += _slacks(machine)
    if "ik" in parts or "fk" in parts:
        lines += _read(machine)
    if "ik" in parts:
        lines += [*_ik(machine, "limits" in parts, "fk" in parts), *_count_turns(machine)]
    if "limits" in parts:
        lines += _limits(machine, "fk" in parts)
    if "fk" in parts:
        lines += _fk(machine)
    return "\n".join([*lines, ""])


def _what(machine: Machine, parts: Sequence[str]) -> Iterator[str]:
    yield "const char *pfk_what(int code)"
    yield "{"
    yield "    switch (code) {"
    yield "    case 0:"
    yield '        return "reached";'
    if "limits" in parts:
        for place, (joint, bound) in enumerate(machine.limits, 1):
            yield f"    case {place}:"
            yield f"        return {quoted(f'beyond a limit: joint {joint}, {bound}')};"
    for place, code in enumerate(machine.codes, 1):
        yield f"    case PFK_LEG + {place}:"
        yield f"        return {quoted('does not reach, or does not close: the leg of ' + ', '.join(code.joints))};"
    yield "    case PFK_NO_POSE:"
    yield '        return "not a pose";'
    yield "    case PFK_NO_ACTUATORS:"
    yield '        return "actuators that are not finite";'
    yield "    case PFK_OTHER_MODE:"
    yield '        return "closed, but not in the working mode of home";'
    yield "    default:"
    yield '        return "no code of this file";'
    yield "    }"
    yield "}"
    yield ""


def _slacks(machine: Machine) -> Iterator[str]:
    n_limits = len(machine.limits)
    yield "/* Fills the room that is left before every limit; 0, or the number of the one that is exceeded most. */"
    yield f"static int pfk_slacks(const pfk_leg leg[PFK_LEGS], pfk_real slack[{'PFK_LIMITS' if n_limits else ''}])"
    yield "{"
    if not n_limits:
        yield "    (void)leg;"
        yield "    (void)slack;"
        yield "    return 0;"
        yield "}"
        yield ""
        return
    lengths = [each.unit == "length" for each in machine.limited for _ in range(2)]
    lengths += [False] * len(machine.table.cones)
    sizes = ", ".join("PFK_SIZE" if each else "1.0" for each in lengths)
    yield f"    static const pfk_real unit[PFK_LIMITS] = {{{sizes}}};"
    for place, cone in enumerate(machine.table.cones):
        yield f"    static const pfk_real cone_{place}[3] = {literal(np.asarray(cone['axis']))};"
    yield f"    pfk_real {'value, ' if machine.limited else ''}worst = PFK_KEPT;"
    yield "    int i, exceeded = 0;"
    for place, each in enumerate(machine.limited):
        yield f"    value = {each.value};"
        yield f"    slack[{2 * place}] = value - {_signed(each.lo)};"
        yield f"    slack[{2 * place + 1}] = {literal(each.hi)} - value;"
    for place, cone in enumerate(machine.table.cones):
        line = machine.cone_line(cone)
        room = literal(float(cone["half_angle"]))
        yield f"    slack[{2 * len(machine.limited) + place}] = {room} - pfk_angle_between(cone_{place}, {line});"
    yield "    for (i = 0; i < PFK_LIMITS; ++i)"
    yield "        if (!(-slack[i] / unit[i] <= worst)) {"
    yield "            worst = -slack[i] / unit[i];"
    yield "            exceeded = i + 1;"
    yield "        }"
    yield "    return exceeded;"
    yield "}"
    yield ""


def _signed(value: float) -> str:
    text = literal(value)
    return f"({text})" if text.startswith("-") else text


def _read(machine: Machine) -> Iterator[str]:
    yield "/* What the actuators are where legs are placed. */"
    yield "static void pfk_read(const pfk_leg leg[PFK_LEGS], pfk_real actuators[PFK_ACTUATORS])"
    yield "{"
    for place, each in enumerate(machine.driven):
        yield f"    actuators[{place}] = {literal(each.home)} + {_bracketed(each.value)};"
    yield "}"
    yield ""


def _bracketed(value: str) -> str:
    return f"({value})" if value.startswith("-") else value


def _given_argument(forward: bool) -> str:
    return ", 0" if forward else ""


def _rest(machine: Machine, given: str) -> Iterator[str]:
    """Place legs at a whole pose, and see whether they close."""
    yield f"    code = pfk_place(&own{given}, leg);"
    if machine.rows_at_rest:
        yield "    if (!code) {"
        yield f"        code = pfk_equations(&own{given}, leg, row, slope, &worst);"
        yield "        code = worst <= PFK_CLOSE ? 0 : code;"
        yield "    }"


def _lead(machine: Machine, forward: bool) -> Iterator[str]:
    """Lead what a task sets of a pose to a target, and let the rest follow."""
    task = machine.task
    yield "/* Leads a pose to a target in so many parts, each completed from the one before: 0, PFK_NO_POSE, or the"
    yield "   number of a leg that does not reach or close. */"
    yield "static int pfk_lead(const pfk_pose *target, int parts, pfk_pose *own, pfk_leg leg[PFK_LEGS])"
    yield "{"
    if task.rotations == 2:
        yield "    pfk_real now[3], aim[3], turn[3], sine, cosine;"
    yield f"    int {'i, ' if task.rotations == 2 else ''}left, steps, code = 0;"
    yield "    pfk_real share;"
    yield "    for (left = parts; left > 0 && !code; --left) {"
    yield "        share = 1.0 / (pfk_real)left;"
    for axis in range(3):
        if task.axes[axis]:
            along = f"own->p[{axis}] + share * (target->p[{axis}] - own->p[{axis}])"
            yield f"        own->p[{axis}] = left > 1 ? {along} : target->p[{axis}];"
    if task.rotations == 3:
        yield "        pfk_turn_toward(own, target, share);"
    elif task.rotations == 2:
        yield "        /* the shortest turn that brings the platform's z axis to where it is wanted */"
        yield "        for (i = 0; i < 3; ++i) {"
        yield "            now[i] = own->R[i][2];"
        yield "            aim[i] = target->R[i][2];"
        yield "        }"
        yield "        pfk_cross(now, aim, turn);"
        yield "        sine = pfk_norm(turn);"
        yield "        cosine = pfk_dot(now, aim);"
        yield "        if (!(cosine > PFK_RANK - 1.0))"
        yield "            return PFK_NO_POSE;"
        yield "        if (sine > 0.0) {"
        yield "            for (i = 0; i < 3; ++i)"
        yield "                turn[i] *= share * atan2(sine, cosine) / sine;"
        yield "            pfk_spin(own, turn);"
        yield "        }"
    yield f"        code = pfk_settle(own{_given_argument(forward)}, PFK_IK_STEPS, parts == 1, leg, &steps);"
    yield "    }"
    yield "    return code;"
    yield "}"
    yield ""


def _ik(machine: Machine, limits: bool, forward: bool) -> Iterator[str]:
    completes = bool(machine.unset)
    if completes:
        yield from _lead(machine, forward)
    yield "int pfk_ik(const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS])"
    yield "{"
    yield "    pfk_leg leg[PFK_LEGS];"
    yield f"    pfk_pose own = *{'pose, wanted = *target' if completes else 'target'};"
    if limits and machine.limits:
        yield "    pfk_real slack[PFK_LIMITS];"
    if machine.rows_at_rest and not completes:
        yield "    pfk_real row[PFK_ROWS], slope[PFK_ROWS][6], worst;"
    yield "    int code;"
    if completes:
        yield from _complete(machine.task)
    else:
        if machine.task.rotations == 0:
            yield from _positions_alone("own", machine.task)
        yield "    if (pfk_make_exact(&own))"
        yield "        return PFK_NO_POSE;"
        yield from _rest(machine, _given_argument(forward))
    yield "    if (code)"
    yield "        return PFK_LEG + code;"
    if limits and machine.limits:
        yield "    code = pfk_slacks(leg, slack);"
        yield "    if (code)"
        yield "        return code;"
    yield "    *pose = own;"
    yield "    pfk_read(leg, actuators);"
    yield "    return 0;"
    yield "}"
    yield ""


def _positions_alone(name: str, task: Task) -> Iterator[str]:
    """Take over what a task sets that has no rotation; the rest is home's."""
    yield f"    pfk_home(&{name});"
    for axis in range(3):
        if task.axes[axis]:
            yield f"    {name}.p[{axis}] = target->p[{axis}];"


def _complete(task: Task) -> Iterator[str]:
    """Lead the pose to a target that leaves something open, at once or in small steps."""
    for axis in range(3):
        if not task.axes[axis]:
            yield f"    wanted.p[{axis}] = 0.0;"
    if task.rotations == 0:
        yield from _positions_alone("wanted", task)
    yield "    if (pfk_make_exact(&wanted) || pfk_make_exact(&own))"
    yield "        return PFK_NO_POSE;"
    yield "    code = pfk_lead(&wanted, 1, &own, leg);"
    yield "    if (code > 0) { /* there may be a way in small steps */"
    yield "        own = *pose;"
    yield "        pfk_make_exact(&own);"
    yield "        code = pfk_lead(&wanted, PFK_PARTS, &own, leg);"
    yield "    }"
    yield "    if (code < 0)"
    yield "        return code;"


def _count_turns(machine: Machine) -> Iterator[str]:
    """A function that counts angles by whole turns from those before, where a range lets them turn so far."""
    turning = [(place, each) for place, each in enumerate(machine.driven) if each.may_turn]
    if not turning:
        return
    yield "void pfk_count_turns(const pfk_real before[PFK_ACTUATORS], pfk_real now[PFK_ACTUATORS])"
    yield "{"
    yield "    pfk_real near;"
    for place, each in turning:
        yield f"    near = pfk_wrap(now[{place}], before[{place}]);"
        lo, hi = each.home + each.lo, each.home + each.hi
        if np.isfinite(each.hi - each.lo):
            yield f"    if (near >= {_signed(lo)} && near <= {_signed(hi)})"
            yield f"        now[{place}] = near;"
        else:
            yield f"    now[{place}] = near;"
    yield "}"
    yield ""


def _limits(machine: Machine, forward: bool) -> Iterator[str]:
    given = _given_argument(forward)
    yield f"int pfk_limits(const pfk_pose *pose, pfk_real slack[{'PFK_LIMITS' if machine.limits else ''}])"
    yield "{"
    yield "    pfk_leg leg[PFK_LEGS];"
    yield "    pfk_pose own = *pose;"
    if machine.rows_at_rest:
        yield "    pfk_real row[PFK_ROWS], slope[PFK_ROWS][6], worst;"
    yield "    int code;"
    yield "    if (pfk_make_exact(&own))"
    yield "        return PFK_NO_POSE;"
    yield from _rest(machine, given)
    yield "    return code ? PFK_LEG + code : pfk_slacks(leg, slack);"
    yield "}"
    yield ""


MODE_APART = 1e-3
"""How far actuators of another working mode are at least from those of home's [L or rad]: nearer, both meet."""


def _fk(machine: Machine) -> Iterator[str]:
    yield "int pfk_fk(const pfk_real actuators[PFK_ACTUATORS], pfk_pose *pose, int *steps)"
    yield "{"
    lengths = ", ".join("PFK_SIZE" if each.unit == "length" else "0.0" for each in machine.driven)
    yield f"    static const pfk_real size[PFK_ACTUATORS] = {{{lengths}}}; /* 0 of an angle */"
    yield "    pfk_leg leg[PFK_LEGS];"
    yield "    pfk_pose own = *pose;"
    yield "    pfk_real given[PFK_ACTUATORS], off;"
    yield "    int i, code, count = 0;"
    for place, each in enumerate(machine.driven):
        sign = "" if each.sense > 0 else "-"
        own = f"(actuators[{place}] - {_signed(each.home)})"
        yield f"    given[{place}] = {sign}{own};"
    yield "    for (i = 0; i < PFK_ACTUATORS; ++i)"
    yield "        if (!(fabs(0.0 * given[i]) <= 0.0))"
    yield "            return PFK_NO_ACTUATORS;"
    yield "    if (pfk_make_exact(&own))"
    yield "        return PFK_NO_POSE;"
    yield "    code = pfk_settle(&own, given, PFK_FK_STEPS, 0, leg, &count);"
    yield "    if (steps)"
    yield "        *steps = count;"
    yield "    if (code)"
    yield "        return PFK_LEG + code;"
    yield "    pfk_make_exact(&own);"
    yield "    *pose = own;"
    yield "    code = pfk_place(&own, 0, leg);"
    yield "    if (code)"
    yield "        return PFK_OTHER_MODE;"
    yield "    pfk_read(leg, given);"
    yield "    for (i = 0; i < PFK_ACTUATORS; ++i) {"
    yield "        off = given[i] - actuators[i];"
    yield "        off = size[i] > 0.0 ? off / size[i] : pfk_wrap(off, 0.0);"
    yield f"        if (!(fabs(off) <= {MODE_APART}))"
    yield "            return PFK_OTHER_MODE;"
    yield "    }"
    yield "    return 0;"
    yield "}"
    yield ""
