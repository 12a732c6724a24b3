"""The colours of a border's limits, in pictures and in the viewer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..answers.words import limit_name
from ..arrays import Ints

if TYPE_CHECKING:
    from .region import Region

MOTOR_COLOURS = ("#0072b2", "#56b4e9", "#009e73", "#332288")
"""Cold colours: stops of motors. These and the warm ones are distinct for colour-blind people (Okabe and Ito; Tol)."""

JOINT_COLOURS = ("#e69f00", "#cc79a7", "#882255", "#f0e442")
"""Warm colours: limits of passive joints, ends of reach and of the map."""

MANY = 3
"""Numbers in a row from which on a span of them is named by its ends: "BL1…3 max"."""

LINK_COLOURS = ("#d55e00", "#7a1f00", "#f4a582")
"""Reds: links that are too near to each other."""

REST = "#b0b0b0"
"""Colour of all other limits together."""


class Group(NamedTuple):
    """Limits that have one colour.

    Attributes
    ----------
    limits : their indices among all limits.
    share : of the border that they form.
    is_motors : True if they are stops of driven joints.
    is_links : True if they are clearances of links.
    """

    name: str
    colour: str
    limits: list[int]
    share: float
    is_motors: bool
    is_links: bool = False

    @property
    def label(self) -> str:
        """The name, with a word for motors."""
        return self.name + ", actuated" * self.is_motors


def groups_of(region: Region) -> list[Group]:
    """Limits grouped by colour: joints that are copies share the one of each bound, in the order of their shares.

    Motors have cold colours, links that are too near reds, all else warm colours: these stops are changed in other
    ways. Where there are more groups than colours, the last ones are one group.
    """
    groups: list[Group] = []
    others: list[tuple[str, str]] = []
    for is_motors, colours in ((True, MOTOR_COLOURS), (False, JOINT_COLOURS)):
        copies: dict[tuple[str, str], list[tuple[str, str]]] = {}
        for joint, bound in region.shares:
            is_stop = bound in ("min", "max") and is_actuated(region, joint)
            if bound != "clearance" and is_stop == is_motors:
                copies.setdefault((joint.rstrip("0123456789"), bound), []).append((joint, bound))
        shares = {key: sum(region.shares[limit] for limit in alike) for key, alike in copies.items()}
        order = sorted(copies.items(), key=lambda item: (-round(shares[item[0]], 2), item[0]))
        for colour, ((stem, bound), alike) in zip(colours, order, strict=False):
            name = f"{stem}{_span([joint[len(stem) :] for joint, _ in alike])} {bound}".strip()
            groups.append(_group(region, name, colour, alike, is_motors))
        others += [limit for _, alike in order[len(colours) :] for limit in alike]
    groups += _groups_of_links(region)
    groups.sort(key=lambda group: -group.share)
    return [*groups, _group(region, f"{len(others)} other limits", REST, others, False)] if others else groups


def _span(numbers: list[str]) -> str:
    """The numbers of joints in their order; by their ends where none is left out: "1…3"."""
    numbers = sorted(numbers, key=lambda number: (len(number), number))
    if len(numbers) >= MANY and all(numbers) and int(numbers[-1]) - int(numbers[0]) == len(numbers) - 1:
        return f"{numbers[0]}…{numbers[-1]}"
    return ", ".join(numbers)


def _groups_of_links(region: Region) -> list[Group]:
    """Pairs of links that are too near: each has its own colour; where there are more, the last is of all the rest."""
    pairs = [limit for limit in region.shares if limit[1] == "clearance"]
    n_alone = len(LINK_COLOURS) - (len(pairs) > len(LINK_COLOURS))
    groups = [
        _group(region, limit_name(*pair), colour, [pair], False)
        for pair, colour in zip(pairs[:n_alone], LINK_COLOURS, strict=False)
    ]
    if pairs[n_alone:]:
        name = f"{len(pairs) - n_alone} other pairs too near"
        groups.append(_group(region, name, LINK_COLOURS[-1], pairs[n_alone:], False))
    return [group._replace(is_links=True) for group in groups]


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
