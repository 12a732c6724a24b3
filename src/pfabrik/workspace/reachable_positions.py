"""Positions within reach in whatever orientation, by searches from feasible configurations.

A search moves a configuration to where its position is nearest to that of a target; the orientation follows. From a
configuration beside the target this takes a few steps. Without one, searches from the machine's seeds, which are spread
over all that it reaches, show whether there is another way there.
"""

from __future__ import annotations

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Mask
from ..batch import take, take_each
from ..closure.link_distances import clearance_excess
from ..closure.parasitic import has_other_assemblies
from ..closure.placed_links import PlacedLinks
from ..derived import derived
from ..kernels.platform.search_records import PoseSolutions, Starts
from ..kernels.rows import LIMIT_EXCESS, REACHED, RESIDUAL, Rows
from ..model import Model
from ..platform.answers import leg_answers, sides_at
from ..platform.coordinates import joint_coordinates
from ..platform.legs_engine import LegsEngine
from ..platform.links_of_legs import keeps_links
from ..platform.nearest import nearest_positions
from ..platform.nearest_pose import home_start, starts_at
from ..tolerances import TOLERANCES


@derived
def follows_positions(model: Model) -> bool:
    """True if searches lead from one position to the next: all chains are legs, and one assembly has all targets.

    Searches must keep links apart too, if there is a clearance.
    """
    return model.has_legs and not has_other_assemblies(model.path_closure) and keeps_links(model)


def start_at(model: Model, start: Solution | None) -> Starts:
    """A single start of searches; home for None."""
    if start is None:
        home = home_start(model)
        return home._replace(q=home.q[:0])
    configurations = start._configurations
    return starts_at(model, configurations.rows.poses, sides_at(model, configurations))


def reach_positions(
    model: Model, targets: Floats, starts: Starts, *, seeds: bool, keep_mode: bool
) -> tuple[Floats, Starts]:
    """How far from the positions of targets (n, 4, 4) [length] searches end, (n,) [L], and where, as starts.

    Distances are 0 where positions are reached. A search that fails ends where it started, and has the least distance
    that counts as one, which says nothing of what is around its target.

    Parameters
    ----------
    starts : one for each target, or one for all.
    seeds : search from the machine's seeds too.
    keep_mode : stay in the working modes of the starts.
    """
    solutions = nearest_positions(model, targets, starts, seeds=seeds, keep_mode=keep_mode)
    is_solved = (solutions.distances < np.inf) & _is_feasible(model, solutions)
    distances = np.maximum(np.where(is_solved, solutions.distances, 0.0), TOLERANCES.position)
    distances[is_solved & (solutions.status == REACHED)] = 0.0
    return distances, _ends(model, solutions, starts)


def coordinates_nearest(model: Model, targets: Floats, starts: Starts, *, keep_mode: bool) -> Floats:
    """Joint coordinates (n, columns), as deviations from home, where searches from starts (n) end."""
    solutions = nearest_positions(model, targets, starts, seeds=False, keep_mode=keep_mode)
    return joint_coordinates(model, solutions.poses, solutions.actuators, solutions.sides, None, solutions.q)


def _is_feasible(model: Model, solutions: PoseSolutions) -> Mask:
    """Mask of solutions with loops closed, limits kept and links apart, as measured."""
    is_closed = solutions.measures[:, RESIDUAL] <= TOLERANCES.position * model.length
    is_feasible = np.asarray(is_closed & (solutions.measures[:, LIMIT_EXCESS] <= TOLERANCES.limit))
    rows = np.flatnonzero(is_feasible & (solutions.distances < np.inf))
    if model.mechanism.clearance is not None and len(rows):
        placed = _placed_links(model, take(solutions, rows))
        is_feasible[rows] = clearance_excess(placed) <= TOLERANCES.limit
    return is_feasible


def _placed_links(model: Model, solutions: PoseSolutions) -> PlacedLinks:
    """The links of solutions."""
    poses, actuators, sides, q = solutions.poses, solutions.actuators, solutions.sides, solutions.q
    rows = Rows(solutions.status, solutions.counters, poses, actuators, solutions.measures)
    answers = leg_answers(model, rows, sides, q, None, sides)
    return PlacedLinks(model.mechanism, answers, lambda: LegsEngine(model).points(answers))


def _ends(model: Model, solutions: PoseSolutions, starts: Starts) -> Starts:
    """The configurations of solutions, as starts; those of the starts where there is none."""
    ends = starts_at(model, solutions.poses, solutions.sides)
    failed = np.flatnonzero(~(solutions.distances < np.inf))
    if len(failed):
        begins = take_each(starts, failed)
        ends.poses[failed], ends.sides[failed] = begins.poses, begins.sides
    return ends
