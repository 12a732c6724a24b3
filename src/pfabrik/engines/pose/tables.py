"""All tables that kernels need of a machine whose chains are legs in closed form."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...common.derived import derived, is_derived
from ...kernels.handle import Handle, Scratch
from ...kernels.joints.joint_constants import NOISE
from ...kernels.pose import tables as T
from ...kernels.projecting import UNBOUNDED
from ...machine.model import Model
from ...options import Options
from ...tolerances import TOLERANCES
from ..joints.assemble import is_over_determined
from ..joints.parasitic import follows_task, has_other_assemblies, has_parasitic_motion
from .nearest import OF_VALUES, objectives_of
from .nearest_pose import no_starts, search_plan
from .redundant_joints import redundant_sets
from .seeds import seeds_of, seeds_of_other_assemblies
from .table import kernel_table, legs_at_rest, local_table, search_table, without_legs


def tables_of(model: Model, options: Options, *, with_seeds: bool = True) -> T.Tables:
    """All that kernels need to answer targets, with options.

    Without seeds, which take a tenth of a second to find, searches stay around their start, and other assemblies are
    not looked for.
    """
    return handle_of(model, options, with_seeds=with_seeds).record


def limit_names(model: Model) -> tuple[tuple[str, str], ...]:
    """(joint, bound) of the limits, numbered as in `Tables`."""
    return model.legs.limits


def handle_of(model: Model, options: Options, *, with_seeds: bool) -> Handle[T.Tables]:
    """The tables of a machine for kernels."""
    tolerances = options.tolerance, options.rotation_tolerance
    return _handle(model, options.hold, options.rotation_length, options.hold_price, *tolerances, with_seeds)


@derived
def _handle(
    model: Model,
    hold: str | None,
    rotation_length: float | None,
    hold_price: float,
    tolerance: float | None,
    rotation_tolerance: float,
    with_seeds: bool,
) -> Handle[T.Tables]:
    table = model.legs
    objectives, n_projections, fallback = objectives_of(
        model, hold, rotation_length, hold_price, tolerance, rotation_tolerance
    )
    search, plan = search_plan(
        model, table, [*objectives, OF_VALUES], seeds_of(model) if with_seeds else no_starts(table)
    )
    resting, closure = legs_at_rest(table), model.path_closure
    machine = np.zeros(1, T.MACHINE)
    fields = {
        "has_sides": table.has_sides,
        "is_partial": table.is_partial,
        "is_completed": table.is_completed,
        "is_free": table.has_free_redundant,
        "rests": resting is not None,
        "searches": not has_other_assemblies(closure),
        "flips": with_seeds and follows_task(closure) and not has_parasitic_motion(closure),
        "projections": n_projections,
        "fallback": fallback,
        "values": len(objectives),
        "turns": not model.mechanism.end_effector_is_joint,
        "is_over_determined": is_over_determined(model.closure),
        "position": TOLERANCES.position,
        "rotation": TOLERANCES.rotation,
        "same_mode": TOLERANCES.same_mode,
        "stretched": TOLERANCES.stretched,
        "noise": NOISE,
    }
    for name, value in fields.items():
        machine[name] = value
    at_rest = T.RestingLegs(without_legs(table), np.zeros((1, 0)), np.zeros((1, len(table.driven))))
    if resting is not None:
        actuators = resting.actuators[None].copy()
        at_rest = T.RestingLegs(kernel_table(resting.table), resting.table.home_sides, actuators)
    return Handle(
        T.Tables(
            machine,
            kernel_table(table),
            local_table(table).record,
            at_rest,
            search,
            search_table(table).record,
            plan,
            seeds_of_other_assemblies(model) if with_seeds and table.is_completed else no_starts(table),
            redundant_sets(model),
            home_of(model),
        )
    )


@derived
def home_of(model: Model) -> T.Start:
    """Home, as a start of answers."""
    actuators = np.array([[drive.home for drive in model.mechanism.drives]])
    return T.Start(model.mechanism.home_pose[None].copy(), model.legs.home_sides, actuators)


@derived
def scratch_of_answers(tables: Handle[T.Tables]) -> Scratch[T.AnswerScratch]:
    """Scratch memory of answers, for each thread its own."""
    return Scratch(T.new_answer_scratch, tables.record)


def has_seeds(model: Model) -> bool:
    """True if the machine's seeds are found already."""
    return is_derived(seeds_of, model)


@lru_cache(maxsize=64)
def question_of(
    assembles: bool,
    first: int,
    last: int,
    has_start: bool,
    keeps_mode: bool,
    is_nearby: bool,
    most_steps: int,
    tolerance: float,
) -> Handle[T.Question]:
    """The question of all rows; the machine's settings bound its searches, and `most_steps` unless that is 0."""
    bounds, asked = (UNBOUNDED, UNBOUNDED, UNBOUNDED, most_steps), np.zeros(1, T.QUESTION)
    asked[0] = assembles, first, last, has_start, keeps_mode, is_nearby, *bounds, tolerance
    return Handle(T.Question(asked))
