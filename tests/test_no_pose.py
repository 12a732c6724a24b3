"""A target that is no pose is INVALID, or refused, whatever the options and the machine, and spoils no other row."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pfabrik as pf
from checks import INTERPRETED
from links import thick_hexaglide
from machines import EVERY, FILES, machine
from oracles import Array, far_poses, is_pose, no_poses, rough_pose, targets_about
from pfabrik import Mechanism, Options, Solution, Solver, Status
from pfabrik.errors import InvalidArgument
from pfabrik.machine.poses import are_poses

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
compiled = pytest.mark.skipif(INTERPRETED, reason="many searches; Python warns of numbers that are not finite")

FEW = ("delta", "canfield", "panda")
"""Of engines of legs and of chains; tasks that leave the rotation out, or most of the position."""

SOME = (*FEW, "stewart", "g1_ankle", "nrpm", "closure.gripper")
ALL = ("thick", *EVERY, *FILES)


def machines(names: tuple[str, ...]) -> pytest.MarkDecorator:
    """Some machines, and in campaigns all."""
    others = (pytest.param(name, marks=pytest.mark.campaign) for name in ALL if name not in names)
    return pytest.mark.parametrize("name", [*names, *others])


NUMBERS = ["pose", "actuators", "q", "position_error", "rotation_error", "residual", "limit_excess"]
PER_ENTRY = st.sampled_from((np.nan, np.inf, -np.inf, 0.0, 0.5, -2.0, 1e200, -1e308))


def mechanism_of(name: str) -> Mechanism:
    return thick_hexaglide() if name == "thick" else machine(name)


def assert_same(answers: Solution, expected: Solution) -> None:
    np.testing.assert_array_equal(answers.status, expected.status)
    for name in NUMBERS:
        np.testing.assert_array_equal(getattr(answers, name), getattr(expected, name), name)


def test_poses_are_told_from_other_matrices_as_exact_arithmetic_does() -> None:
    poses = [np.eye(4), pf.pose((1.0, 2.0, 3.0), rpy=(0.3, -2.0, 1.0))]
    for pose in poses:
        matrices = np.concatenate([no_poses(pose), pose[None], rough_pose(pose)[None], far_poses(pose)])
        expected = [is_pose(matrix) for matrix in matrices]
        np.testing.assert_array_equal(are_poses(matrices), expected)
        assert expected == [False] * len(no_poses(pose)) + [True] * (2 + len(far_poses(pose)))


@compiled
@machines(SOME)
def test_every_way_to_be_no_pose_is_invalid_and_any_finite_pose_is_answered(name: str) -> None:
    m = mechanism_of(name)
    home = m.home_pose
    targets = np.concatenate([no_poses(home), home[None], rough_pose(home)[None], far_poses(home)])
    n = len(no_poses(home))
    for most_steps in (None, 5):
        answers = pf.solve_ik(m, targets, options=Options(on_invalid="mark", most_steps=most_steps))
        assert (answers.status[:n] == Status.INVALID).all() and (answers.status[n : n + 2] == Status.REACHED).all()
        assert (answers.status[n + 2 :] <= Status.PROJECTED).all()
        for each in NUMBERS:
            numbers = np.asarray(getattr(answers, each))
            assert np.isnan(numbers[:n]).all() and np.isfinite(numbers[n:]).all(), each
    if has_margins(m):
        np.testing.assert_array_equal(np.isnan(pf.feasibility(m, targets).margin), np.arange(len(targets)) < n)


def has_margins(m: Mechanism) -> bool:
    try:
        pf.feasibility(m, m.home_pose)
    except pf.errors.UnsupportedMechanism:
        return False
    return True


@st.composite
def questions(draw: st.DrawFn, m: Mechanism) -> tuple[Array, Options, Any]:
    """Targets, near and far, some of them with other numbers in some places; options; a start, or one for each."""
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    targets = targets_about(m, rng, 4, draw(st.sampled_from((0.02, 0.8))), draw(st.sampled_from((0.02, 0.8))))
    for row in draw(st.sets(st.integers(0, 3), min_size=1, max_size=3)):
        for place in draw(st.sets(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=1, max_size=2)):
            targets[(row, *place)] = draw(PER_ENTRY)
    options = Options(
        most_steps=draw(st.sampled_from((None, 1, 20))),
        working_mode=draw(st.sampled_from((None, "any", "keep"))),
        hold=draw(st.sampled_from((None, "orientation", "position"))),
        rotation_length=draw(st.sampled_from((None, m.characteristic_length))),
        tolerance=draw(st.sampled_from((None, 1e-3 * m.characteristic_length))),
        on_invalid="mark",
    )
    starts: tuple[Any, ...] = (
        None,
        pf.solve_ik(m, m.home_pose),
        pf.solve_ik(m, np.repeat(m.home_pose[None], 4, axis=0)),
    )
    return targets, options, draw(st.sampled_from((*starts, starts[1].q)))


@compiled
@machines(FEW)
@given(data=st.data())
def test_rows_that_are_no_poses_are_marked_or_refused_and_spoil_no_others(name: str, data: st.DataObject) -> None:
    m = mechanism_of(name)
    targets, options, start = data.draw(questions(m))
    valid = np.array([is_pose(target) for target in targets])
    is_each = isinstance(start, Solution) and start.shape == (4,)
    answers = pf.solve_ik(m, targets, start=start, options=options)
    np.testing.assert_array_equal(answers.status == Status.INVALID, ~valid)
    for each in NUMBERS:
        assert np.isnan(getattr(answers, each)[~valid]).all(), each
    if valid.any():
        rows = np.flatnonzero(valid)
        assert_same(
            answers[rows], pf.solve_ik(m, targets[rows], start=start[rows] if is_each else start, options=options)
        )
    refusing = replace(options, on_invalid="raise")
    for row in np.flatnonzero(~valid)[:1]:
        with pytest.raises(InvalidArgument, match="target: found") as caught:
            pf.solve_ik(m, targets, start=start, options=refusing)
        assert caught.value.rows == tuple(np.flatnonzero(~valid))
        own = start[int(row)] if is_each else start
        for given_options in (refusing, options):
            solver = Solver(m, start=own, options=given_options)
            if given_options is refusing:
                with pytest.raises(InvalidArgument, match="target: found"):
                    solver.ik(targets[row])
            else:
                solver.ik(targets[row])
            assert solver.status is Status.INVALID and np.isnan(solver.pose).all()


@compiled
@machines(FEW)
@given(data=st.data())
def test_a_path_passes_over_what_is_no_pose(name: str, data: st.DataObject) -> None:
    m = mechanism_of(name)
    targets, options, start = data.draw(questions(m))
    options = replace(options, working_mode="keep")
    start = start[0] if isinstance(start, Solution) and start.shape else start
    valid = np.array([is_pose(target) for target in targets])
    answers = pf.track(m, targets, start=start, options=options)
    np.testing.assert_array_equal(answers.status == Status.INVALID, ~valid)
    if valid.any():
        assert_same(answers[np.flatnonzero(valid)], pf.track(m, targets[valid], start=start, options=options))
