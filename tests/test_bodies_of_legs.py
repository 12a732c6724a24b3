"""Bodies of legs: what a leg, or a table of all its bodies, says of them is what tables of single bodies say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.errors import InvalidMechanism
from pfabrik.machine.catalog import catalog_file
from pfabrik.machine.description.body_inertias import inertias_of
from pfabrik.machine.files import dumps, loads

HEAD = """schema = 1
name = "hexapod"
end_effector = "platform"
reference_point = [0, 0, 125]
"""
PLATFORM = '[[body]]\nname = "platform"\nmass = 1.5\ncentre = [0, 0, 130]\ninertia = [900, 900, 1700]\n'
CRANKS = """
[[leg]]
chain = "R*-U-S"
base = [[95, 35, 0], [95, -35, 0]]
via = [[95, 65, 0], [95, -65, 0]]
platform = [[55, 45, 125], [55, -45, 125]]
copies = { count = 3, axis = [0, 0, 1] }
A.axis = ["x", "-x"]
"""
STRUTS = """
[[leg]]
chain = "U-P*-S"
base = [[100, 20, 0], [100, -20, 0]]
platform = [[40, 40, 125], [40, -40, 125]]
copies = { count = 3, axis = [0, 0, 1] }
"""
RAILS = """
[[leg]]
chain = "P*-U-S"
axis = "vertical"
base = [[100, 20, 0], [100, -20, 0]]
platform = [[40, 40, 125], [40, -40, 125]]
copies = { count = 3, axis = [0, 0, 1] }
"""


def written_out(**of_bodies: tuple[str, str]) -> str:
    """A table for each of six bodies; A and B are the joints that its shape is between."""
    return "".join(
        f'[[body]]\nname = "{family}{k}"\nbetween = ["{ends[0]}{k}", "{ends[1]}{k}"]\n{text}\n'
        for family, (ends, text) in of_bodies.items()
        for k in range(1, 7)
    )


CASES = {
    "a density": (
        CRANKS + "AB = { thickness = 10, density = 2700 }\nBC = { thickness = 6, density = 1600 }\n",
        CRANKS + written_out(AB=("AB", "thickness = 10\ndensity = 2700"), BC=("BC", "thickness = 6\ndensity = 1600")),
    ),
    "a mass": (
        CRANKS + "AB = { thickness = 10, mass = 0.2 }\nBC = { thickness = 6, mass = 0 }\n",
        CRANKS + written_out(AB=("AB", "thickness = 10\nmass = 0.2"), BC=("BC", "thickness = 6\nmass = 0")),
    ),
    "the thickness of the leg": (
        CRANKS + "thickness = 8\nAB = { density = 2700 }\nBC = { mass = 0.1 }\n",
        CRANKS + written_out(AB=("AB", "thickness = 8\ndensity = 2700"), BC=("BC", "thickness = 8\nmass = 0.1")),
    ),
    "the family, with the thickness of the leg": (
        CRANKS + 'thickness = 8\n[[body]]\nname = "AB"\ndensity = 2700\n[[body]]\nname = "BC"\nmass = 0.1\n',
        CRANKS + written_out(AB=("AB", "thickness = 8\ndensity = 2700"), BC=("BC", "thickness = 8\nmass = 0.1")),
    ),
    "the family": (
        CRANKS
        + '[[body]]\nname = "AB"\nthickness = 7\ndensity = 2700\n'
        + '[[body]]\nname = "BC"\nthickness = 5\nmass = 0.1\n',
        CRANKS + written_out(AB=("AB", "thickness = 7\ndensity = 2700"), BC=("BC", "thickness = 5\nmass = 0.1")),
    ),
    "both parts of struts": (
        STRUTS + "thickness = 9\nAB = { thickness = 20, mass = 1.2 }\nBC = { density = 7800 }\n",
        STRUTS + written_out(AB=("AC", "thickness = 20\nmass = 1.2"), BC=("AC", "thickness = 9\ndensity = 7800")),
    ),
    "struts by their family": (
        STRUTS + 'thickness = 9\nAB.mass = 1\n[[body]]\nname = "BC"\nbetween = ["A", "C"]\nthickness = 5\nmass = 0.5\n',
        STRUTS + written_out(AB=("AC", "thickness = 9\nmass = 1"), BC=("AC", "thickness = 5\nmass = 0.5")),
    ),
    "carriages": (
        RAILS + "BC = { thickness = 9, mass = 0.4 }\nAB = { mass = 2, centre = [[105, 20, -3], [105, -20, -3]] }\n",
        RAILS
        + written_out(BC=("BC", "thickness = 9\nmass = 0.4"))
        + "".join(
            f'[[body]]\nname = "AB{2 * turn + leg}"\nmass = 2\ncentre = [{x}, {y}, -3]\n'
            for turn in range(3)
            for leg, side in ((1, 20), (2, -20))
            for x, y in [(
                105 * math.cos(turn * math.tau / 3) - side * math.sin(turn * math.tau / 3),
                105 * math.sin(turn * math.tau / 3) + side * math.cos(turn * math.tau / 3),
            )]
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_legs_and_families_weigh_what_single_bodies_written_out_weigh(case: str) -> None:
    short, long = (loads(HEAD + text + PLATFORM) for text in CASES[case])
    assert loads(dumps(short)) == short
    assert short.without_limits().joints == long.without_limits().joints
    for place in np.linspace(0.0, 1.0, 5):
        target = pf.pose([0, 0, 125 + 4 * place], rpy=[0.02 * place, 0, 0.03 * place])
        twist, acceleration = [300, -200, 100, 2, 1, -3 * place], [-4000, 900, 100 * place, 20, 1, 30]
        found, expected = (
            pf.inverse_dynamics(pf.solve_ik(each, target), twists=twist, accelerations=acceleration).actuators
            for each in (short, long)
        )
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("count", [2, 3, 5, 6])
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_what_has_a_place_is_turned_with_legs_that_are_turned_copies(count: int) -> None:
    leg = """
