"""The paper's method, plain and accelerated, and its projection: as honest as all else, and as far as the default."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import machines
import pfabrik as pf
from checks import INTERPRETED, excess_of_joints, gap_of_joints
from machines.redescribed import scaled
from machines.trunks import ARMS, TRUNKS
from pfabrik import Mechanism, Status
from pfabrik.passes import Options

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
compiled_only = pytest.mark.skipif(INTERPRETED, reason="a minute and more")

ACCELERATED = replace(Options.accelerated(), working_mode="any")
WAYS = {
    "paper": Options(tolerance=1e-2, max_rounds=50),
    "extended": Options(tolerance=1e-2, max_rounds=50, method="extended"),
    "centroid": Options.centroid(),
    "nothing held": replace(Options.centroid(), hold=None),
    "position held": replace(Options.centroid(), hold="position"),
}
if not INTERPRETED:  # where a target out of reach takes seconds
    WAYS |= {
        "accelerated": Options.accelerated(),
        "accelerated, nothing held": replace(Options.accelerated(), hold=None),
        "accelerated, position held": replace(Options.accelerated(), hold="position"),
    }
N = 4 if INTERPRETED else 60


@cache
def machine(name: str) -> Mechanism:
    return ARMS[name]() if name in ARMS else machines.machine(name)


def far_and_near(mechanism: Mechanism, n: int) -> np.ndarray:
    """Poses (n, 4, 4) from home to some L away, turned by any angle; the last is a million L away."""
    rng, home = np.random.default_rng(1), mechanism.home_pose
    targets = np.repeat(home[None], n, axis=0)
    reach = np.geomspace(0.02, 3.0, n)[:, None]
    targets[:, :3, 3] += reach * rng.normal(size=(n, 3)) * mechanism.characteristic_length
    turns = Rotation.from_rotvec(np.minimum(reach, 1.0) * rng.normal(size=(n, 3)))
    targets[:, :3, :3] = turns.as_matrix() @ home[:3, :3]
    targets[-1, :3, 3] *= 1e6
    return targets


FIRST = ("five_bar", "stewart", "nrpm", *TRUNKS)
"""Machines that are asked in all ways in every run; others in two."""


@pytest.mark.parametrize(
    ("name", "way"),
    [
        pytest.param(
            name, way, marks=[pytest.mark.campaign] * (name not in FIRST and way not in ("paper", "accelerated"))
        )
        for name in (*FIRST, *machines.MACHINES)
        for way in WAYS
    ],
)
def test_limits_are_kept_and_loops_closed_for_any_target(name: str, way: str) -> None:
    mechanism, options = machine(name), WAYS[way]
    answer = pf.passes.solve(mechanism, far_and_near(mechanism, 4), options)
    assert np.isin(answer.status, (Status.REACHED, Status.PROJECTED)).all()
    assert gap_of_joints(mechanism, answer).max() <= 1e-9
    assert excess_of_joints(mechanism, answer).max() <= 1e-9
    reached = answer.status == Status.REACHED
    assert (answer.position_error[reached] <= (options.tolerance or 1e-9 * mechanism.characteristic_length)).all()


@pytest.mark.parametrize("name", ["stewart", "hexapod_rus", "planar_rrr"])
def test_a_path_keeps_its_working_mode_and_goes_on_from_answer_to_answer(name: str) -> None:
    """Out of the workspace and back: the coordinates of all joints end where they began."""
    mechanism = machine(name)
    way = np.sin(np.linspace(0.0, np.pi, 9))
    targets = np.repeat(mechanism.home_pose[None], len(way), axis=0)
    targets[:, 0, 3] += 1.2 * way * mechanism.characteristic_length
    for options in (Options.paper(), Options.centroid(), Options.accelerated())[: 2 if INTERPRETED else 3]:
        path = pf.passes.track(mechanism, targets, options)
        assert (path.status == Status.PROJECTED).any()
        np.testing.assert_allclose(path.actuators[-1], path.actuators[0], atol=0.02 * mechanism.characteristic_length)


# --- as far as the default -------------------------------------------------------------------------------------------


def targets_about(mechanism: Mechanism, size: float, turn: float, n: int = N) -> np.ndarray:
    """Poses (n, 4, 4) up to `size` [L] and `turn` [rad] from home; of a planar machine in its plane."""
    rng, targets = np.random.default_rng(8), np.repeat(mechanism.home_pose[None], n, axis=0)
    steps, turns = rng.uniform(-size, size, (n, 3)), rng.uniform(-turn, turn, (n, 3))
    axes = [np.array(joint.axis) for joint in mechanism.joints if joint.type == "revolute"]
    if len(axes) > 4 and np.ptp(np.abs(axes), axis=0).max() < 1e-9:
        normal = axes[0] / np.linalg.norm(axes[0])
        steps -= np.outer(steps @ normal, normal)
        turns = np.outer(turns @ normal, normal)
    targets[:, :3, 3] += steps * mechanism.characteristic_length
    if not mechanism.end_effector_is_joint:
        targets[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix() @ mechanism.home_pose[:3, :3]
    return targets


def reachable(mechanism: Mechanism, size: float, turn: float, n: int = N) -> np.ndarray:
    """Those of them that the default reaches."""
    targets = targets_about(mechanism, size, turn, n)
    return targets[pf.solve_ik(mechanism, targets).status == Status.REACHED]


TWO_PARTS = ("five_bar", "stewart", "servo_hexapod", "reachy_mini", "hexaglide", "rrr", "prr", "rpr", "planar_rrr")
MORE_PARTS = () if INTERPRETED else (*ARMS, *(name for name in TRUNKS if name != "pivoted"))


@pytest.mark.parametrize("name", [*TWO_PARTS[: 2 if INTERPRETED else None], "nrpm", *MORE_PARTS])
def test_exact_meetings_reach_all_that_the_default_reaches_of_legs_of_two_parts_in_one_pass(name: str) -> None:
    """Arms of many dimensions, hinges aslant, three struts and more, elbows, cranks and planar legs on them."""
    mechanism = machine(name)
    targets = reachable(mechanism, *((0.1, 0.1) if name in TRUNKS or INTERPRETED else (0.4, 0.2)))
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    assert len(targets) >= 2
    np.testing.assert_array_equal(answers.status, Status.REACHED)
    assert gap_of_joints(mechanism, answers).max() <= 1e-9
    assert excess_of_joints(mechanism, answers).max() <= 1e-9
    assert np.abs(answers.pose[:, :3, 3] - targets[:, :3, 3]).max() <= 1e-9 * mechanism.characteristic_length
    if name in TWO_PARTS:
        np.testing.assert_array_equal(answers.iterations, 1)
    assert np.median(answers.iterations) <= 6


@compiled_only
def test_the_arms_of_the_paper_take_less_than_two_passes_over_a_whole_workspace() -> None:
    mechanism = pf.load("nrpm")
    targets = reachable(mechanism, 1.0, 0.26, 2000)
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    assert (answers.status == Status.REACHED).all()
    assert len(targets) > 200 and np.mean(answers.iterations) <= 1.9
    warm = pf.passes.solve(mechanism, targets[1:], ACCELERATED, start=answers[:-1])
    assert (warm.status == Status.REACHED).all()


@compiled_only
def test_arms_are_told_of_every_limit_of_their_struts_and_move_for_those_that_ask() -> None:
    """Of crossbars that do not know of their cones, or split the difference with content struts, 78 of 100 are."""
    mechanism = pf.load("nrpm")
    targets = reachable(mechanism, 0.8, 0.26, 150)
    assert len(targets) >= 25
    extended = pf.passes.solve(mechanism, targets, Options.extended())
    assert np.mean(extended.status == Status.REACHED) >= 0.92
    assert np.mean(pf.passes.solve(mechanism, targets).status == Status.REACHED) <= 0.9  # by the paper's text


@compiled_only
@pytest.mark.parametrize(
    ("name", "size", "farther"),
    [("five_bar", 1.2, 1.03), ("stewart", 1.0, 1.02), ("servo_hexapod", 0.8, 1.2), ("prr", 1.0, 1.2)],
)
def test_targets_out_of_reach_end_near_the_nearest_pose(name: str, size: float, farther: float) -> None:
    mechanism = pf.load(name)
    targets = targets_about(mechanism, size, 0.2, 2 * N)
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    nearest = pf.solve_ik(mechanism, targets, options=pf.Options(working_mode="any"))
    held = (nearest.status == Status.PROJECTED) & (nearest.rotation_error <= 1e-6) & (answers.rotation_error <= 1e-6)
    held &= nearest.position_error > 0.02 * mechanism.characteristic_length
    ratios = answers.position_error[held] / nearest.position_error[held]
    assert len(ratios) >= 1
    assert ratios.min() >= 1.0 - 1e-6 and np.median(ratios) <= 1.01 and ratios.max() <= farther


@compiled_only
def test_a_leg_that_keeps_its_side_is_not_flipped() -> None:
    mechanism = pf.load("rrr")
    targets = targets_about(mechanism, 0.5, 0.4, 2 * N)
    answers = pf.passes.solve(mechanism, targets, replace(ACCELERATED, working_mode="keep"))
    default = pf.solve_ik(mechanism, targets, options=pf.Options(working_mode="keep"))
    reached = answers.status == Status.REACHED
    np.testing.assert_array_equal(reached, default.status == Status.REACHED)
    np.testing.assert_allclose(answers.actuators[reached], default.actuators[reached], atol=1e-7)


# --- the paper's text ------------------------------------------------------------------------------------------------


def turned_into(axis: np.ndarray, half_angle: float, b: np.ndarray) -> np.ndarray:
    """The paper's clamp: R a/|a| |b| by Rodrigues' formula, about a x b, where the angle of a and b is too large."""
    angle = np.arctan2(np.linalg.norm(np.cross(axis, b)), axis @ b)
    if angle <= half_angle:
        return b
    u = np.cross(axis, b) / np.linalg.norm(np.cross(axis, b))
    K = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    R = np.cos(half_angle) * np.eye(3) + np.sin(half_angle) * K + (1 - np.cos(half_angle)) * np.outer(u, u)
    return R @ axis * np.linalg.norm(b)


def test_a_pass_of_the_paper_is_its_formulas_on_a_strut_between_two_cones() -> None:
    """Its clamp of d and of both joints' angles, inward (the platform's joints) and outward, and its centroid."""
    mechanism, half, wide = pf.load("stewart"), *np.radians((20.0, 26.0))
    names = {side: [joint.name for joint in mechanism.joints if joint.name[0] == side] for side in "ABC"}
    up = np.array([0.0, 0.0, 1.0])
    mechanism = mechanism.with_limits({name: pf.Cone(up, half, "base") for name in names["A"]})
    mechanism = mechanism.with_limits({name: pf.Cone(-up, wide, "platform") for name in names["C"]})
    base, ends = (np.array([mechanism.joint(name).at for name in names[side]]) for side in "AC")
    lo, hi = np.array([mechanism.joint(name).range for name in names["B"]]).T
    home = mechanism.home_pose[:3, 3]
    rng = np.random.default_rng(4)
    for _ in range(20):
        target = home + rng.uniform(-60, 60, 3)
        trace = pf.passes.trace(mechanism, target, replace(Options.paper(), max_iterations=1, max_rounds=1))
        goals = ends - home + target
        inward, outward = goals.copy(), goals.copy()
        for i, (foot, goal) in enumerate(zip(base, goals, strict=True)):
            back = turned_into(-up, wide, foot - goal)
            inward[i] = goal + np.clip(np.linalg.norm(back), lo[i], hi[i]) * back / np.linalg.norm(back)
            out = turned_into(up, half, goal - foot)
            out = -turned_into(-up, wide, -out)
            outward[i] = foot + np.clip(np.linalg.norm(out), lo[i], hi[i]) * out / np.linalg.norm(out)
        stages = {
            kind: [stage for stage in trace if stage.kind == kind and not stage.round] for kind in ("inward", "outward")
        }
        for i in range(6):
            np.testing.assert_allclose(stages["inward"][i].nodes[2 * i], inward[i], atol=1e-9)
            np.testing.assert_allclose(stages["outward"][i].nodes[2 * i + 1], outward[i], atol=1e-9)
        revised = [stage for stage in trace if stage.kind == "revised"]
        if np.abs(outward - goals).max() > 0.01:
            np.testing.assert_allclose(revised[0].pose[:3, 3], target + (outward - goals).mean(axis=0), atol=1e-9)
        else:
            assert not revised


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm", "reachy_mini"])
@pytest.mark.parametrize("method", ["paper", "extended", "accelerated", "centroid"])
def test_passes_know_no_unit(name: str, method: str) -> None:
    """In millimetres and in metres: the same passes and statuses, and E is 0.01 mm."""
    factors = {"mm": 1.0, "m": 1e3}
    given = pf.load(name)
    base = scaled(given, {"m": 1e3, "mm": 1.0}[given.length_unit])
    targets, found = targets_about(base, 0.5, 0.2, 12), {}
    for unit, factor in factors.items():
        machine = replace(scaled(base, 1.0 / factor), length_unit=unit)
        there = targets.copy()
        there[:, :3, 3] /= factor
        found[unit] = pf.passes.solve(machine, there, Options(method=method, max_rounds=100))
        reached = found[unit].status == Status.REACHED
        assert (found[unit].position_error[reached] * factor <= 0.01).all()
    np.testing.assert_array_equal(found["mm"].status, found["m"].status)
    np.testing.assert_array_equal(found["mm"].iterations, found["m"].iterations)
    np.testing.assert_allclose(found["mm"].pose[:, :3, 3], 1e3 * found["m"].pose[:, :3, 3], atol=1e-5)


def test_where_the_unit_is_no_length_the_papers_E_is_a_ten_thousandth_of_L() -> None:
    machine = replace(pf.load("five_bar"), length_unit="link")
    options = Options.paper().of(machine)
    assert options.tolerance == pytest.approx(1e-4 * machine.characteristic_length)
    assert Options(tolerance=3.0).of(machine).tolerance == 3.0
    assert Options.accelerated().of(machine).tolerance is None


@pytest.mark.parametrize("name", ["servo_hexapod", *TRUNKS])
@pytest.mark.parametrize("mode", ["keep", "any"])
def test_answers_of_another_engine_are_marked(name: str, mode: str) -> None:
    """Passes that are cut short leave loops open; one target beyond them all is among these."""
    mechanism = machine(name)
    targets = np.concatenate([targets_about(mechanism, 1.5, 0.8, 5), mechanism.home_pose[None]])
    options = replace(Options.paper(), max_rounds=1, working_mode=mode)
    answers = pf.passes.solve(mechanism, targets, options)
    marked = pf.passes.by_fallback(answers)
    assert marked.any() and not marked[-1] and (answers.rounds[~marked] >= 0).all()
    as_usual = pf.Options(tolerance=options.of(mechanism).tolerance, working_mode=mode)
    usual = pf.solve_ik(mechanism, targets[marked], options=as_usual)
    np.testing.assert_array_equal(answers.status[marked], usual.status)
    np.testing.assert_allclose(answers.pose[marked], usual.pose, atol=1e-12)


@pytest.mark.parametrize("name", ["delta", "rps", "agile_eye"])
def test_answers_for_machines_that_passes_do_not_serve_are_marked(name: str) -> None:
    mechanism = pf.load(name)
    targets = np.repeat(mechanism.home_pose[None], 3, axis=0)
    assert pf.passes.by_fallback(pf.passes.solve(mechanism, targets)).all()
    assert pf.passes.by_fallback(pf.passes.track(mechanism, targets)).all()
    assert (pf.solve_ik(mechanism, targets).rounds == 0).all()


# --- step by step ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm", "hexaglide", *TRUNKS])
@pytest.mark.parametrize("method", ["paper", "extended"])
def test_a_trace_makes_the_passes_that_solve_makes(name: str, method: str) -> None:
    mechanism = machine(name)
    options = Options(method=method, max_iterations=20, max_rounds=3)
    for target in targets_about(mechanism, 0.5, 0.2, 6):
        trace, answer = pf.passes.trace(mechanism, target, options), pf.passes.solve(mechanism, target, options)
        assert trace.passes == len(trace.gaps)
        if not pf.passes.by_fallback(answer):
            assert (trace.passes, trace.rounds) == (answer.iterations, answer.rounds)
        if trace.is_reached and not trace.rounds:
            assert answer.position_error <= 3.0 * trace.tolerance
        assert trace.gaps[-1] == trace[-1].gap or trace[-1].kind == "revised"
    assert len(trace) == len(list(trace)) and str(trace).startswith(mechanism.name)


def test_a_trace_is_drawn_half_by_half_and_filmed(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    for name, panels in (("five_bar", 6), ("stewart", 4), ("nrpm", 11)):
        mechanism = pf.load(name)
        trace = pf.passes.trace(mechanism, mechanism.home_pose[:3, 3] + [0.0, 20.0, -10.0])
        figure = trace.plot()
        titles = [axes.get_title() for axes in figure.axes if axes.axison or axes.get_title()]
        assert len([title for title in titles if title]) == panels
        assert titles[0] == "(a) start" and titles[panels - 1].startswith(f"({'abcdefghijk'[panels - 1]}) after")
    trace.animate(tmp_path / "passes.gif", seconds=0.05)
    assert (tmp_path / "passes.gif").read_bytes().startswith(b"GIF")


def test_a_trace_that_is_cut_says_so() -> None:
    mechanism = pf.load("five_bar")
    cut, whole = (pf.passes.trace(mechanism, [0, 44, 241], most=most) for most in (50, 10_000))
    assert cut.is_cut and "stopped here" in str(cut) and cut.passes == 50
    assert not whole.is_cut and whole.is_reached and "stopped" not in str(whole)


def test_what_cannot_be_traced_is_refused() -> None:
    mechanism = pf.load("five_bar")
    with pytest.raises(pf.errors.InvalidArgument, match="one pose"):
        pf.passes.trace(mechanism, [[0, 0, 150]] * 2)
    with pytest.raises(pf.errors.InvalidArgument, match="plain"):
        pf.passes.trace(mechanism, [0, 0, 150], Options.accelerated())
    with pytest.raises(pf.errors.InvalidArgument, match="most"):
        pf.passes.trace(mechanism, [0, 0, 150], most=0)
    for name in ("g1_ankle", "delta"):  # positions do not express it; its task is no whole pose
        with pytest.raises(pf.errors.UnsupportedMechanism):
            pf.passes.trace(pf.load(name), pf.load(name).home_pose)


# --- forward kinematics ----------------------------------------------------------------------------------------------


@compiled_only
@pytest.mark.parametrize("name", pf.catalog())
def test_forward_kinematics_by_passes_ends_in_the_assembly_that_newtons_method_ends_in(name: str) -> None:
    """Of machines whose legs are struts, or cranks or carriages with rods: at poses that are given, without Newton."""
    mechanism = pf.load(name)
    try:
        at_home = pf.passes.solve_fk(mechanism, pf.solve_ik(mechanism, mechanism.home_pose).actuators)
    except pf.errors.UnsupportedMechanism:
        pytest.skip("joint positions do not express it")
    assert at_home.status is Status.REACHED and at_home.iterations <= 1
    known = pf.solve_ik(mechanism, targets_about(mechanism, 0.1, 0.1, 40))
    known = known[np.flatnonzero(known.status == Status.REACHED)]
    near, length = pf.solve_fk(mechanism, known.actuators), mechanism.characteristic_length
    answers = pf.passes.solve_fk(mechanism, known.actuators)
    assert len(known) >= 10
    np.testing.assert_array_equal(answers.status, Status.REACHED)
    assert not pf.passes.by_fallback(answers).any()
    assert gap_of_joints(mechanism, answers).max() <= 1e-9
    np.testing.assert_allclose(answers.actuators, known.actuators, atol=1e-9 * length)
    shift, turn = np.abs(answers.pose - near.pose)[:, :3, 3].max(), np.abs(answers.pose - near.pose)[:, :3, :3].max()
    assert shift <= 1e-6 * length and turn <= 1e-6


@pytest.mark.parametrize("name", ["delta", "canfield", "five_bar"])
def test_what_newtons_method_reaches_passes_do_not_answer_worse(name: str) -> None:
    """Far from home: passes may end beyond limits of passive joints, or elsewhere; Newton's method then answers."""
    mechanism = pf.load(name)
    home = pf.solve_ik(mechanism, mechanism.home_pose).actuators
    values = home + np.random.default_rng(5).uniform(-1.5, 1.5, (40, len(home)))
    by_passes, usual = pf.passes.solve_fk(mechanism, values), pf.solve_fk(mechanism, values)
    assert np.isin(by_passes.status, (Status.REACHED, Status.PROJECTED)).all()
    assert excess_of_joints(mechanism, by_passes).max() <= 1e-9
    assert (by_passes.status[usual.status == Status.REACHED] == Status.REACHED).all()


