"""What a notebook shows of mechanisms and answers: well-formed, escaped, finite, and where the joints are."""

from __future__ import annotations

import dataclasses
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from machines import MACHINES, planar, tripod_rps
from pfabrik.machine.description.sketch import HEIGHT, HELD, WIDTH, sketch

MARKED = pf.Options(on_invalid="mark")
FIVE_BAR = pf.load("five_bar")
SVG = "{http://www.w3.org/2000/svg}"
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?|nan|inf", re.IGNORECASE)


def drawing(text: str) -> ET.Element:
    """The one SVG in some HTML, which has to be well-formed."""
    (found,) = ET.fromstring(text).iter(f"{SVG}svg")
    return found


def markers(svg: ET.Element) -> dict[str, tuple[float, float]]:
    """Title of a joint's marker -> its middle [pixels]."""
    found = {}
    for each in svg.iter():
        title = each.find(f"{SVG}title")
        if each.tag in (f"{SVG}circle", f"{SVG}rect") and title is not None:
            place, half = [float(each.get(name) or each.get(f"c{name}") or "nan") for name in "xy"], 0.0
            if each.tag == f"{SVG}rect":
                half = float(each.get("width") or "nan") / 2
            found[title.text or ""] = (place[0] + half, place[1] + half)
    return found


def cells(text: str) -> list[list[str]]:
    return [[cell.text or "" for cell in row] for row in ET.fromstring(text).iter("tr")]


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize("make", MACHINES.values(), ids=MACHINES)
def test_every_joint_is_drawn_once_within_the_picture_and_the_actuated_are_marked(
    make: Callable[[], pf.Mechanism],
) -> None:
    mechanism = make()
    svg = drawing(mechanism._repr_html_())
    found = markers(svg)
    assert set(found) == {joint.name + "*" * joint.actuated for joint in mechanism.joints}
    for x, y in found.values():
        assert 0 <= x <= WIDTH
        assert 0 <= y <= HEIGHT
    for each in svg.iter():
        for name in ("points", "d", "x", "y", "cx", "cy"):
            assert np.isfinite([float(number) for number in NUMBER.findall(each.get(name) or "")]).all()


def test_a_mechanism_shows_its_name_counts_task_and_actuators_with_limits_in_degrees() -> None:
    text = FIVE_BAR._repr_html_()
    assert {"Planar 5-bar", "5 joints, 2 actuators; task x y z"} <= set(ET.fromstring(text).itertext())
    rows = [["p1", "-60", "60", "deg"], ["p5", "-60", "60", "deg"]]
    assert cells(text) == [["actuator", "min", "max", "unit"], *rows]
    assert cells(FIVE_BAR.without_limits()._repr_html_())[1] == ["p1", "-", "-", "deg"]


def test_an_answer_shows_status_errors_and_actuators() -> None:
    answer = pf.solve_ik(FIVE_BAR, (0, 0, 300))
    text = answer._repr_html_()
    words = " ".join(ET.fromstring(text).itertext())
    assert "projected: " in words
    assert f"{answer.position_error:.3g} mm from the target" in words
    shown = {row[0]: float(row[1]) for row in cells(text)[1:]}
    expected = dict(zip(("p1", "p5"), np.degrees(answer.actuators), strict=True))
    assert shown == pytest.approx(expected, rel=1e-5)


def test_a_planar_machine_is_drawn_in_its_plane_at_one_scale() -> None:
    mechanism = FIVE_BAR  # in the plane of y and z
    found = markers(drawing(mechanism._repr_html_()))
    spots = np.array([found[joint.name + "*" * joint.actuated] for joint in mechanism.joints])
    places = np.array([joint.at for joint in mechanism.joints])[:, 1:] * (1, -1)
    ratio = np.ptp(spots[:, 0]) / np.ptp(places[:, 0])
    np.testing.assert_allclose(spots - spots[0], ratio * (places - places[0]), atol=0.15)


