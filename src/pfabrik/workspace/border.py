"""Which limits of a border share a colour, in pictures and in the viewer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .region import Region

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#f0e442")
"""Colours that colour-blind people can tell apart, after Okabe and Ito; of the limits that form most of the border."""

REST = "#b0b0b0"
"""Of all other limits together."""


class Group(NamedTuple):
    """Limits that have one colour.

    Attributes
    ----------
    limits : their places among all.
    share : how much of the border they form.
    """

    label: str
    colour: str
    limits: list[int]
    share: float


def groups_of(found: Region) -> list[Group]:
    """Limits that share a colour: each its own where there are colours enough; else those of joints that are copies."""
    together = {limit: [limit] for limit in found.shares}
    if len(together) > len(COLOURS):
        together = {}
        for joint, bound in found.shares:
            together.setdefault((joint.rstrip("0123456789"), bound), []).append((joint, bound))
    order = sorted(together.items(), key=lambda item: -sum(found.shares[limit] for limit in item[1]))
    groups: list[Group] = []
    for colour, ((name, bound), limits) in zip(COLOURS, order, strict=False):
        copies = sorted(joint[len(name) :] for joint, _ in limits)
        groups.append(_group(found, f"{name}{', '.join(copies)} {bound}".strip(), colour, limits))
    rest = [limit for _, limits in order[len(COLOURS) :] for limit in limits]
    return [*groups, _group(found, f"{len(rest)} other limits", REST, rest)] if rest else groups


def _group(found: Region, label: str, colour: str, limits: list[tuple[str, str]]) -> Group:
    share = sum(found.shares[limit] for limit in limits)
    return Group(label, colour, [place for place, limit in enumerate(found.limits) if limit in limits], share)
