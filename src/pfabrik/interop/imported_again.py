"""The original of a mechanism imported again: how far what import changes puts its poses off those of the file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..answers.solution import Solution
from ..description.mechanism import Mechanism
from ..errors import PfabrikError
from ..fk import solve_fk
from .mjcf_reading import from_mjcf
from .original import Original
from .urdf_reading import from_urdf
from .xml_reading import kind_of


def changes_of_import(
    original: Original,
    path: str | os.PathLike[str],
    loops: str | os.PathLike[str] | Mapping[str, Any] | None,
    configuration: str,
    solutions: Sequence[Solution],
) -> tuple[float, float, float]:
    """Gap of the file's loops [m], and how far poses of the machine that import makes of it are from it [m], [rad].

    The largest at the actuators of some answers of another mechanism that is said to be the same; 0 where import does
    not make a machine with the same actuators and end effector of the file: then nothing is explained by it.
    """
    again = _imported_again(original, path, loops, configuration)
    if again is None:
        return 0.0, 0.0, 0.0
    mechanism, file = original.mechanism, Original(again, path, loops, configuration)
    has_same = again.coordinate_names == mechanism.coordinate_names
    largest = np.zeros(3)
    for solution in solutions:
        values = dict(zip(mechanism.actuator_names, np.asarray(solution.actuators).tolist(), strict=True))
        answer = solve_fk(again, values, start=solution.q if has_same else None)
        if answer:
            largest = np.maximum(largest, file.compare(answer))
    gap, position, rotation = largest.tolist()
    return gap, position, rotation


def _imported_again(
    original: Original,
    path: str | os.PathLike[str],
    loops: str | os.PathLike[str] | Mapping[str, Any] | None,
    configuration: str,
) -> Mechanism | None:
    """The file as a machine with a mechanism's base, end effector, actuators and point; None where it makes none.

    Joints that the mechanism has not were left out, or held; so those of machines with the same joints come first.
    """
    mechanism, machines = original.mechanism, []
    asked: dict[str, Any] = {
        "base": mechanism.base,
        "end_effector": mechanism.end_effector,
        "actuated": mechanism.actuator_names,
        "length_unit": mechanism.length_unit,
        "task": mechanism.task,
    }
    for fixed in ((), original.left_out):
        try:
            if kind_of(path) != "mjcf":
                machine = from_urdf(path, loops, fixed=fixed, **asked).mechanism
            else:
                machine = from_mjcf(path, configuration=configuration, fixed=fixed, **asked).mechanism
        except PfabrikError:
            continue
        machines.append(machine)
    machines.sort(key=lambda each: each.coordinate_names != mechanism.coordinate_names)
    if not machines or set(machines[0].actuator_names) != set(mechanism.actuator_names):
        return None
    point = {} if mechanism.end_effector_is_joint else {"reference_point": mechanism.reference_point}
    return machines[0]._with(**point)
