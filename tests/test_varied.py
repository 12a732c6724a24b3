"""Machines at other values of their dimensions, against machines that are made anew, and slopes against differences."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.arrays import Floats
from pfabrik.kinematics import VariedMachine, varied
from pfabrik.rotations import from_rotvec

TEMPLATES = sorted((Path(pf.__file__).parent / "catalog" / "templates").glob("*.toml"))


@cache
def template(name: str) -> pf.Mechanism:
    return pf.load(next(path for path in TEMPLATES if path.stem == name))


@cache
def all_varied(name: str) -> VariedMachine:
    return varied(template(name))


def drawn(name: str, seed: int, spread: float = 0.05) -> tuple[Floats, pf.Mechanism]:
    """Values of all dimensions at random, near those of the template, and the machine that has them."""
    machine, rng = template(name), np.random.default_rng(seed)
    own = np.array([machine.dimensions[each] for each in all_varied(name).names])
    values = own * rng.uniform(1.0 - spread, 1.0 + spread, len(own))
    return values, machine.with_dimensions(dict(zip(all_varied(name).names, values.tolist(), strict=True)))


def poses_near_home(machine: pf.Mechanism, seed: int, n: int = 60, reach: float = 0.5) -> Floats:
    """Poses in all directions of the task and others, some within all limits and some out of reach."""
    rng, size = np.random.default_rng(seed), machine.characteristic_length
    poses = np.tile(machine.home_pose, (n, 1, 1))
    shares = reach * rng.uniform(0.0, 1.0, (n, 1))
    is_planar = len({joint.at[2] for joint in machine.joints if joint.at is not None}) == 1
    axes, turns = ((1.0, 1.0, 0.0), (0.0, 0.0, 1.0)) if is_planar else ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    poses[:, :3, 3] += size * shares * rng.standard_normal((n, 3)) * axes
    poses[:, :3, :3] = from_rotvec(shares * rng.standard_normal((n, 3)) * turns)
    return poses


@pytest.mark.parametrize("name", [path.stem for path in TEMPLATES])
def test_least_margins_are_those_of_the_machine_made_anew(name: str) -> None:
    """The oracle is the file read with these values, and its legs decomposed and measured by `feasibility`."""
    counts = np.zeros(2, int)
    for seed in range(4):
        values, machine = drawn(name, seed)
        poses, at = poses_near_home(machine, seed), all_varied(name).at(values)
        margins, found = at.margins(poses), pf.feasibility(machine, poses)
        np.testing.assert_allclose(margins.min(axis=1), found.margin, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(at.home_pose, machine.home_pose, atol=1e-9 * machine.characteristic_length)
        named = [all_varied(name).limits[k] for k in margins.argmin(axis=1)]
        alone = np.diff(np.sort(margins, axis=1)[:, :2], axis=1)[:, 0] > 1e-6
        assert all(named[row] == found.limits[found.binding[row]] for row in np.flatnonzero(alone))
        counts += np.count_nonzero(found.margin > 0.0), np.count_nonzero(found.margin < 0.0)
    assert counts.min() > 5
