"""Machines whose files have few digits: what was meant exactly is made exact, is told, and moves as MuJoCo moves the
exact machine; what is off by more than rounding is left alone. And what a referee says of machines that hardly move."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from in_mujoco import Model, notes_of
from oracles import any_values
from pfabrik.errors import UnknownName
from pfabrik.exchange.interop import Imported, from_mjcf, from_urdf, to_mjcf, verify
from pfabrik.exchange.interop.digits import digits_of
from rounded_files import (
    LINKAGES,
    Linkage,
    delta_description,
    delta_position,
    model_text,
    planar_four_bar,
    spherical_three_legs,
)

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

MAGNIFIED = 60.0
"""How many units of the last digit poses may be off: loops add up the roundings of all their joints."""


def imported(linkage: Linkage, text: str, **asked: str) -> Imported:
    return from_mjcf(text, base="world", end_effector=linkage.end_effector, **asked)


def answers_as_mujoco_does(found: Imported, linkage: Linkage, tolerance: float, scale: float = 1.0) -> None:
    """Forward kinematics at drives far from home against MuJoCo's, of the same linkage in seventeen digits."""
    model = Model.of(model_text(linkage, scale=scale))
    model.lead(linkage.drives, np.zeros(len(linkage.drives)))
    begin = model.pose(linkage.end_effector)
    values = np.random.default_rng(1).uniform(-0.3, 0.3, (5, len(linkage.drives)))
    solutions = pf.solve_fk(found.mechanism, values)
    for value, solution in zip(values, solutions, strict=True):
        assert solution, solution
        assert solution.residual <= 1e-9
        assert model.lead(linkage.drives, value) <= 1e-12 * scale
        position, turned = model.pose(linkage.end_effector)
        assert np.linalg.norm(solution.pose[:3, 3] - position) <= tolerance * scale
        assert np.abs(solution.pose[:3, :3] - turned @ begin[1].T).max() <= 10.0 * tolerance


WRITTEN = [
    *((name, digits, "quat", 1.0) for name in LINKAGES for digits in (7, 4)),
    ("spherical", 6, "euler", 1.0),
    ("mixture", 6, "xyaxes", 1.0),
    ("spherical", 6, "quat", 1e3),
    ("planar", 3, "quat", 1.0),
    ("third rod", 5, "euler", 1.0),
    ("third rod", 4, "xyaxes", 1.0),
]
"""Linkages, the digits of their files, how bodies are turned there, and the unit of length over a metre."""


@pytest.mark.parametrize(("name", "digits", "turned", "scale"), WRITTEN)
def test_what_rounding_locks_moves_as_the_exact_machine_does(name: str, digits: int, turned: str, scale: float) -> None:
    linkage = LINKAGES[name]()
    found = imported(linkage, model_text(linkage, digits, turned, scale))
    counted = pf.mobility(found.mechanism)
    assert counted.mobility == linkage.freedoms
    assert not counted.nearly_free
    answers_as_mujoco_does(found, linkage, MAGNIFIED * 10.0**-digits, scale)


def test_what_was_made_exact_is_named_with_how_much_and_is_exact() -> None:
    linkage = spherical_three_legs()
    found = imported(linkage, model_text(linkage, 7))
    (note,) = (note for note in found.notes if "made to meet in one point" in note.what)
    assert len(note.names) == len(linkage.hinges)
    assert 1e-9 < float(note.what.split("up to ")[1].split()[0]) < 1e-6
    points, axes = (np.array([getattr(joint, key) for joint in found.mechanism.joints]) for key in ("at", "axis"))
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    centre = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, points))
    assert np.abs(np.cross(axes, points - centre)).max() <= 1e-15  # they meet to the last bit
    for name, digits, said in (
        ("planar", 7, "axes made parallel within the digits of the file, turned by up to"),
        ("bennett", 6, "made the nearest machine that moves"),
    ):
        assert said in notes_of(imported(LINKAGES[name](), model_text(LINKAGES[name](), digits)))


@pytest.mark.parametrize("by", [1e-3, 1e-4])
def test_an_axis_that_is_off_by_more_than_rounding_is_left_where_it_is(by: float) -> None:
    """A thousandth of a metre beside the point where the others meet, in a file of seven digits: not meant to meet."""
    linkage = spherical_three_legs()
    beside = by * np.cross(linkage.hinges[1].axis, [0.0, 0.0, 1.0])
    linkage.hinges[1] = linkage.hinges[1]._replace(at=linkage.hinges[1].at + beside)
    found = imported(linkage, model_text(linkage, 7))
    joint = found.mechanism.joint("p0")
    at, axis = np.array(joint.at), np.array(joint.axis)
    assert np.linalg.norm(np.cross(axis, at - linkage.hinges[1].at)) <= 1e-6
    assert "made the nearest machine" not in notes_of(found)
    assert not any("p0" in note.names for note in found.notes if "meet in one point" in note.what)


