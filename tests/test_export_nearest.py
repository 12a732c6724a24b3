"""The exported C where a target is out of reach: the nearest feasible pose is the library's, and a loop goes on."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import pfabrik as pf
from checks import actuator_units
from exported import (
    CATALOGUE,
    KEEP,
    Truth,
    answers_of,
    asked,
    compiled,
    flat,
    home_of,
    limit_units,
    machine,
    matrices,
    needs_compiler,
    program_of,
    slack_of,
    survives,
)
from oracles import far_poses, is_pose, no_poses
from oracles.nearest import priced
from pfabrik.exchange.export import source
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.source import targets_around_home
from pfabrik.exchange.export.static_data import Precision
from pfabrik.machine.description.task import task_of
from pfabrik.machine.model import model_of

Array = np.ndarray
PROJECTED, BUDGET, NO_POSE, JUMPED, LEG = -4, -5, -1, -11, 1000
FARTHER = {"double": 1e-7, "float": 1e-3}
"""How much farther from its target than the library's a nearest pose may be [L]."""

AT_A_LIMIT = {"double": 1e-6, "float": 1e-4}
"""Slack of a limit that a pose is said to be at [L or rad]: ten times what the file takes for it."""

KINDS = {"double": np.float64, "float": np.float32}
FILES = [("stewart", "double"), ("delta", "float"), ("five_bar", "double")]
LONG = [("stewart", "float"), ("delta", "double"), ("five_bar", "float")]
LONG += [(name, precision) for name in ("orthoglide", "rps") for precision in FARTHER]
every_file = pytest.mark.parametrize(
    ("name", "precision"), [*FILES, *(pytest.param(*each, marks=pytest.mark.campaign) for each in LONG)]
)

PRECISIONS = dict(FILES) | {
    name: ("double", "float")[place % 2] for place, name in enumerate(CATALOGUE) if name not in dict(FILES)
}
EVERY = [
    pytest.param(name, precision, marks=() if precision == PRECISIONS[name] else pytest.mark.campaign)
    for name in CATALOGUE
    for precision in FARTHER
]
"""Machines of the catalogue, every other one in single precision; the others in a campaign."""


class Said(NamedTuple):
    """What a file said, one row a target."""

    codes: Array
    poses: Array
    holding: Array
    held: Array
    jumped: Array
    moved: Array
    steps: Array
    actuators: Array
    fk: Array
    fk_steps: Array


def said(name: str, precision: str, targets: Array, **options: int) -> Said:
    """What a machine's file answers to targets, as `said_by` asks it."""
    return said_by(program_of(name, precision), targets, len(machine(name).actuator_names), **options)


def said_by(
    program: Path,
    targets: Array,
    n_a: int,
    *,
    steps: int = 200,
    starts: int = 24,
    warm: int = 0,
    machines: int = 1,
    most: int = 0,
) -> Said:
    """What a program answers of a machine with so many actuators, from home or warm from the answer before.

    With several machines their targets are in turn; with `most`, so many steps are taken for a target at most.
    """
    told, _ = asked(program, flat(targets), "nearest", steps, starts, warm, machines, most)
    assert told[:, 1].all()  # there are words for every code
    codes, _, poses, holding, notes, actuators, fk = np.split(told, [1, 2, 14, -6 - n_a, -2 - n_a, -2], axis=1)
    return Said(codes[:, 0].astype(int), matrices(poses), holding > 0.0, *notes.T, actuators, *fk.T)


def statuses(told: Said) -> Array:
    """The library's statuses of codes; a code that none has stays."""
    return np.where(told.codes == 0, 0, np.where(told.codes == PROJECTED, 1, told.codes))


