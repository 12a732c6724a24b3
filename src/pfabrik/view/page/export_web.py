"""`export_web`: a machine as one page that answers by itself, in any browser, without a server or a network."""

from __future__ import annotations

import html
import json
import os
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_ending
from ...common.memory_image import image_of, packed
from ...common.whole_files import whole_path
from ...engines.pose.legs_engine import LegsEngine
from ...engines.pose.seeds import seeds_of
from ...engines.pose.table import reading_table
from ...engines.pose.tables import limit_names, tables_of
from ...errors import InvalidArgument
from ...kernels.pose import tables as T
from ...kernels.pose.evaluate import new_evaluation_scratch
from ...kernels.pose.search_records import new_solutions
from ...kernels.search_constants import MOVED, SUSPICIOUS, UNDONE
from ...kinematics import Model, engine_of, model_of, tilt_axis
from ...machine.description.mechanism import Mechanism
from ...options import USUAL, Options
from ...tolerances import TOLERANCES
from ..drawn_parts import free_axes
from .posed_drawing import drawing_of

FOLDER = Path(__file__).parent
UNBOUNDED = 2**62
"""A number of steps that no search takes."""

SCRIPTS = (
    *("vectors", "meshes", "canvas", "scene", "gizmo", "engine"),
    *("singular", "session", "panel", "gestures", "page"),
)
"""Files of `web`, in the order in which a page has them."""


def export_web(mechanism: Mechanism, path: str | os.PathLike[str], *, hold_price: float = USUAL.hold_price) -> None:
    """Write a page on which one drags the machine: one file, for any browser, without a server or a network.

    The page answers as `solve_ik` and `solve_fk` do, by the same kernels: drag the platform or the sliders of the
    actuators; out of reach it shows the nearest feasible pose and lights up the limits that stop it. It shows travel,
    working modes and a slice of the workspace, and its address keeps the pose, to be sent as a link. No compiler is
    needed to write it.

    Parameters
    ----------
    mechanism : Mechanism
        A machine whose chains are all legs in closed form, as all parallel machines of the catalogue are.
    path : str or PathLike
        The file, which ends in ".html" or ".htm".
    hold_price : float, optional
        Up to which the nearest poses hold the orientation, as in `Options`.

    Raises
    ------
    InvalidArgument
        Another ending, or a machine that a page cannot answer for; says why.
    """
    require_ending(path, (".html", ".htm"))
    text = web_page(mechanism, Options(hold_price=hold_price))
    with whole_path(path) as part:
        part.write_text(text, encoding="utf-8")


def web_page(mechanism: Mechanism, options: Options = USUAL) -> str:
    """The text of the page."""
    model = _checked(mechanism)
    folder = FOLDER / "web"
    script = "\n".join((folder / f"{name}.js").read_text(encoding="utf-8") for name in SCRIPTS)
    filled = {
        "name": html.escape(mechanism.name),
        "style": _unindented((folder / "style.css").read_text(encoding="utf-8")),
        "machine": _as_json(machine_data(model, options)),
        "kernels": packed((FOLDER / "kernels.wasm").read_bytes()),
        "script": _unindented(script),
    }
    page = (folder / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{(\w+)\}", lambda place: filled[place[1]], page)


def _checked(mechanism: Mechanism) -> Model:
    """The model of a machine that a page can answer for.

    Raises
    ------
    InvalidArgument
    """
    model = model_of(mechanism)
    reason = model.why_no_legs
    if not reason and not isinstance(engine_of(mechanism), LegsEngine):
        reason = "its end effector is no platform on legs"
    if not reason and not tables_of(model, Options()).machine[0]["searches"]:
        reason = "the same pose has other assemblies, which need all joint coordinates"
    if reason:
        raise InvalidArgument("mechanism", f"'{mechanism.name}': {reason}", "a machine that closed forms answer alone")
    return model


def machine_data(model: Model, options: Options = USUAL) -> dict[str, Any]:
    """All that the page knows of a machine: its tables as an image of memory, names and units, and its drawing."""
    mechanism, legs, tables = model.mechanism, model.legs, tables_of(model, options)
    box = _box(model)
    drawing = drawing_of(model, box)
    (slides, turns), axis = free_axes(mechanism), tilt_axis(mechanism)
    only = None if axis is None else axis.tolist()
    image = image_of(_records(model, options))
    return {
        "name": mechanism.name,
        "unit": mechanism.length_unit,
        "length": model.length,
        "home": mechanism.home_pose.ravel().tolist(),
        "box": box.tolist(),
        "columns": len(mechanism.coordinates),
        "branches": (np.sign(legs.home_sides[0]) if legs.has_sides else 0.0 * legs.home_sides[0]).tolist(),
        "task": {
            "slides": slides,
            "turns": turns,
            "rotations": int(model.task.rotations),
            "only": None if only is None else only.tolist(),
        },
        "actuators": [_actuator(drive) for drive in mechanism.drives],
        "arms": legs.implicit_joints["leg"].tolist() if legs.has_free_redundant else [],
        "others": len(tables.others.poses),
        "limits": _limits(model),
        "ranges": [
            [int(row["column"]), float(row["lo"] * row["unit"]), float(row["hi"] * row["unit"]), float(row["unit"])]
            for row in legs.limited
        ],
        "question": {name: place for place, name in enumerate(T.QUESTION.names or ())},
        "active": TOLERANCES.active,
        "holding": TOLERANCES.holding,
        "jump": {
            "turning": float(mechanism.rotation_length),
            "suspicious": SUSPICIOUS,
            "undone": UNDONE,
            "moved": MOVED,
        },
        "image": {"data": packed(image.data), "size": image.size, "moved": image.moved, "places": image.places},
        "drawing": drawing,
    }


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


def _records(model: Model, options: Options) -> dict[str, tuple[Any, ...]]:
    """The arguments of kernels, by their names in the page."""
    tables = tables_of(model, options)
    legs, actuators = tables.legs.legs.shape[0], tables.home.actuators.shape[1]
    free = {
        name: getattr(tables, name)._replace(limited=tables.legs.limited[:0].copy(), cones=tables.legs.cones[:0].copy())
        for name in ("legs", "near")
    }
    reading, weighing = reading_table(model.legs).record, T.new_weighing_scratch(tables)
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


def _actuator(drive: Any) -> dict[str, Any]:
    low, high = (float(bound) if np.isfinite(bound) else None for bound in drive.bounds)
    kind = {"name": drive.name, "joint": drive.joint.name, "isAngle": drive.kind == "angle"}
    return kind | {"low": low, "high": high, "home": float(drive.home), "column": int(drive.column)}


def _as_json(data: Any) -> str:
    """JSON that ends no script; a number beyond all is written as one that reads as infinite."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    return re.sub(r"(?<=[\[:,])(-?)Infinity(?=[\],}])", r"\g<1>1e999", text).replace("<", "\\u003c")


def _unindented(text: str) -> str:
    """Text without its indentation and its lines of comment, for a smaller page."""
    lines = (line.strip() for line in text.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith(("//", "/**", "* ")))
