"""The C functions that fill a leg's equations and their derivatives by the pose: one for each shape.

A rod with foot F, head H, l = H - F, u = l / |l| has the equations |l| = length, n . l = 0 for a foot on one hinge n,
m . l = 0 for a head on one hinge m, and the angle about u between marks of its two ends where both keep it from
spinning. A pivot keeps its centre on its slides, and pairs of directions a . R b at their angle. Each derivative is
that of a . (H - F) + b . W + c . w, with W and w the angular velocities of what foot and head are on.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from .legs import PivotShape, RodShape
from .placing import carried, function_name, marks, parameters

Unit = Literal["length", "angle"]


class Drive(NamedTuple):
    """What an actuator moves of a leg: "carrier", "slide", "foot", "head" or "pivot slide"; which of its hinges."""

    what: str
    place: int


def units(shape: RodShape | PivotShape) -> list[Unit]:
    """Of each equation of a leg at any pose."""
    if isinstance(shape, PivotShape):
        pairs = {"cross": 1, "hinge": 2, "weld": 3}.get(shape.ending, 0)
        return _units(3 - shape.slides, pairs)
    lengths = (not shape.slides) + (shape.foot == "hinge") + (shape.head == "hinge")
    return _units(lengths, int(shape.twists))


def _units(lengths: int, angles: int) -> list[Unit]:
    found: list[Unit] = ["length" for _ in range(lengths)]
    return found + ["angle" for _ in range(angles)]


def drive_unit(shape: RodShape | PivotShape, drive: Drive) -> Unit:
    """Of the equation that an actuator adds in forward kinematics."""
    is_angle = isinstance(shape, PivotShape) and drive.what == "foot"
    return "angle" if is_angle else "length"


def equations_function(shape: RodShape | PivotShape, letter: str) -> str:
    """A function that fills the equations of a leg."""
    own = [*parameters(shape), _own(shape), "pfk_real row[]", "pfk_real slope[][6]"]
    body = _pivot_rows(shape) if isinstance(shape, PivotShape) else _rod_rows(shape)
    return "\n".join([f"static void {function_name('equations', letter)}({', '.join(own)})", "{", *body, "}", ""])


def drive_function(shape: RodShape | PivotShape, letter: str, drive: Drive) -> str:
    """A function that fills the equation of an actuator whose coordinate is given."""
    own = [*parameters(shape), _own(shape), "pfk_real given", "pfk_real *row", "pfk_real slope[6]"]
    body = _pivot_drive(shape, drive) if isinstance(shape, PivotShape) else _rod_drive(shape, drive)
    name = f"{function_name('drive', letter)}_{drive.what.replace(' ', '_')}_{drive.place}"
    return "\n".join([f"static void {name}({', '.join(own)})", "{", *body, "}", ""])


def _own(shape: RodShape | PivotShape) -> str:
    """A leg fills how its carrier follows the pose; one without is only read."""
    fills = isinstance(shape, RodShape) and shape.carrier and not shape.is_shared
    return "pfk_leg *leg" if fills else "const pfk_leg *leg"


ZERO = "    static const pfk_real zero[3] = {0.0, 0.0, 0.0};"


def _rod_rows(shape: RodShape) -> Iterator[str]:
    rod, leg = ("main", "lead") if shape.is_shared else ("rod", "leg")
    own_carrier = shape.carrier and not shape.is_shared
    hinged = "hinge" in (shape.foot, shape.head)
    yield ZERO
    if hinged:
        yield "    pfk_real n[3], across[3];"
    if shape.twists:
        yield "    pfk_real foot_mark[3], head_mark[3], foot_first[3], head_first[3], by_foot[3], by_head[3];"
        yield "    pfk_real foot_body[3], head_body[3], along;"
    if own_carrier or shape.twists:
        yield "    int i;"
    if own_carrier:
        yield "    for (i = 0; i < 6; ++i)"
        yield "        leg->follow[i] = 0.0;"
        yield "    if (!leg->is_held) {"
        yield "        pfk_slope(frame, leg->head, leg->u, zero, leg->follow);"
        yield "        for (i = 0; i < 6; ++i)"
        yield f"            leg->follow[i] /= -({_rate(shape, 'leg->u', 'zero')});"
        yield "    }"
    row = 0
    if not shape.slides:
        yield "    row[0] = leg->length - rod->length;"
        yield from _slope(shape, 0, "leg->u", "zero", "zero")
        row += 1
    if shape.foot == "hinge":
        yield from carried(shape, "rod->foot_axes[0]", "n")
        yield f"    row[{row}] = pfk_dot(n, leg->span);"
        yield "    pfk_cross(n, leg->span, across);"
        yield from _slope(shape, row, "n", "across", "zero")
        row += 1
    if shape.head == "hinge":
        yield "    pfk_rotate(frame, rod->head_axes[0], n);"
        yield f"    row[{row}] = pfk_dot(n, leg->span);"
        yield "    pfk_cross(n, leg->span, across);"
        yield from _slope(shape, row, "n", "zero", "across")
        row += 1
    if shape.twists:
        yield from _twist(shape, row)
    yield "    (void)zero;"
    if shape.is_shared:
        yield f"    (void){rod};"
        yield f"    (void){leg};"


def _twist(shape: RodShape, row: int) -> Iterator[str]:
    yield from marks(shape)
    yield f"    row[{row}] = pfk_wrap(pfk_angle(leg->u, foot_mark, head_mark) - rod->twist, 0.0);"
    for end, kind in (("foot", shape.foot), ("head", shape.head)):
        directions = f"{end}_first, {end}_mark" if kind == "cross" else f"{end}_first"
        yield f"    pfk_{kind}_spin({directions}, leg->u, by_{end}, {end}_body);"
    yield "    for (i = 0; i < 3; ++i) {"
    yield "        by_head[i] -= by_foot[i];"
    yield "        foot_body[i] = -foot_body[i];"
    yield "    }"
    yield "    along = pfk_dot(by_head, leg->u);"
    yield "    for (i = 0; i < 3; ++i)"
    yield "        by_head[i] = (by_head[i] - along * leg->u[i]) / leg->length;"
    yield from _slope(shape, row, "by_head", "foot_body", "head_body")


def _slope(shape: RodShape, row: int, a: str, b: str, c: str, to: str | None = None) -> Iterator[str]:
    to = f"slope[{row}]" if to is None else to
    yield f"    pfk_slope(frame, leg->head, {a}, {c}, {to});"
    if shape.carrier:
        leg = "lead" if shape.is_shared else "leg"
        yield f"    pfk_follow({_rate(shape, a, b)}, {leg}->follow, {to});"


def _rate(shape: RodShape, a: str, b: str) -> str:
    """Derivative of - a . F + b . W by the coordinate of the carrier."""
    rod = "main" if shape.is_shared else "rod"
    return (
        f"pfk_crank_rate({rod}->axis, leg->arm, {a}, {b})"
        if shape.carrier == "crank"
        else f"-pfk_dot({a}, {rod}->axis)"
    )


def _rod_drive(shape: RodShape, drive: Drive) -> Iterator[str]:
    """Of a slide |l| = length + given; of hinges kept . u = value, kept a direction of what they are on.

    Of one hinge n, kept is n x line turned by the angle; of two, a and b, the first turns b, the second leaves a.
    """
    yield ZERO
    if drive.what == "slide":
        yield "    *row = leg->length - rod->length - given;"
        yield from _slope(shape, 0, "leg->u", "zero", "zero", "slope")
        return
    end, kind = drive.what, shape.foot if drive.what == "foot" else shape.head
    yield "    pfk_real own[3], kept[3], across[3], value = 0.0;"
    axes = f"rod->{end}_axes"
    if kind == "hinge":
        yield f"    pfk_cross({axes}[0], rod->line, across);"
        yield f"    pfk_about_angle(across, {axes}[0], given, own);"
    elif drive.place == 0:
        yield f"    pfk_about_angle({axes}[1], {axes}[0], given, own);"
        yield f"    value = pfk_dot({axes}[1], rod->line);"
    else:
        yield f"    pfk_about_angle(rod->line, {axes}[1], given, across);"
        yield f"    pfk_along({axes}[0], 0.0, {axes}[0], own);"
        yield "    value = pfk_dot(own, across);"
    if end == "foot":
        yield from carried(shape, "own", "kept")
    else:
        yield "    pfk_rotate(frame, own, kept);"
    yield "    *row = pfk_dot(kept, leg->span) - value * leg->length;"
    yield "    pfk_cross(kept, leg->span, across);"
    yield "    pfk_along(kept, -value, leg->u, kept);"
    yield from _slope(shape, 0, "kept", *(("across", "zero") if end == "foot" else ("zero", "across")), to="slope")
    yield "    (void)zero;"


def _pivot_rows(shape: PivotShape) -> Iterator[str]:
    n_fixed = 3 - shape.slides
    pairs = {"cross": 1, "hinge": 2, "weld": 3}.get(shape.ending, 0)
    yield ZERO
    if pairs:
        yield "    pfk_real moved[3], across[3], over = 0.0;"
    if n_fixed or pairs:
        yield "    int i;"
    if n_fixed:
        yield f"    for (i = 0; i < {n_fixed}; ++i) {{"
        yield "        row[i] = pfk_dot(pivot->fixed[i], leg->span);"
        yield "        pfk_slope(frame, leg->head, pivot->fixed[i], zero, slope[i]);"
        yield "    }"
    upright = {"hinge": 1, "weld": 3}.get(shape.ending, 0)
    if upright:
        yield "    /* an axis that is turned over meets the conditions too */"
        yield f"    for (i = 0; i < {upright}; ++i) {{"
        yield "        pfk_rotate(frame, pivot->foot_axes[i], moved);"
        yield "        over = pfk_dot(moved, pivot->foot_axes[i]) < 0.0 ? 2.0 : over;"
        yield "    }"
    if pairs:
        kept, moved = {
            "cross": ("pivot->foot_axes[0]", "pivot->foot_axes[1]"),
            "hinge": ("pivot->kept[i]", "pivot->foot_axes[0]"),
            "weld": ("pivot->foot_axes[i]", "pivot->foot_axes[(i + 1) % 3]"),
        }[shape.ending]
        yield f"    for (i = 0; i < {pairs}; ++i) {{"
        yield f"        pfk_rotate(frame, {moved}, moved);"
        yield f"        row[{n_fixed} + i] = pfk_dot({kept}, moved) - pfk_dot({kept}, {moved}) + over;"
        yield f"        pfk_cross(moved, {kept}, across);"
        yield f"        pfk_slope(frame, leg->head, zero, across, slope[{n_fixed} + i]);"
        yield "    }"
    yield "    (void)zero;"


def _pivot_drive(shape: PivotShape, drive: Drive) -> Iterator[str]:
    """Of a slide, where the centre is along it; of hinges kept . R moved = value, with one of both turned by the angle.

    Of one hinge, of two (a, b) or of three (a, b, c): R = Rot(a) [Rot(b) [Rot(c)]].
    """
    yield ZERO
    if drive.what == "pivot slide":
        yield f"    *row = pfk_dot(pivot->slides[{drive.place}], leg->span) - given;"
        yield f"    pfk_slope(frame, leg->head, pivot->slides[{drive.place}], zero, slope);"
        return
    yield "    pfk_real kept[3], own[3], moved[3], across[3], value = 0.0;"
    a, b, c = (f"pivot->foot_axes[{place}]" for place in range(3))
    if shape.ending == "hinge":
        yield f"    pfk_about_angle(pivot->kept[0], {a}, given, kept);"
        yield "    pfk_along(pivot->kept[1], 0.0, pivot->kept[1], own);"
    elif shape.ending == "cross":
        yield f"    pfk_cross({a}, {b}, across);"
        if drive.place == 0:
            yield f"    pfk_about_angle(across, {a}, given, kept);"
            yield f"    pfk_along({b}, 0.0, {b}, own);"
        else:
            yield f"    pfk_along({a}, 0.0, {a}, kept);"
            yield f"    pfk_about_angle(across, {b}, -given, own);"
    elif drive.place == 0:
        yield f"    pfk_about_angle({b}, {a}, given, kept);"
        yield f"    pfk_along({c}, 0.0, {c}, own);"
        yield f"    value = pfk_dot({b}, {c});"
    elif drive.place == 1:
        yield f"    pfk_along({a}, 0.0, {a}, kept);"
        yield f"    pfk_about_angle({c}, {b}, given, across);"
        yield "    value = pfk_dot(kept, across);"
        yield f"    pfk_along({c}, 0.0, {c}, own);"
    else:
        yield f"    pfk_along({a}, 0.0, {a}, kept);"
        yield f"    pfk_about_angle({b}, {c}, -given, own);"
        yield f"    value = pfk_dot({a}, {b});"
    yield "    pfk_rotate(frame, own, moved);"
    yield "    *row = pfk_dot(kept, moved) - value;"
    yield "    pfk_cross(moved, kept, across);"
    yield "    pfk_slope(frame, leg->head, zero, across, slope);"
