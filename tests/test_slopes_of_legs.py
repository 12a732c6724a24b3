"""Slopes of legs that are written by hand, against the derivatives of the legs' own routines.

These run as plain Python on numbers with derivatives (`duals`), which refuse to be asked `if`. Rounding alone is
between both: 1e-12 of the largest slope leaves room for divisions by margins of a hundredth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

import pfabrik as pf
from duals import dual, duals, on_duals
from machines import EVERY, FILES, machine
from pfabrik.engines.pose.table import kernel_table, with_pointing_cones
from pfabrik.kernels import vectors
from pfabrik.kernels.legs import answer, endings, frames, kinds, pivots, rods
from pfabrik.kernels.legs import records as K
from pfabrik.kernels.pose import equations, limits
from pfabrik.machine.decomposition.leg_forms import NoLeg
from pfabrik.machine.model import model_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
MODULES = (vectors, endings, frames, pivots, rods, kinds, answer, equations, limits)
LEAST_MARGIN = 1e-2
"""Singularity margin of a leg from which it is compared: nearer to dead points slopes grow without bound."""
CLOSED = 1e-9
"""Largest constraint of a pivot that counts as closed: off it, its angles have slopes of another extension."""


def table_of(name: str) -> K.Table:
    """The kernel table of a machine, with all angles; a test is skipped where no legs are in closed form."""
    try:
        legs = model_of(machine(name)).legs
    except NoLeg:
        pytest.skip("no legs in closed form")
    return kernel_table(legs)._replace(legs=legs.aimed, cones=with_pointing_cones(legs.aimed, legs.cones))


def poses_of(name: str) -> np.ndarray:
    """Poses (n, 4, 4) [L]: one near home, two anywhere, and what a machine answers to the first."""
    mechanism, rng = machine(name), np.random.default_rng(1)
    poses, L = np.tile(mechanism.home_pose, (3, 1, 1)), mechanism.characteristic_length
    sizes = np.array([[0.15], [3.0], [3.0]])
    poses[:, :3, :3] = Rotation.from_rotvec(sizes * rng.uniform(-1.0, 1.0, (3, 3))).as_matrix() @ poses[:, :3, :3]
    poses[:, :3, 3] += 0.5 * L * sizes * rng.uniform(-1.0, 1.0, (3, 3))
    poses = np.concatenate([poses, pf.solve_ik(mechanism, poses[:1]).pose])
    poses[:, :3, 3] /= L
    return poses


def moving(pose: np.ndarray, n: int) -> Any:
    """A pose with its derivatives by the platform's velocity and angular velocity, the first of n unknowns."""
    slopes = np.zeros((4, 4, n))
    for i in range(3):
        slopes[i, 3, i] = 1.0
        slopes[:3, :3, 3 + i] = np.cross(np.eye(3)[i], pose[:3, :3].T).T
    return duals(pose, slopes)


def evaluated(table: K.Table, pose: np.ndarray, choices: dict[str, set[bool]]) -> tuple[Any, Any, np.ndarray]:
    """Legs at a pose: with slopes that are written by hand; of numbers with derivatives; their singularity margins."""
    legs, n = table.legs, equations.count_unknowns(table)
    q, margins = 0.1 * np.random.default_rng(2).uniform(-1.0, 1.0, len(legs)), np.ones(len(legs))
    hand = equations.new_leg_evaluation(table)
    equations.evaluate_legs(table, equations.PlatformState(pose, q, legs["side"]), hand)
    equations.put_slopes(table, hand)
    derived = equations.LegEvaluation(*(array.astype(object) for array in hand))
    state = equations.PlatformState(moving(pose, n), duals(q, np.eye(n + 1)[table.columns, :n]), legs["side"])
    with on_duals(MODULES, choices) as patch:
        equations.set_frames(state.pose, table.task[0], derived.frames)
        for k in range(len(legs)):

            def noted(*given: Any, k: int = k) -> None:
                margins[k] = dual(kinds.place_leg(*given)).value

            patch.setattr(equations, "place_leg", noted)
            equations.evaluate_leg(table, k, equations.owner_of(table, k), state, derived)
    return hand, derived, margins


def assert_equal(hand: np.ndarray, derived: Any, of: str, motions: np.ndarray | None = None) -> None:
    """Slopes agree, for all motions or given ones."""
    slope = dual(derived).slope + np.zeros(len(hand))
    off = hand - slope if motions is None else (hand - slope) @ motions
    assert np.abs(off).max(initial=0.0) <= 1e-12 * max(1.0, np.abs(slope).max()), of


