"""Machines as firmwares with kinematics of their own describe them: struts, towers or thighs, with dimensions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...kernels.legs import records as K
from ...tolerances import TOLERANCES
from .machine_data import Coordinate, ExportedLeg, Machine


class Tower(NamedTuple):
    """A rail of a delta, moved inward by the offset of its rods on the platform.

    Attributes
    ----------
    place : (3,) [length], of the carriage at value 0.
    rod : its length.
    highest : of the carriage's value; infinite without a range.
    """

    place: Floats
    rod: float
    highest: float


class Thigh(NamedTuple):
    """A crank of a delta with its pair of parallel rods.

    Attributes
    ----------
    hip, ankle : (3,) [length]: the centre of the crank, and the middle of the rods on the platform from the reference
        point.
    length, shin : of the crank, and of the rods.
    added : the actuator's value, or minus it where that counts upward, less the angle by which the crank hangs [rad].
    least, most : of that angle; infinite without a range.
    """

    hip: Floats
    ankle: Floats
    length: float
    shin: float
    added: float
    least: float
    most: float


def struts_of(machine: Machine) -> list[tuple[Floats, Floats, float]] | None:
    """Base and platform ends of six struts, and their actuators' values less their lengths; None for other machines."""
    mechanism = machine.mechanism
    sets_whole_pose = not machine.unset and not mechanism.end_effector_is_joint
    if not sets_whole_pose or len(machine.legs) != 6 or machine.equations:
        return None
    legs = [machine.legs[driven.leg] for driven in machine.driven]
    if [driven.place for driven in machine.driven] != [K.SLIDE] * 6:
        return None
    if any(leg.record["reversed"] or leg.record["proximal"] != K.NO_PROXIMAL for leg in legs):
        return None
    ends = [(leg.of("base_end_point"), leg.of("platform_end_point")) for leg in legs]
    offsets = [driven.home - float(leg.of("length")) for driven, leg in zip(machine.driven, legs, strict=True)]
    return [(*driven, offset) for driven, offset in zip(ends, offsets, strict=True)]


def _pair(machine: Machine, driven: Coordinate, proximal: int) -> tuple[ExportedLeg, ExportedLeg] | None:
    """The two rods on an actuator, if it is the proximal joint asked for: a crank, or a carriage."""
    pair = [leg for leg in machine.legs if leg.main == driven.leg]
    return (pair[0], pair[1]) if len(pair) == 2 and pair[0].record["proximal"] == proximal else None


def towers_of(machine: Machine) -> list[Tower] | None:
    """The rails of a delta in the order of its actuators; None for other machines."""
    mechanism, size = machine.mechanism, machine.mechanism.characteristic_length
    if set(mechanism.task) != {"x", "y", "z"} or len(machine.driven) != 3 or len(machine.legs) != 6:
        return None
    towers = []
    for driven in machine.driven:
        pair = _pair(machine, driven, K.CARRIAGE)
        if pair is None:
            return None
        axis = pair[0].record["proximal_axis"] * driven.sense
        offsets = [leg.of("base_end_point") - leg.of("platform_end_point") for leg in pair]
        lengths = [float(leg.of("length")) for leg in pair]
        difference = max(np.abs(offsets[0] - offsets[1]).max() / size, abs(lengths[0] - lengths[1]) / size)
        if (
            difference > TOLERANCES.alignment
            or np.linalg.norm(np.cross(axis, [0, 0, 1])) > TOLERANCES.alignment
            or axis[2] < 0
        ):
            return None
        towers.append(Tower(offsets[0] - driven.home * axis, lengths[0], driven.home + driven.hi))
    return towers


def angle_of(place: Floats) -> float:
    """The angle of a place (3,) about the z axis [deg], from 0 to 360."""
    return math.degrees(math.atan2(place[1], place[0])) % 360.0


def thighs_of(machine: Machine, *, either_way: bool = False) -> list[Thigh] | None:
    """The cranks of a delta that hangs from them, in the order of its actuators; None for other machines.

    Their axes are level and square to the way outward, they go down with their actuators (or up, if either way will
    do), and their knees are outside.
    """
    mechanism = machine.mechanism
    if set(mechanism.task) != {"x", "y", "z"} or len(machine.driven) != 3 or len(machine.legs) != 6:
        return None
    thighs = [_thigh(machine, driven, either_way) for driven in machine.driven]
    fitting = [driven for driven in thighs if driven is not None]
    return fitting if len(fitting) == len(thighs) else None


def _thigh(machine: Machine, driven: Coordinate, either_way: bool) -> Thigh | None:
    size, tolerance = machine.mechanism.characteristic_length, TOLERANCES.alignment
    pair = _pair(machine, driven, K.CRANK)
    if pair is None:
        return None
    axis, crank = pair[0].record["proximal_axis"], pair[0].of("crank")
    knees = [leg.of("base_end_point") for leg in pair]
    ankles = [leg.of("platform_end_point") for leg in pair]
    misalignment = np.cross(axis, knees[1] - knees[0])
    difference = max(np.abs((knees[1] - knees[0]) - (ankles[1] - ankles[0])).max(), np.linalg.norm(misalignment)) / size
    knee, ankle = 0.5 * (knees[0] + knees[1]), 0.5 * (ankles[0] + ankles[1])
    hip = knee - crank
    outward = np.append(hip[:2], 0.0) / max(float(np.linalg.norm(hip[:2])), tolerance * size)
    if difference > tolerance or max(abs(axis[2]), abs(axis @ outward)) > tolerance:
        return None
    down = np.array([0.0, 0.0, -1.0])
    sense = math.copysign(1.0, np.cross(axis * driven.sense, outward) @ down)
    if sense < 0.0 and not either_way:
        return None
    to_ankle = ankle + np.asarray(machine.mechanism.reference_point) - hip
    is_outside = (to_ankle @ down) * (crank @ outward) + (crank @ down) * -(to_ankle @ outward) > 0.0
    if to_ankle @ down <= 0.0 or not is_outside:
        return None
    angle = math.atan2(crank @ down, crank @ outward)
    shin = float(pair[0].of("length"))
    least, most = sorted((angle + sense * driven.lo, angle + sense * driven.hi))
    return Thigh(hip, ankle, float(np.linalg.norm(crank)), shin, sense * driven.home - angle, least, most)