def test_parallel_hinges_that_are_tilted_by_more_than_rounding_stay_tilted() -> None:
    linkage = planar_four_bar()
    first, second = linkage.hinges[1].axis, np.array([0.3, 0.2, -0.9])
    tilted = first + 1e-3 * np.cross(first, second)
    linkage.hinges[1] = linkage.hinges[1]._replace(axis=tilted / np.linalg.norm(tilted))
    found = imported(linkage, model_text(linkage, 7))
    axes = np.array([joint.axis for joint in found.mechanism.joints])
    assert np.isclose(
        np.linalg.norm(np.cross(axes, axes[0]), axis=1).max(), np.linalg.norm(np.cross(tilted, first)), rtol=1e-2
    )


@pytest.mark.parametrize("name", ["agile_eye", "five_bar", "delta", "canfield"])
def test_machines_of_the_catalogue_in_six_digits_answer_as_they_are(name: str, tmp_path: Path) -> None:
    mechanism = pf.load(name)
    words = to_mjcf(mechanism).split('"')
    for place in range(1, len(words), 2):
        if words[place - 1].endswith((" pos=", " axis=")):
            words[place] = " ".join(f"{float(number):.6g}" for number in words[place].split())
    found = from_mjcf('"'.join(words), length_unit=mechanism.length_unit).mechanism
    assert pf.mobility(found).mobility == pf.mobility(mechanism).mobility
    assert not pf.mobility(found).nearly_free
    length, names = mechanism.characteristic_length, mechanism.actuator_names
    values = dict(zip(names, any_values(mechanism, 6, 0.3).T, strict=True))
    one, other = pf.solve_fk(mechanism, values), pf.solve_fk(found, values)
    reached = np.asarray(one.status) == 0
    assert (np.asarray(other.status)[reached] == 0).all()
    assert np.linalg.norm((one.pose - other.pose)[reached][:, :3, 3], axis=1).max(initial=0.0) <= 1e-4 * length


@pytest.mark.parametrize(
    ("texts", "value", "error"),
    [
        (["0.0206569 0.0357787", "0.21213 -0.0999988"], 0.123456, 0.5e-6),  # six significant digits
        (["0.0206569 0.0357787", "0.21213 -0.0999988"], 0.0, 0.0),
        (["0.020657 0.135779", "1.212130 -0.099999", "10.123457"], 1.5, 0.5e-6),  # six decimals
        (["0.7071 0.7071", "0.866 0.5"], 0.7071, 0.5e-4),
        (["0 0 1", "0.5 0 0"], 0.5, 0.0),  # as good as exact
    ],
)
def test_the_last_digit_of_a_file_is_found(texts: list[str], value: float, error: float) -> None:
    assert digits_of(texts).error([value]) == pytest.approx(error, abs=1e-16)
    quarter = digits_of(["0.123456789012345 1.1234567890123456", "1.5708"])  # rounded wherever it stands
    assert quarter.error([1.5708], 3) == pytest.approx(0.5e-4)


@pytest.mark.parametrize("decimals", [3, 4, 5, 6, 7, 9, 10, 12, 16])
def test_a_machine_with_more_rods_than_it_needs_moves_whatever_the_digits_of_its_file(decimals: int) -> None:
    """Pairs of rods are parallelograms only if the digits let them be; the closed form knows nothing of pairs."""
    text, loops = delta_description(decimals)
    found = from_urdf(text, loops, end_effector="platform")
    assert pf.mobility(found.mechanism).mobility == 3
    assert "move nothing" not in notes_of(found) and "moves anything" not in notes_of(found)
    for angles in np.radians([[30.0, 45.0, 60.0], [10.0, 0.0, 0.0], [70.0, 20.0, 50.0]]):
        answer = pf.solve_fk(found.mechanism, angles)
        assert answer, answer
        assert np.abs(answer.pose[:3, 3] - delta_position(angles)).max() <= 10.0 * 10.0**-decimals + 1e-12


def test_an_import_says_where_no_drive_moves_anything() -> None:
    """A linkage of four skew hinges moves for its proportions alone, of which three digits leave nothing."""
    linkage = LINKAGES["bennett"]()
    said = notes_of(imported(linkage, model_text(linkage, 3)))
    assert (
        "no drive moves anything: forward kinematics does not follow 10 deg, or a tenth of a range, from home: h0"
        in said
    )
    for digits in (5, 17):
        assert "no drive moves" not in notes_of(imported(linkage, model_text(linkage, digits)))


def spoiled(by: float) -> pf.Mechanism:
    """A four-bar with one axis that leans by an angle."""
    linkage = planar_four_bar()
    lean = linkage.hinges[1].axis + by * np.cross(linkage.hinges[1].axis, [0.3, 0.2, -0.9])
    axes = [lean if place == 1 else hinge.axis for place, hinge in enumerate(linkage.hinges)]
    joints = [
        pf.Joint(each.name, "revolute", (each.parent, each.child), each.at, axis=axis, actuated=each.name == "h0")
        for each, axis in zip(linkage.hinges, axes, strict=True)
    ]
    return pf.Mechanism("spoiled", joints, "coupler", (0.0, 0.0, 0.0), "world", length_unit="m")