@pytest.mark.parametrize(
    "make, upward", [(lambda: planar("RPR"), (0, 1.0, 0)), (tripod_rps, (0, 0, 1.0))], ids=["planar", "in space"]
)
def test_an_answer_is_drawn_where_its_points_are_and_up_is_up(
    make: Callable[[], pf.Mechanism], upward: tuple[float, float, float]
) -> None:
    """A machine moved as a whole looks the same; one whose platform alone is lifted is drawn higher."""
    mechanism, lift = make(), 20.0 * np.array(upward)
    centres = {joint.name: np.array(joint.at) for joint in mechanism.joints if joint.at is not None}
    reference = mechanism.home_pose[:3, 3]
    at_home = sketch(mechanism)
    assert sketch(mechanism, {name: place + lift for name, place in centres.items()}, reference + lift) == at_home
    on_platform = [joint.name for joint in mechanism.joints if mechanism.end_effector in joint.connects]
    lifted = centres | {name: centres[name] + lift for name in on_platform}
    first, second, *_ = (j.name for j in mechanism.joints if mechanism.base in j.connects and j.at is not None)

    def heights(svg: str) -> list[float]:
        """Of the platform's joints above the first foot, in distances of two feet."""
        spots = markers(ET.fromstring(svg))
        unit = math.dist(spots[first], spots[second])
        return [(spots[first][1] - spots[name][1]) / unit for name in on_platform]

    before, after = heights(at_home), heights(sketch(mechanism, lifted, reference + lift))
    assert all(low < high for low, high in zip(before, after, strict=True))


def test_only_joints_at_a_limit_are_orange() -> None:
    """As in pictures and in the viewer; at home none is, and out of reach those that the answer names."""
    stewart = pf.load("stewart")
    held = pf.solve_ik(stewart, [10, 0, 285])
    for shown, names in ((stewart, set()), (held, {limit.joint for limit in held.active_limits})):
        marked = [each for each in drawing(shown._repr_html_()).iter() if each.get("fill") == HELD]
        assert {(each.findtext(f"{SVG}title") or "").rstrip("*") for each in marked} == names
    assert 0 < len(held.active_limits) < 6


def test_what_has_no_single_configuration_is_shown_without_a_drawing() -> None:
    batch = pf.solve_ik(FIVE_BAR, [(0, 0, 190), (0, 0, 300), (0, 0, 310)])
    assert cells(batch._repr_html_()) == [["status", "rows"], ["REACHED", "1"], ["PROJECTED", "2"]]
    stewart = pf.load("stewart")
    for shown, word in (
        (batch, "REACHED"),
        (pf.solve_ik(FIVE_BAR, [(0, np.nan, 190)], options=MARKED)[0], "invalid"),
        (pf.workspace(stewart, resolution=20.0), "mm³"),
        (pf.workspace(stewart, fixed={"z": 5000.0}), "nothing within reach"),
    ):
        text = shown._repr_html_()
        assert any(word in each for each in ET.fromstring(text).itertext())
        assert not list(ET.fromstring(text).iter(f"{SVG}svg"))


def test_a_workspace_shows_its_size_ends_limits_and_its_outline_in_the_plane() -> None:
    found = pf.workspace(FIVE_BAR, resolution=8.0)
    text = found._repr_html_()
    words = list(ET.fromstring(text).itertext())
    assert any(word.endswith("mm²") for word in words)
    low, high = found.bounds[:, 0]
    assert f"y from {low:.6g} to {high:.6g} mm" in words
    first, *rows = cells(text)
    assert first == ["border", "formed by", "joint"]
    assert {(limit, kind) for _, limit, kind in rows} == {
        (f"{joint} {bound}", "revolute, actuated" if joint in ("p1", "p5") else "revolute")
        for joint in ("p1", "p2", "p4", "p5")
        for bound in ("min", "max")
    }
    assert sum(float(share.rstrip("%")) for share, *_ in rows) == pytest.approx(100.0, abs=0.5)
    paths = list(drawing(text).iter(f"{SVG}path"))
    assert {path.findtext(f"{SVG}title") for path in paths} == {limit for _, limit, _ in rows}
    alike = {(limit[0], limit.split()[1], kind) for _, limit, kind in rows}  # p1 and p5, p2 and p4 share their colours
    assert len({path.get("stroke") for path in paths}) == len(alike)
    ends = np.array([float(number) for path in paths for number in NUMBER.findall(path.get("d") or "")]).reshape(-1, 2)
    assert (ends >= 0.0).all() and (ends <= (WIDTH, HEIGHT)).all()
    y_by_z = np.ptp(found.vertices, axis=0)
    assert np.ptp(ends, axis=0) == pytest.approx(y_by_z * (np.ptp(ends[:, 0]) / y_by_z[0]), abs=0.2)  # at one scale
    top = found.vertices[np.argmax(found.vertices[:, 1])]
    assert ends[np.argmin(ends[:, 1]), 0] == pytest.approx(WIDTH / 2 + top[0] * np.ptp(ends[:, 0]) / y_by_z[0], abs=0.5)


