"""The colours of a border's limits, in pictures and in the viewer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import Ints

if TYPE_CHECKING:
    from .region import Region

MOTOR_COLOURS = ("#0072b2", "#56b4e9", "#009e73", "#332288", "#7fbf3f")
"""Cold colours: stops of motors. These and the warm ones are distinct for colour-blind people (Okabe and Ito; Tol)."""

JOINT_COLOURS = ("#e69f00", "#cc79a7", "#882255", "#f0e442", "#a6761d")
"""Warm colours: limits of passive joints, ends of reach and of the map."""

REST = "#b0b0b0"
"""Colour of all other limits together."""


class Group(NamedTuple):
    """Limits that have one colour.

    Attributes
    ----------
    limits : their indices among all limits.
    share : of the border that they form.
    is_motors : True if they are stops of driven joints.
    """

    name: str
    colour: str
    limits: list[int]
    share: float
    is_motors: bool

    @property
    def label(self) -> str:
        """The name, with a word for motors."""
        return self.name + ", actuated" * self.is_motors


def groups_of(region: Region) -> list[Group]:
    """Limits grouped by colour: each has its own if there are colours enough; else joints that are copies share one.

    Motors have cold colours, all else warm ones: these stops are changed in other ways.
    """
    groups: list[Group] = []
    others: list[tuple[str, str]] = []
    for is_motors, colours in ((True, MOTOR_COLOURS), (False, JOINT_COLOURS)):
        limits = [limit for limit in region.shares if is_actuated(region, limit[0]) == is_motors]
        together: dict[tuple[str, str], list[tuple[str, str]]] = {}
        for joint, bound in limits:
            stem = joint if len(limits) <= len(colours) else joint.rstrip("0123456789")
            together.setdefault((stem, bound), []).append((joint, bound))
        order = sorted(together.items(), key=lambda item: -sum(region.shares[limit] for limit in item[1]))
        for colour, ((stem, bound), alike) in zip(colours, order, strict=False):
            copies = sorted(joint[len(stem) :] for joint, _ in alike)
            groups.append(_group(region, f"{stem}{', '.join(copies)} {bound}".strip(), colour, alike, is_motors))
        others += [limit for _, alike in order[len(colours) :] for limit in alike]
    groups.sort(key=lambda group: -group.share)
    return [*groups, _group(region, f"{len(others)} other limits", REST, others, False)] if others else groups


def is_actuated(region: Region, joint: str) -> bool:
    """True if a limit is that of a driven joint; False for one that is no joint's: a coordinate's end, or reach."""
    return any(each.name == joint and bool(each.actuated) for each in region.mechanism.joints)


def _group(region: Region, name: str, colour: str, limits: list[tuple[str, str]], is_motors: bool) -> Group:
    share = sum(region.shares[limit] for limit in limits)
    places = [place for place, limit in enumerate(region.limits) if limit in limits]
    return Group(name, colour, places, share, is_motors)


def group_of_limits(region: Region, groups: list[Group]) -> Ints:
    """The place of each limit's group among groups, (n,); that of the last for a limit that forms no face."""
    places = np.full(len(region.limits), max(len(groups) - 1, 0))
    for place, group in enumerate(groups):
        places[group.limits] = place
    return places