def test_nearly_free_motions_are_named_with_how_hard_the_loops_resist(tmp_path: Path) -> None:
    """To first order the resistance grows as the angle by which an axis leans; of exact axes there is none."""
    small, twice, exact = (pf.mobility(spoiled(by)).nearly_free for by in (1e-5, 2e-5, 0.0))
    assert exact == ()
    assert len(small) == len(twice) == 1
    assert twice[0].singular_value == pytest.approx(2.0 * small[0].singular_value, rel=1e-2)
    assert 1e-7 < small[0].singular_value < 1e-5
    assert set(small[0].joints) == {"h0", "h1", "h2", "h3"}
    assert pf.mobility(spoiled(1e-5)).mobility == 0
    path = tmp_path / "machine.toml"
    pf.save(spoiled(1e-5), path)
    shown = pfabrik(["info", str(path)]).output
    assert "nearly free" in shown and "not counted as a motion" in shown
    value = json.loads(pfabrik(["info", str(path), "--json"]).output)["mobility"]["nearly_free"][0]
    assert value["singular_value"] == pf.mobility(pf.load(path)).nearly_free[0].singular_value
    assert "the loops hardly resist a motion of" in pfabrik(["check", str(path)]).output


def test_the_referee_says_how_far_it_went_and_fails_where_that_is_too_near(tmp_path: Path) -> None:
    mechanism = pf.load("five_bar")
    found = verify(mechanism, poses=6)
    assert found
    assert found.goes_far
    assert set(found.travelled.drives) == set(mechanism.actuator_names)
    assert found.travelled.position <= 0.2 * np.sqrt(2.0) * mechanism.characteristic_length * (1.0 + 1e-9)
    homes = {name: mechanism.home_coordinate(name) for name in ("p2", "p4")}
    near = mechanism.with_limits({name: (at - 0.03, at + 0.03) for name, at in homes.items()})
    held = verify(near, poses=6)
    assert held.agrees
    assert not held.goes_far
    assert not held
    path = tmp_path / "near.toml"
    pf.save(near, path)
    run = pfabrik(["verify", str(path), "--poses", "6"])
    assert run.exit_code == 1
    assert "too near to home to say anything" in run.output


def test_the_original_file_is_the_referee_too(tmp_path: Path) -> None:
    linkage = spherical_three_legs()
    original, machine = tmp_path / "robot.xml", tmp_path / "machine.toml"
    original.write_text(model_text(linkage, 7))
    pf.save(dataclasses.replace(imported(linkage, str(original)).mechanism, task=("rotation",)), machine)
    ask = ["verify", str(machine), "--poses", "8", "--original", str(original)]
    run = pfabrik(ask)
    assert run.exit_code == 0, run.output
    assert "original file                agrees" in run.output
    against = json.loads(pfabrik([*ask, "--json"]).output)["original"]
    assert 1e-12 < against["rotation_difference"] < 1e-4
    longer = spherical_three_legs()
    turned = np.cross(longer.hinges[1].axis, [0.0, 0.0, 1.0])
    longer.hinges[1] = longer.hinges[1]._replace(axis=longer.hinges[1].axis + 1e-2 * turned)
    original.write_text(model_text(longer, 7))
    other = pfabrik(ask)
    assert other.exit_code == 1
    assert "original file                does not agree" in other.output
    original.write_text(model_text(linkage, 7).replace('"m1"', '"motor"'))
    with pytest.raises(UnknownName, match="m1"):
        verify(pf.load(machine), poses=1, original=original)


@pytest.mark.parametrize(("digits", "by"), [(17, 1e-5), (7, 1e-4), (5, 1e-2)])
def test_a_joint_out_of_place_by_more_than_import_moves_it_is_no_agreement(
    digits: int, by: float, tmp_path: Path
) -> None:
    """What the machine is off grows with what its joint is off; what import changes explains none of it."""
    linkage, original = planar_four_bar(), tmp_path / "robot.xml"
    original.write_text(model_text(linkage, digits))
    right = imported(linkage, str(original), task=["x"]).mechanism
    assert verify(right, poses=5, original=original)
    shift = by * right.characteristic_length * linkage.hinges[0].axis[[1, 2, 0]]
    moved = [dataclasses.replace(each, at=each.at + shift) if each.name == "h1" else each for each in right.joints]
    against = verify(dataclasses.replace(right, joints=moved), poses=5, original=original).original
    assert against is not None and not against
    assert against.position_difference > against.position_tolerance


def test_a_machine_typed_to_six_digits_says_by_how_much_it_differs(tmp_path: Path) -> None:
    linkage, original = planar_four_bar(), tmp_path / "robot.xml"
    original.write_text(model_text(linkage))
    exact = imported(linkage, str(original), task=["x"]).mechanism
    typed = [dataclasses.replace(each, at=np.round(each.at, 6)) for each in exact.joints]
    against = verify(dataclasses.replace(exact, joints=typed), poses=5, original=original).original
    assert against is not None
    assert 1e-8 < against.position_difference < 1e-5 and against.position_tolerance < 1e-8
