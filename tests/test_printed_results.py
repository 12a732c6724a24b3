"""Results print the same in Python and at the command line."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from pfabrik.common.printed import ResultTable
from pfabrik.view.overview import Overview


def test_a_track_says_what_the_command_says(tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("x,y,z\n0,0,-200\n10,0,-200\n0,0,-900\n", encoding="utf-8")
    delta = pf.load("delta")
    said = pfabrik(["track", "delta", str(path)])
    lines = pf.track(delta, pf.read_path(path, delta).targets).table().lines
    assert list(lines) == re.sub(r" \(line \d+\)", "", said.stdout + said.stderr).splitlines()
    assert "2 reached, 1 projected; first at target 3; farthest" in lines[0]
    assert lines[1].startswith("worst step: target 3, margin 0 of ")


def test_an_overview_says_what_the_command_says() -> None:
    assert pfabrik(["info", "delta"]).stdout == f"{Overview(pf.load('delta'))}\n"


def test_forces_of_a_batch_show_the_largest_of_each_actuator() -> None:
    stewart = pf.load("stewart")
    held = pf.forces(pf.solve_ik(stewart, [(0, 0, 190), (0, 5, 190)]), [0, 0, -200])
    shown = {name: float(value) for name, value, _ in held.table().rows}
    assert shown == pytest.approx(dict(zip(stewart.actuator_names, held.actuators.max(axis=0), strict=True)), rel=1e-5)


def test_reactions_show_every_component_and_of_a_batch_the_largest() -> None:
    five_bar = pf.load("five_bar")
    many = pf.forces(pf.solve_ik(five_bar, [(0, 10, 180), (0, 10, 200)]), [0, 0, -20])
    for held, places in (
        (many, (..., [1, 2, 3])),
        (pf.forces(pf.solve_ik(five_bar, (0, 10, 180)), [0, 0, -20]), [1, 2, 3]),
    ):
        table = held.reactions.table()
        (shown,) = [[float(cell) for cell in row[2:5]] for row in table.rows if row[0] == "p1"]
        assert np.abs(shown) == pytest.approx(
            np.abs(np.reshape(held.reactions["p1"][places], (-1, 3))).max(axis=0), rel=1e-4
        )
        assert [row[1] for row in table.rows] == ["-"] * 5 and "p1 fx my mz" in str(table)
        assert [float(pull) for _, pull in table.more[0].rows] == pytest.approx(
            [np.ravel(pull)[np.abs(np.ravel(pull)).argmax()] for pull in held.rods.values()], rel=1e-4
        )


def test_what_no_load_moves_is_rigid() -> None:
    rows = {
        way: said for way, said, _ in pf.stiffness(pf.solve_ik(pf.load("delta"), (10, 5, -200)), 500.0).table().rows
    }
    assert [way for way, said in rows.items() if said == "rigid"] == ["about x", "about y", "about z"]


def test_singular_motions_are_named_with_their_actuators() -> None:
    """A crank of the 5-bar in line with its forearm, and a hexapod turned by a quarter, which gives in a screw."""
    shoulder, reach = np.array([-50.0, 0.0]), np.hypot(66.0, 88.0) + np.hypot(116.0, 87.0)
    along = np.array([0.3, np.sqrt(1.0 - 0.09)])
    free, tip = pf.load("five_bar").without_limits(), shoulder + reach * along
    path = np.linspace((0.0, 180.0), tip, 40) * (1.0, 1.0)
    stretched = pf.track(free, np.column_stack([np.zeros(40), path]))[-1]
    lost, _ = pf.singularity(stretched).motions
    assert re.fullmatch(
        r"nearest to being lost: a translation along \(0, 0.3\d*, 0.95\d*\), for which p1 would move most", lost
    )
    stewart = pf.load("stewart").without_limits()
    turned = [pf.pose([0, 0, 195], rotvec=[0, 0, yaw]) for yaw in np.radians([0, 30, 60, 80, 90])]
    found = pf.singularity(pf.track(stewart, np.stack(turned)))
    assert found.motions == []
    _, gained = pf.singularity(pf.track(stewart, np.stack(turned))[-1]).motions
    assert re.search(r"gained: a screw of -154.7 mm a turn about \(0, 0, 1\) through \(0, 0, 195\), with all", gained)


def test_forces_say_which_rows_have_none() -> None:
    stewart, given = pf.load("stewart"), np.full((3, 4, 4), np.nan)
    mark = pf.Options(on_invalid="mark")
    assert str(pf.forces(pf.solve_ik(stewart, given, options=mark), [0, 0, -200])).startswith(
        "no forces in 3 of 3 rows: "
    )
    given[1] = stewart.home_pose
    text = str(pf.forces(pf.solve_ik(stewart, given, options=mark), [0, 0, -200]))
    assert text.startswith("no forces in 2 of 3 rows: the row is INVALID") and "BR3" in text
    assert str(pf.forces(pf.solve_ik(stewart, given[:0]), [0, 0, -200])) == "no row"


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        (pf.transmission, lambda found: found.translation.velocity[..., 0]),
        (partial(pf.accuracy, errors=0.1), lambda found: found.position),
        (partial(pf.stiffness, k=500.0), lambda found: 1.0 / found.compliance[..., 0, 0]),
        (partial(pf.wrench_capacity, limits=(-100.0, 100.0)), lambda found: found.radius),
    ],
    ids=["transmission", "accuracy", "stiffness", "wrench capacity"],
)
def test_first_order_results_show_numbers_ranges_and_reasons(
    asked: Callable[..., Any], shown: Callable[..., Any]
) -> None:
    stewart, mark = pf.load("stewart"), pf.Options(on_invalid="mark")
    for targets in ([(0, 0, 190), (0, 9, 190)], (0, 0, 190)):
        found = asked(pf.solve_ik(stewart, targets))
        values = np.unique(shown(found))
        table = found.table()
        number = table.rows[0][table.header.index("velocity") if "velocity" in table.header else 1]
        assert [float(word) for word in number.split(" to ")] == pytest.approx(values, rel=1e-5) and not table.lines
    nothing = asked(pf.solve_ik(stewart, np.full((2, 4, 4), np.nan), options=mark))
    assert "in 2 of 2 rows: the row is INVALID" in str(nothing) and nothing.table().rows[0][1] == "-"


def test_clearances_of_batches_are_plain_numbers() -> None:
    mechanism = pf.load("reachy_mini")
    poses = np.stack([mechanism.home_pose, np.full((4, 4), np.nan)])
    solution = pf.solve_ik(mechanism, poses, options=pf.Options(on_invalid="mark"))
    plain = json.loads(json.dumps(pf.clearance(solution).to_dict(), allow_nan=False))
    assert plain["distance"][0] == pytest.approx(pf.clearance(solution[0]).distance) and plain["distance"][1] is None


def test_a_table_in_a_notebook_has_what_its_text_has_in_its_order() -> None:
    table = ResultTable("name", ["above"], ("a", "b"), [("1", "2")], ["below\nfurther below"])
    words = re.findall(r">([^<]+)<", table._repr_html_())
    assert words == ["name", "above", "a", "b", "1", "2", "below", "further below"]
    assert "<table>" not in ResultTable("name", ["nothing within reach"])._repr_html_()


def test_a_largest_shape_shows_its_size_in_its_units_and_its_certificate() -> None:
    square = pf.largest(pf.load("five_bar"), "box")
    text = str(square)
    assert re.search(r"^z \[mm\] +[\d.]+ +129\.085$", text, re.MULTILINE)
    assert text.endswith(str(square.certificate))
    tilts = pf.workspace(pf.load("ankle_rss"), resolution=0.1).inscribed("box")
    assert re.fullmatch(r"largest box, [\d,.]+ deg²", tilts.table().lines[0])
    size = float(tilts.table().lines[0].split()[2].replace(",", ""))
    assert size == pytest.approx(np.degrees(tilts.extents).prod(), rel=1e-5)
    assert [name for name, *_ in tilts.table().rows] == ["pivot[0] [deg]", "pivot[1] [deg]"]
    assert [float(extent) for *_, extent in tilts.table().rows] == pytest.approx(np.degrees(tilts.extents), rel=1e-5)
