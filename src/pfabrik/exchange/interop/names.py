"""Names that nothing else has."""

from __future__ import annotations


def unique(name: str, taken: set[str]) -> str:
    """The name, or the name with a number if it is taken; it counts as taken from now on."""
    free, number = name, 1
    while free in taken:
        number += 1
        free = f"{name}_{number}"
    taken.add(free)
    return free
