"""Which modes answers are in: that of the start is kept, or released where a call allows it, and no other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import pytest

import machines
import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible, home_values
from machines import closure, machine
from machines.small import four_bar
from oracles import any_values
from pfabrik import Joint, Mechanism, Options, Solution, Status
from pfabrik.engines.pose.answers import sides_at
from pfabrik.engines.pose.branch import branch_of, same_branch
from pfabrik.machine.model import model_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
KEEP, ANY = Options(working_mode="keep"), Options(working_mode="any")


def apart(one: Solution, other: Solution) -> float:
    """Largest difference of two configurations in joint centres [L] and actuators (angles as points on a circle)."""
    mechanism = one.mechanism
    off = [np.abs(one.points[name] - other.points[name]).max() / mechanism.characteristic_length for name in one.points]
    for drive, a, b in zip(mechanism.drives, one.actuators, other.actuators, strict=True):
        is_angle = drive.kind == "angle"
        off.append(2 * abs(np.sin((a - b) / 2)) if is_angle else abs(a - b) / mechanism.characteristic_length)
    return float(max(off))


# --- four modes of a 5-bar, by every verb ----------------------------------------------------------------------------


def elbows(answers: Solution) -> set[tuple[float, float]]:
    """On which sides of the lines from their shoulders to the tip a 5-bar's elbows are, in the plane x = 0."""
    p, sides = answers.points, []
    for shoulder, elbow in (("p1", "p2"), ("p5", "p4")):
        sides.append(np.ravel(np.sign(np.cross(p["p3"] - p[shoulder], p[elbow] - p[shoulder])[..., 0])))
    return set(zip(*sides, strict=True))


TARGETS = np.array([(0.0, -10.0, 170.0), (0.0, 30.0, 190.0)])


def by_solver(mechanism: Mechanism, mode: Solution) -> Solution:
    solver = pf.Solver(mechanism, start=mode)
    solver.ik(TARGETS[1])
    return solver.solution


VERBS: dict[str, Callable[[Mechanism, Solution], Solution]] = {
    "solve_ik": lambda machine, mode: pf.solve_ik(machine, TARGETS, start=mode),
    "solve_ik from a joint vector": lambda machine, mode: pf.solve_ik(machine, TARGETS, start=mode.q),
    "solve_ik from one for each": lambda machine, mode: pf.solve_ik(machine, TARGETS, start=np.tile(mode.q, (2, 1))),
    "solve_fk": lambda machine, mode: pf.solve_fk(machine, mode.actuators + 0.02, start=mode),
    "track": lambda machine, mode: pf.track(machine, np.linspace(*TARGETS, 9), start=mode),
    "Solver": by_solver,
    "travel": lambda machine, mode: pf.travel(mode, along=(0, 0, 1))[0].end,
}


@cache
def five_bar_modes() -> tuple[Mechanism, Sequence[Solution]]:
    mechanism = pf.load("five_bar").without_limits()
    return mechanism, pf.working_modes(mechanism, (0.0, 10.0, 180.0))


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_keeps_each_of_the_four_working_modes_of_a_5_bar(verb: str) -> None:
    mechanism, modes = five_bar_modes()
    assert len(modes) == 4 and len(set.union(*map(elbows, modes))) == 4
    for mode in modes:
        answers = VERBS[verb](mechanism, mode)
        assert answers and elbows(answers) == elbows(mode)


def test_a_path_stays_in_its_working_mode_where_another_would_reach_and_starts_in_that_of_its_start() -> None:
    """The left elbow may bend either way; at the end of the path only the bend that is not home's is allowed."""
    mechanism = pf.load("five_bar").without_limits().with_limits(p2=np.radians((-100.0, 140.0)))
    path = np.array(mechanism.reference_point) + np.linspace(0, 1, 20)[:, None] * (0.0, -5.0, -75.0)
    home, flipped = pf.solve_ik(mechanism, path[0]), pf.solve_ik(mechanism, path[-1])
    assert flipped and elbows(flipped) != elbows(home)
    followed = pf.track(mechanism, path)
    assert (followed.status[0], followed.status[-1]) == (Status.REACHED, Status.PROJECTED)
    assert elbows(followed) == elbows(home)
    back = pf.track(mechanism, path[::-1], start=flipped)
    assert back and elbows(back) == elbows(flipped)


# --- starts of other machines ----------------------------------------------------------------------------------------

MACHINES: dict[str, tuple[Callable[[], Mechanism], np.ndarray]] = {
    "3-RRR": (lambda: machines.planar("RRR"), pf.pose([6, -9, 30], rotvec=[0, 0, 0.2])),
    "6-RSS": (machines.hexapod_rus, pf.pose([5, -8, 130], rpy=[0.05, 0.1, -0.15])),
    "delta": (closure.delta, pf.pose([20, -30, -230])),
    "6R": (closure.wrist_arm, pf.pose([430, 60, 600], rotvec=[0.2, 0.3, -0.1])),
}
"""What makes a machine, and a target."""


