"""The attempts of the engine of legs, repeated one by one to look into an answer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Floats
from ...kernels.pose.tables import IN_OTHER_ASSEMBLIES, IN_OTHER_MODES, Start
from ...kernels.rows import ITERATIONS, REACHED
from ...machine.model import Model
from ...options import Options
from ..joints.attempts import Attempt, held_words, with_verdicts
from ..joints.configurations import Configurations, new_rows
from .nearest import endings
from .nearest_pose import starts_at
from .reach import reach
from .seeds import seeds_of
from .single import Answers, Request, answer_phases
from .tables import home_of


def attempts(
    model: Model, target: Floats, start: Configurations | None, sides: Floats, options: Options, *, keep_mode: bool
) -> Iterator[Attempt]:
    """Every attempt to answer one target (1, 4, 4), from a start with legs on given sides (1, legs)."""
    table, rows, sides = model.legs, new_rows(model, 1), sides.copy()
    reach(model, target, start, sides, keep_mode, rows)
    yield _of_closed_forms("closed forms", "working mode of the start", rows.status[0] == REACHED)
    if rows.status[0] == REACHED:
        return
    home = home_of(model)
    begin = home._replace(sides=sides) if start is None else Start(start.rows.poses, sides, start.rows.actuators)
    answers = Answers(rows, np.full_like(sides, np.nan), sides.copy())

    def is_answered(phase: int) -> bool:
        request = Request(model, options, begin, start is not None, keep_mode, nearby=False)
        answer_phases(request, target, answers, np.arange(1), phase, phase)
        return bool(rows.status[0] == REACHED)

    phases = [("other working modes", IN_OTHER_MODES, table.has_sides)]
    phases += [("other assemblies", IN_OTHER_ASSEMBLIES, table.is_completed)]
    for name, phase, is_tried in phases:
        if is_tried and not keep_mode:
            yield _of_closed_forms("closed forms", name, is_answered(phase))
            if rows.status[0] == REACHED:
                return
    own, seeds = starts_at(model, begin.poses, sides), seeds_of(model)
    own = own._replace(q=np.zeros((1, len(table.legs)))) if len(seeds.q) and start is None else own
    for projection, ends in endings(model, options, target, own, keep_mode=keep_mode):
        others = dict(endings(model, options, target, seeds, keep_mode=keep_mode))[projection]
        errors = np.concatenate([ends.measures[:, :2], others.measures[:, :2]])
        distances = model.length * projection.distances(model.path_closure, *errors.T)
        distances[np.isinf(np.concatenate([ends.distances, others.distances]))] = np.nan
        steps = np.concatenate([ends.counters[:, ITERATIONS], others.counters[:, ITERATIONS]]).tolist()
        names = ["the start", *(f"seed {k + 1}" for k in range(len(seeds.poses)))]
        yield from with_verdicts(
            f"platform's pose, {held_words(projection.hold, projection.price)}", names, steps, distances
        )


def _of_closed_forms(phase: str, start: str, is_reached: bool | np.bool_) -> Attempt:
    return Attempt(phase, start, 0, 0.0 if is_reached else np.nan, "reached" if is_reached else "not reached")
