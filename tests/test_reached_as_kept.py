"""What targets do not decide, maps and margins search for: they say what `solve_ik` reaches that keeps the mode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED
from machines import closure, machine, planar
from machines.closure import joint
from oracles import any_values, targets_about
from pfabrik import Mechanism, Options, Status

pytestmark = [
    pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning"),
    pytest.mark.skipif(INTERPRETED, reason="many searches"),
]
KEEP = Options(working_mode="keep")
X, Z, SLIDE = (1, 0, 0), (0, 0, 1), 100.0


def delta(start: str) -> Mechanism:
    """A rotary delta whose arms are on a body, with the task of a position."""
    alone = closure.delta("SS", None)
    joints = [replace(each, connects=(start, each.connects[1])) if each.actuated else each for each in alone.joints]
    return replace(alone, joints=joints, base=start, task=("x", "y", "z"))


def delta_on_a_slide() -> Mechanism:
    slide = joint("P*", "slide", ("base", "carriage"), None, X, range=(-SLIDE, SLIDE))
    alone = delta("carriage")
    return replace(alone, joints=[slide, *alone.joints], base="base")


def three_links(bent: tuple[float, float, float], task: tuple[str, ...]) -> Mechanism:
    """A planar arm of three hinges; told by x and y it has one more than that takes."""
    joints, at, turn, bodies = [], np.zeros(3), 0.0, ("base", "a", "b", "hand")
    for k, (length, bend) in enumerate(zip((100, 80, 50), np.radians(bent), strict=True)):
        joints.append(joint("R*", f"q{k}", bodies[k : k + 2], at, Z, range=(-2.0, 2.0)))
        turn += bend
        at = at + length * np.array([np.cos(turn), np.sin(turn), 0.0])
    return Mechanism("three links", joints, "hand", tuple(at), task=task)


UNDECIDED: dict[str, Callable[[], Mechanism]] = {
    "a delta on a slide": delta_on_a_slide,
    "three links told by x and y": lambda: three_links((30, 60, 40), ("x", "y")),
    "three links drawn straight": lambda: three_links((0, 0, 0), ("x", "y")),
    "3-RRR told by x and y": lambda: replace(planar("RRR"), task=("x", "y")),
    **{name: lambda name=name: machine(name) for name in ("files.parallelogram_robot", "files.walking_linkage")},
}


def targets_of(mechanism: Mechanism, n: int) -> np.ndarray:
    """Poses about home and those of its own motors, some of both beyond the border."""
    rng = np.random.default_rng(3)
    own = pf.solve_fk(mechanism, any_values(mechanism, n, 0.6, seed=3))
    around = [targets_about(mechanism, rng, n // 2, size, size) for size in (0.2, 1.5)]
    return np.concatenate([own.pose[own.status == Status.REACHED], *around])


@pytest.mark.parametrize("name", UNDECIDED)
def test_what_is_feasible_is_what_is_reached_in_the_mode_of_home(name: str) -> None:
    mechanism = UNDECIDED[name]()
    targets = targets_of(mechanism, 60)
    margin = pf.feasibility(mechanism, targets).margin
    kept = pf.solve_ik(mechanism, targets, options=KEEP)
    clear = np.abs(margin) > 1e-7
    np.testing.assert_array_equal((margin >= 0.0)[clear], (kept.status == Status.REACHED)[clear])
    assert (clear & (margin < 0.0)).any()


def test_a_delta_under_a_carriage_reaches_what_it_reaches_somewhere_along_it() -> None:
    """The oracle is the delta alone, moved along in steps: a target counts from one on, and not if none is near."""
    mechanism, alone = delta_on_a_slide(), delta("base")
    home, length = mechanism.home_pose[:3, 3], mechanism.characteristic_length
    points = home + np.random.default_rng(0).uniform(-1.2, 1.2, (1500, 3)) * length
    steps = np.linspace(-SLIDE, SLIDE, 201)
    swept = points[:, None] - steps[:, None] * np.array(X)
    margins = np.asarray(pf.feasibility(alone, swept.reshape(-1, 3)).margin).reshape(len(points), -1).max(axis=1)
    feasible = np.asarray(pf.feasibility(mechanism, points).margin) >= 0.0
    assert feasible[margins >= 0.0].all() and not feasible[margins < -0.03].any()
    assert 100 < feasible.sum() < 1400
    space = pf.workspace(mechanism)
    clear = np.abs(margins) > 0.03
    assert np.mean(space.contains(points)[clear] == (margins >= 0.0)[clear]) > 0.998
    box = np.prod(2.4 * length * np.ones(3))
    assert space.size == pytest.approx(feasible.mean() * box, rel=0.15)


@pytest.mark.parametrize("name", ["three links told by x and y", "3-RRR told by x and y"])
def test_maps_contain_what_keep_reaches(name: str) -> None:
    mechanism = UNDECIDED[name]()
    space = pf.workspace(mechanism)
    low, high = space.vertices.min(axis=0), space.vertices.max(axis=0)
    points = np.random.default_rng(1).uniform(low, high, (500, 2))
    reached = pf.solve_ik(mechanism, space.poses(points), options=KEEP).status == Status.REACHED
    assert np.mean(space.contains(points) == reached) > 0.99