@cache
def modes_of(name: str) -> tuple[Mechanism, Sequence[Solution]]:
    """The machine without limits, and its working modes at the target."""
    make, target = MACHINES[name]
    mechanism = make().without_limits()
    return mechanism, pf.working_modes(mechanism, target)


@pytest.mark.compiled
@pytest.mark.parametrize("name", MACHINES)
def test_a_near_target_is_reached_in_the_mode_of_the_start_or_else_of_home(name: str) -> None:
    mechanism, modes = modes_of(name)
    here, there = MACHINES[name][1], MACHINES[name][1].copy()
    there[:2, 3] += (0.5, -0.4)
    for mode in (None, "any", "keep"):
        for start in modes[::5]:
            answer = pf.solve_ik(mechanism, there, start=start, options=Options(working_mode=mode))
            assert answer and apart(answer, start) <= 0.1  # modes are farther apart
    assert apart(pf.solve_ik(mechanism, here), modes[0]) <= 1e-6


def barred(name: str) -> Mechanism:
    """The machine with one limit that bars the mode of home from the target by 0.02, but leaves another."""
    free, modes = modes_of(name)
    for k, actuator in enumerate(free.actuator_names):
        value = modes[0].actuators[k]
        for other in modes[1:]:
            away = (np.sign(value) * (value - other.actuators[k])) % (2 * np.pi)  # back past home
            if abs(value) > 0.04 and 0.1 < away < 2 * np.pi - 0.1:
                bounds = np.sign(value) * np.array([min(abs(value) - away, 0.0) - 0.05, abs(value) - 0.02])
                return free.with_limits({actuator: tuple(sorted(bounds))})
    raise AssertionError(f"no limit of {name} bars the mode of home alone")


@pytest.mark.compiled
@pytest.mark.parametrize("name", MACHINES)
def test_a_mode_that_cannot_reach_is_left_where_that_is_allowed_and_kept_where_it_is_not(name: str) -> None:
    mechanism, target = barred(name), MACHINES[name][1]
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    assert pf.solve_ik(mechanism, target)
    assert pf.solve_ik(mechanism, target, start=home, options=ANY)
    for options in (Options(), KEEP):
        answer = pf.solve_ik(mechanism, target, start=home, options=options)
        assert answer.status is Status.PROJECTED and apart(answer, modes_of(name)[1][0]) <= 0.2


@pytest.mark.parametrize("name", ["five_bar", "delta", "closure.SCARA", "closure.H4", "closure.Par4"])
def test_whatever_assembles_is_kept_when_it_is_asked_for_from_itself(name: str) -> None:
    """Actuators may take an elbow past its dead point; the joint vector tells the modes of legs on arms too."""
    mechanism, n = machine(name).without_limits(), 4 if INTERPRETED else 24
    turns = np.array([2.0 * np.pi * (drive.kind == "angle") for drive in mechanism.drives])
    span = np.where(turns > 0.0, 1.5, 0.5 * mechanism.characteristic_length)
    values = home_values(mechanism) + np.random.default_rng(0).uniform(-span, span, (n, len(span)))
    there = pf.solve_fk(mechanism, values)
    there = there[there.status == Status.REACHED]
    for start in (there, there.q):
        answer = pf.solve_ik(mechanism, there.pose, start=start)
        off = np.abs(answer.actuators - there.actuators)
        assert answer and np.minimum(off, np.abs(turns - off)).max() <= 1e-6


# --- an arm of two links: its modes in closed form -------------------------------------------------------------------

LONG, SHORT, SHOULDER = 90.0, 60.0, np.radians((-60.0, 110.0))


def two_links(bent: float, elbow: tuple[float, float], end: str) -> Mechanism:
    """Two hinges in a plane, drawn with the elbow bent; its end effector is the forearm, or a joint at its tip."""
    tip = (LONG + SHORT * np.cos(bent), SHORT * np.sin(bent), 0.0)
    z = (0, 0, 1)
    joints = [
        Joint("A", "revolute", ("base", "upper"), (0, 0, 0), z, actuated=True, range=tuple(SHOULDER)),
        Joint("B", "revolute", ("upper", "forearm"), (LONG, 0, 0), z, actuated=True, home=bent, range=elbow),
    ]
    if end == "tip":
        return Mechanism("arm", [*joints, Joint("tip", "revolute", ("forearm", "tool"), tip, z)], "tip")
    return Mechanism("arm", joints, "forearm", tip, task=("x", "y"))


