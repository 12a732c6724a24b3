"""The exported C where a target is out of reach: the nearest feasible pose is the library's, and a loop goes on."""

from __future__ import annotations

import subprocess
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.errors import InvalidArgument, UnsupportedMechanism
from pfabrik.export.export_c import c_source
from pfabrik.export.self_test import targets_around_home
from pfabrik.model import model_of
from test_export_c import COMPILERS, compiled, flat, limit_units, machine, needs_compiler, slack_of

Array = np.ndarray
KEEP = pf.Options(working_mode="keep")
PROJECTED, BUDGET, NO_POSE = -4, -5, -1
FARTHER = {"double": 1e-8, "float": 1e-4}
"""How much farther from its target than the library's a nearest pose may be [L]."""

AT_A_LIMIT = {"double": 1e-6, "float": 1e-4}
"""Slack of a limit that a pose is said to be at [L or rad]: ten times what the file takes for it."""

DRIVER = """
#include EXPORTED
#include <stdio.h>
int main(void)
{
    double x[12], out[14];
    pfk_pose pose;
    pfk_real a[PFK_ACTUATORS] = {0};
    char holding[PFK_LIMITS + 1] = {0};
    pfk_home(&pose);
    while (fread(x, sizeof(double), 12, stdin) == 12) {
        pfk_pose target;
        int i, j;
        if (!WARM)
            pfk_home(&pose);
        for (i = 0; i < 3; ++i)
            for (target.p[i] = (pfk_real)x[i], j = 0; j < 3; ++j)
                target.R[i][j] = (pfk_real)x[3 + 3 * i + j];
        out[0] = pfk_ik_or_nearest(&target, &pose, a, STEPS, STARTS, holding);
        out[1] = pfk_what((int)out[0])[0];
        for (i = 0; i < 3; ++i)
            for (out[2 + i] = (double)pose.p[i], j = 0; j < 3; ++j)
                out[5 + 3 * i + j] = (double)pose.R[i][j];
        fwrite(out, sizeof(double), 14, stdout);
        for (i = 0; i < PFK_LIMITS; ++i) {
            out[0] = holding[i];
            fwrite(out, sizeof(double), 1, stdout);
        }
    }
    return 0;
}
"""
QUICK = [("stewart", "double"), ("delta", "float"), ("five_bar", "double")]
LONG = [("stewart", "float"), ("delta", "double"), ("five_bar", "float")]
LONG += [(name, precision) for name in ("orthoglide", "rps") for precision in ("double", "float")]
SLOW = [pytest.param(*each, marks=pytest.mark.campaign) for each in LONG]
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-DCHECKED")


class Said(NamedTuple):
    """What a file said, one row a target."""

    codes: Array
    poses: Array
    holding: Array


