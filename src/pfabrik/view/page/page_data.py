"""All that a page knows of a machine."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np

from ...common.arrays import Floats
from ...common.memory_image import image_of, packed
from ...engines.pose.driven_legs import live_tables
from ...engines.pose.legs_engine import LegsEngine
from ...engines.pose.seeds import seeds_of
from ...engines.pose.table import reading_table
from ...engines.pose.tables import limit_names, tables_of
from ...kernels.pose import tables as T
from ...kernels.pose.evaluate import new_evaluation_scratch
from ...kernels.pose.live_pose import new_live_scratch
from ...kernels.pose.search_records import new_solutions
from ...kernels.search_constants import MOVED, SUSPICIOUS, UNDONE
from ...kernels.ticks import DRIVE
from ...kinematics import Model, engine_of, joint_path, model_of, passive_series, tilt_axis
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.mechanism import Mechanism
from ...machine.motion.singularities import loop_blocks
from ...options import USUAL, Options
from ...tolerances import TOLERANCES
from ..drawn_parts import free_axes
from ..eye import VIEWS
from .posed_drawing import drawing_of

UNBOUNDED = 2**62
"""A number of steps that no search takes."""


def why_no_page(model: Model) -> str:
    """The reason why a page cannot answer for a machine by itself; empty where it can."""
    if model.why_no_legs:
        return model.why_no_legs
    if not isinstance(engine_of(model.mechanism), LegsEngine):
        return "its end effector is no platform on legs"
    if not tables_of(model, USUAL).machine[0]["searches"]:
        return "the same pose has other assemblies, which need all joint coordinates"
    return ""


def page_data(mechanism: Mechanism, options: Options = USUAL) -> dict[str, Any]:
    """Names, units and the drawing of a machine; with the tables of its answers where a page has them by itself."""
    model = model_of(mechanism)
    answers_itself = not why_no_page(model)
    box = _box(model) if answers_itself else mechanism.home_pose[:3, 3] + model.length * np.array([[-1.0], [1.0]])
    (slides, turns), axis = free_axes(mechanism), tilt_axis(mechanism)
    common = {
        "name": mechanism.name,
        "unit": mechanism.length_unit,
        "length": model.length,
        "home": mechanism.home_pose.ravel().tolist(),
        "box": box.tolist(),
        "columns": len(mechanism.coordinates),
        "branches": [],
        "task": {
            "slides": slides,
            "turns": turns,
            "rotations": int(model.task.rotations),
            "only": None if axis is None else axis.tolist(),
        },
        "actuators": [_row(drive, drive.bounds) | {"speed": drive.said("max_speed")} for drive in mechanism.drives],
        "series": _series(mechanism),
        "hasLimits": mechanism.without_limits() != mechanism,
        "drawing": drawing_of(mechanism, answers_itself, box),
        "views": {name: np.radians([around, up]).tolist() for name, (up, around) in VIEWS.items()},
    }
    return common | (_tables(model, options) if answers_itself else {})


def _tables(model: Model, options: Options) -> dict[str, Any]:
    """What the kernels in the page ask: the machine's tables as an image of memory, and the names of their entries."""
    legs, tables, records = model.legs, tables_of(model, options), _records(model, options)
    image = image_of(records)
    return {
        "branches": (np.sign(legs.home_sides[0]) if legs.has_sides else 0.0 * legs.home_sides[0]).tolist(),
        "arms": legs.implicit_joints["leg"].tolist() if legs.has_free_redundant else [],
        "others": len(tables.others.poses),
        "limits": _limits(model),
        "ranges": [
            [int(row["column"]), float(row["lo"] * row["unit"]), float(row["hi"] * row["unit"]), float(row["unit"])]
            for row in legs.limited
        ],
        "question": _places(T.QUESTION),
        "drive": _places(DRIVE),
        "driven": [] if loop_blocks(model.mechanism) else legs.driven[["column", "unit"]].tolist(),
        "multipliers": len(cast(Any, records["liveHessian"]).multipliers),
        "active": TOLERANCES.active,
        "holding": TOLERANCES.holding,
        "jump": {
            "turning": float(model.mechanism.rotation_length),
            "suspicious": SUSPICIOUS,
            "undone": UNDONE,
            "moved": MOVED,
        },
        "image": {"data": packed(image.data), "size": image.size, "moved": image.moved, "places": image.places},
    }