@cache
def known(name: str, n: int = 40) -> tuple[Array, pf.Solution]:
    """Targets around home, half of them mostly out of reach, and the library's answers from home in its mode."""
    mechanism, rng = machine(name), np.random.default_rng(3)
    targets = targets_around_home(mechanism, n, rng)
    targets[n // 2 :, :3, 3] += 0.6 * mechanism.characteristic_length * rng.uniform(-1.0, 1.0, (n - n // 2, 3))
    return targets, pf.solve_ik(mechanism, targets, start=home_of(mechanism), options=KEEP)


def costs(mechanism: pf.Mechanism, poses: Array, targets: Array) -> Array:
    """Distances from targets with the price of an orientation that is given up [length]."""
    moved, turned = task_of(mechanism).errors(np.asarray(poses), targets)
    length = mechanism.characteristic_length
    away = np.hypot(moved, mechanism.rotation_length * turned) / length
    return length * (away + priced(mechanism, pf.Options(), away, turned))


@needs_compiler
@every_file
def test_what_is_out_of_reach_is_answered_as_the_library_does(name: str, precision: str) -> None:
    targets, found = known(name)
    mechanism, told = machine(name), said(name, precision, targets)
    np.testing.assert_array_equal(statuses(told), found.status)
    away = found.status == 1
    assert away.sum() > 5 and (~away).sum() > 5
    farther = costs(mechanism, told.poses, targets) - costs(mechanism, found.pose, targets)
    assert farther[away].max() <= FARTHER[precision] * mechanism.characteristic_length
    # the limits that the pose is at: measured on the coordinates of all joints
    back = pf.solve_ik(mechanism.without_limits(), told.poses[away], options=KEEP)
    slack = slack_of(mechanism, back.q)[back.status == 0]
    holding = told.holding[away][back.status == 0]
    assert (slack[holding] <= AT_A_LIMIT[precision]).all() and (slack[~holding] > 0.0).mean() > 0.99
    assert holding.any(axis=1).mean() > 0.5 or name == "five_bar"  # which is mostly held by its dead points
    assert len(limit_units(mechanism)) == holding.shape[1] == len(model_of(mechanism).legs.limits)


def away_and_back(name: str, n: int) -> Array:
    """Targets that leave the workspace and come back."""
    mechanism = machine(name)
    targets = np.repeat(mechanism.home_pose[None], n, axis=0)
    targets[:, 0, 3] += 1.5 * mechanism.characteristic_length * np.sin(np.linspace(0.0, np.pi, n))
    return targets


@needs_compiler
@pytest.mark.parametrize(
    ("name", "precision"), [*FILES, ("g1_ankle", "double"), pytest.param("delta", "double", marks=pytest.mark.campaign)]
)
def test_what_is_commanded_is_reached_at_a_dead_point_too(name: str, precision: str) -> None:
    """As the library reaches it; in single precision rounding may leave a few beyond a limit."""
    mechanism, targets = machine(name), known(name)[0]
    told = said(name, precision, targets)
    out = np.isin(told.codes, (PROJECTED, JUMPED))
    poses = told.poses[out]
    assert (out.sum() > 5 and (pf.solve_ik(mechanism, poses, options=KEEP).status == 0).all()) or precision == "float"
    given = Truth(poses, poses, out[out], told.actuators[out], np.zeros(0))
    again = answers_of(program_of(name, precision), mechanism, given)
    for codes in (again.limits, again.ik):
        assert (codes < LEG).all() and (codes == 0).mean() >= (1.0 if precision == "double" else 0.9)


@needs_compiler
@every_file
def test_the_steps_of_a_call_have_a_bound_that_the_caller_sets(name: str, precision: str) -> None:
    """Of all searches together, and of forward kinematics; one that is not met changes nothing."""
    targets = known(name)[0]
    free = said(name, precision, targets)
    half = int(free.steps.max()) // 2
    assert half > 1 and free.fk_steps.max() > 2
    for one, other in zip(free, said(name, precision, targets, most=100_000), strict=True):
        np.testing.assert_array_equal(one, other)
    bound = said(name, precision, targets, most=half)
    assert bound.steps.max() <= half and set(bound.codes) <= {0, PROJECTED, JUMPED, BUDGET} and BUDGET in bound.codes
    short = said(name, precision, targets, most=2)
    assert short.steps.max() <= 2 and short.fk_steps.max() <= 2
    assert (short.fk[short.fk_steps == 2] != 0).any() and set(short.fk[short.fk_steps == 2]) <= {0, BUDGET}
    feasible = pf.feasibility(machine(name), bound.poses).margin
    assert np.min(feasible) >= (-1e-8 if precision == "double" else -1e-4)


@needs_compiler
def test_two_machines_in_one_program_answer_as_each_by_itself() -> None:
    """Bit by bit, whatever the other is asked between: nothing but the caller's memory is written."""
    one, other = away_and_back("stewart", 60), known("stewart")[0][:40]
    other = np.concatenate([other, other[:20]])
    both = np.stack([one, other], axis=1).reshape(-1, 4, 4)
    together = said("stewart", "double", both, starts=0, steps=40, warm=1, machines=2)
    for k, targets in enumerate((one, other)):
        alone = said("stewart", "double", targets, starts=0, steps=40, warm=1)
        for mine, its in zip(alone, together, strict=True):
            np.testing.assert_array_equal(mine, its[k::2])


@needs_compiler
@every_file
def test_each_answer_tells_what_is_held_whether_it_jumped_and_how_far_drives_move(name: str, precision: str) -> None:
    mechanism, targets = machine(name), away_and_back(name, 60)
    told = said(name, precision, targets, starts=0, steps=40, warm=1)
    is_out = told.codes != 0
    assert is_out.any() and (told.held[~is_out] == -1).all() and (told.held[is_out] >= 0).all()
    np.testing.assert_array_equal(told.jumped > 0, told.codes == JUMPED)
    homes = np.array([drive.home for drive in mechanism.drives])
    steps = np.diff(np.concatenate([homes[None], told.actuators]), axis=0) / actuator_units(mechanism)
    np.testing.assert_allclose(told.moved, np.abs(steps).max(axis=1), atol=1e-12 if precision == "double" else 1e-5)


@needs_compiler
@pytest.mark.parametrize(("name", "precision"), [FILES[0], pytest.param(*LONG[1], marks=pytest.mark.campaign)])
def test_a_loop_that_leaves_the_workspace_goes_on_and_comes_back(name: str, precision: str) -> None:
    mechanism = machine(name)
    targets = away_and_back(name, 200)
    told = said(name, precision, targets, starts=0, steps=40, warm=1)
    assert set(told.codes) == {0, PROJECTED}
    assert (told.codes[:3] == 0).all() and (told.codes[-3:] == 0).all() and told.codes[100] == PROJECTED
    assert np.min(pf.feasibility(mechanism, told.poses).margin) >= -1e-8
    steps = np.linalg.norm(np.diff(told.poses[:, :3, 3], axis=0), axis=1)
    assert steps.max() <= 2.0 * np.abs(np.diff(targets[:, 0, 3])).max()
    away = told.codes == PROJECTED
    best = pf.solve_ik(mechanism, targets[away], start=home_of(mechanism), options=KEEP)
    farther = costs(mechanism, told.poses[away], targets[away]) - costs(mechanism, best.pose, targets[away])
    assert (farther <= 1e-6 * mechanism.characteristic_length).mean() > 0.9


@needs_compiler
def test_a_search_that_is_cut_short_says_so_and_ends_within_limits() -> None:
    targets, found = known("stewart")
    told = said("stewart", "double", targets, starts=0, steps=2)
    away = found.status == 1
    assert (told.codes[away] == BUDGET).mean() > 0.5
    assert np.min(pf.feasibility(machine("stewart"), told.poses[away]).margin) >= -1e-8


@needs_compiler
@pytest.mark.parametrize(("name", "precision"), FILES)
def test_what_is_no_pose_is_refused_and_nothing_else(name: str, precision: str) -> None:
    """Also in what the task leaves out; every function with the same code, and nothing is written."""
    mechanism = machine(name)
    home, n = mechanism.home_pose, len(mechanism.actuator_names)
    hostile = np.concatenate([home[None], no_poses(home), far_poses(home)])
    hostile[:, 3] = home[3]  # which files do not ask for
    with np.errstate(over="ignore"):
        is_refused = ~np.array([is_pose(matrix) for matrix in hostile.astype(KINDS[precision]).astype(float)])
    assert is_refused.sum() > 40
    told = said(name, precision, hostile, steps=30, starts=2)
    np.testing.assert_array_equal(told.codes == NO_POSE, is_refused)
    assert set(told.codes[~is_refused]) <= {0, PROJECTED, BUDGET}
    given = np.concatenate([flat(hostile), flat(hostile), np.zeros((len(hostile), n))], axis=1)
    rows, _ = asked(program_of(name, precision), given, "there")
    ik, limits, fk = rows[:, :3].T
    for codes in (ik, limits):
        np.testing.assert_array_equal(codes == NO_POSE, is_refused)
    assert (fk[is_refused] == NO_POSE).all()
    for poses in (told.poses, matrices(rows[:, 4:16])):
        np.testing.assert_allclose(poses[is_refused], np.broadcast_to(home, (is_refused.sum(), 4, 4)), rtol=1e-7)
        assert np.isfinite(poses).all()
    assert not rows[is_refused, 28 : 28 + n].any()


@needs_compiler
@pytest.mark.parametrize(("name", "precision"), EVERY)
def test_every_machine_is_searched_and_survives_with_integers_of_32_bits(
    name: str, precision: Precision, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In and out of reach the library's answers; and whatever any function is given, finite results or a code."""
    if (name, precision) in FILES:
        program = program_of(name, precision)
    else:
        monkeypatch.setattr(source, "N_TRIED", 3)  # for the self-test, which is not of interest here
        program = compiled(c_source(machine(name), precision=precision))
    targets, found = known(name, 12)
    told = said_by(program, targets, len(machine(name).actuator_names))
    np.testing.assert_array_equal(statuses(told), found.status)
    away = found.status == 1
    assert away.any() or name == "agile_eye"  # which turns about its centre, as far as these targets are
    farther = costs(machine(name), told.poses, targets) - costs(machine(name), found.pose, targets)
    assert (farther[away] <= FARTHER[precision] * machine(name).characteristic_length).all()
    survives(program)
