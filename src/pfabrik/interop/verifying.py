"""Answers compared with those of MuJoCo: on our own export, and on the file that a mechanism was imported from."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument
from ..tolerances import TOLERANCES
from .original import Original
from .referee import Referee
from .referee_configurations import Travelled, reached_at_random, travelled

FAR = 0.25
"""Share of its range, or of what was tried, that some actuator must have gone through: poses nearer to home than that
hold for machines that do not move at all."""


@dataclass(frozen=True)
class AgainstOriginal:
    """What the file says that a mechanism was imported from: the largest differences over all poses.

    Attributes
    ----------
    loop_gap : how far the file's own loops stay open, by rounding [length; angles as they are].
    position_difference, rotation_difference : between our pose and the file's, with the actuated joints where we have
        them [length], [rad].
    position_tolerance, rotation_tolerance : how far apart the digits of the file let poses be [length], [rad].
    """

    loop_gap: float
    position_difference: float
    rotation_difference: float
    position_tolerance: float
    rotation_tolerance: float

    def __bool__(self) -> bool:
        """Whether its loops close, and poses differ, by no more than the digits of the file explain."""
        apart = max(self.loop_gap, self.position_difference)
        return apart <= self.position_tolerance and self.rotation_difference <= self.rotation_tolerance


@dataclass(frozen=True)
class Verification:
    """What the referee found: the largest differences over all poses, lengths in the mechanism's unit.

    Attributes
    ----------
    poses : how many configurations were compared, of as many different targets.
    loop_gap : how far MuJoCo finds our answers open, by its own constraint rows [length; angles times L].
    position_difference, rotation_difference : between our pose and the one in which MuJoCo closes the loops by itself,
        with the actuated joints where we have them [length], [rad].
    tolerance : what counts as agreement [length].
    travelled : how far the poses went from home.
    original : what the original file says; None where none was given, or there were no poses.
    """

    poses: int
    loop_gap: float
    position_difference: float
    rotation_difference: float
    tolerance: float
    travelled: Travelled
    original: AgainstOriginal | None = None

    @property
    def agrees(self) -> bool:
        """Whether MuJoCo agrees on every pose with us, on our export and on the original."""
        apart = max(self.loop_gap, self.position_difference)
        own = apart <= self.tolerance and self.rotation_difference <= TOLERANCES.rotation
        return self.poses > 0 and own and (self.original is None or bool(self.original))

    @property
    def goes_far(self) -> bool:
        """Whether the poses are far enough from home to say something of the machine."""
        return max(self.travelled.shares.values(), default=0.0) >= FAR

    def __bool__(self) -> bool:
        """Whether there were poses that go far, and the two agree on all."""
        return self.agrees and self.goes_far


def verify(
    mechanism: Mechanism,
    *,
    poses: int = 100,
    seed: int = 0,
    original: str | os.PathLike[str] | None = None,
    loops: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    configuration: str = "qpos0",
) -> Verification:
    """Compare answers with MuJoCo's, over random targets that are reached.

    The mechanism is written as a MuJoCo model. At each answer MuJoCo's constraint rows say how far the loops are open;
    then the passive joints are moved off, and Newton's method on these rows closes the loops again, with the actuated
    joints held: that must lead to the same pose. An original is led from home to each answer, by the names of joints.

    Parameters
    ----------
    poses : how many.
    seed : of the random targets.
    original : the path of the MuJoCo model or robot description (URDF) that the mechanism was imported from.
    loops, configuration : as the original was imported with; see `from_urdf` and `from_mjcf`.

    Raises
    ------
    MissingLibrary : MuJoCo is not installed.
    InvalidArgument : less than one pose.
    UnknownName : an actuator or end effector that the original does not have.
    """
    checked_mechanism(mechanism)
    given: tuple[tuple[str, Any, int], ...] = (("poses", poses, 1), ("seed", seed, 0))
    for name, value, least in given:
        if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
            raise InvalidArgument(name, reprlib.repr(value), f"an integer from {least} on")
    rng = np.random.default_rng(seed)
    referee = Referee(mechanism)
    model = None if original is None else Original(mechanism, original, loops, configuration)
    found = reached_at_random(mechanism, poses, rng)
    tolerance = TOLERANCES.position * mechanism.characteristic_length
    if not found:
        return Verification(0, np.nan, np.nan, np.nan, tolerance, Travelled({}, {}, 0.0, 0.0))
    gap, position, rotation = np.max([referee.compare(solution, rng) for solution in found], axis=0).tolist()
    against = None
    if model is not None:
        far, off, turned = np.max([model.compare(solution) for solution in found], axis=0).tolist()
        unit, most = referee.metres, (model.position_tolerance, model.rotation_tolerance)
        against = AgainstOriginal(far / unit, off / unit, turned, most[0] / unit, most[1])
    return Verification(len(found), gap, position, rotation, tolerance, travelled(mechanism, found), against)
