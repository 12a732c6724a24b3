"""Machines for tests: what positions express, what they do not (`closure`), trees, and those of the literature."""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

from pfabrik import Mechanism, catalog, load

from .closure import MACHINES as CLOSED
from .closure import ON_ARMS, coaxial_rrr
from .positions import (
    MACHINES,
    five_bar,
    hexaglide,
    hexapod_rus,
    hexapod_ups,
    mixed,
    planar,
    ring,
    serial_planar,
    serial_spherical,
    struts,
    tripod_prs,
    tripod_rps,
)
from .trunks import TRUNKS

EVERY: dict[str, Callable[[], Mechanism]] = {
    **{name: partial(load, name) for name in catalog()},
    **{f"positions.{name}": make for name, make in MACHINES.items()},
    **{f"closure.{name}": make for name, make in (CLOSED | ON_ARMS | {"coaxial_rrr": coaxial_rrr}).items()},
}
"""Every machine of the catalogue and of the tests but trees."""

FILES: dict[str, Callable[[], Mechanism]] = {
    f"files.{path.stem}": partial(load, path) for path in sorted(Path(__file__).with_name("files").glob("*.toml"))
}
"""Machines of kinds that answers once were wrong for, as files."""


@cache
def machine(name: str) -> Mechanism:
    """A machine by its name in `EVERY`, or in one of the tables; made once."""
    return (TRUNKS | CLOSED | ON_ARMS | MACHINES | FILES | EVERY)[name]()


__all__ = [
    "EVERY",
    "FILES",
    "MACHINES",
    "TRUNKS",
    "five_bar",
    "hexaglide",
    "hexapod_rus",
    "hexapod_ups",
    "machine",
    "mixed",
    "planar",
    "ring",
    "serial_planar",
    "serial_spherical",
    "struts",
    "tripod_prs",
    "tripod_rps",
]