def test_mobility_shows_every_count() -> None:
    machine = pf.load("nrpm")
    found = pf.mobility(machine)
    shown = {name.replace("-", "_"): int(count) for name, count, _ in cells(found._repr_html_())[1:]}
    counts = {name: value for name, value in dataclasses.asdict(found).items() if isinstance(value, int)}
    assert shown == {**counts, "redundancy": len(machine.actuator_names) - 6}


def test_singularity_shows_every_measure_and_what_is_singular() -> None:
    machine = FIVE_BAR.without_limits()
    reached = pf.solve_ik(machine, (0, 0, 175))
    assert [row[2] for row in cells(pf.singularity(reached)._repr_html_())] == ["singular", *["no"] * 4]
    stretched = pf.configuration(machine, pf.solve_ik(machine, (0, 0, 1e4)).q)
    rows = {kind: word for kind, _, word in cells(pf.singularity(stretched)._repr_html_())[1:]}
    assert rows["serial"] == "yes"
    batch = pf.singularity(pf.solve_ik(machine, [(0, 0, 175), (0, 10, 180), (0, np.nan, 0)], options=MARKED))
    text = batch._repr_html_()
    assert "batch of shape (3,)" in list(ET.fromstring(text).itertext())
    assert {kind: float(least) for kind, least, _ in cells(text)[1:]} == pytest.approx(
        {kind: np.nanmin(getattr(batch, kind)) for kind in ("serial", "parallel", "constraint", "passive")}, rel=5e-3
    )


def test_margins_show_the_nearest_limit_first_and_of_a_batch_the_least() -> None:
    machine = pf.load("stewart")
    one = pf.margins(pf.solve_ik(machine, (10, 0, 190)))
    header, *rows = cells(one._repr_html_())
    assert header == ["joint", "bound", "margin"]
    assert {(joint, bound) for joint, bound, _ in rows} == set(one)
    values = [float(value) for *_, value in rows]
    assert values == sorted(values)
    batch = pf.margins(pf.solve_ik(machine, [(10, 0, 190), (0, 0, 250), (np.nan, 0, 0)], options=MARKED))
    header, *rows = cells(batch._repr_html_())
    assert header == ["joint", "bound", "least margin"]
    for joint, bound, value in rows:
        assert float(value) == pytest.approx(np.nanmin(batch[joint, bound]), rel=1e-3, abs=1e-4)
    none = pf.margins(pf.solve_ik(machine, [(np.nan, 0, 0)], options=MARKED))
    assert {value for *_, value in cells(none._repr_html_())[1:]} == {"-"}


AT = pf.solve_ik(FIVE_BAR, (0, 0, 175))


def timed(machine: pf.Mechanism) -> pf.Timed:
    return pf.time_path(pf.track(machine, [(0, y, 175) for y in (0, 5, 10)]), speed=1.0, acceleration=2.0)


@cache
def space() -> pf.Workspace:
    return pf.workspace(FIVE_BAR, resolution=10.0)


