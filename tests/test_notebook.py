"""What a notebook shows of mechanisms and answers: well-formed, escaped, finite, and where the joints are."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable

import numpy as np
import pytest

import pfabrik as pf
from machines import MACHINES, planar, tripod_rps
from pfabrik.description.sketch import HEIGHT, WIDTH, sketch

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


def test_names_are_escaped() -> None:
    joints = [
        pf.Joint('<b>&"1', "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        pf.Joint("'2'", "revolute", ("link", "tool"), at=(10, 0, 0), axis=(0, 0, 1), actuated=True),
    ]
    mechanism = pf.Mechanism("<script>&", joints, "tool", (20, 0, 0), task=("x", "y"))
    svg = drawing(mechanism._repr_html_())
    assert set(markers(svg)) == {'<b>&"1*', "'2'*"}
    assert svg.findtext(f"{SVG}title") == "<script>&"
    assert "<script>" not in mechanism._repr_html_()


def test_a_mechanism_shows_its_name_counts_task_and_actuators_with_limits_in_degrees() -> None:
    mechanism = pf.load("five_bar")
    text = mechanism._repr_html_()
    assert {"Planar 5-bar", "5 joints, 2 actuators; task x y z"} <= set(ET.fromstring(text).itertext())
    assert cells(text) == [
        ["actuator", "min", "max", "unit"],
        ["p1", "-60", "60", "deg"],
        ["p5", "-60", "60", "deg"],
    ]


def test_what_has_no_limit_shows_none() -> None:
    assert cells(pf.load("five_bar").without_limits()._repr_html_())[1] == ["p1", "-", "-", "deg"]


def test_an_answer_shows_status_errors_and_actuators() -> None:
    answer = pf.solve_ik(pf.load("five_bar"), (0, 0, 300))
    text = answer._repr_html_()
    words = " ".join(ET.fromstring(text).itertext())
    assert "projected: " in words
    assert f"position error {answer.position_error:.3g} mm" in words
    shown = {row[0]: float(row[1]) for row in cells(text)[1:]}
    expected = dict(zip(("p1", "p5"), np.degrees(answer.actuators), strict=True))
    assert shown == pytest.approx(expected, rel=1e-5)


def test_a_planar_machine_is_drawn_in_its_plane_at_one_scale() -> None:
    mechanism = pf.load("five_bar")  # in the plane of y and z
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


def test_a_batch_shows_how_many_rows_have_each_status_and_no_drawing() -> None:
    batch = pf.solve_ik(pf.load("five_bar"), [(0, 0, 190), (0, 0, 300), (0, 0, 310)])
    text = batch._repr_html_()
    assert cells(text) == [["status", "rows"], ["REACHED", "1"], ["PROJECTED", "2"]]
    assert not list(ET.fromstring(text).iter(f"{SVG}svg"))


def test_a_row_that_was_no_pose_is_shown_without_a_drawing() -> None:
    marked = pf.solve_ik(pf.load("five_bar"), [(0, np.nan, 190)], options=pf.Options(on_invalid="mark"))[0]
    text = marked._repr_html_()
    assert "invalid" in list(ET.fromstring(text).itertext())
    assert not list(ET.fromstring(text).iter(f"{SVG}svg"))