def test_forward_kinematics_by_passes_says_where_nothing_assembles() -> None:
    hexapod, mechanism = pf.load("stewart"), pf.load("five_bar")
    lengths = pf.solve_ik(hexapod, hexapod.home_pose).actuators + [300, -100, 0, 0, 0, 0]
    apart = pf.passes.solve_fk(hexapod, lengths, Options(max_rounds=2))
    assert apart.status is Status.PROJECTED and pf.passes.by_fallback(apart)
    np.testing.assert_array_equal(apart.actuators, pf.solve_fk(hexapod, lengths).actuators)
    beyond = pf.passes.solve_fk(mechanism.without_limits(), [1e300, 0.3])
    assert beyond.status is Status.PROJECTED and beyond.actuator_error >= 1e299
    values = np.array([pf.solve_fk(mechanism, pf.solve_ik(mechanism, [0, 10, 150]).actuators).actuators, [np.nan, 0.0]])
    with pytest.raises(pf.errors.InvalidArgument, match="finite"):
        pf.passes.solve_fk(mechanism, values)
    marked = pf.passes.solve_fk(mechanism, values, Options(on_invalid="mark"))
    assert marked.status.tolist() == [Status.REACHED, Status.INVALID]
    assert marked.pose[0, :3, 3] == pytest.approx([0, 10, 150], abs=1e-6)
    with pytest.raises(pf.errors.UnsupportedMechanism):
        pf.passes.solve_fk(pf.load("g1_ankle"), [0.0, 0.0])
