"""Maps over coordinates that the end effector cannot change by themselves are refused by name; all others have a size.

The oracle knows forward kinematics alone: actuators that lead to a pose are searched for by Gauss and Newton's steps.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import pfabrik as pf
from command import pfabrik, told, write_files
from machines import machine
from machines.small import slides
from pfabrik.errors import InvalidArgument

Array = NDArray[np.float64]

NAMES = ("x", "y", "z", "tilt_x", "tilt_y", "yaw")
STEP, MET, SLOPE = 0.01, 1e-8, 1e-4
"""Displacement of a coordinate, and the largest error of a pose that leads there [L or rad]; that of an actuator."""


def asked_for_all(name: str, point: Sequence[float] | None = None) -> pf.Mechanism:
    """A machine of the catalogue without the task of its file, so that it asks for position and orientation."""
    listed = machine(name)
    at = listed.reference_point if point is None else point
    return pf.Mechanism(name, list(listed.joints), listed.end_effector, at, base=listed.base)


def off_centre() -> pf.Mechanism:
    """A machine whose end effector turns about a centre, at another point of it."""
    return asked_for_all("agile_eye", (0.0, 0.0, 30.0))


# The oracle


def displaced(home: Array, coordinates: dict[str, float]) -> Array:
    """The pose home, with coordinates displaced, as `workspace` defines them."""
    pose, value = home.copy(), dict.fromkeys(NAMES, 0.0) | coordinates
    pose[:3, 3] += [value["x"], value["y"], value["z"]]
    tilt = Rotation.from_rotvec([value["tilt_x"], value["tilt_y"], 0.0]).as_matrix()
    pose[:3, :3] = tilt @ Rotation.from_rotvec([0.0, 0.0, value["yaw"]]).as_matrix() @ home[:3, :3]
    return pose


def missed(mechanism: pf.Mechanism, target: Array) -> float:
    """How far the end effector stays from what the task has of a pose, whatever its actuators do [L or rad]."""
    axes = ["xyz".index(name) for name in mechanism.task if name in "xyz"]

    def errors(actuators: Array) -> Array:
        poses = pf.solve_fk(mechanism, np.atleast_2d(actuators)).pose
        turns = Rotation.from_matrix(target[:3, :3] @ poses[:, :3, :3].swapaxes(1, 2)).as_rotvec()
        if "tilt" in mechanism.task:
            turns = target[:3, 2] - poses[:, :3, 2]
        elif "rotation" not in mechanism.task:
            turns = turns[:, 2:] if "yaw" in mechanism.task else turns[:, :0]
        aside = (target[axes, 3] - poses[:, axes, 3]) / mechanism.characteristic_length
        return np.concatenate([aside, turns], axis=1)

    def slopes(actuators: Array) -> Array:
        """By central differences: steps far above the tolerance of poses."""
        steps = SLOPE * np.eye(len(actuators))
        up, down = np.split(errors(np.concatenate([actuators + steps, actuators - steps])), 2)
        return np.asarray((up - down).T / (2.0 * SLOPE))

    actuators = np.asarray(pf.solve_ik(mechanism, mechanism.home_pose).actuators)
    for _ in range(10):
        actuators = actuators - np.linalg.pinv(slopes(actuators), 1e-9) @ errors(actuators)[0]
    return float(np.abs(errors(actuators)).max())


def is_set(mechanism: pf.Mechanism, name: str) -> bool:
    """True if a coordinate is of the task."""
    return not {name, "rotation" * (name not in "xyz"), "tilt" * ("tilt" in name)}.isdisjoint(mechanism.task)


def changes(mechanism: pf.Mechanism, names: Sequence[str]) -> bool:
    """True if coordinates change together, up or down, while all others of the task are held."""
    endless, units = mechanism.without_limits(), [mechanism.characteristic_length] * 3 + [1.0] * 3
    unit = dict(zip(NAMES, units, strict=True))
    for signs in itertools.product((1.0, -1.0), repeat=len(names)):
        steps = {
            name: sign * (STEP + 0.002 * k) * unit[name]
            for k, (name, sign) in enumerate(zip(names, signs, strict=True))
        }
        if missed(endless, displaced(mechanism.home_pose, steps)) < MET:
            return True
    return False


def checked(mechanism: pf.Mechanism, over: tuple[str, ...]) -> bool:
    """True if a map has a size, which is positive and finite and the oracle has it; False if it is refused by name."""
    step = 0.2 * (1.0 if set(over) <= set(NAMES[3:]) else mechanism.characteristic_length)
    try:
        size = pf.workspace(mechanism, over=over, resolution=step).size
    except InvalidArgument as error:
        if not all(is_set(mechanism, name) for name in over):
            return False
        assert not changes(mechanism, over), (mechanism.name, over, str(error))
        assert error.argument == "over"
        named = [name for name in over if re.search(rf"\b{name}\b", error.found)]
        assert named, str(error)
        if " by no more" in error.found:
            stuck = error.found.partition(", which change")[0]
            assert not any(changes(mechanism, [name]) for name in over if re.search(rf"\b{name} \(", stuck)), str(error)
        return False
    assert 0.0 < size < math.inf
    assert changes(mechanism, over), (mechanism.name, over, size)
    return True


PAIRS = [*itertools.combinations(NAMES, 2)]


@pytest.mark.parametrize("name", ["rps", "prs", "tricept", "canfield", "ankle_ups", "delta", "psu", "reachy_mini"])
def test_a_map_has_a_size_where_its_coordinates_change_together(name: str) -> None:
    """Of a machine that is asked for the whole pose: what follows from other coordinates is parasitic then."""
    mechanism = asked_for_all(name)
    chosen = np.random.default_rng(len(name)).permutation(len(PAIRS))[:3]
    for over in [("tilt_x", "tilt_y"), *(PAIRS[k] for k in chosen)]:
        checked(mechanism, over)


@pytest.mark.campaign
@pytest.mark.parametrize("asks_all", [False, True])
@pytest.mark.parametrize("name", pf.catalog())
def test_every_map_of_every_machine_has_a_size_or_is_refused_by_name(name: str, asks_all: bool) -> None:
    mechanism = asked_for_all(name) if asks_all else machine(name)
    if asks_all and mechanism.task == machine(name).task:
        return  # the same map again
    for over in (*PAIRS, *itertools.combinations(NAMES, 3)):
        checked(mechanism, over)


def test_what_turns_about_a_centre_moves_no_other_point_by_itself() -> None:
    """Of the point off the centre, positions follow from tilts and tilts from positions; yaw is about it."""
    for over in (("x", "y"), ("tilt_x", "tilt_y"), ("tilt_x", "yaw")):
        with pytest.raises(InvalidArgument, match=r"two or three .*: yaw alone does; .* fits is rotation"):
            pf.workspace(off_centre(), over=over, resolution=0.2 if "tilt_x" in over else 8.0)


@pytest.mark.parametrize(
    ("axes", "over", "words"),
    [
        (
            ((1, 1, 0), (0, 0, 1)),
            ("x", "y"),
            r"x \(0 mm\), y \(0 mm\), which change by no more while z is held; .*: z alone",
        ),
        (((2, 1, 0), (0, 0, 1)), ("x", "z"), r"x \(0 mm\), which changes by no more while y, z are held; .*: z alone"),
        (
            ((1, 1, 1), (1, -1, 0)),
            ("x", "y"),
            r"x \(0 mm\), y \(0 mm\), which change .* while z is held; .*: none does",
        ),
    ],
)
def test_coordinates_that_change_together_alone_are_named(
    axes: tuple[tuple[int, ...], ...], over: tuple[str, ...], words: str
) -> None:
    with pytest.raises(InvalidArgument, match=words):
        pf.workspace(slides(*[(-0.3, 0.7)] * len(axes), axes=axes), over=over, resolution=0.2)


def test_a_cross_of_two_lines_has_no_size() -> None:
    """The angles of a universal joint make a tilt about one axis each, and a tilt about both with a twist."""
    with pytest.raises(
        InvalidArgument, match="tilt_x, tilt_y, which change one at a time, never together, while x, y, z, yaw"
    ):
        pf.workspace(asked_for_all("ankle_ups"), over=("tilt_x", "tilt_y"))


def test_what_the_tolerance_of_poses_leaves_is_no_size() -> None:
    """A tripod's point moves aside with the square of its tilt, of which the tolerance leaves the root."""
    with pytest.raises(InvalidArgument, match=r"tilt_x \(0\.00\d+ deg\), tilt_y .* by no more"):
        pf.workspace(asked_for_all("rps"), over=("tilt_x", "tilt_y"))


