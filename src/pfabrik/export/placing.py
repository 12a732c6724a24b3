"""The C functions that place legs at a pose: one for each shape."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from .legs import PivotShape, RodShape


def function_name(verb: str, letter: str) -> str:
    """What the function of a shape is called."""
    return f"pfk_{verb}_{letter}"


class Needs(NamedTuple):
    """What is asked of the legs of a shape.

    Attributes
    ----------
    given : whether the coordinate of their carrier may be given, as in forward kinematics.
    lines : the ends from which the rod's direction is asked for, by a cone.
    angles : the ends whose hinges' angles are asked for.
    """

    given: bool = False
    lines: frozenset[str] = frozenset()
    angles: frozenset[str] = frozenset()


def place_function(shape: RodShape | PivotShape, letter: str, needs: Needs) -> str:
    """A function that fills what is asked of a leg at a pose; it tells how far the leg is from reaching [L]."""
    body = _place_pivot(shape, needs) if isinstance(shape, PivotShape) else _place_rod(shape, needs)
    return "\n".join([*_head(shape, letter, needs.given), *body, "}", ""])


def parameters(shape: RodShape | PivotShape) -> list[str]:
    """What every function of a leg is given: its numbers, what carries it, and the platform as it sees it."""
    kind = "pfk_pivot *pivot" if isinstance(shape, PivotShape) else "pfk_rod *rod"
    lead = ["const pfk_rod *main", "const pfk_leg *lead"] if isinstance(shape, RodShape) and shape.is_shared else []
    return [f"const {kind}", *lead, "const pfk_frame *frame"]


def described(shape: RodShape | PivotShape) -> str:
    """A shape in words."""
    side = ", read from the platform" if shape.is_reversed else ""
    if isinstance(shape, PivotShape):
        slides = {0: "", 1: "a slide, then "}.get(shape.slides, f"{shape.slides} slides, then ")
        return f"a pivot: {slides}{ENDINGS[shape.ending]}{side}"
    carrier = {"crank": " on a crank", "carriage": " on a carriage", "": ""}[shape.carrier]
    carrier = carrier.replace("a cr", "the cr").replace("a car", "the car") if shape.is_shared else carrier
    same = " of the leg before" if shape.is_shared and carrier else ""
    kind = "a rod that changes its length" if shape.slides else "a rod"
    return f"{kind}{carrier}{same}, from {ENDINGS[shape.foot]} to {ENDINGS[shape.head]}{side}"


ENDINGS = {
    "weld": "a weld",
    "hinge": "a hinge",
    "cross": "two crossed hinges",
    "triple": "three hinges through a point",
    "ball": "a ball",
}


def _head(shape: RodShape | PivotShape, letter: str, can_be_given: bool) -> list[str]:
    own = [*parameters(shape), *(["const pfk_real *given"] if can_be_given else []), "pfk_leg *leg"]
    return [
        f"/* {described(shape)[0].upper()}{described(shape)[1:]}: how far it is from reaching. */",
        f"static pfk_real {function_name('place', letter)}({', '.join(own)})",
        "{",
    ]


def _place_rod(shape: RodShape, needs: Needs) -> Iterator[str]:
    ends = [(end, kind) for end, kind in (("foot", shape.foot), ("head", shape.head)) if end in needs.angles]
    aimed = [end for end, kind in ends if kind == "cross"]
    own_carrier = shape.carrier and not shape.is_shared
    yield "    pfk_real gap = 0.0;"
    if aimed:
        yield "    pfk_real sure;"
    if shape.is_shared and shape.carrier == "crank":
        yield "    pfk_real arm[3];"
    if own_carrier:
        yield "    pfk_real moved[3];"
    yield "    pfk_map(frame, rod->head, leg->head);"
    if own_carrier:
        yield from _find_carrier(shape.carrier, needs.given)
    yield from _place_foot(shape)
    yield "    pfk_along(leg->head, -1.0, leg->foot, leg->span);"
    yield "    leg->length = pfk_norm(leg->span);"
    yield "    leg->u[0] = leg->u[1] = leg->u[2] = 0.0;"
    yield "    if (!(leg->length > 0.0))"
    yield "        return 1.0;"
    yield "    pfk_along(leg->u, 1.0 / leg->length, leg->span, leg->u);"
    yield from _see_line(shape, needs.lines | {end for end, _ in ends})
    if own_carrier:
        test = "leg->is_held && !given" if needs.given else "leg->is_held"
        yield f"    if ({test})"
        yield "        gap = fabs(leg->length - rod->length) / PFK_SIZE;"
    for end, kind in ends:
        yield from _turn_end(end, kind)
    if shape.twists and aimed:
        yield from _aim_otherwise(shape, aimed[-1])
    yield "    return gap;"


def _find_carrier(carrier: str, can_be_given: bool) -> Iterator[str]:
    """Where a rod's own carrier is, so that the rod reaches its head; or as it is given."""
    find = f"leg->is_held = pfk_{carrier}(rod, moved, leg);"
    yield "    pfk_displaced(frame, rod->head, moved);"
    if not can_be_given:
        yield f"    {find}"
        return
    yield "    if (given) {"
    yield "        leg->is_held = 1;"
    yield "        leg->carrier = *given;"
    if carrier == "crank":
        yield "        leg->cosine = cos(*given);"
        yield "        leg->sine = sin(*given);"
    yield "    } else"
    yield f"        {find}"