@pytest.mark.parametrize("name", [*EVERY, *FILES])
def test_slopes_of_equations_and_limits_are_those_of_what_legs_compute(name: str) -> None:
    table = table_of(name)
    legs = table.legs
    for pose in poses_of(name):
        hand, derived, margins = evaluated(table, pose, {})
        rows = [slice(leg["first_row"], leg["first_row"] + leg["n_rows"]) for leg in legs]
        for k in np.flatnonzero(margins > LEAST_MARGIN):
            for slope, row in zip(hand.slopes[rows[k]], derived.rows[rows[k]], strict=True):
                assert_equal(slope, row, f"constraint of leg {k}")
        for k in np.flatnonzero([equations.has_proximal(leg) for leg in legs]):
            row = equations.length_row(table, k)
            assert_equal(hand.slopes[row], derived.rows[row], f"length of leg {k}")
            limits.dead_point_slope(table, k, hand)
            with on_duals(MODULES, {}):
                assert_equal(hand.slope, limits.dead_point_slope(table, k, derived), f"dead point of leg {k}")
        for coordinate in np.concatenate([table.known, table.limited]):
            k, place, motions = coordinate["leg"], coordinate["place"], None
            is_closed = True
            if legs[k]["kind"] == K.PIVOT:
                is_closed = np.abs(hand.rows[rows[k]]).max(initial=0.0) < CLOSED
                motions = null_space(hand.slopes[rows[k]])
            if is_closed and margins[k] > LEAST_MARGIN:
                limits.coordinate_slope(table, coordinate, hand)
                value = coordinate["sense"] * derived.values[k, place]
                assert_equal(hand.slope, value, f"coordinate {place} of leg {k}", motions)
        for cone in table.cones:
            k, place = cone["leg"], cone["place"]
            limits.cone_slope(table, cone, hand)
            with on_duals(MODULES, {}):
                angle = vectors.angle_between(tuple(cone["axis"]), tuple(derived.values[k, place : place + 3]))
            assert_equal(hand.slope, angle, f"cone at {place} of leg {k}")


@pytest.mark.parametrize("name", [*EVERY, *FILES])
def test_slopes_that_complete_poses_are_those_of_placed_legs(name: str) -> None:
    table = table_of(name)
    legs, task = table.legs, table.task[0]
    n, is_redundant = 6 + task["redundant"], legs["kind"] == K.REDUNDANT
    if (legs["orients"] == 1).any():
        pytest.skip("a redundant joint follows the pose")
    sides = np.where(is_redundant, 0.1, legs["side"])
    columns = np.where(is_redundant, np.minimum(6 + legs["column"], n), n)
    for pose in poses_of(name):
        hand = answer.new_completion(table)
        frames.set_frames(pose, task, hand.frames)
        if not answer.place_legs(legs, hand.frames, sides, hand.values, hand.lines)[1] > LEAST_MARGIN:
            continue
        answer.put_slopes(legs, hand.frames, hand.values, hand.lines, hand.proximal_slopes, hand.slopes)
        derived = answer.Completion(*(array.astype(object) for array in hand))
        with on_duals(MODULES, {}):
            frames.set_frames(moving(pose, n), task, derived.frames)
            moved = duals(sides, np.eye(n + 1)[columns, :n])
            answer.place_legs(legs, derived.frames, moved, derived.values, derived.lines)
            for k, leg in enumerate(legs):
                owner, frame, values = equations.owner_of(table, k), derived.frames[leg["frame"]], derived.values
                if leg["kind"] == K.PIVOT:
                    pivots.pivot_rows(leg, frame, derived.rows)
                elif leg["kind"] == K.ROD:
                    rods.rod_rows(leg, legs[owner], frame, values[owner], values[k], derived.lines[k], derived.rows)
        for slope, row in zip(hand.slopes, derived.rows, strict=True):
            assert_equal(slope, row, "a constraint")


def test_slopes_are_compared_where_hinges_flip_and_where_axes_are_turned_over() -> None:
    choices: dict[str, set[bool]] = {}
    for name in ("closure.upu", "orthoglide"):
        for pose in poses_of(name):
            evaluated(table_of(name), pose, choices)
    assert choices["twist_side"] == choices["pivot_rows"] == {True, False}
