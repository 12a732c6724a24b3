"""What a firmware's file says beside the machine: where it lets the nozzle go, and slips of whoever wrote it."""

from __future__ import annotations

from typing import NamedTuple


class PrintRegion(NamedTuple):
    """Settings that are no part of a machine.

    Attributes
    ----------
    radius : the firmware's word for how far out it prints, and the number; empty where the file says none.
    lowest : z below which the nozzle does not go [mm].
    floor : name of that z.
    slips : remarks on keys that nothing reads, which may be slips of those that are read.
    """

    radius: str = ""
    lowest: float = 0.0
    floor: str = "the bed"
    slips: tuple[str, ...] = ()
