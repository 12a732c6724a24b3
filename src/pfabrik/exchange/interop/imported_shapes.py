"""The shapes of an imported mechanism, from the collision geometry of its file, and the pairs that may touch."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import product
from typing import Any

from ...kinematics import links_of
from ...machine.description.links import MOST_PAIRS, bodies_of_shapes, overlaps_at_home
from ...machine.description.mechanism import Mechanism, Shape
from ...machine.description.structure import Structure
from ...machine.description.whole_rules import MOST_SHAPES, form_of_shapes, shape_faults
from .collision import Collision, Solid
from .notes import Note, note_names

Pair = frozenset[str]
NamedPair = tuple[str, str]


def with_collision(mechanism: Mechanism, collision: Collision, notes: list[Note]) -> Mechanism:
    """With the shapes of the collision geometry; what its file lets pass, or overlaps at home, may touch (`ignore`)."""
    solids = _solids_of(mechanism, collision.solids, notes)
    if not solids:
        if collision.clearance is not None:
            notes.append(Note("the clearance is left out, for no link has a thickness"))
        return mechanism
    if len(solids) > MOST_SHAPES:
        what = f"collision geometry is left out: {len(solids)} solids, of which a mechanism has at most {MOST_SHAPES}"
        notes.append(Note(what))
        return mechanism
    shapes = tuple(each.shape for each in solids)
    bodies = {shape.body for shape in shapes}
    notes.append(Note(f"collision geometry is read as shapes ({len(shapes)}), of", tuple(sorted(bodies))))
    bare = _unchecked(mechanism, shapes=shapes)
    structure = _unchecked(bare, ignore=_ignored(bare, solids, collision, notes), clearance=collision.clearance)
    overlapping = _in_order(bare, _overlapping(structure, notes))
    structure = _unchecked(structure, ignore=(*structure.ignore, *overlapping))
    clearance = structure.clearance
    if clearance is not None and not 0 < len(links_of(structure).pairs) <= MOST_PAIRS:
        notes.append(Note(f"the clearance is left out, for {len(links_of(structure).pairs)} pairs of links may touch"))
        clearance = None
    return mechanism._with(shapes=shapes, ignore=structure.ignore, clearance=clearance)


def _unchecked(structure: Structure, **changes: Any) -> Structure:
    """A structure with other fields."""
    fields: dict[str, Any] = Structure.__getstate__(structure)
    return Structure(**(fields | changes))


def _solids_of(mechanism: Mechanism, solids: Sequence[Solid], notes: list[Note]) -> list[Solid]:
    """The solids that a mechanism can have; notes name the bodies that joints have swallowed."""
    lost = dict.fromkeys(each.shape.body for each in solids if each.shape.body not in mechanism.bodies)
    note_names(notes, "collision geometry of bodies within a joint is left out, of", lost)
    on_bodies = [each for each in solids if each.shape.body not in lost]
    sound = [each for each in on_bodies if _is_sound(mechanism, each.shape)]
    if len(sound) < len(on_bodies):
        count = len(on_bodies) - len(sound)
        notes.append(Note(f"collision geometry without a volume, or of unknown joints, is left out ({count})"))
    return sound


def _is_sound(mechanism: Mechanism, shape: Shape) -> bool:
    if any(form_of_shapes((shape,))):
        return False
    return shape.between is None or not any(shape_faults(_unchecked(mechanism, shapes=(shape,))))


def _ignored(bare: Structure, solids: Sequence[Solid], collision: Collision, notes: list[Note]) -> list[NamedPair]:
    """The pairs of bodies that may touch by the file: those that it excludes, as it names them, then all others."""
    passing = _passing(bare, solids, collision, notes)
    bodies = bodies_of_shapes(bare)
    names = {
        frozenset(pair) for places in passing.values() for i, j in places for pair in product(bodies[i], bodies[j])
    }
    excluded = [pair for pair in dict.fromkeys(collision.excluded) if frozenset(pair) in names]
    touching = {tuple(pair) for pair in links_of(_unchecked(bare, ignore=excluded)).pairs.tolist()}
    others = {pair for pair, places in passing.items() if not touching.isdisjoint(places)}
    return excluded + _in_order(bare, others)


def _passing(
    bare: Structure, solids: Sequence[Solid], collision: Collision, notes: list[Note]
) -> dict[Pair, list[tuple[int, int]]]:
    """Pairs of bodies none of whose solids touch by the file, each with the pairs of solids that would touch else.

    Bits that let no two links touch, or no link the base, are there to have nothing touch: they say nothing of pairs.
    """
    bodies = bodies_of_shapes(bare)
    groups: dict[bool, dict[Pair, list[tuple[int, int]]]] = {False: defaultdict(list), True: defaultdict(list)}
    for i, j in links_of(bare).pairs.tolist():
        pair = frozenset((solids[i].shape.body, solids[j].shape.body))
        groups[bare.base in pair][pair].append((i, j))
    passing, count, is_silent = {}, 0, False
    for group in groups.values():
        every = [pair for pairs in group.values() for pair in pairs]
        has_bits = any(_touches(collision, solids[i], solids[j]) for i, j in every)
        is_silent |= bool(every) and not has_bits
        for pair, places in group.items():
            excluded = [_is_excluded(collision, solids, bodies, i, j) for i, j in places]
            touching = [_touches(collision, solids[i], solids[j]) or not has_bits for i, j in places]
            if all(out or not may for out, may in zip(excluded, touching, strict=True)):
                count += not all(excluded)
                passing[pair] = places
    if is_silent:
        notes.append(
            Note("contype and conaffinity keep all links from touching each other, or the base: here such pairs count")
        )
    if count:
        notes.append(Note(f"pairs of links that contype and conaffinity keep from touching are in `ignore` ({count})"))
    return passing


def _touches(collision: Collision, one: Solid, other: Solid) -> bool:
    return one.touches(other) or frozenset((one.name, other.name)) in collision.paired


def _is_excluded(collision: Collision, solids: Sequence[Solid], bodies: Sequence[set[str]], i: int, j: int) -> bool:
    """True if the file excludes the pair of two solids, a strut by either part of it."""
    if frozenset((solids[i].name, solids[j].name)) in collision.paired:
        return False
    owners = [bodies[k] if solids[k].shape.between else {solids[k].owner} for k in (i, j)]
    return any(pair in collision.excluded or pair[::-1] in collision.excluded for pair in product(*owners))


def _overlapping(structure: Structure, notes: list[Note]) -> set[Pair]:
    """Pairs of bodies that overlap at home, or are nearer than the clearance; a note says how many, and which most."""
    overlaps = overlaps_at_home(structure)
    pairs = [tuple(structure.shapes[k].body for k in (i, j)) for _, i, j in overlaps]
    distinct = set(map(frozenset, pairs))
    if overlaps:
        distance, (first, second) = overlaps[0][0], pairs[0]
        how = f"by {-distance:.3g} {structure.length_unit}" if distance < 0.0 else "nearly"
        what = f"pairs of links that overlap at home are in `ignore` ({len(distinct)}), the deepest"
        notes.append(Note(what, (f"{first} and {second} {how}",)))
    return distinct


def _in_order(structure: Structure, pairs: set[Pair]) -> list[NamedPair]:
    """Pairs in the order of the bodies."""
    place = {body: index for index, body in enumerate(structure.bodies)}
    ordered = [sorted(pair, key=place.__getitem__) for pair in pairs]
    return [(one, other) for one, other in sorted(ordered, key=lambda pair: [place[body] for body in pair])]