def within_limits(targets: np.ndarray, elbow: tuple[float, float]) -> np.ndarray:
    """Targets (n, 3) that are reached with the elbow bent to either side, (2, n): the textbook's closed form."""
    x, y = targets[:, :2].T
    cosine = (x * x + y * y - LONG**2 - SHORT**2) / (2 * LONG * SHORT)
    reached = []
    for sign in (1.0, -1.0):
        b = sign * np.arccos(np.clip(cosine, -1.0, 1.0))
        a = np.arctan2(y, x) - np.arctan2(SHORT * np.sin(b), LONG + SHORT * np.cos(b))
        a = (a + np.pi) % (2 * np.pi) - np.pi
        inside = (SHOULDER[0] <= a) & (a <= SHOULDER[1]) & (elbow[0] <= b) & (b <= elbow[1])
        reached.append(inside & (np.abs(cosine) <= 1.0))
    return np.array(reached)


@pytest.mark.parametrize("end", ["forearm", "tip"])
@pytest.mark.parametrize(
    ("bent", "elbow"), [(0, (0, 100)), (0, (-100, 0)), (0, (-100, 100)), (40, (-30, 140)), (-20, (-100, 100))]
)
def test_an_arm_reaches_what_its_closed_form_says_in_every_mode(
    bent: float, elbow: tuple[float, float], end: str
) -> None:
    """Drawn straight it is in both modes, at the end of a range that allows only one of them too."""
    limits = (np.radians(elbow[0]), np.radians(elbow[1]))
    mechanism = two_links(np.radians(bent), limits, end)
    targets = np.pad(np.random.default_rng(0).uniform(-150, 150, (150, 2)), ((0, 0), (0, 1)))
    bent_up, bent_down = within_limits(targets, limits)
    in_any = bent_up | bent_down
    in_homes = in_any if bent == 0 else bent_up if bent > 0 else bent_down
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    for kept, start, options in [
        (in_any, None, None),
        (in_homes, None, KEEP),
        (in_homes, home, None),
        (in_homes, home.q, None),
    ]:
        answer = pf.solve_ik(mechanism, targets, start=start, options=options)
        np.testing.assert_array_equal(answer.status == Status.REACHED, kept)
    for start in (None, home):
        np.testing.assert_array_equal(pf.feasibility(mechanism, targets, start=start).margin >= 0.0, in_homes)


def test_the_workspace_of_an_arm_drawn_straight_is_that_of_its_elbow() -> None:
    limits = (0.0, np.radians(100.0))
    space = pf.workspace(two_links(0.0, limits, "forearm"))
    area = LONG * SHORT * np.ptp(SHOULDER) * (1 - np.cos(limits[1]))
    assert space.size == pytest.approx(area, rel=1e-3)
    targets = np.random.default_rng(1).uniform(-150, 150, (500, 2))
    margin = pf.feasibility(space.mechanism, np.pad(targets, ((0, 0), (0, 1)))).margin
    off_border = np.abs(margin) > 0.02
    reached = within_limits(np.pad(targets, ((0, 0), (0, 1))), limits).any(axis=0)
    np.testing.assert_array_equal(space.contains(targets)[off_border], reached[off_border])


def test_the_branch_of_an_elbow_is_the_sign_of_its_angle() -> None:
    """det C of two links is 90 sin B, to a factor; both branches meet at the stretched home."""
    mechanism = two_links(0.0, (-3.0, 3.0), "forearm").without_limits()
    angles = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 2))
    answers, model = pf.solve_fk(mechanism, angles), model_of(mechanism)
    signs = branch_of(model, answers.pose, sides_at(model, answers._configurations))
    np.testing.assert_array_equal(signs[:, -1], np.sign(angles[:, 1]))
    home = branch_of(model, mechanism.home_pose[None], model.legs.home_sides)
    assert same_branch(signs, home).all() and not same_branch(signs, -signs).any()


# --- legs that begin otherwise ---------------------------------------------------------------------------------------


def test_a_slide_along_the_hinge_below_it_reaches_around_home() -> None:
    mechanism = Mechanism.from_legs(
        "R*-P*-R-S",
        base=(0, 0, 0),
        via=(200, 0, 40),
        platform=(70, 0, 150),
        copies=machines.positions.THIRD,
        A={"axis": "vertical", "range": np.radians((-50, 50))},
        B={"axis": "vertical", "range": (-90, 90)},
        C={"axis": "tangential"},
        reference_point=(0, 0, 150),
    )
    near = mechanism.home_pose[:3, 3] + np.random.default_rng(0).uniform(-7, 7, (40, 3))
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    answer = pf.solve_ik(mechanism, near, options=KEEP)
    assert answer and pf.solve_ik(mechanism, near, start=home)
    assert (pf.feasibility(mechanism, near).margin >= 0.0).all()
    for turn, hinge in zip(np.radians([0, 120, 240]), answer.actuators[:, ::2].T, strict=True):
        ball = near - mechanism.home_pose[:3, 3] + [70 * np.cos(turn), 70 * np.sin(turn), 150]
        azimuth = np.arctan2(ball[:, 1], ball[:, 0]) - turn
        np.testing.assert_allclose(np.exp(1j * hinge), np.exp(1j * azimuth), atol=1e-9)


