"""`largest`: the largest box, cylinder or ball of positions that is proved to be within reach."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import array
from ..arrays import Floats
from ..certify.certificates import Certificate
from ..certify.pose_region import PoseRegion
from ..certify.question import certify
from ..checks import require_known, require_positive
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument, PfabrikError
from ..telling import OnProgress, telling
from .ask import workspace

Kind = Literal["box", "cylinder", "ball"]

BUDGET = 50_000
"""Cells that each attempt may look at: near the largest, many more would be needed for little."""

GROWTH, FAR, MOST_ATTEMPTS = 1.02, 1.1, 60
"""Factor by which a shape that is proved grows at first, up to this; then it doubles. The most attempts in all."""


@dataclass(frozen=True)
class Largest:
    """The largest shape found that is proved.

    Attributes
    ----------
    kind : "box", "cylinder" along z, or "ball".
    centre : (3,) [length].
    extents : length along x, y and z, (3,) [length]: sides of a box, diameters, height.
    certificate : of its region; None if it was not asked for.
    """

    kind: Kind
    centre: Floats
    extents: Floats
    certificate: Certificate | None

    @property
    def region(self) -> PoseRegion:
        """Its poses, if it is proved."""
        assert self.certificate is not None and self.certificate.region is not None
        return self.certificate.region


def largest(
    mechanism: Mechanism,
    kind: Kind,
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
    certified : False for the shape that is only sampled, at home's orientation, as of `Workspace.inscribed`.
    centre : (3,) [length].
    extents : proportions of its lengths along x, y and z, (3,); the first two of a cylinder, and all of a ball, are
        equal.
    rotation, tilt, yaw : the orientations at each position, as of `PoseRegion.box`.
    accuracy : share of its size up to which it is found.
    on_progress : called with (thousandths of proofs done, those in all, about); default: a line on a terminal, if it
        takes more than two seconds.

    Raises
    ------
    UnsupportedMechanism : as of `certify`.
    InvalidArgument : not even a hundredth of the shape is proved about the centre.
    """
    require_known("shape", [kind], get_args(Kind))
    step = require_positive("accuracy", accuracy)
    middle, half = _first(checked_mechanism(mechanism), kind, centre, extents, certified)
    if certified is False:
        return Largest(kind, middle, 2.0 * half, None)

    def attempt(scale: float, tell: OnProgress) -> Certificate:
        turns: dict[str, Any] = {"rotation": rotation, "tilt": tilt, "yaw": yaw}
        size = scale * half
        if kind == "box":
            region = PoseRegion.box(middle - size, middle + size, **turns)
        elif kind == "ball":
            region = PoseRegion.ball(middle, size[0], **turns)
        else:
            region = PoseRegion.cylinder(middle, size[0], 2.0 * size[2], **turns)
        return certify(mechanism, region, budget=BUDGET, on_progress=tell)

    with telling(f"largest {kind}", on_progress) as tell:
        scale, best = _bisected(attempt, step, tell)
    extents_found = 2.0 * scale * half
    extents_found.setflags(write=False)
    return Largest(kind, middle, extents_found, best)


def _bisected(
    attempt: Callable[[float, OnProgress], Certificate], step: float, tell: OnProgress | None
) -> tuple[float, Certificate]:
    """The largest scale that is proved, to a share of itself, and its certificate."""
    low, high, best, scale = 0.0, np.inf, None, 1.0
    for count in range(MOST_ATTEMPTS):
        gap = (high - low) / (max(low, 0.01) * step) if high < np.inf else 1.0 / step
        ahead = math.ceil(math.log2(max(gap, 1.0)))

        def report(done: int, total: int, count: int = count, ahead: int = ahead) -> None:
            if tell is not None:
                tell(1000 * count + 1000 * done // total, 1000 * (count + 1 + ahead))

        certificate = attempt(scale, report)
        if certificate:
            low, best = scale, certificate
        else:
            high = scale
        if low > 0.0 and high <= low * (1.0 + step):
            break
        if high < 0.01:
            raise InvalidArgument(
                "centre", f"a shape of which nothing is proved: {certificate}", "a centre within reach"
            )
        scale = 0.5 * (low + high) if high < np.inf else low * (GROWTH if low < FAR else 2.0)
    assert best is not None
    return low, best


def _first(mechanism: Mechanism, kind: Kind, centre: Any, extents: Any, certified: bool) -> tuple[Floats, Floats]:
    """The centre and the half sizes to begin with, (3,) each."""
    middle = None if centre is None else array("centre", centre, "3")
    shape = None if extents is None else array("extents", extents, "3")
    if shape is not None and not (shape >= 0.0).all():
        raise InvalidArgument("extents", f"{shape.tolist()}", "three numbers that are not negative")
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
            "sphere" if kind == "ball" else kind,
            None if middle is None else middle[axes],
            proportions=proportions,
        )
    except PfabrikError:
        if middle is None:
            raise
        raise InvalidArgument("centre", f"{middle.tolist()}", "a point with room around it") from None
    whole, half = mechanism.home_pose[:3, 3].copy(), np.zeros(3)
    whole[axes], half[axes] = found.centre, 0.5 * found.extents
    return whole, half