def _place_foot(shape: RodShape) -> Iterator[str]:
    """Where the foot is, on what carries it."""
    rod, leg = ("main", "lead") if shape.is_shared else ("rod", "leg")
    if shape.carrier == "crank" and shape.is_shared:
        yield "    pfk_along(rod->foot, -1.0, main->centre, arm);"
        yield "    pfk_about(arm, main->axis, lead->cosine, lead->sine, leg->arm);"
        yield "    pfk_along(main->centre, 1.0, leg->arm, leg->foot);"
    elif shape.carrier == "crank":
        yield "    leg->arm[0] = leg->arm[1] = leg->arm[2] = 0.0;"
        yield "    pfk_along(leg->arm, leg->cosine, rod->spoke, leg->arm);"
        yield "    pfk_along(leg->arm, leg->sine, rod->across, leg->arm);"
        yield "    pfk_along(rod->centre, 1.0, leg->arm, leg->foot);"
    elif shape.carrier == "carriage":
        yield f"    pfk_along(rod->foot, {leg}->carrier, {rod}->axis, leg->foot);"
    else:
        yield "    pfk_along(rod->foot, 0.0, rod->foot, leg->foot);"


def _see_line(shape: RodShape, seen: frozenset[str]) -> Iterator[str]:
    """The rod's direction as what its foot, or its head, is on sees it."""
    rod, leg = ("main", "lead") if shape.is_shared else ("rod", "leg")
    if "foot" in seen and shape.carrier == "crank":
        yield f"    pfk_about(leg->u, {rod}->axis, {leg}->cosine, -{leg}->sine, leg->foot_line);"
    elif "foot" in seen:
        yield "    pfk_along(leg->u, 0.0, leg->u, leg->foot_line);"
    if "head" in seen:
        yield "    pfk_rotate_back(frame, leg->u, leg->head_line);"


def _turn_end(end: str, kind: str) -> Iterator[str]:
    """The angles of the hinges at an end; of two that cross, also whether they can point the rod there."""
    if kind == "hinge":
        yield f"    leg->{end}_angle[0] = pfk_angle(rod->{end}_axes[0], rod->line, leg->{end}_line);"
    elif kind == "cross":
        arguments = f"rod->{end}_axes, rod->line, leg->{end}_line, rod->{end}_side, leg->{end}_angle"
        yield f"    sure = pfk_aim({arguments});"
        yield "    gap = -sure > gap ? -sure : gap;"


def _aim_otherwise(shape: RodShape, end: str) -> Iterator[str]:
    """The other way to aim two crossed hinges, where the two ends hold the rod the other way around."""
    yield "    {"
    yield "        pfk_real foot_mark[3], head_mark[3], foot_first[3], head_first[3];"
    yield from (f"    {line}" for line in marks(shape))
    yield "        if (fabs(pfk_wrap(pfk_angle(leg->u, foot_mark, head_mark) - rod->twist, 0.0)) > 0.25 * PFK_TURN)"
    yield f"            pfk_aim(rod->{end}_axes, rod->line, leg->{end}_line, -rod->{end}_side, leg->{end}_angle);"
    yield "    }"


def marks(shape: RodShape) -> Iterator[str]:
    """Directions that go with the ends of a rod, the last hinge of each, and the first hinges, as they are now."""
    for end, kind in (("foot", shape.foot), ("head", shape.head)):
        axes, mark, first = f"rod->{end}_axes", f"{end}_mark", f"{end}_first"
        if kind == "cross":
            yield f"    pfk_about_angle({axes}[1], {axes}[0], leg->{end}_angle[0], {first});"
        else:
            yield f"    pfk_along({axes}[0], 0.0, {axes}[0], {first});"
        if end == "foot":
            yield from carried(shape, first, mark)
            yield from carried(shape, f"{axes}[0]", first)
        else:
            yield f"    pfk_rotate(frame, {first}, {mark});"
            yield f"    pfk_rotate(frame, {axes}[0], {first});"


def carried(shape: RodShape, axis: str, to: str) -> Iterator[str]:
    """A direction of what the foot is on, as it is now."""
    rod, leg = ("main", "lead") if shape.is_shared else ("rod", "leg")
    if shape.carrier == "crank":
        yield f"    pfk_about({axis}, {rod}->axis, {leg}->cosine, {leg}->sine, {to});"
    else:
        yield f"    pfk_along({axis}, 0.0, {axis}, {to});"


def _place_pivot(shape: PivotShape, needs: Needs) -> Iterator[str]:
    if shape.slides:
        yield "    int i;"
    ending = shape.ending if "foot" in needs.angles else ""
    if ending == "triple":
        yield "    pfk_real last[3], sure;"
    if ending == "cross":
        yield "    pfk_real last[3];"
    yield "    pfk_map(frame, pivot->head, leg->head);"
    yield "    pfk_along(leg->head, -1.0, pivot->foot, leg->span);"
    if shape.slides:
        yield f"    for (i = 0; i < {shape.slides}; ++i)"
        yield "        leg->slide[i] = pfk_dot(pivot->slides[i], leg->span);"
    if ending == "hinge":
        yield "    leg->foot_angle[0] = pfk_spin_angle(frame, pivot->foot_axes[0]);"
    elif ending == "cross":
        yield "    pfk_rotate(frame, pivot->foot_axes[1], last);"
        yield "    leg->foot_angle[0] = pfk_angle(pivot->foot_axes[0], pivot->foot_axes[1], last);"
        yield "    leg->foot_angle[1] = pfk_last_angle(frame, pivot->foot_axes, pivot->square, leg->foot_angle, 1);"
    elif ending == "triple":
        yield "    pfk_rotate(frame, pivot->foot_axes[2], last);"
        yield "    sure = pfk_aim(pivot->foot_axes, pivot->foot_axes[2], last, pivot->foot_side, leg->foot_angle);"
        yield "    leg->foot_angle[2] = pfk_last_angle(frame, pivot->foot_axes, pivot->square, leg->foot_angle, 2);"
        yield "    return sure < 0.0 ? -sure : 0.0;"
    if ending != "triple":
        yield "    return 0.0;"