def _places(record: np.dtype[Any]) -> dict[str, int]:
    """Where the fields of a record are, counted in words."""
    return {name: place for place, name in enumerate(record.names or ())}


class _Target(NamedTuple):
    targets: Floats


class _Values(NamedTuple):
    values: Floats


class _Weights(NamedTuple):
    weights: Floats


class _Reading(NamedTuple):
    """Outputs of `evaluate_poses`."""

    coordinates: Floats  # (1, columns)
    no_rows: Floats  # (0, 0)
    no_slopes: Floats  # (0, 0, 0)


def _records(model: Model, options: Options) -> dict[str, Any]:
    """The arguments of kernels, by their names in the page."""
    tables = tables_of(model, options)
    legs, actuators = tables.legs.legs.shape[0], tables.home.actuators.shape[1]
    free = {
        name: getattr(tables, name)._replace(limited=tables.legs.limited[:0].copy(), cones=tables.legs.cones[:0].copy())
        for name in ("legs", "near")
    }
    reading, weighing = reading_table(model.legs).record, T.new_weighing_scratch(tables)
    live = live_tables(model, options, np.ones(actuators), np.full(actuators, np.inf))
    scratch = new_live_scratch(live)
    return {
        "tables": tables,
        "free": tables._replace(**free),
        "scratch": T.new_answer_scratch(tables),
        "start": T.Start(*(array.copy() for array in tables.home)),
        "home": tables.home,
        "others": tables.others,
        "target": _Target(np.zeros((1, 4, 4))),
        "values": _Values(np.zeros((1, actuators))),
        "weighing": weighing,
        "weights": _Weights(np.zeros(len(weighing.search.first.linear.h))),
        "live": live,
        "liveState": live.state,
        "liveScratch": scratch,
        "liveHessian": scratch.search.hessian,
        "question": T.Question(_question()),
        "answer": new_solutions(1, legs, actuators),
        "reading": reading,
        "readingScratch": new_evaluation_scratch(reading),
        "read": _Reading(np.zeros((1, len(model.mechanism.coordinates))), np.zeros((0, 0)), np.zeros((0, 0, 0))),
    }


def _question() -> Any:
    """What the page asks, before it says from where: searches are not bounded."""
    asked = np.zeros(1, T.QUESTION)
    asked["tolerance"] = Options().actuator_tolerance
    for bound in ("seeds", "steps", "effort"):
        asked[bound] = UNBOUNDED
    return asked


def _limits(model: Model) -> list[dict[str, Any]]:
    """The limits by their numbers: joint, bound, and their place in the order of the description."""
    mechanism, limited = model.mechanism, model.legs.limited
    coned = [joint.name for joint in mechanism.joints if joint.cone is not None]
    ranges = [2 * int(column) + bound for column in limited["column"] for bound in (0, 1)]
    limits = []
    for number, (joint, bound) in enumerate(limit_names(model)):
        is_range = number < len(ranges)
        place = ranges[number] if is_range else 2 * len(mechanism.coordinates) + coned.index(joint)
        limits.append({"joint": joint, "bound": bound, "place": place})
    return limits


def _box(model: Model) -> Floats:
    """Lowest and highest positions of the end effector among configurations all over its workspace [length]."""
    places = np.concatenate([seeds_of(model).poses[:, :3, 3] * model.length, model.mechanism.home_pose[None, :3, 3]])
    return np.array([places.min(axis=0), places.max(axis=0)])


def _row(each: JointCoordinate, bounds: tuple[float, float]) -> dict[str, Any]:
    """A coordinate that has a slider."""
    low, high = (float(bound) if np.isfinite(bound) else None for bound in bounds)
    kind = {"name": each.name, "joint": each.joint.name, "isAngle": each.kind == "angle"}
    return kind | {"low": low, "high": high, "home": float(each.home), "column": int(each.column)}


def _series(mechanism: Mechanism) -> dict[str, Any] | None:
    """The passive joints in series that carry the end effector: their coordinates, and the motions of each."""
    names = passive_series(mechanism)
    if not names:
        return None
    path, length = joint_path(mechanism, names), mechanism.characteristic_length
    motions = [
        {"kind": each.kind, "axis": list(each.axis), "sign": each.sign, "place": each.place}
        | {"point": (np.array(each.point) / length).tolist()}
        for each in path.motions
    ]
    return {"coordinates": [_row(each, each.limits) for each in path.coordinates], "motions": motions}
