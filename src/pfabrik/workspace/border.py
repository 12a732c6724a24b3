"""The colours of a border's limits, in pictures and in the viewer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .region import Region

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#f0e442", "#332288", "#882255")
"""Colours of the limits that form most of the border, distinct for colour-blind people (Okabe and Ito; two by Tol)."""

REST = "#b0b0b0"
"""Colour of all other limits together."""


class Group(NamedTuple):
    """Limits that have one colour.

    Attributes
    ----------
    limits : their indices among all limits.
    share : of the border that they form.
    """

    label: str
    colour: str
    limits: list[int]
    share: float


def groups_of(region: Region) -> list[Group]:
    """Limits grouped by colour: each has its own if there are colours enough; else joints that are copies share one.

    Stops of motors and of passive joints are never one group, whatever their names: they are changed in other ways.
    """
    together: dict[tuple[str, str, bool], list[tuple[str, str]]] = {}
    for joint, bound in region.shares:
        stem = joint if len(region.shares) <= len(COLOURS) else joint.rstrip("0123456789")
        together.setdefault((stem, bound, is_actuated(region, joint)), []).append((joint, bound))
    order = sorted(together.items(), key=lambda item: -sum(region.shares[limit] for limit in item[1]))
    groups: list[Group] = []
    for colour, ((stem, bound, actuated), limits) in zip(COLOURS, order, strict=False):
        copies = sorted(joint[len(stem) :] for joint, _ in limits)
        label = f"{stem}{', '.join(copies)} {bound}".strip() + ", actuated" * actuated
        groups.append(_group(region, label, colour, limits))
    others = [limit for _, limits in order[len(COLOURS) :] for limit in limits]
    return [*groups, _group(region, f"{len(others)} other limits", REST, others)] if others else groups


def is_actuated(region: Region, joint: str) -> bool:
    """True if a limit is that of a driven joint; False for one that is no joint's: a coordinate's end, or reach."""
    return any(each.name == joint and bool(each.actuated) for each in region.mechanism.joints)


def _group(region: Region, label: str, colour: str, limits: list[tuple[str, str]]) -> Group:
    share = sum(region.shares[limit] for limit in limits)
    return Group(label, colour, [place for place, limit in enumerate(region.limits) if limit in limits], share)
