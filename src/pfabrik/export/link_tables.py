"""The tables of an exported file by which it places links and measures the distances of their pairs."""

from __future__ import annotations

from collections.abc import Iterator

from ..kernels.clearance.solids import BOX, CAPSULE, DISC, KIND, ROUND, A
from .exported_links import ExportedLinks, ExportedSolid
from .moved_bodies import FIRST_MOVED, Motion
from .wording import literal, table, words

SOLIDS = {CAPSULE: "PFK_CAPSULE", BOX: "PFK_BOX", DISC: "PFK_DISC"}


def link_tables(links: ExportedLinks) -> Iterator[str]:
    """The tables of bodies, of links on them, and of pairs of links."""
    yield f"enum {{ PFK_LINKS = {len(links.solids)}, PFK_BODIES = {FIRST_MOVED + len(links.motions)} }};"
    yield ""
    if links.motions:
        yield from table("pfk_body pfk_bodies[]", map(_motion, links.motions))
    yield from table("pfk_link pfk_links[PFK_LINKS]", (_link(solid, links.has_solids) for solid in links.solids))
    yield from table("int pfk_pairs[PFK_PAIRS][2]", (f"    {{{first}, {second}}}" for first, second, _ in links.pairs))
    yield from words("pair", [f"links too near: {' and '.join(names)}" for *_, names in links.pairs])


def _motion(motion: Motion) -> str:
    integers = f"{motion.on}, {motion.kind}, {motion.leg}, {motion.place}"
    return f"    {{{integers}, {literal(motion.sense)}, {literal(motion.axis)}, {literal(motion.point)}}}"


def _link(solid: ExportedSolid, has_solids: bool) -> str:
    kind, size = int(solid.sizes[KIND]), literal(float(solid.sizes[ROUND]))
    bodies = "{" + ", ".join(map(str, solid.bodies)) + "}"
    if not has_solids:
        return f"    {{{bodies}, {{{size}, {literal(solid.place[:2])}}}}}"
    return f"    {{{bodies}, {{{SOLIDS[kind]}, {size}, {literal(solid.sizes[A:])}, {literal(solid.place)}}}}}"
