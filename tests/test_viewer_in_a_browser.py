"""What a page has beside when a program serves it, in headless Chromium: `show`, borders, paths, answers of Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from in_chromium import MARKS, centre, chromium, opened, target, until
from machines import tripod_rps

pytestmark = MARKS
DESK = {"viewport": {"width": 780, "height": 320}}
WIDE = {"viewport": {"width": 1280, "height": 800}}
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
IN_VIEW = """(names) => names.every((name) => {
  const { left, right, top, bottom } = document.querySelector(name).getBoundingClientRect();
  const panel = document.querySelector("#scroll").getBoundingClientRect();
  return left >= panel.left && right <= panel.right && top >= panel.top && bottom <= panel.bottom;
})"""
"""If elements are in the panel as it is, without scrolling."""


@pytest.fixture(scope="module")
def started() -> Iterator[Any]:
    yield from chromium()


@pytest.fixture
def browser(started: Any) -> Iterator[Any]:
    """The browser, whose pages are closed in the end."""
    yield started
    for context in started.contexts:
        context.close()


@pytest.fixture
def shown() -> Iterator[Callable[..., pf.Viewer]]:
    """`view`, whose viewers are closed in the end."""
    viewers: list[pf.Viewer] = []

    def view(what: Any) -> pf.Viewer:
        viewers.append(pf.view(what, port=18280))
        return viewers[-1]

    yield view
    for viewer in viewers:
        viewer.close()


def drag(page: Any, right: float, down: float) -> None:
    """Drag the end effector on the screen [px], in steps."""
    x, y = centre(page)
    page.mouse.move(x, y)
    page.mouse.down()
    for share in (0.25, 0.5, 0.75, 1.0):
        page.mouse.move(x + share * right, y + share * down)
    page.mouse.up()


def test_a_drag_is_read_and_what_a_program_shows_is_shown_in_all_pages(
    browser: Any, shown: Callable[..., pf.Viewer]
) -> None:
    """Each page has a pose of its own until then."""
    machine = pf.load("stewart")
    viewer = shown(machine)
    page, faults = opened(browser, viewer.url, **DESK)
    other, _ = opened(browser, viewer.url, **DESK)
    drag(page, 0.0, -250.0)
    until(page, "!page.live.states.isBusy")
    assert viewer.solution.status == pf.Status.PROJECTED
    assert viewer.target == pytest.approx(target(page))
    named = {f"{limit.joint} {limit.bound}" for limit in viewer.solution.active_limits}
    assert named == set(page.evaluate("page.session.answer.limits.map(({ joint, bound }) => `${joint} ${bound}`)"))
    assert target(other) == pytest.approx(machine.home_pose)
    viewer.show(pf.solve_ik(machine, (0, 0, 210)))
    for each in (page, other):
        until(each, "page.session.target[11] === 210")
    assert not faults


def test_a_file_is_shown_again_with_the_pose_kept_and_its_faults_told(
    browser: Any, shown: Callable[..., pf.Viewer], tmp_path: Path
) -> None:
    path, stewart = tmp_path / "mine.toml", pf.load("stewart")
    pf.save(stewart, path)
    viewer = shown(path)
    page, _ = opened(browser, viewer.url + "#p=0,0,200,0,0,0", **DESK)
    path.write_text(path.read_text(encoding="utf-8").replace("spherical", "sferical"), encoding="utf-8")
    until(page, "document.querySelector('#note').textContent.includes('did you mean')")
    pf.save(stewart.with_limits({"BL1": (140.0, 240.0)}), path)
    until(page, "window.page?.machine.live.version === 1 && window.page.session.target?.[11] === 200")
    pf.save(tripod_rps(), path)
    until(page, "window.page?.machine.live.version === 2 && window.page.shown")
    assert page.evaluate("page.machine.name") == tripod_rps().name


def test_borders_are_found_and_limits_let_go(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    page, faults = opened(browser, viewer.url, draws=True, **DESK)
    page.click("#workspace")
    until(page, "document.querySelector('#note').textContent.includes('mm²')")
    assert "p1, 5 max, actuated: 29%" in page.locator("#legend").inner_text()  # as in the picture
    page.click("#workspace")
    assert page.evaluate("page.borders.length") == 0
    page.click("#limited")
    until(page, "window.page?.machine.live.free && window.page.shown")
    until(page, "!page.live.states.isBusy")
    assert viewer.mechanism == pf.load("five_bar").without_limits()
    page.click("#locus")
    until(page, "page.borders.length === 1")
    assert "singularities" in page.locator("#legend").inner_text()
    viewer.show(pf.solve_ik(pf.load("five_bar"), (0, 0, 190)))
    until(page, "window.page?.session?.target?.[11] === 190 && !window.page.machine.live.free")
    assert not faults


def test_an_arm_without_closed_forms_is_answered_by_python(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    """Dragged and driven; what is asked for runs ahead of the answers."""
    viewer = shown("panda")
    page, faults = opened(browser, viewer.url, **WIDE)
    settled = "!page.session.engine.newest.isBusy && !page.live.states.isBusy"
    drag(page, -60.0, -90.0)
    until(page, settled)
    expected = pf.solve_ik(viewer.mechanism, target(page), start=viewer.solution)
    assert page.evaluate("page.session.answer.actuators") == pytest.approx(expected.actuators, abs=1e-6)
    drawn = dict(page.evaluate("[...page.scene.names].map(([name, k]) => [name, page.scene.points[k]])"))
    for name, place in expected.points.items():
        assert np.multiply(drawn[name], viewer.mechanism.characteristic_length) == pytest.approx(place, abs=1e-3)
    assert np.linalg.norm(viewer.target[:3, 3] - viewer.mechanism.home_pose[:3, 3]) > 50.0
    again, _ = opened(browser, page.evaluate("location.origin + location.pathname + page.session.link"), **WIDE)
    until(again, settled)
    assert again.evaluate("page.session.answer.actuators") == pytest.approx(expected.actuators, abs=1e-5)
    page.evaluate("page.panel.drive(0, 0.5)")
    until(page, settled)
    driven = pf.solve_fk(viewer.mechanism, page.evaluate("page.session.wished"))
    assert np.reshape(page.evaluate("page.session.answer.pose"), (4, 4)) == pytest.approx(driven.pose, abs=1e-6)
    until(page, "document.querySelectorAll('#travel > div > div').length === 6")
    assert page.evaluate(IN_VIEW, ["#near"])
    assert not faults


def test_a_path_is_played_also_in_a_page_that_was_saved(
    browser: Any, shown: Callable[..., pf.Viewer], tmp_path: Path
) -> None:
    """Of an arm too, for which such a page cannot answer."""
    panda = pf.load("panda")
    line = panda.home_pose[:3, 3] + np.linspace([0, 0, 0], [30, 0, 60], 12)
    track = pf.track(panda, line)
    viewer = shown(track)
    viewer.save(tmp_path / "panda.html")
    for address in (viewer.url, (tmp_path / "panda.html").as_uri()):
        page, faults = opened(browser, address, **DESK)
        until(page, "!!page.player")
        page.click("#player button")
        until(page, "page.player.place > 4")
        page.click("#player button")
        page.evaluate("page.player.take(7)")
        assert page.evaluate("page.session.answer.actuators") == pytest.approx(track[7].actuators, rel=1e-6)
        assert not faults


def test_sliders_of_joints_in_series_ask_for_poses(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("g1_ankle")
    page, _ = opened(browser, viewer.url, **DESK)
    page.evaluate("page.panel.driveJoint(0, -0.2), page.panel.driveJoint(1, 0.1)")
    until(page, "!page.live.states.isBusy")
    joints = viewer.solution.joints
    assert [joints["pitch_joint"], joints["roll_joint"]] == pytest.approx([-0.2, 0.1], abs=1e-9)
    page.evaluate("page.panel.driveJoint(1, 1.0)")
    assert "roll_joint max" in page.locator("#limits").inner_text()
    assert page.evaluate("page.session.joints") == [-0.2, 1.0]


def test_links_that_are_nearest_are_measured_and_solids_hidden(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("reachy_mini")
    page, _ = opened(browser, viewer.url, **DESK)
    page.locator("canvas").press("ArrowDown")
    until(page, "!page.later && page.distance && !page.live.states.isBusy")
    length = viewer.mechanism.characteristic_length
    until(
        page,
        f"Math.abs(page.distance.distance - {pf.clearance(viewer.solution).distance}) < 1e-9",
    )
    ends = np.array(page.evaluate("page.distance.ends")) * length
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(pf.clearance(viewer.solution).distance)
    assert page.locator("#names .distance").count() == 1
    assert page.evaluate("page.distance.shapes.length") == 2
    page.click("#solids")
    until(page, "!document.querySelector('#names .distance')")


def test_modes_are_listed_and_the_pose_is_copied_as_python(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("rrr")
    page, _ = opened(browser, viewer.url, **DESK)
    page.evaluate("document.querySelector('#assembly').click()")
    until(page, "document.querySelectorAll('#listed button').length > 1")
    modes = pf.assembly_modes(viewer.mechanism, pf.solve_ik(viewer.mechanism, viewer.target).actuators)
    assert page.locator("#listed button").count() == len(modes)
    page.evaluate("document.querySelectorAll('#listed button')[1].click()")
    until(page, "!page.live.states.isBusy")
    assert viewer.solution.pose == pytest.approx(modes[1].pose, abs=1e-6)
    assert eval(page.evaluate("page.live.poseAsPython()"), {"pf": pf}) == pytest.approx(viewer.target, abs=1e-3)


def test_a_page_says_when_the_program_behind_it_has_ended(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    page, _ = opened(browser, viewer.url, **DESK)
    page.wait_for_timeout(300)
    assert not page.locator("#gone").is_visible()
    viewer.close()
    page.locator("#gone").wait_for()
    drag(page, 20.0, 20.0)  # it goes on by itself
    assert page.evaluate("page.session.answer.status") == 0


def test_what_counts_is_in_sight(browser: Any, shown: Callable[..., pf.Viewer]) -> None:
    """Bars of singularities on a desk and the last strut on a phone without scrolling; the ghost of a far target."""
    viewer = shown("stewart")
    page, _ = opened(browser, viewer.url, **WIDE)
    for height in (800, 576):  # of a window, and of a page within another
        page.set_viewport_size({"width": 1280, "height": height})
        assert page.evaluate(IN_VIEW, ["#near"])
    phone, _ = opened(browser, viewer.url, **PHONE)
    for height in (844, 576):
        phone.set_viewport_size({"width": 390, "height": height})
        assert phone.evaluate(IN_VIEW, ["#actuators .row:last-child"])
    for each in (page, phone):
        for view in ("top", "iso"):
            each.get_by_role("button", name=view, exact=True).click()
            each.evaluate("page.session.ask(poseOf([300, 100, 600], [0, 0, 0]))")
            seen = each.evaluate("page.scene.platformAt(page.session.target).map((p) => page.scene.camera.onScreen(p))")
            sizes = each.evaluate("(({ width, height, covered }) => [width, height, covered])(page.scene.camera)")
            width, height, covered = sizes
            assert (np.array(seen) > 0.0).all() and (np.array(seen) < [width * (1.0 - covered), height]).all()