def test_legs_with_loops_reach_in_another_mode_what_no_start_leads_to() -> None:
    mechanism = machine("files.four_bar_tripod")
    heights = [(0.0, 0.0, z) for z in (161.0, 163.0, 165.0, 172.0, 174.0, 176.0, 178.0)]
    answer = pf.solve_ik(mechanism, heights)
    assert answer
    assert_feasible(mechanism, answer)
    assert (pf.solve_ik(mechanism, heights, options=KEEP).status == Status.PROJECTED).all()


# --- forward: the assembly mode --------------------------------------------------------------------------------------


def crank_in_a_four_bar() -> Mechanism:
    """It does not go all round; one place along its coupler is asked for."""
    return four_bar((0, 0), (0, 80), (100, 80), (120, 0), end="coupler", at=(60, 80), task=("x",))


@pytest.mark.parametrize("name", ["rrr", "reachy_mini", "canfield", "crank"])
def test_forward_kinematics_is_where_small_steps_from_home_lead(name: str) -> None:
    """Without limits, far from home; what is not reached has a reason, and the other mode for who asks for any."""
    mechanism = crank_in_a_four_bar() if name == "crank" else pf.load(name).without_limits()
    rows, home, here = 3 if INTERPRETED else 16, home_values(mechanism), None
    spans = np.random.default_rng(0).uniform(-0.8, 0.8, (rows, len(home)))
    values = home + spans * actuator_units(mechanism)
    answer = pf.solve_fk(mechanism, values)
    for share in np.linspace(0.01, 1.0, 100):
        here = pf.solve_fk(mechanism, home + share * (values - home), start=here)
    reached = answer.status == Status.REACHED
    np.testing.assert_array_equal(reached, here.status == Status.REACHED)
    off = np.abs(answer.pose - here.pose)[reached]
    off[:, :3, 3] /= mechanism.characteristic_length
    assert off.max() <= 1e-5
    assert all("parallel singularity" in row.reason for row in answer[~reached])
    assert pf.solve_fk(mechanism, values[reached], options=ANY)


def test_a_crank_reaches_in_any_mode_whatever_its_circles_reach() -> None:
    """Coupler and rocker meet if the distance of their ends is at most the sum of both, and at least the difference."""
    mechanism, coupler, rocker = crank_in_a_four_bar(), 100.0, np.hypot(20.0, 80.0)
    angles = np.linspace(-3.1, 3.1, 8 if INTERPRETED else 40)
    ends = 80.0 * np.column_stack([-np.sin(angles), np.cos(angles)])
    distances = np.linalg.norm(ends - [120.0, 0.0], axis=1)
    answer = pf.solve_fk(mechanism, angles[:, None], options=ANY)
    meets = (distances <= coupler + rocker) & (distances >= coupler - rocker)
    np.testing.assert_array_equal(answer.status == Status.REACHED, meets)


@pytest.mark.parametrize("name", ["rps", "rrr"])
def test_in_any_mode_values_are_reached_that_have_an_assembly_mode_at_all(name: str) -> None:
    mechanism = pf.load(name).without_limits()
    values = any_values(pf.load(name), 4 if INTERPRETED else 12, 2.0, seed=5)
    answer = pf.solve_fk(mechanism, values, options=ANY)
    has_mode = [len(pf.assembly_modes(mechanism, row, most_starts=512)) > 0 for row in values]
    np.testing.assert_array_equal(answer.status == Status.REACHED, has_mode)


@pytest.mark.parametrize("name", ["files.palletizer", "files.parallelogram_robot"])
def test_a_joint_behind_a_parallelogram_does_not_fold_it(name: str) -> None:
    """A parallelogram's elbow turns by the lift's angle less the shoulder's, whatever the wrist does."""
    limited = machine(name)
    values, mechanism = any_values(limited, 20 if INTERPRETED else 1000, 1.0), limited.without_limits()
    lift, shoulder = (values[:, mechanism.actuator_names.index(each)] for each in ("lift", "shoulder"))
    is_unfolded = np.abs(lift - shoulder) < np.radians(85.0)
    for start in (None, pf.solve_fk(mechanism, home_values(mechanism))):
        answer = pf.solve_fk(mechanism, values[is_unfolded], start=start)
        assert answer
        np.testing.assert_allclose(answer.joints["elbow"], (lift - shoulder)[is_unfolded], rtol=0, atol=1e-6)
