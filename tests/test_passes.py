"""The paper's method, plain and accelerated, and its projection: as honest as all else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, excess_of_joints, gap_of_joints
from machines import MACHINES
from machines.trunks import TRUNKS
from pfabrik import Mechanism, Status
from pfabrik.passes import Options

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

EVERY: dict[str, Callable[[], Mechanism]] = {
    **{name: (lambda name=name: pf.load(name)) for name in ("five_bar", "stewart", "nrpm")},
    **MACHINES,
    **TRUNKS,
}
WAYS = {
    "paper": Options(tolerance=1e-2, max_rounds=50),
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


@cache
def made(name: str) -> Mechanism:
    return EVERY[name]()


def any_targets(machine: Mechanism, n: int) -> np.ndarray:
    """Poses (n, 4, 4) from home to some L away, turned by any angle; the last is a million L away."""
    rng, home = np.random.default_rng(1), machine.home_pose
    targets = np.repeat(home[None], n, axis=0)
    reach = np.geomspace(0.02, 3.0, n)[:, None]
    targets[:, :3, 3] += reach * rng.normal(size=(n, 3)) * machine.characteristic_length
    turns = Rotation.from_rotvec(np.minimum(reach, 1.0) * rng.normal(size=(n, 3)))
    targets[:, :3, :3] = turns.as_matrix() @ home[:3, :3]
    targets[-1, :3, 3] *= 1e6
    return targets


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", EVERY)
def test_limits_are_kept_and_loops_closed_for_any_target(name: str, way: str) -> None:
    machine, options = made(name), WAYS[way]
    targets = any_targets(machine, 4 if INTERPRETED else 8)
    answer = pf.passes.solve(machine, targets, options)
    assert np.isin(answer.status, (Status.REACHED, Status.PROJECTED)).all()
    assert gap_of_joints(machine, answer).max() <= 1e-9
    assert excess_of_joints(machine, answer).max() <= 1e-9
    reached = answer.status == Status.REACHED
    assert (answer.position_error[reached] <= (options.tolerance or 1e-9 * machine.characteristic_length)).all()


@pytest.mark.parametrize("name", ["stewart", "hexapod_rus", "planar_rrr"])
def test_a_path_keeps_its_working_mode_and_goes_on_from_answer_to_answer(name: str) -> None:
    """Out of the workspace and back: the coordinates of all joints end where they began."""
    machine = made(name)
    way = np.sin(np.linspace(0.0, np.pi, 9 if INTERPRETED else 21))
    targets = np.repeat(machine.home_pose[None], len(way), axis=0)
    targets[:, 0, 3] += 1.2 * way * machine.characteristic_length
    ways = (Options.paper(), Options.centroid(), Options.accelerated())
    for options in ways[:2] if INTERPRETED else ways:
        found = pf.passes.track(machine, targets, options)
        assert (found.status == Status.PROJECTED).any()
        np.testing.assert_allclose(found.actuators[-1], found.actuators[0], atol=0.02 * machine.characteristic_length)


@pytest.mark.skipif(INTERPRETED, reason="a hundred targets")
def test_arms_are_told_of_every_limit_of_their_struts_and_move_for_those_that_ask() -> None:
    """Of crossbars that do not know of their cones, or split the difference with content struts, 78 of 100 are."""
    mechanism, rng = pf.load("nrpm"), np.random.default_rng(5)
    targets = np.repeat(mechanism.home_pose[None], 150, axis=0)
    targets[:, :3, 3] += rng.uniform(-0.8, 0.8, (150, 3)) * mechanism.characteristic_length
    targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.26, 0.26, (150, 3))).as_matrix()
    targets = targets[pf.solve_ik(mechanism, targets).status == Status.REACHED]
    answers = pf.passes.solve(mechanism, targets)
    assert len(targets) >= 25
    assert np.mean(answers.status == Status.REACHED) >= 0.92