[[leg]]
chain = "R*-S-S"
base = [90, 0, 0]
via = [90, 40, 3]
platform = [50, 0, 120]
A.axis = "radial"
"""
    ball = '[[body]]\nname = "BC"\nshape = "sphere"\nat = [3, -20, 7]\ndiameter = 5\ndensity = 2700\n'
    mass = '[[body]]\nname = "AB"\nmass = 2\ncentre = [40, 7, -9]\ninertia = [10, 14, 11, 2, -3, 1]\n'
    copies = f"copies = {{ count = {count}, axis = [0, 0, 1] }}\n"
    found = inertias_of(loads(HEAD + leg + copies + ball + mass), 0.001)
    for k in range(count):
        turn = pf.pose([0, 0, 0], rpy=[0, 0, math.tau * k / count])[:3, :3]
        for family in ("AB", "BC"):
            first, own = found[f"{family}1"], found[f"{family}{k + 1}"]
            assert own.mass == first.mass
            np.testing.assert_allclose(own.centre, turn @ first.centre, atol=1e-12)
            np.testing.assert_allclose(own.inertia, turn @ first.inertia @ turn.T, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "place", "found"),
    [
        ('[[body]]\nname = "AAB"\nthickness = 1\n', "body[0].name", "did you mean 'AB'?"),
        ('[[body]]\nname = "AB"\nmass = 1\ncentre = [1, 2, 3]\n', "body[0].centre", "'AB' stands for 6 bodies"),
        (
            '[[body]]\nname = "AB"\nshape = "sphere"\nat = [1, 2, 3]\ndiameter = 3\n',
            "body[0].at",
            "stands for 6 bodies",
        ),
        ('[[body]]\nname = "AB"\nmass = 1\n', "body[0].centre", "nothing"),
        ('[[body]]\nname = "AB"\ndensity = 1\n', "body[0].thickness", "nothing"),
        ('AB.density = 3\nthickness = 3\n[[body]]\nname = "AB"\ndensity = 1\n', "body[0].name", "leg[0].AB has too"),
        ('AB = { mass = 1, thickness = 3 }\n[[body]]\nname = "AB"\nmass = 1\n', "leg[0].AB.mass", "'AB1' twice"),
        ("AC.mass = 1\n", "leg[0].AC", "a body that the chain does not have"),
    ],
)
def test_faults_of_bodies_of_legs_are_named_once_at_their_places(text: str, place: str, found: str) -> None:
    with pytest.raises(InvalidMechanism) as refused:
        loads(HEAD + CRANKS + text)
    assert [fault.place for fault in refused.value.faults] == [place]
    assert found in refused.value.faults[0].found


def test_a_near_miss_of_a_body_with_copies_is_all_of_them() -> None:
    with pytest.raises(InvalidMechanism, match=r"did you mean 'cylinderR'\?"):
        text = '\n[[body]]\nname = "cilinderR"\nmass = 1\ncentre = [0, 0, 0]\n'
        loads(catalog_file("stewart").read_text(encoding="utf-8") + text)


@pytest.mark.parametrize(
    ("text", "lacking"),
    [
        ('[[body]]\nname = "AB1"\nthickness = 3\ndensity = 1\n', ["AB2", "AB6", "BC1", "platform"]),
        ("thickness = 3\nAB.mass = 1\n", ["BC1", "BC6", "platform"]),
        ("thickness = 3\nAB.mass = 1\nBC.mass = 0\n" + PLATFORM, []),
        ("thickness = 3\n", []),
    ],
)
def test_check_notes_bodies_without_a_mass_beside_others_that_have_one(tmp_path, text: str, lacking: list[str]) -> None:
    file = tmp_path / "m.toml"
    file.write_text(HEAD + CRANKS + text)
    answer = CliRunner().invoke(main, ["check", str(file)])
    assert answer.exit_code == 0
    assert ("without a mass" in answer.stderr) == bool(lacking)
    assert all(f"'{body}'" in answer.stderr for body in lacking)


@pytest.mark.parametrize("by", ["leg", "copy"])
def test_home_and_range_may_be_lists_with_one_for_each_leg(by: str) -> None:
    homes = [5, -5] if by == "leg" else [5, -5, 0, 3, -3, 1]
    text = f"A.home = {homes}\nA.range = {[[h - 10, h + 20] for h in homes]}\nB.home = {[[h, 2 * h] for h in homes]}\n"
    machine = loads(HEAD + CRANKS + text + 'B.axes = ["x", "y"]\n')
    for k in range(6):
        home = homes[k % len(homes)]
        joint, passive = machine.joint(f"A{k + 1}"), machine.joint(f"B{k + 1}")
        assert joint.home == math.radians(home)
        assert joint.range == (math.radians(home - 10), math.radians(home + 20))
        assert passive.home == (math.radians(home), math.radians(2 * home))
    assert pf.solve_ik(machine, machine.home_pose).actuators == pytest.approx(
        np.radians([homes[k % len(homes)] for k in range(6)]), abs=1e-9
    )


def test_each_home_beyond_its_range_is_named_where_it_stands() -> None:
    with pytest.raises(InvalidMechanism) as refused:
        loads(HEAD + CRANKS + "A.home = [5, -50, 0, 70, -3, 1]\nA.range = [-20, 20]\n")
    assert [fault.place for fault in refused.value.faults] == ["leg[0].A.range"]
    with pytest.raises(InvalidMechanism) as refused:
        loads(HEAD + CRANKS + 'A.home = [5, -5, "x", 1, 1, true]\n')
    assert [fault.place for fault in refused.value.faults] == ["leg[0].A.home[2]", "leg[0].A.home[5]"]