def said(
    name: str,
    targets: Array,
    folder: Path,
    precision: str = "double",
    *,
    steps: int = 200,
    starts: int = 99,
    warm: int = 0,
) -> Said:
    """What a machine's file answers to targets, each from home, or from the answer before; with all indices checked."""
    (folder / "driver.c").write_text(DRIVER)
    options = f"-DSTEPS={steps}", f"-DSTARTS={starts}", f"-DWARM={warm}", *SANITIZED
    text = c_source(machine(name), precision=precision)
    program = compiled(folder, text, COMPILERS[0], "-std=c99", *options, driver=folder / "driver.c")
    run = subprocess.run([str(program)], input=flat(targets).tobytes(), capture_output=True)
    assert run.returncode == 0, run.stderr.decode()[-2000:]
    told = np.frombuffer(run.stdout).reshape(len(targets), -1)
    poses = np.tile(np.eye(4), (len(targets), 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = told[:, 2:5], told[:, 5:14].reshape(-1, 3, 3)
    return Said(told[:, 0].astype(int), poses, told[:, 14:] > 0.0)


def home_of(name: str) -> Array:
    mechanism = machine(name)
    return np.concatenate([np.ravel(mechanism.home_coordinate(joint.name)) for joint in mechanism.joints])


@lru_cache
def known(name: str, n: int = 80) -> tuple[Array, pf.Solution]:
    """Targets around home, half of them mostly out of reach, and the library's answers from home in its mode."""
    mechanism, rng = machine(name), np.random.default_rng(3)
    targets = targets_around_home(mechanism, n, rng)
    targets[n // 2 :, :3, 3] += 0.6 * mechanism.characteristic_length * rng.uniform(-1.0, 1.0, (n - n // 2, 3))
    return targets, pf.solve_ik(mechanism, targets, start=home_of(name), options=KEEP)


@needs_compiler
@pytest.mark.parametrize(("name", "precision"), QUICK + SLOW)
def test_what_is_out_of_reach_is_answered_as_the_library_does(name: str, precision: str, tmp_path: Path) -> None:
    targets, found = known(name)
    mechanism, told = machine(name), said(name, targets, tmp_path, precision)
    status = np.where(told.codes == 0, 0, np.where(told.codes == PROJECTED, 1, told.codes))
    np.testing.assert_array_equal(status, found.status)
    away = status == 1
    assert away.sum() > 5 and (~away).sum() > 5
    position, length = np.linalg.norm((told.poses - targets)[:, :3, 3], axis=1), mechanism.characteristic_length
    farther = position - np.linalg.norm((np.asarray(found.pose) - targets)[:, :3, 3], axis=1)
    assert farther[away].max() <= FARTHER[precision] * length
    # the limits that the pose is at: measured on the coordinates of all joints
    back = pf.solve_ik(mechanism.without_limits(), told.poses[away], options=KEEP)
    slack = slack_of(mechanism, back.q, home_of(name))[back.status == 0]
    holding = told.holding[away][back.status == 0]
    assert (slack[holding] <= AT_A_LIMIT[precision]).all() and (slack[~holding] > 0.0).mean() > 0.99
    assert holding.any(axis=1).mean() > 0.5 or name == "five_bar"  # which is mostly held by its dead points
    assert len(limit_units(mechanism)) == holding.shape[1] == len(model_of(mechanism).legs.limits)


@needs_compiler
@pytest.mark.parametrize("name", ["stewart", "delta"])
def test_a_loop_that_leaves_the_workspace_goes_on_and_comes_back(name: str, tmp_path: Path) -> None:
    mechanism = machine(name)
    way = np.sin(np.linspace(0.0, np.pi, 200))
    targets = np.repeat(mechanism.home_pose[None], len(way), axis=0)
    targets[:, 0, 3] += 1.5 * mechanism.characteristic_length * way
    told = said(name, targets, tmp_path, starts=0, steps=40, warm=1)
    assert set(told.codes) == {0, PROJECTED}
    assert (told.codes[:3] == 0).all() and (told.codes[-3:] == 0).all() and told.codes[100] == PROJECTED
    margin = np.asarray(pf.feasibility(mechanism, told.poses).margin)
    assert margin.min() >= -1e-8
    steps = np.linalg.norm(np.diff(told.poses[:, :3, 3], axis=0), axis=1)
    assert steps.max() <= 2.0 * np.abs(np.diff(targets[:, 0, 3])).max()
    away = told.codes == PROJECTED
    best = pf.solve_ik(mechanism, targets[away], start=home_of(name), options=KEEP)
    distance, least = (
        np.linalg.norm((each - targets[away])[:, :3, 3], axis=1) for each in (told.poses[away], best.pose)
    )
    assert (distance <= least + 1e-6 * mechanism.characteristic_length).mean() > 0.9


@needs_compiler
def test_a_search_that_is_cut_short_says_so_and_ends_within_limits(tmp_path: Path) -> None:
    targets, found = known("stewart")
    told = said("stewart", targets, tmp_path, starts=0, steps=2)
    away = found.status == 1
    assert (told.codes[away] == BUDGET).mean() > 0.5
    assert np.asarray(pf.feasibility(machine("stewart"), told.poses[away]).margin).min() >= -1e-8


@needs_compiler
@pytest.mark.parametrize(("name", "precision"), [QUICK[0], QUICK[1], *SLOW[:2]])
def test_nothing_that_is_asked_breaks_it(name: str, precision: str, tmp_path: Path) -> None:
    """NaN, infinity, what is next to it and no rotations: a code, no pose written, or the nearest pose."""
    home, targets, are_poses = machine(name).home_pose, [], []
    for value in (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e30, 1e-308):
        for row, column in ((0, 3), (2, 3), (0, 0), (1, 2)):
            target = home.copy()
            target[row, column] = value
            targets.append(target)
            are_poses.append(np.isfinite(value) and (column == 3 or (abs(value) < 1.0 and row != column)))
    targets += [0.0 * home, -home, np.where(np.eye(4) > 0.0, 2.0, home)]
    are_poses += [False, False, False]
    hostile, is_pose = np.array(targets), np.array(are_poses)
    told = said(name, hostile, tmp_path, precision, steps=30, starts=2)
    assert np.isfinite(told.poses).all()
    assert set(told.codes[is_pose]) <= {0, PROJECTED, BUDGET, NO_POSE}  # a float has no 1e308
    assert (told.codes[~is_pose & (np.abs(hostile[:, :3, 3]) > 1e300).any(axis=1)] == NO_POSE).all()
    ignores_rotation = "rotation" not in machine(name).task
    assert ignores_rotation or (told.codes[~is_pose] == NO_POSE).all()


def test_nearest_is_of_ik_and_limits() -> None:
    with pytest.raises(InvalidArgument, match="'ik' and 'limits' too"):
        c_source(machine("stewart"), parts=("ik", "nearest"))
    text = c_source(machine("stewart"), parts=("ik", "limits"))
    assert "int pfk_nearest(" not in text and "PFK_STARTS" not in text


def test_machines_whose_links_other_searches_keep_apart_have_no_nearest() -> None:
    stewart = machine("stewart")
    cylinders = [body for body in stewart.bodies if "cylinder" in body]
    at = {body: next(joint.at for joint in stewart.joints if body in joint.connects and joint.at) for body in cylinders}
    shapes = [pf.Shape(body, ends=(at[body], np.add(at[body], (0.0, 0.0, 9.0))), thickness=4.0) for body in cylinders]
    kept = stewart.with_shapes(shapes).with_clearance(5.0)
    assert "int pfk_nearest(" not in c_source(kept)
    with pytest.raises(UnsupportedMechanism, match="leave 'nearest' out"):
        c_source(kept, parts=("ik", "limits", "nearest"))