SINGULARITIES = ["measure", "least", "below 0.1"]
POSE = ["x [mm]", "y [mm]", "z [mm]", "roll [deg]", "pitch [deg]", "yaw [deg]"]
THREE = [(0, 0, 190), (0, 0, 900), (90, 0, 190)]
RESULTS: dict[str, tuple[Callable[[], Any], list[str]]] = {
    "working modes": (
        lambda: pf.working_modes(FIVE_BAR, (0, 0, 175)),
        ["mode", "p1 [deg]", "p5 [deg]", "starts", "exceeds"],
    ),
    "assembly modes": (lambda: pf.assembly_modes(FIVE_BAR, AT.actuators), ["mode", *POSE, "starts", "exceeds"]),
    "no mode": (lambda: pf.working_modes(FIVE_BAR, (0.0, 0.0, 1e4)), []),
    "timed path": (lambda: timed(FIVE_BAR), ["held back by", "limit", "share of the time"]),
    "feasibility": (lambda: pf.feasibility(pf.load("stewart"), THREE[0]), ["joint", "bound", "margin"]),
    "feasibility of a batch": (
        lambda: pf.feasibility(pf.load("stewart"), THREE),
        ["joint", "bound", "rows", "least margin"],
    ),
    "singularity map": (lambda: pf.singularity_map(FIVE_BAR, space(), resolution=20.0), SINGULARITIES),
    "singularities of a path": (
        lambda: pf.singularity_map(FIVE_BAR, pf.track(FIVE_BAR, [(0, 0, 175), (0, 5, 180)])),
        SINGULARITIES,
    ),
    "singularity": (lambda: pf.singularity(AT), ["kind", "measure", "singular"]),
    "mobility": (lambda: pf.mobility(FIVE_BAR), ["", "count", "of"]),
    "margins": (lambda: pf.margins(AT), ["joint", "bound", "margin"]),
    "workspace": (space, ["border", "formed by", "joint"]),
    "largest shape": (lambda: space().inscribed("sphere"), ["coordinate", "centre", "extent"]),
    "platform speed": (lambda: pf.platform_speed(AT, speed=1.0), ["", "x", "y", "z", "speed", "unit", "limited by"]),
}


@pytest.mark.parametrize(("make", "header"), RESULTS.values(), ids=RESULTS)
def test_every_result_is_a_small_table(make: Callable[[], Any], header: list[str]) -> None:
    text = make()._repr_html_()
    first, *rows = cells(text) or [[]]
    assert first == header
    assert all(len(row) == len(header) for row in rows)
    assert len(text) < 10_000
    assert "nan" not in text


def test_modes_are_listed_with_their_actuator_values() -> None:
    modes = pf.working_modes(FIVE_BAR, (0, 0, 175))
    _, *rows = cells(modes._repr_html_())
    assert len(rows) == len(modes) == 4
    for row, mode in zip(rows, modes, strict=True):
        assert [float(cell) for cell in row[1:3]] == pytest.approx(np.degrees(mode.actuators), rel=1e-5)


def test_names_are_escaped_in_all_that_is_shown() -> None:
    name = {joint.name: f"<i>&\"{joint.name}'" for joint in FIVE_BAR.joints}
    joints = [dataclasses.replace(joint, name=name[joint.name]) for joint in FIVE_BAR.joints]
    renamed = pf.Mechanism("<script>&", joints, name[FIVE_BAR.end_effector])
    answer, modes = pf.solve_ik(renamed, (0, 0, 175)), pf.working_modes(renamed, (0, 0, 175))
    border = pf.workspace(renamed, resolution=10.0)
    others = (pf.feasibility(renamed, (0, 0, 175)), pf.platform_speed(answer, speed=1.0), pf.margins(answer))
    for each in (renamed, answer, modes, border, timed(renamed), *others):
        text = each._repr_html_()
        assert "<i>" not in text and "<script>" not in text
        ET.fromstring(text)
    assert "<i>&\"p1' [deg]" in cells(modes._repr_html_())[0]
    svg = drawing(renamed._repr_html_())
    assert set(markers(svg)) == {name[joint.name] + "*" * joint.actuated for joint in FIVE_BAR.joints}
    assert svg.findtext(f"{SVG}title") == "<script>&"
    paths = drawing(border._repr_html_()).iter(f"{SVG}path")
    assert "<i>&\"p1' max" in [row[1] for row in cells(border._repr_html_())]
    assert "<i>&\"p1' max" in [path.findtext(f"{SVG}title") for path in paths]
