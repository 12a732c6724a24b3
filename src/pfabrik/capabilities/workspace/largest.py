"""`largest`: the largest box, cylinder or ball of positions that is proved to be within reach."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import require_known, require_positive
from ...common.printed import ResultTable
from ...common.telling import OnProgress, telling
from ...errors import InvalidArgument, PfabrikError
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ..certify.certificates import Certificate
from ..certify.pose_region import PoseRegion
from ..certify.question import certify
from .ask import workspace
from .inscribed import LEAST, Inscribed, largest_scale

ShapeKind = Literal["box", "cylinder", "ball"]

BUDGET, MOST_ATTEMPTS = 50_000, 60
"""Cells that each attempt may look at: near the largest, many more would be needed for little. The most attempts."""


@dataclass(frozen=True)
class Largest(Inscribed):
    """The largest shape found that is proved.

    Attributes
    ----------
    kind : {"box", "cylinder", "ball"}
        A cylinder stands along z.
    centre : array (3,)
        The centre [length].
    extents : array (3,)
        Length along x, y and z [length]: sides of a box, diameters, height.
    certificate : Certificate or None
        Certificate of its region; None if it was not asked for.
    """

    certificate: Certificate | None

    @property
    def region(self) -> PoseRegion:
        """Its poses, if it is proved."""
        assert self.certificate is not None and self.certificate.region is not None
        return self.certificate.region

    def table(self) -> ResultTable:
        """Centre and extents, and the certificate."""
        return dataclasses.replace(super().table(), more=[] if self.certificate is None else [self.certificate.table()])


def largest(
    mechanism: Mechanism,
    kind: ShapeKind,
    *,
    certified: bool = True,
    centre: ArrayLike | None = None,
    extents: ArrayLike | None = None,
    rotation: ArrayLike | None = None,
    tilt: float | None = None,
    yaw: ArrayLike = 0.0,
    accuracy: float = 0.005,
    on_progress: OnProgress | None = None,
) -> Largest:
    """The largest shape of positions, with all orientations of a range, that is proved to be within reach.

    Its size is found by halving intervals; its centre and proportions are those given, or those of the largest shape
    that `Workspace.inscribed` finds at home's orientation.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    kind : str
        "box", "cylinder" along z, or "ball".
    certified : bool, optional
        False for the shape that is only sampled, at home's orientation, as in `Workspace.inscribed`.
    centre : array (3,), optional
        The centre [length].
    extents : array (3,), optional
        Proportions of its lengths along x, y and z; the first two of a cylinder, and all of a ball, are equal.
    rotation : float or array (3,) or (2, 3), optional
        The orientations at each position, as in `PoseRegion.box` [rad].
    tilt : float, optional
        As in `PoseRegion.box` [rad].
    yaw : float or array (2,), optional
        As in `PoseRegion.box` [rad].
    accuracy : float, optional
        Share of its size up to which it is found.
    on_progress : callable, optional
        Called with (thousandths of proofs done, those in all, about); default: a line on a terminal, if it takes more
        than two seconds.

    Raises
    ------
    UnsupportedMechanism
        As in `certify`.
    InvalidArgument
        Not even a hundredth of the shape is proved about the centre.
    """
    require_known("shape", [kind], ("box", "cylinder", "ball"))
    step = require_positive("accuracy", accuracy)
    middle, half = _first(checked_mechanism(mechanism), kind, centre, extents, certified)
    names, units = ("x", "y", "z"), (mechanism.length_unit,) * 3
    if certified is False:
        return Largest(kind, middle, 2.0 * half, names, units, None)
    certificates: list[Certificate] = []

    def is_proved(scale: float, low: float, high: float) -> bool:
        count = len(certificates)
        ahead = _attempts_ahead(low, high, step)

        def report(done: int, total: int) -> None:
            if tell is not None:
                tell(1000 * count + 1000 * done // total, 1000 * (count + 1 + ahead))

        region = _region(kind, middle, scale * half, rotation=rotation, tilt=tilt, yaw=yaw)
        certificates.append(certify(mechanism, region, budget=BUDGET, on_progress=report))
        return bool(certificates[-1])

    with telling(f"largest {kind}", on_progress) as tell:
        scale = largest_scale(is_proved, step, most_attempts=MOST_ATTEMPTS)
    if not scale:
        nothing = f"a shape of which nothing is proved: {certificates[-1]}"
        raise InvalidArgument("centre", nothing, "a centre within reach")
    size = 2.0 * scale * half
    size.setflags(write=False)
    best = next(certificate for certificate in reversed(certificates) if certificate)
    return Largest(kind, middle, size, names, units, best)


def _region(kind: str, middle: Floats, half: Floats, **turns: Any) -> PoseRegion:
    if kind == "box":
        return PoseRegion.box(middle - half, middle + half, **turns)
    if kind == "ball":
        return PoseRegion.ball(middle, half[0], **turns)
    return PoseRegion.cylinder(middle, half[0], 2.0 * half[2], **turns)


def _attempts_ahead(low: float, high: float, step: float) -> int:
    """How often an interval is halved to a share of its lower end."""
    gap = (high - low) / (max(low, LEAST) * step) if high < np.inf else 1.0 / step
    return math.ceil(math.log2(max(gap, 1.0)))


def _first(mechanism: Mechanism, kind: ShapeKind, centre: Any, extents: Any, certified: bool) -> tuple[Floats, Floats]:
    """The centre and the half sizes to begin with, (3,) each."""
    middle = None if centre is None else array("centre", centre, "3")
    shape = None if extents is None else array("extents", extents, "3")
    if shape is not None and not ((shape >= 0.0).all() and shape.any()):
        raise InvalidArgument("extents", f"{shape.tolist()}", "three numbers that are not negative, and not all 0")
    if kind == "ball" and shape is not None and np.ptp(shape) > 0.0:
        raise InvalidArgument("extents", f"{shape.tolist()}", "three equal ones for a ball")
    if kind == "cylinder" and shape is not None and shape[0] != shape[1]:
        raise InvalidArgument("extents", f"{shape.tolist()}", "two equal ones, then the height, for a cylinder")
    if middle is not None and shape is not None and certified:
        return middle, 0.5 * shape
    space = workspace(mechanism)
    places = [name for name in space.names if name in ("x", "y", "z")]
    if len(places) < len(space.names) or (len(places) < 3 and kind != "box"):
        raise InvalidArgument("kind", f"'{kind}'", "a shape of positions that the machine spans: in a plane, a box")
    axes = ["xyz".index(name) for name in places]
    proportions = None if shape is None or kind == "ball" else shape[[0, 2]] if kind == "cylinder" else shape[axes]
    try:
        found = space.inscribed(
            "sphere" if kind == "ball" else kind, None if middle is None else middle[axes], proportions=proportions
        )
    except PfabrikError:
        if middle is None:
            raise
        raise InvalidArgument("centre", f"{middle.tolist()}", "a point with room around it") from None
    whole, half = mechanism.home_pose[:3, 3].copy(), np.zeros(3)
    whole[axes], half[axes] = found.centre, 0.5 * found.extents
    return whole, half
