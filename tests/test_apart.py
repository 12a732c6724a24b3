"""Answers keep links apart, and nothing nearer to their targets does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from links import STROKE, axes_of_struts, distances_of_pairs, struts, thick_hexaglide
from machines.redescribed import moved
from pfabrik.cli import main
from pfabrik.engines.engine import engine_of
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.engines.pose.legs_engine import LegsEngine
from pfabrik.engines.pose.links_of_legs import keeps_links
from pfabrik.machine.description.links import collisions_at_home
from pfabrik.machine.model import model_of
from pfabrik.view.skeleton import skeleton_of

Array = NDArray[np.float64]
FREE = pf.Options(hold=None)
COUNT = 4 if INTERPRETED else 24


def around(machine: pf.Mechanism, count: int = COUNT, angle: float = 0.8, seed: int = 1) -> Array:
    """Poses around home."""
    rng = np.random.default_rng(seed)
    poses = np.tile(machine.home_pose, (count, 1, 1))
    poses[:, :3, 3] += 0.3 * machine.characteristic_length * rng.normal(size=(count, 3))
    poses[:, :3, :3] = Rotation.from_rotvec(angle * rng.normal(size=(count, 3))).as_matrix()
    return poses


def between_joints(name: str, share: float) -> pf.Mechanism:
    """A machine of the catalogue with capsules between the joints of all its links, and a ball on its platform."""
    machine = pf.load(name)
    length = share * machine.characteristic_length
    shapes: list[pf.Shape] = []
    for body in set(machine.bodies) - {machine.base, machine.end_effector}:
        joints = [each for each in machine.joints if body in each.connects and each.at is not None]
        if len(joints) == 2 and np.linalg.norm(np.subtract(*(np.array(each.at) for each in joints))) > length:
            shapes.append(pf.Shape(body, thickness=length))
    if not machine.end_effector_is_joint:
        shapes.append(pf.Shape(machine.end_effector, "sphere", at=machine.reference_point, diameter=length))
    shapes.sort(key=lambda shape: shape.body)
    at_home: set[tuple[str, str]] = set()
    for _ in range(len(shapes) ** 2):
        try:
            thick = machine.with_shapes(shapes, sorted(at_home))
        except pf.errors.InvalidMechanism as error:
            at_home |= {tuple(str(fault.found).split("'")[1:4:2]) for fault in error.faults}  # type: ignore[misc]
            continue
        distance = pf.clearance(pf.solve_ik(thick, thick.home_pose)).distance
        return thick.with_clearance(float(min(0.02 * machine.characteristic_length, 0.5 * distance)))
    raise AssertionError(name)


def distances_from(targets: Array, answers: pf.Solution) -> Array:
    """Distances from targets in units of L, rotations times the lever of the machine."""
    machine = answers.mechanism
    turned = Rotation.from_matrix(answers.pose[:, :3, :3] @ np.swapaxes(targets[:, :3, :3], 1, 2)).magnitude()
    moved = np.linalg.norm(answers.pose[:, :3, 3] - targets[:, :3, 3], axis=1)
    found: Array = np.hypot(moved, machine.rotation_length * turned) / machine.characteristic_length
    return found


# The nearest pose


def room(poses: Array) -> Array:
    """What is left of strokes and of distances of `struts`, 20 thick and 2 apart, in their unit, (n, 27)."""
    lengths = np.linalg.norm(np.diff(axes_of_struts(poses), axis=2)[:, :, 0], axis=2)
    return np.concatenate([lengths - STROKE[0], STROKE[1] - lengths, distances_of_pairs(poses, 22.0)], axis=1)


def nearest(machine: pf.Mechanism, target: Array, starts: int) -> float:
    """The least distance from a target that SLSQP finds from random starts [L]."""
    length, lever = machine.characteristic_length, machine.rotation_length / machine.characteristic_length
    turned, rng, best = Rotation.from_matrix(target[:3, :3]), np.random.default_rng(0), np.inf

    def square(x: Array) -> float:
        turn = (Rotation.from_rotvec(x[3:]) * turned.inv()).magnitude()
        return float(((x[:3] - target[:3, 3] / length) ** 2).sum() + (lever * turn) ** 2)

    def within(x: Array) -> Array:
        return room(pf.pose(x[None, :3] * length, rotvec=x[None, 3:]))[0] / length

    for _ in range(starts):
        start = np.concatenate([[0, 0, 195 / length] + 0.6 * rng.uniform(-1, 1, 3), 0.6 * rng.normal(size=3)])
        limits = [{"type": "ineq", "fun": within}]
        found = minimize(square, start, method="SLSQP", constraints=limits, options={"ftol": 1e-14})
        if within(found.x).min() > -1e-8:
            best = min(best, float(np.sqrt(max(found.fun, 0.0))))
    return best


@pytest.mark.skipif(INTERPRETED, reason="takes minutes")
@pytest.mark.parametrize(("tries", "starts"), [(3, 8), pytest.param(60, 200, marks=pytest.mark.campaign)])
def test_no_start_of_slsqp_comes_nearer(tries: int, starts: int) -> None:
    machine = struts(20.0, clearance=2)
    targets = around(machine, max(tries, 25), seed=5)
    answers = pf.solve_ik(machine, targets, options=FREE)
    distances = distances_from(targets, answers)
    held = [k for k, limits in enumerate(answers.active_limits) if any(each.bound == "clearance" for each in limits)]
    assert len(held) >= 6
    for k in held[:tries]:
        assert distances[k] <= nearest(machine, targets[k], starts) + 1e-7


def test_nothing_in_the_same_orientation_is_nearer_than_what_is_certified() -> None:
    machine = struts(20.0, clearance=2)
    targets, rng, checked = around(machine, 3 * COUNT, seed=3), np.random.default_rng(0), 0
    answers = pf.solve_ik(machine, targets)
    for k in np.flatnonzero(answers.certified & (np.asarray(answers.status) == pf.Status.PROJECTED)):
        steps = rng.normal(size=(300, 3))
        steps *= (1.0 - 1e-7) * answers.position_error[k] / np.linalg.norm(steps, axis=1, keepdims=True)
        poses = np.tile(answers.pose[k], (300, 1, 1))
        poses[:, :3, 3] = targets[k, :3, 3] + steps * rng.uniform(size=(300, 1)) ** (1 / 3)
        assert (room(poses).min(axis=1) < 1e-7).all()
        checked += any(each.bound == "clearance" for each in answers[int(k)].active_limits)
    assert INTERPRETED or checked > 4


@pytest.mark.parametrize("method", ["paper", "accelerated", "centroid"])
def test_passes_keep_links_apart(method: str) -> None:
    machine, options = struts(20.0, clearance=2), replace(getattr(pf.passes.Options, method)(), hold=None)
    targets, least = around(machine), 2.0 - 1e-9 * machine.characteristic_length
    free, kept = (pf.passes.solve(each, targets, options) for each in (machine.with_clearance(None), machine))
    assert np.min(pf.clearance(free).distance) < least <= np.min(pf.clearance(kept).distance)


@pytest.mark.parametrize("machine", [struts(16.0, clearance=2), thick_hexaglide()], ids=["struts", "rails"])
def test_searches_in_poses_and_in_joint_coordinates_agree(machine: pf.Mechanism) -> None:
    engine, model = engine_of(machine.with_clearance(None)), model_of(machine)
    assert isinstance(engine, LegsEngine) and keeps_links(model)
    targets = around(machine)
    ends = [
        pf.Solution(machine, each.answer(targets, None, FREE, keep_mode=False), (COUNT,))
        for each in (LegsEngine(model), ClosureEngine(model))
    ]
    one, other = (distances_from(targets, each) for each in ends)
    assert np.count_nonzero(np.abs(one - other) > 1e-6) <= COUNT // 20
    assert all(np.asarray(pf.clearance(each).distance).min() >= 2 - 1e-6 for each in ends)


def test_a_multiplier_is_what_the_answer_gains_by_less_clearance() -> None:
    machine = struts(20.0, clearance=2)
    targets = around(machine, 60, seed=5)
    answers, closer = (
        pf.solve_ik(each, targets, options=FREE) for each in (machine, machine.with_clearance(2.0 - 1e-3))
    )
    gains = (distances_from(targets, answers) - distances_from(targets, closer)) * machine.characteristic_length / 1e-3
    checked = 0
    for limits, gain in zip(answers.active_limits, gains, strict=True):
        multipliers = [each.multiplier for each in limits if each.bound == "clearance"]
        if limits and len(multipliers) == 1:
            assert gain == pytest.approx(multipliers[0], rel=0.02, abs=1e-3)
            checked += 1
    assert checked > 8


# Every answer


CATALOGUE = ("hexaglide", "delta", "reachy_mini", "agile_eye", "orthoglide", "nrpm", "panda", "rrr")


@pytest.mark.parametrize("name", CATALOGUE[:3] if INTERPRETED else CATALOGUE)
def test_every_answer_keeps_links_apart(name: str) -> None:
    machine = between_joints(name, 0.15)
    free, least = machine.with_clearance(None), machine.clearance
    assert least is not None
    targets, length = around(machine, angle=0.5), machine.characteristic_length
    loose = pf.solve_ik(free, targets)
    answers = pf.solve_ik(machine, targets)
    forward = pf.solve_fk(machine, loose.actuators)
    tracked = pf.track(machine, targets[: COUNT // 4])
    for each in (answers, forward, tracked):
        assert np.asarray(pf.clearance(each).distance).min() >= least - 1e-9 * length
        assert np.max(each.limit_excess) <= 1e-9 and np.max(each.residual) <= 1e-8 * length
        assert set(np.asarray(each.status).tolist()) <= {pf.Status.REACHED, pf.Status.PROJECTED}
        named = [limit for row in each.active_limits for limit in row]  # what is named is at its limit
        assert all(abs(limit.value - limit.limit) <= 1e-6 * length for limit in named)
        assert bool(named) == (pf.Status.PROJECTED in each.status)
    kept = np.asarray(pf.clearance(loose).distance) >= least
    np.testing.assert_array_equal(np.asarray(answers.status)[kept], np.asarray(loose.status)[kept])


def test_links_beyond_balls_are_where_joints_have_them_whatever_bodies_have_links() -> None:
    """Links that are reached in another order than the loops reach them: a box on a carriage, rods, a platform."""
    machine = pf.load("prs")
    length, point = machine.characteristic_length, np.array(machine.reference_point)
    boxes = {"carriage2": machine.joint("B2").at, "platform": point, "base": point + [0, 0, 0.3 * length]}
    shapes = [pf.Shape(body, "box", at=at, size=[0.1 * length] * 3) for body, at in boxes.items()]
    rods = [pf.Shape(f"rod{k}", thickness=0.02 * length) for k in (1, 2, 3)]
    machine = machine.with_shapes(shapes + rods).with_clearance(0.15 * length)
    loose = pf.solve_ik(machine.with_clearance(None), around(machine, 2 * COUNT, 0.5), options=FREE)
    near = pf.clearance(loose).distance < 0.15 * length  # type: ignore[operator]
    assert near.any() and not near.all()
    found = ClosureEngine(model_of(machine)).too_near(loose._configurations)
    np.testing.assert_array_equal(found, np.flatnonzero(near))


def test_actuators_that_lead_past_a_dead_point_keep_links_apart() -> None:
    """Far from home: what another assembly mode is replaced by keeps links apart too."""
    base = [[89, 4, 26], [31, 84, 26], [-42, 79, 26], [-89, -2, 26], [-38, -81, 26], [18, -88, 26]]
    platform = [[43, 15, 118], [27, 36, 118], [-9, 45, 118], [-43, -14, 118], [-7, -43, 118], [5, -47, 118]]
    legs = {"stroke": (-60, 80), "thickness": 8, "A": {"axis": "vertical"}, "clearance": 2}
    machine = pf.Mechanism.from_legs("P*-S-S", base=base, platform=platform, reference_point=(0, 0, 118), **legs)
    answers = pf.solve_fk(machine, 50 * np.random.default_rng(0).normal(size=(60, 6)))
    assert np.asarray(pf.clearance(answers).distance).min() >= 2 - 1e-9 * machine.characteristic_length
    assert np.max(answers.limit_excess) <= 1e-9


def obstructed_five_bar() -> pf.Mechanism:
    """A five-bar with a post beside one elbow: some targets are free of it with the elbow on the other side only."""
    machine = pf.load("five_bar").without_limits()
    links = [pf.Shape(body, thickness=8) for body in machine.bodies if body != machine.base]
    return machine.with_shapes([*links, pf.Shape("base", "sphere", at=(0, 140, 150), diameter=70)]).with_clearance(2)


def test_another_working_mode_answers_where_it_is_clear() -> None:
    machine = obstructed_five_bar()
    free = machine.with_clearance(None)
    targets = machine.home_pose[:3, 3] + np.random.default_rng(2).normal(size=(4 * COUNT, 3)) * [0, 60, 60]
    loose, answers = pf.solve_ik(free, targets), pf.solve_ik(machine, targets)
    touching = (np.asarray(pf.clearance(loose).distance) < 2) & (np.asarray(loose.status) == pf.Status.REACHED)
    kinds = set()
    for k in np.flatnonzero(touching):
        modes = [mode for mode in pf.working_modes(free, targets[k]) if mode.status == pf.Status.REACHED]
        is_clear = any(pf.clearance(mode).distance >= 2 for mode in modes)
        assert (answers[int(k)].status == pf.Status.REACHED) == is_clear
        kinds.add(is_clear)
    assert INTERPRETED or kinds == {True, False}
    home = pf.solve_ik(machine, targets[touching], options=pf.Options(working_mode="keep"))
    assert (np.asarray(home.status) == pf.Status.PROJECTED).all()


def test_a_track_goes_past_what_it_cannot_reach_and_comes_back() -> None:
    machine = thick_hexaglide()
    poses = np.tile(machine.home_pose, (COUNT, 1, 1))
    angles = 0.7 * np.sin(np.linspace(0, np.pi, COUNT))
    poses[:, :3, :3] = Rotation.from_rotvec(np.outer(angles, [0, 0, 1])).as_matrix()
    steps: list[tuple[int, int]] = []
    tracked = pf.track(machine, poses, on_progress=lambda done, count: steps.append((done, count)))
    status = np.asarray(tracked.status)
    assert status[0] == status[-1] == pf.Status.REACHED and (status == pf.Status.PROJECTED).any()
    assert steps[-1] == (COUNT, COUNT)
    stopped = int(np.flatnonzero(status == pf.Status.PROJECTED)[0])
    assert "at their clearance" in tracked[stopped].reason
    np.testing.assert_allclose(tracked.actuators[-1], tracked.actuators[0], atol=1e-6)
    apart = pf.track(machine.with_clearance(None), poses)
    assert np.asarray(pf.clearance(apart).distance).min() < 2


def test_answers_move_and_grow_with_the_machine() -> None:
    machine, R = struts(20.0, clearance=2), Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    targets, shift = around(machine, 2 * COUNT, seed=5), np.array([30.0, -80.0, 12.0])
    distances = distances_from(targets, pf.solve_ik(machine, targets, options=FREE))
    for copy, turn, move, size in (
        (moved(machine, R, shift), R, shift, 1.0),
        (struts(20.0, 2, size=0.01), np.eye(3), np.zeros(3), 0.01),
    ):
        there = targets.copy()
        there[:, :3, 3] = size * targets[:, :3, 3] @ turn.T + move
        there[:, :3, :3] = turn @ targets[:, :3, :3] @ turn.T
        found = distances_from(there, pf.solve_ik(copy, there, options=FREE))
        assert np.count_nonzero(np.abs(found - distances) > 1e-6) <= COUNT // 10


def turned_about_z(machine: pf.Mechanism, angle: float) -> Array:
    return machine.home_pose @ pf.pose([0, 0, 0], rotvec=[0, 0, angle])


def test_machines_without_a_clearance_have_the_engine_they_had() -> None:
    machine = thick_hexaglide()
    assert type(engine_of(machine.with_clearance(None))) is LegsEngine
    assert not list(collisions_at_home(machine))


def test_a_track_tells_how_near_links_come_between_its_steps(tmp_path: Path) -> None:
    """The tip passes a post: on its way to the other side, and not where it goes around."""
    machine = pf.load("five_bar").without_limits()
    links = [pf.Shape(body, thickness=8) for body in ("link2", "link3")]
    post = pf.Shape("base", "sphere", at=(0, 11, 230), diameter=20)
    machine = machine.with_shapes([*links, post]).with_clearance(2)
    sides = np.array([[0, -40.0, 200.0], [0, -40.0, 230.0], [0, 40.0, 230.0], [0, 40.0, 200.0]])
    tracked = pf.track(machine, sides)
    assert (np.asarray(tracked.status) == pf.Status.REACHED).all() and tracked.passing is not None
    fine = np.linspace(sides[1], sides[2], 2001)
    nearest = np.asarray(pf.clearance(pf.solve_ik(machine.with_clearance(None), fine)).distance).min()
    assert nearest == pytest.approx(-14.0, abs=0.05)
    assert tracked.passing[2] == pytest.approx(nearest, abs=2e-3 * machine.characteristic_length)
    ends = np.asarray(pf.clearance(tracked).distance)
    np.testing.assert_allclose(tracked.passing[[0, 1, 3]], [ends[0], min(ends[:2]), min(ends[2:])], atol=1.0)
    assert pf.track(machine.with_clearance(None), sides).passing is None
    saved, path = tmp_path / "machine.toml", tmp_path / "path.csv"
    pf.save(machine, saved)
    path.write_text("x,y,z\n" + "\n".join(",".join(map(str, row)) for row in sides), encoding="utf-8")
    ran = CliRunner().invoke(main, ["track", str(saved), str(path), "-o", str(tmp_path / "out.csv")])
    assert ran.exit_code == 1 and "on the way to target 3" in ran.output, ran.output


def test_the_pair_that_stops_an_answer_is_lit_up() -> None:
    machine = thick_hexaglide()
    answer = pf.solve_ik(machine, turned_about_z(machine, 0.7))
    lit = {solid.body for solid in skeleton_of(answer).solids if solid.is_stopped}
    stopping = answer.active_limits[0]
    assert isinstance(stopping, pf.ActiveLimit) and stopping.bound == "clearance"
    assert len(lit) == 2 and "–".join(sorted(lit)) in {each.joint for each in answer.active_limits}  # type: ignore[union-attr]
    assert not any(solid.is_stopped for solid in skeleton_of(pf.solve_ik(machine, machine.home_pose)).solids)


def test_the_centre_of_a_sliding_joint_moves_with_its_first_body() -> None:
    """A carriage described before the rail that it is on: its capsule goes with it, in searches too."""
    joints = [
        pf.Joint("Z", "prismatic", ("base", "column"), actuated=True, axis=(0, 0, 1), range=(-5, 5)),
        pf.Joint(
            "P", "prismatic", ("carriage", "column"), actuated=True, at=(0, 0, 0), axis=(-1, 0, 0), range=(-60, 60)
        ),
        pf.Joint("R", "revolute", ("carriage", "tool"), actuated=True, at=(0, 0, 40), axis=(0, 1, 0), range=(-1, 1)),
    ]
    shapes = [
        pf.Shape("carriage", thickness=10, between=("P", "R")),
        pf.Shape("base", "sphere", at=(50, 0, 20), diameter=20),
    ]
    machine = pf.Mechanism("gantry", joints, "tool", (0, 0, 80), shapes=shapes)
    moved = pf.solve_fk(machine, [0, 20, 0.0])
    side = 1.0 if moved.pose[0, 3] > 0 else -1.0
    assert pf.clearance(moved).distance == pytest.approx(50 - side * 20 - 5 - 10, abs=1e-9)
    kept = machine.with_clearance(5)
    answer = pf.solve_fk(kept, [0, side * 45, 0.0])
    assert answer.status == pf.Status.PROJECTED
    assert answer.actuators[1] == pytest.approx(side * 30, abs=1e-6)


def test_two_bodies_that_touch_in_several_places_are_named_once() -> None:
    """A plate above two posts of one body, which both stop it."""
    posts = [pf.Shape("base", "sphere", at=(side, 0, 60), diameter=40) for side in (-20, 20)]
    plate = pf.Shape("platform", "disc", at=(0, 0, 190), axis=(0, 0, 1), diameter=60, thickness=4)
    machine = struts(1.0, clearance=1, stroke=(100, 280), shapes=[*posts, plate])
    answer = pf.solve_ik(machine, [0, 0, 60])
    assert answer.pose[2, 3] == pytest.approx(60 + 20 + 1 + 7, abs=1e-6)
    assert [each.joint for each in answer.active_limits] == ["base–platform"] * 2  # type: ignore[union-attr]
    assert answer.reason == "base–platform at their clearance 1 mm"
