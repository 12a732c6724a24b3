"""Machines for tests, here those that positions express; `closure` has others, `published` those of the literature."""

from .positions import (
    MACHINES,
    hexaglide,
    hexapod_rus,
    hexapod_ups,
    mixed,
    planar,
    ring,
    serial_planar,
    serial_spherical,
    tripod_prs,
    tripod_rps,
)

__all__ = [
    "MACHINES",
    "hexaglide",
    "hexapod_rus",
    "hexapod_ups",
    "mixed",
    "planar",
    "ring",
    "serial_planar",
    "serial_spherical",
    "tripod_prs",
    "tripod_rps",
]
