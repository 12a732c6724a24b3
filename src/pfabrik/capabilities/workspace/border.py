"""The colours of a border's limits, in pictures and in the viewer."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...answers.words import limit_name
from ...common.arrays import Ints

if TYPE_CHECKING:
    from .region import Region

MOTOR_COLOURS = ("#0072b2", "#009e73", "#aaddff", "#a6d96a")
"""Cold colours: stops of motors. Neighbours differ in hue, for colour-blind people
too: light and shade change lightness, in which both bounds of a joint must not differ alone."""

JOINT_COLOURS = ("#e69f00", "#cc79a7", "#f0e442", "#882255")
"""Warm colours: limits of passive joints, ends of reach and of the map."""

MANY = 3
"""Numbers in a row from which on a span of them is named by its ends: "BL1…3 max"."""

LETTERED = re.compile(r"(?<=_)[A-Za-z]{1,2}$|(?<=[a-z])[A-Z]$|(?<=[A-Z0-9])[a-z]$")
"""Letters at the end of a name that may number it: one or two after an underscore, or one of another case."""

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
    types = {joint.name: str(joint.type) for joint in region.mechanism.joints}
    stems = stems_of(types)
    for is_motors, colours in ((True, MOTOR_COLOURS), (False, JOINT_COLOURS)):
        copies: dict[tuple[str, str, str], list[tuple[str, str]]] = {}
        for joint, bound in region.shares:
            is_stop = bound in ("min", "max") and is_actuated(region, joint)
            if bound != "clearance" and is_stop == is_motors:
                copies.setdefault((stems.get(joint, joint), types.get(joint, ""), bound), []).append((joint, bound))
        shares = {key: sum(region.shares[limit] for limit in alike) for key, alike in copies.items()}
        order = sorted(copies.items(), key=lambda item: (-round(shares[item[0]], 2), item[0]))
        for colour, ((stem, _, bound), alike) in zip(colours, order, strict=False):
            name = f"{stem}{_span([joint[len(stem) :] for joint, _ in alike])} {bound}".strip()
            groups.append(_group(region, name, colour, alike, is_motors))
        others += [limit for _, alike in order[len(colours) :] for limit in alike]
    groups += _groups_of_links(region)
    groups.sort(key=lambda group: -group.share)
    return [*groups, _group(region, f"{len(others)} other limits", REST, others, False)] if others else groups


def stems_of(types: Mapping[str, str]) -> dict[str, str]:
    """What the names of copies have in common, by name; a name alone for a joint that is no copy.

    Copies are joints of one type whose names differ in a number at their end, or, where there are at least three, in
    letters there: carriage_a, carriage_b, carriage_c; upper_al, upper_ar, upper_bl, …; armX, armY, armZ.

    Parameters
    ----------
    types : of joints, by name.
    """
    stems = {name: name.rstrip("0123456789") for name in types}
    lettered = {name: LETTERED.sub("", name) for name, stem in stems.items() if stem == name and LETTERED.search(name)}
    counts = Counter((stem, types[name]) for name, stem in lettered.items())
    return stems | {name: stem for name, stem in lettered.items() if counts[stem, types[name]] >= MANY}


def _span(numbers: list[str]) -> str:
    """The numbers or letters of joints in their order; by their ends where none is left out: "1…3"."""
    numbers = sorted(numbers, key=lambda number: (len(number), number))
    places = [
        int(number) if number.isdecimal() else ord(number)
        for number in numbers
        if number.isdecimal() or len(number) == 1
    ]
    if len(numbers) >= MANY and len(places) == len(numbers) and places[-1] - places[0] == len(places) - 1:
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
        name = f"{len(pairs) - n_alone} other clearances"
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