@pytest.mark.parametrize("travel", [1.0, 1e-4, 1e-6])
def test_a_map_may_be_as_small_as_its_ranges(travel: float) -> None:
    """Far below the cells, and what the tolerance of poses leaves across a parasitic motion."""
    stage = slides(*[(-0.3 * travel, 0.7 * travel)] * 2, point=(0, 0, 0))
    assert pf.workspace(dataclasses.replace(stage, task=("x", "y"))).size == pytest.approx(travel**2, rel=1e-3)


def test_proofs_and_shapes_that_fit_are_refused_alike() -> None:
    mechanism = asked_for_all("rps")
    for options in ({"certified": True}, {"over": ("x", "tilt_y")}, {"orientation": mechanism.home_pose[:3, :3]}):
        with pytest.raises(InvalidArgument, match="a task that fits is z tilt"):
            pf.workspace(mechanism, **options)
    with pytest.raises(InvalidArgument, match="a task that fits is z tilt"):
        pf.largest(mechanism, "box")


@pytest.mark.usefixtures("folder")
def test_the_command_says_in_one_line_what_does_not_change() -> None:
    write_files("untasked.toml")
    for line in (
        "workspace",
        "workspace --over tilt_x,tilt_y",
        "workspace --largest box",
        "singularities --over x,yaw",
    ):
        command, _, options = line.partition(" ")
        done = pfabrik(f"{command} untasked.toml {options}")
        assert done.exit_code == 2
        (line,) = told(done)
        assert "which change by no more" in line and "a task that fits is z tilt" in line
    nothing = pfabrik("workspace untasked.toml --over x,y --fix yaw=3")
    assert (nothing.exit_code, nothing.stdout.count("a task that fits is z tilt")) == (1, 1)
    assert not [*Path().glob("*.png")]
