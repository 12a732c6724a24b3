"""The page of the catalogue is what its generator writes, its pictures exist, and the page on adding one is true."""

from __future__ import annotations

import importlib.util
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from machines import MACHINES, planar, tripod_rps
from pfabrik.cli import main
from pfabrik.description.places import joint_places, slider_place
from pfabrik.errors import InvalidArgument

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure

from pfabrik.view.drawing import around, draw, rail_of

DOCS = Path(__file__).parents[1] / "docs"
ADDING = (DOCS / "adding-a-mechanism.md").read_text(encoding="utf-8")
LARGEST_PICTURE = 25_000  # bytes


def generator() -> ModuleType:
    """The script docs/mechanisms.py as a module."""
    spec = importlib.util.spec_from_file_location("mechanisms_page", DOCS / "mechanisms.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def places_of(mechanism: pf.Mechanism, solution: pf.Solution | None = None) -> dict[str, np.ndarray]:
    reference = mechanism.home_pose[:3, 3] if solution is None else solution.pose[:3, 3]
    return joint_places(mechanism, None if solution is None else solution.points, reference)


def gantry() -> pf.Mechanism:
    """Three slides in a row: not one joint has a centre."""
    bodies = ("base", "bridge", "trolley", "tool")
    joints = [
        pf.Joint(f"P{k}", "prismatic", bodies[k : k + 2], axis=np.eye(3)[k], actuated=True, range=(-5, 5))
        for k in range(3)
    ]
    return pf.Mechanism("gantry", joints, "tool", (1, 2, 3))


# The page.


def test_the_page_is_what_its_generator_writes() -> None:
    written = (DOCS / "mechanisms.md").read_text(encoding="utf-8")
    assert written == generator().page(), "run: python docs/mechanisms.py"


def test_every_machine_has_a_small_picture_and_no_other_has_one() -> None:
    pictures = {path.stem: path.stat().st_size for path in (DOCS / "pictures").glob("*.png")}
    assert set(pictures) == set(pf.catalog()), "run: python docs/mechanisms.py"
    assert max(pictures.values()) < LARGEST_PICTURE


def test_pictures_are_the_same_every_time_and_stale_ones_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = generator()
    monkeypatch.setattr(module, "PICTURES", tmp_path / "pictures")
    monkeypatch.setattr(module, "PAGE", tmp_path / "mechanisms.md")
    monkeypatch.setattr(module.pf, "catalog", lambda: ("five_bar",))
    module.main()
    first = module.picture("five_bar").read_bytes()
    module.picture("gone").touch()
    module.main()
    assert [path.name for path in module.PICTURES.iterdir()] == ["five_bar.png"]
    assert module.picture("five_bar").read_bytes() == first


# Adding a mechanism.


def test_commands_on_the_new_machine_print_what_the_page_shows(tmp_path: Path) -> None:
    (text,) = re.findall(r'write_text\("""\\\n(.*?)"""\)', ADDING, re.DOTALL)
    (tmp_path / "four_rpr.toml").write_text(text, encoding="utf-8")
    shown = re.findall(r"^\$ pfabrik (.*?)\n(.*?)^```$", ADDING, re.DOTALL | re.MULTILINE)
    assert len(shown) == 2
    for line, expected in shown:
        words = [word.replace("four_rpr.toml", str(tmp_path / "four_rpr.toml")) for word in shlex.split(line)]
        printed = CliRunner().invoke(main, words).output
        parts = expected.rstrip("\n").split("\n...\n")
        assert all(part in printed for part in parts), printed
        assert len(parts) > 1 or printed.rstrip("\n") == parts[0]


# The drawing.


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize("make", [*MACHINES.values(), gantry], ids=[*MACHINES, "gantry"])
def test_home_can_be_drawn(make: Callable[[], pf.Mechanism]) -> None:
    mechanism = make()
    axes = draw(mechanism)
    axes.figure.draw_without_rendering()
    assert sum(len(collection.get_offsets()) for collection in markers(axes)) == len(mechanism.joints)


def markers(axes: Any) -> list[Any]:
    """What has been drawn for joints; polygons have no label."""
    return [each for each in axes.collections if not str(each.get_label()).startswith("_")]


def test_an_answer_is_drawn_where_its_points_are() -> None:
    mechanism = tripod_rps()
    answer = pf.solve_ik(mechanism, (0, 0, 212))
    home, moved = places_of(mechanism), places_of(mechanism, answer)
    assert moved["S1"] == pytest.approx(answer.points["S1"])
    assert moved["S1"][2] - home["S1"][2] == pytest.approx(12.0)
    assert moved["P1"] == pytest.approx((answer.points["R1"] + answer.points["S1"]) / 2)
    assert draw(mechanism, answer).get_zlabel() == "z [mm]"


def test_a_rail_spans_the_travel_and_stays_when_the_carriage_moves() -> None:
    mechanism = planar("PRR")
    moved = pf.solve_fk(mechanism, [3.0, -2.0, 4.0])
    at_home = rail_of(mechanism, mechanism.joint("A1"), places_of(mechanism), None)
    later = rail_of(mechanism, mechanism.joint("A1"), places_of(mechanism, moved), moved)
    assert np.linalg.norm(at_home[1] - at_home[0]) == pytest.approx(140)
    assert np.array(later) == pytest.approx(np.array(at_home))
    assert rail_of(mechanism, mechanism.joint("B1"), places_of(mechanism), None) is None


def test_a_planar_machine_is_seen_from_the_front() -> None:
    flat, deep = draw(planar("RPR")), draw(tripod_rps())
    assert (flat.elev, flat.azim, flat.get_zlabel()) == (90, -90, "")
    assert deep.elev < 45


def test_scales_are_equal_on_all_axes() -> None:
    axes = draw(tripod_rps())
    spans = np.array([np.ptp(getattr(axes, f"get_{name}lim")()) for name in "xyz"])
    assert np.ptp(axes._box_aspect / spans) == pytest.approx(0, abs=1e-12)


def test_it_draws_on_the_axes_that_are_given() -> None:
    axes = Figure().add_subplot(projection="3d")
    assert draw(tripod_rps(), axes=axes) is axes


def test_slides_without_any_centre_are_drawn_at_the_reference_point() -> None:
    mechanism = gantry()
    assert slider_place(mechanism, mechanism.joint("P1"), {}) is None
    assert np.array(list(places_of(mechanism).values())) == pytest.approx(np.array([[1, 2, 3]] * 3))


def test_corners_of_a_polygon_follow_each_other() -> None:
    square = [np.array(corner, float) for corner in ((0, 0, 1), (1, 1, 1), (1, 0, 1), (0, 1, 1))]
    ordered = np.array(around(square))
    assert np.linalg.norm(ordered - np.roll(ordered, 1, axis=0), axis=1) == pytest.approx(1)


def test_a_batch_and_another_machine_are_refused() -> None:
    mechanism = tripod_rps()
    batch = pf.solve_ik(mechanism, np.array([mechanism.home_pose] * 2))
    with pytest.raises(InvalidArgument, match="batch of shape"):
        draw(mechanism, batch)
    with pytest.raises(InvalidArgument, match="one of 'planar 3-RPR'"):
        draw(planar("RPR"), batch[0])
