"""What arguments of several questions are checked for."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.common.arguments import array, is_positive
from pfabrik.common.checks import put_limits, require_finite, require_names, require_path, require_positive
from pfabrik.errors import InvalidArgument, PfabrikError, UnknownName

NAMES = ("A1", "A2")


NUMBERS = [np.nan, -np.inf, True, "2", None, [2.0], 10**400]
REFUSED: list[tuple[Callable[[str, Any], Any], list[Any], str]] = [
    (require_finite, NUMBERS, "expected a finite number"),
    (require_positive, [*NUMBERS, 0, -1.0, np.True_, 2j], "expected a positive number"),
    (require_path, [None, 3, b"a", "\0", ["a"]], "expected the path of a file"),
    (require_names, [None, 3, "ab", b"ab", ["a", 3], np.array("ab"), np.eye(2)], "expected a list of names"),
]


@pytest.mark.parametrize(("require", "values", "expected"), REFUSED, ids=[expected for *_, expected in REFUSED])
def test_what_cannot_be_meant_is_refused_by_name(
    require: Callable[[str, Any], Any], values: list[Any], expected: str
) -> None:
    for value in values:
        with pytest.raises(InvalidArgument, match=rf"x: found .*; {expected}"):
            require("x", value)


def test_numbers_paths_and_names_of_any_type_are_taken() -> None:
    for value in (2, 2.0, np.float32(2), np.int64(2), Fraction(4, 2)):
        found = require_positive("rate", value)
        assert type(found) is float and found == 2.0
    assert require_finite("x", np.int8(-3)) == -3.0
    assert require_path("path", "a") == require_path("path", Path("a")) == Path("a")
    assert require_names("over", np.array(["a", "b"])) == require_names("over", iter("ab")) == ("a", "b")


@pytest.mark.parametrize(("shape", "fits", "others"), [
    ("... 3", [(3,), (2, 3), (0, 4, 3)], [(), (2,), (3, 2)]),
    ("n 3 | 3", [(3,), (5, 3)], [(), (2, 5, 3), (3, 5)]),
    ("() | 6", [(), (6,)], [(1,), (6, 1)]),
    ("2 n", [(2, 0), (2, 7)], [(3, 2), (2,)]),
    ("...", [(), (2, 3)], []),
])  # fmt: skip
def test_arrays_are_of_the_shape_that_is_asked_for(shape: str, fits: list[Any], others: list[Any]) -> None:
    for each in fits:
        assert array("x", np.ones(each, int), shape).shape == each
    for each in others:
        with pytest.raises(InvalidArgument) as caught:
            array("x", np.ones(each), shape, "lengths", " [mm]")
        assert caught.value.found == f"shape {each}" and caught.value.expected.startswith("lengths of shape (")
        assert caught.value.expected.endswith(" [mm]")


def test_values_that_may_not_be_are_told_by_their_rows() -> None:
    values = np.ones((2, 3, 4))
    values[0, 2, 1] = values[1, 1, 3] = np.nan
    with pytest.raises(InvalidArgument, match="a number that is not finite") as caught:
        array("x", values, "... 4")
    assert caught.value.rows == (2, 4)
    with pytest.raises(InvalidArgument, match=r"x: found \[1.0, 0.0\]; expected positive") as caught:
        array("x", [1, 0], "2", "positive numbers", holds=is_positive)
    assert caught.value.rows == ()


ARRAY = np.zeros((0, 3))

WRONG: dict[str, Callable[[pf.Mechanism], Any]] = {
    "path: found None": lambda machine: pf.save(machine, None),
    "path: found 3": lambda machine: pf.read_path(3, machine),
    "path: found 4": lambda machine: pf.export_c(machine, 4),
    "path: found 5": lambda machine: pf.interop.to_mjcf(machine, 5),
    "parts: found": lambda machine: pf.export_c(machine, "x.c", parts=ARRAY),
    "precision: found": lambda machine: pf.export_c(machine, "x.c", precision=ARRAY),
    "masses: found": lambda machine: pf.interop.to_mjcf(machine, masses="x"),
    "masses\\['platform'\\]": lambda machine: pf.interop.to_mjcf(machine, masses={"platform": None}),
    "poses: found": lambda machine: pf.interop.verify(machine, poses=None),
    "seed: found": lambda machine: pf.interop.verify(machine, seed=-1),
    "opened: found": lambda machine: pf.interop.assemble(None),
    "over: found": lambda machine: pf.workspace(machine, over=3),
    "within: found": lambda machine: pf.workspace(machine, within=3),
    "fixed\\['z'\\]: found": lambda machine: pf.workspace(machine, fixed={"z": 10**400}),
    "orientation: found": lambda machine: pf.workspace(machine, orientation=10**400),
    "start: found a ragged nest": lambda machine: pf.workspace(machine, start=[[1, 2], [3]]),
    "on_progress: found": lambda machine: pf.track(machine, ARRAY, on_progress=3),
    "no joint named '3'": lambda machine: pf.solve_ik(machine, {3: 4}),
    "limits: found": lambda machine: machine.with_limits(3),
    "no joint named": lambda machine: machine.joint([]),
    "task: found": lambda machine: pf.Mechanism("m", machine.joints, "platform", (0, 0, 1), task=[["x"]]),
    "joint: found": lambda machine: pf.Mechanism("m", np.array(None), "platform"),
    "joints: found": lambda machine: pf.Mechanism.from_legs("U-P*-S", joints=None),
    "leg\\[0\\].name: found": lambda machine: pf.Mechanism.from_legs(pf.Leg("U-P*-S", name=[])),
    "degrees: found": lambda machine: pf.pose([0, 0, 0], degrees=ARRAY),
    "names: found": lambda machine: pf.plot(machine, names=None),
    "ax: found": lambda machine: pf.plot(machine, 3),
    "figure: found": lambda machine: pf.plot_track(pf.track(machine, machine.home_pose[None]), 3),
    "track: found an empty path": lambda machine: pf.time_path(pf.track(machine, ARRAY), speed=1.0),
    r"joint 'BL1'\.range: found 280 to 150; expected the lowest": lambda machine: machine.with_limits(BL1=(280, 150)),
    r"over: found \['x', 'w'\]; expected a Workspace or a Track; over coordinates by": lambda machine: (
        pf.singularity_map(machine, ["x", "w"])
    ),
    r"over: found that of another mechanism of the same name, '6-UPS .*', with other joint BL1;": lambda machine: (
        pf.singularity_map(machine, pf.track(machine.with_limits(BL1=None), machine.home_pose[None]))
    ),
    r"start: found an answer of another mechanism of the same name, .*, with other joint BL1;": lambda machine: (
        pf.solve_ik(machine, ARRAY, start=pf.solve_ik(machine.with_limits(BL1=None), machine.home_pose))
    ),
    r"start: found an answer of another mechanism, 'Planar 5-bar';": lambda machine: pf.solve_ik(
        machine, ARRAY, start=pf.solve_ik(five_bar := pf.load("five_bar"), five_bar.home_pose)
    ),
    r"\.: found a directory or device; expected a model in XML": lambda machine: pf.interop.from_urdf("."),
    r"nothing\.xml: found no such file; expected a model in XML": lambda machine: pf.interop.kind_of("nothing.xml"),
    r"points: found a number that is not finite": lambda machine: pf.workspace(
        machine, over=["x", "y"], resolution=40.0
    ).contains([np.nan, 0.0]),
}


@pytest.mark.parametrize("said", WRONG)
def test_what_cannot_be_meant_is_told_by_the_argument_and_what_was_found(said: str) -> None:
    with pytest.raises(PfabrikError, match=said):
        WRONG[said](pf.load("stewart"))


def test_limits_that_are_not_named_stay_and_wrong_ones_are_named() -> None:
    limits = np.array([1.0, np.inf])
    put_limits(limits, "speed", None, NAMES)
    put_limits(limits, "speed", {"A2": 3}, NAMES)
    assert limits.tolist() == [1.0, 3.0]
    put_limits(limits, "speed", 4, NAMES)
    assert limits.tolist() == [4.0, 4.0]
    with pytest.raises(UnknownName, match="A3"):
        put_limits(np.zeros(2), "speed", {"A3": 1.0}, NAMES)
    with pytest.raises(InvalidArgument, match=r"speed\['A1'\]"):
        put_limits(np.zeros(2), "speed", {"A1": 0.0}, NAMES)
