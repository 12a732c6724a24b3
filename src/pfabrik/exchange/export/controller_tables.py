"""A machine as the kernels of a controller take it: its tables, and the memory of a call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...capabilities.dynamics.moving_rows import Probes, moving_of
from ...capabilities.dynamics.weights import weights_of
from ...common.arrays import Records
from ...engines.joints.assemble import is_over_determined
from ...engines.pose.driven_legs import live_tables
from ...engines.pose.nearest_pose import home_start, no_starts
from ...engines.pose.rotation import keeps_rotation
from ...engines.pose.seeds import seeds_of
from ...engines.pose.table import kernel_table
from ...engines.pose.tables import tables_of
from ...kernels.clearance.convex import new_polytope
from ...kernels.clearance.distance_constants import MOST_CORNERS
from ...kernels.clearance.link_records import NO_LINKS
from ...kernels.clearance.solids import KIND, WIDTH
from ...kernels.controller.assembled import Assembling
from ...kernels.controller.driven import Driving
from ...kernels.controller.joints_in_series import Series
from ...kernels.controller.links_on_bodies import LinksOnBodies
from ...kernels.controller.projected import Projecting
from ...kernels.controller.rates import Rating
from ...kernels.controller.reached import Reaching
from ...kernels.controller.streamed import Streaming
from ...kernels.dynamics.moving import new_exerted, new_moving_scratch
from ...kernels.legs.answer import Completion, new_completion
from ...kernels.pose.equations import LegEvaluation, new_leg_evaluation
from ...kernels.pose.forward import NewtonScratch, new_newton_scratch
from ...kernels.pose.live_pose import new_live_scratch
from ...kernels.pose.search_records import Starts, new_solutions
from ...kernels.pose.tables import EXACTLY, NEAREST, QUESTION, Question, Start, new_answer_scratch
from ...kinematics import JointPath, Model, model_of, task_of, tilt_axis
from ...machine.decomposition.leg_table import COMPLETED_WITHIN
from ...machine.files.units import metres_of
from ...machine.moved_bodies import FIRST_MOVED, Motion, angles_needed
from ...options import Options
from .driven_bodies import frames_on_bodies
from .machine_data import Machine

NEAR = 0.5
"""Largest step of implicit joints on the way to a target [L or rad]: more than one pose may close."""

ASKED = {"first": NEAREST, "last": EXACTLY, "has_start": 1, "keeps_mode": 1, "is_nearby": 0}
"""Question of a controller to `answer_row` out of reach; each call sets seeds and steps, and if it has a start."""


class ControllerTables(NamedTuple):
    """Tables that the parts of a file need; None for parts that are left out."""

    reaching: Reaching
    assembling: Assembling | None
    rating: Rating | None
    series: Series | None
    projecting: Projecting | None
    driving: Driving | None
    streaming: Streaming | None


def controller_tables(machine: Machine, parts: Sequence[str], path: JointPath | None = None) -> ControllerTables:
    """The tables of a machine for some parts of a file."""
    model = model_of(machine.mechanism)
    reaching = _reaching(machine, model, parts)
    start = Starts(np.zeros((1, 4, 4)), np.zeros((0, len(machine.legs))), np.zeros((1, len(machine.legs))))
    assembling = rating = series = projecting = None
    if "fk" in parts:
        n_a, stays = np.zeros((1, len(machine.driven))), not is_over_determined(model.closure)
        assembling = Assembling(
            reaching.near,
            start,
            no_starts(model.legs) if stays else seeds_of(model),
            np.array([int(stays)]),
            n_a,
            _newton_scratch(model, reaching),
        )
    if "rates" in parts:
        rating = _rating(machine, reaching)
    if path is not None:
        series = _series(path)
    if "nearest" in parts:
        projecting = _projecting(model, reaching, Options(hold_price=machine.hold_price))
    driving = _driving(machine) if "effort" in parts else None
    streaming = _streaming(machine, model, reaching) if "live" in parts else None
    return ControllerTables(reaching, assembling, rating, series, projecting, driving, streaming)


def _reaching(machine: Machine, model: Model, parts: Sequence[str]) -> Reaching:
    table, n = kernel_table(model.legs), len(machine.legs)
    links = _links_on_bodies(machine, parts)
    if motions := machine.motions(parts):
        table = table._replace(legs=_aimed(motions, table.legs))
    if "limits" not in parts:
        table = table._replace(limited=table.limited[:0], cones=table.cones[:0])
    far = table
    near = far._replace(task=_within(far.task, NEAR)) if machine.has_implicit_joints else far
    whole_near, whole_far = near, far
    if machine.has_implicit_joints and machine.unset:
        whole_near, whole_far = (each._replace(task=_whole(each.task)) for each in (near, far))
    n_ways = 1 if _follows_at_once(machine, model) else 3 if not machine.has_implicit_joints else 6
    axis = tilt_axis(machine.mechanism) if machine.completes else None
    return Reaching(
        near,
        far,
        whole_near,
        whole_far,
        home=home_start(model),
        ways=np.zeros(n_ways),
        tilt=np.zeros((0, 3)) if axis is None else np.array(axis)[None],
        links=links,
        scratch=new_completion(table),
        wanted=np.zeros((4, 4)),
        present=np.zeros((4, 4)),
        step=np.zeros((4, 4)),
        begin=np.zeros(n),
        sides=np.zeros(n),
        turn=np.zeros(3),
        slack=np.zeros(max(1, 2 * len(table.limited) + len(table.cones))),  # C has no empty arrays
        distance=np.zeros(1),
    )


def _follows_at_once(machine: Machine, model: Model) -> bool:
    """True if the task sets the pose, or its position alone of a platform that keeps its orientation."""
    return not machine.completes or (not machine.has_implicit_joints and keeps_rotation(model) and all(model.task.axes))


def _within(task: Records, farthest: float) -> Records:
    task = task.copy()
    task["farthest"] = min(farthest, COMPLETED_WITHIN)
    return task


def _whole(task: Records) -> Records:
    """The task that sets the whole pose."""
    task = task.copy()
    task["axes"], task["rotations"], task["unset"] = 1, 3, 0
    return task


def _aimed(motions: Sequence[Motion], legs: Records) -> Records:
    """Legs whose angles are computed where bodies need them."""
    legs = legs.copy()
    for k, leg in enumerate(legs):
        for end, start in (("base_end", 1), ("platform_end", 5)):
            if angles_needed(motions, k, start):
                leg[f"{end}_aimed"] = 1
    return legs


def _links_on_bodies(machine: Machine, parts: Sequence[str]) -> LinksOnBodies:
    links, length = machine.links_kept(parts), machine.mechanism.characteristic_length
    motions, limits = machine.motions(parts), NO_LINKS if links is None else links.limits
    numbers = [(each.sense, *each.axis, *np.asarray(each.point) / length) for each in motions]
    return LinksOnBodies(
        np.array([(each.on, each.kind, each.leg, each.place) for each in motions], np.int64).reshape(-1, 4),
        np.array(numbers, float).reshape(-1, 7),
        limits.sizes[:, :WIDTH],
        limits.home,
        limits.bodies,
        limits.pairs,
        limits.least,
        np.zeros((FIRST_MOVED + len(motions) if links is not None or machine.places_bodies(parts) else 0, 4, 4)),
        np.zeros_like(limits.home),
        new_polytope(MOST_CORNERS if limits.sizes[limits.pairs, KIND].any() else 0),
        np.zeros((2, 3)),
    )


def _shared(own: LegEvaluation, with_: Completion) -> LegEvaluation:
    """A leg evaluation in the memory of another: no two are needed at once."""
    return own._replace(frames=with_.frames, values=with_.values, lines=with_.lines)


def _newton_scratch(model: Model, reaching: Reaching) -> NewtonScratch:
    own = new_newton_scratch(reaching.near, not model.mechanism.end_effector_is_joint)
    return own._replace(leg_eval=_shared(own.leg_eval, reaching.scratch))


def _rating(machine: Machine, reaching: Reaching) -> Rating:
    table, width, n_a = reaching.far, 6 + machine.n_redundant, len(machine.driven)
    leg_eval, rows = _shared(new_leg_evaluation(table), reaching.scratch), int(table.task[0]["rows"])
    return Rating(
        table, leg_eval, np.zeros((rows, width)), np.zeros(rows, np.int64), np.zeros((n_a, width)), np.zeros((6, 6))
    )


def _series(path: JointPath) -> Series:
    n, mechanism = len(path.coordinates), path.mechanism
    size = mechanism.characteristic_length
    return Series(
        path._table,
        np.array(mechanism.reference_point, float),
        path.home,
        np.where(path.is_angle, 1.0, size),
        np.array([size]),
        np.zeros(n),
        np.zeros((4, 4)),
        np.zeros((6, n)),
        np.zeros((4, 4)),
        np.zeros((n, n + 1)),
        np.zeros(3 if mechanism.end_effector_is_joint else 6),
    )


WITHOUT_DOUBT = 1e-4
"""Share of a number that is no rounding, of a float neither."""


def _driving(machine: Machine) -> Driving:
    mechanism, length = machine.mechanism, machine.mechanism.characteristic_length
    moving = moving_of(mechanism, "task", weights_of(mechanism), np.zeros(3), Probes())
    axes = task_of(mechanism).twists(mechanism.home_pose)
    moving = moving._replace(limits=np.append(moving.limits[:2], WITHOUT_DOUBT))
    k = len(axes)
    return Driving(
        moving,
        new_moving_scratch(moving, k),
        np.array(frames_on_bodies(mechanism, machine.bodies), np.int64),
        axes,
        np.array([int(machine.rotations == 2)]),
        np.zeros((k, 6)),
        np.zeros(k),
        np.zeros(k),
        new_exerted(moving, 1, k, fill=0.0),
        np.array([length, length * metres_of(mechanism.length_unit)]),
    )


def _projecting(model: Model, reaching: Reaching, options: Options) -> Projecting:
    tables = tables_of(model, options)
    legs, n_a = len(model.legs.legs), len(model.legs.driven)
    scratch = new_answer_scratch(tables)
    completion, nothing, search = reaching.scratch, _emptied(scratch.newton), scratch.nearest.search
    search = search._replace(leg_eval=_shared(search.leg_eval, completion))
    asked = np.zeros(1, QUESTION)
    for name, value in ASKED.items():
        asked[name] = value
    return Projecting(
        tables,
        scratch._replace(
            completion=completion, resting=completion, newton=nothing, nearest=scratch.nearest._replace(search=search)
        ),
        Question(asked),
        Start(np.zeros((1, 4, 4)), np.zeros((1, legs)), np.zeros((1, n_a))),
        np.zeros((1, 4, 4)),
        new_solutions(1, legs, n_a),
        new_solutions(1, legs, n_a),
        Start(np.zeros((1, 4, 4)), np.zeros((1, legs)), np.zeros((1, n_a))),
        np.zeros((1, 4, 4)),
        np.zeros(2, np.int64),
    )


def _streaming(machine: Machine, model: Model, reaching: Reaching) -> Streaming:
    n_a, options = len(machine.driven), Options(hold_price=machine.hold_price)
    live = live_tables(model, options, np.ones(n_a), np.full(n_a, np.inf))
    scratch = new_live_scratch(live)
    search = scratch.search._replace(leg_eval=_shared(scratch.search.leg_eval, reaching.scratch))
    return Streaming(live, scratch._replace(completion=reaching.scratch, search=search))


def _emptied(value: Any) -> Any:
    """A NamedTuple without the numbers of its arrays: memory that is not needed."""
    if isinstance(value, tuple):
        return type(value)(*map(_emptied, value))
    return value[:0]
