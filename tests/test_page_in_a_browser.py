"""A page as a visitor meets it: in headless Chromium without a network, by mouse, finger and keys."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from in_chromium import MARKS, centre, chromium, opened, target, until

pytestmark = MARKS
ALONE, SERVED = "alone", "served"
BOTH = pytest.mark.parametrize("form", [ALONE, SERVED])
SIZE = {"width": 900, "height": 500}
DESK = {"viewport": SIZE}
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
FOLLOWS = 0.5  # of a millimetre: a pixel is larger


@pytest.fixture(scope="module")
def started() -> Iterator[Any]:
    yield from chromium()


@pytest.fixture
def browser(started: Any) -> Iterator[Any]:
    """The browser, whose pages are closed in the end."""
    yield started
    for context in started.contexts:
        context.close()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., str]]:
    """The address of a machine's page, as a file alone or as a program serves it."""
    folder, addresses, viewers = tmp_path_factory.mktemp("pages"), dict[Any, str](), list[pf.Viewer]()

    def find(machine: pf.Mechanism, form: str = ALONE) -> str:
        if (machine, form) not in addresses and form == ALONE:
            file = folder / f"{len(addresses)}.html"
            pf.export_web(machine, file)
            addresses[machine, form] = file.as_uri()
        elif (machine, form) not in addresses:
            viewers.append(pf.view(machine, port=18180))
            addresses[machine, form] = viewers[-1].url
        return addresses[machine, form]

    yield find
    for viewer in viewers:
        viewer.close()


@BOTH
def test_the_platform_follows_the_mouse_and_what_stops_it_is_named(
    browser: Any, address: Callable[..., str], form: str
) -> None:
    page, faults = opened(browser, address(pf.load("stewart"), form), draws=True, **DESK)
    x, y = centre(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y + 20)
    assert np.subtract(centre(page), [x + 40, y + 20]) == pytest.approx(0.0, abs=FOLLOWS)
    assert page.locator("#status b").inner_text() == "Reached"
    page.mouse.move(x + 250, y - 100)
    page.mouse.up()
    assert page.locator("#status b").inner_text() == "Out of reach"
    named = page.locator("#limits").inner_text().split()
    assert named
    assert named[0] in page.locator("#names").inner_text()
    assert not faults


@BOTH
def test_where_live_is_on_drives_go_no_faster_than_they_may_and_rest_in_the_end(
    browser: Any, address: Callable[..., str], form: str
) -> None:
    machine = pf.load("stewart")
    page, faults = opened(browser, address(machine, form), draws=True, **DESK)
    page.locator("#pace button").click()
    page.evaluate(
        """() => {
          const { session } = page, settle = session.settle.bind(session);
          window.ticks = [];
          session.settle = (state) => { settle(state); ticks.push([performance.now(), ...session.answer.actuators]); };
        }"""
    )
    x, y = centre(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 250, y - 100)
    page.mouse.up()
    until(page, "ticks.length > 1 && !page.session.driver.clock")
    assert page.locator("#status b").inner_text() == "Out of reach"
    ticks = np.array(page.evaluate("ticks"))
    waits, steps = np.diff(ticks[:, 0]) / 1000.0, np.abs(np.diff(ticks[:, 1:], axis=0)).max(axis=1)
    assert steps.max() > 0.0
    speed = page.evaluate("page.session.driver.speeds[0]")
    assert steps.sum() <= speed * (waits.sum() + 1.0)
    page.locator("#home").click()  # is driven to, like all else
    until(page, "page.session.answer.status === 0 && !page.session.driver.clock")
    assert page.evaluate("page.session.answer.actuators") == pytest.approx(
        pf.solve_ik(machine, machine.home_pose).actuators
    )
    assert not faults


@BOTH
def test_a_link_opens_at_the_pose_that_it_was_copied_at(browser: Any, address: Callable[..., str], form: str) -> None:
    page, _ = opened(browser, address(pf.load("stewart"), form) + "#p=10,-20,200,5,0,10", **DESK)
    page.locator("canvas").press("ArrowRight")
    until(page, "page.session.past.length === 1")
    again, _ = opened(browser, page.evaluate("location.href"), **DESK)
    assert target(again) == pytest.approx(target(page), abs=1e-6)
    page.keyboard.press("Control+z")
    assert target(page)[:3, 3] == pytest.approx([10.0, -20.0, 200.0], abs=1e-6)


def test_a_slider_drives_an_actuator(browser: Any, address: Callable[..., str]) -> None:
    page, _ = opened(browser, address(pf.load("five_bar")), **DESK)
    slider = page.locator("#actuators input").first
    slider.focus()
    for _ in range(3):
        slider.press("PageUp")
    machine = pf.load("five_bar")
    expected = pf.solve_fk(machine, page.evaluate("page.session.answer.actuators"))
    assert np.reshape(page.evaluate("page.session.answer.pose"), (4, 4)) == pytest.approx(expected.pose, abs=1e-6)
    assert page.evaluate("page.session.answer.actuators[0]") > machine.drives[0].home
    until(page, "!page.later && page.session.past.length > 0")
    page.locator("#undo").click()  # a slider that goes on without a pause makes one step
    assert target(page) == pytest.approx(machine.home_pose)
    assert page.locator("#fields input").evaluate_all("(all) => all.map((each) => each.ariaLabel)") == ["y", "z"]


def test_a_drag_through_a_parallel_singularity_keeps_its_mode_and_the_page_says_that_it_passed(
    browser: Any, address: Callable[..., str]
) -> None:
    page, faults = opened(browser, address(pf.load("five_bar").without_limits()), **DESK)
    x, y = centre(page)
    shares, mode = [], page.evaluate("page.session.mode")
    page.mouse.move(x, y)
    page.mouse.down()
    for down in range(8, 130, 8):
        page.mouse.move(x, y + down)
        until(page, "!page.later")
        shares.append(int(page.locator("#near output").last.text_content().split()[0]))
        if len(shares) == 1:
            assert not page.locator("#crossing").inner_text()
    page.mouse.up()
    least = shares.index(min(shares))
    assert min(shares) < 10
    assert 0 < least < len(shares) - 1
    assert shares[-1] > 30
    assert page.locator("#status b").inner_text() == "Reached"
    assert "passed a parallel singularity" in page.locator("#crossing").inner_text()
    assert page.evaluate("page.session.mode") == mode
    page.locator("#home").click()
    until(page, "!page.later")
    assert not page.locator("#crossing").inner_text()
    assert not faults


def test_buttons_of_modes_keep_their_numbers(browser: Any, address: Callable[..., str]) -> None:
    page, _ = opened(browser, address(pf.load("five_bar")) + "#p=0,10,180,0,0,0", **DESK)
    expected = pf.working_modes(pf.load("five_bar"), [0.0, 10.0, 180.0])
    until(page, "document.querySelectorAll('#modes > h2 + div button').length === 4")
    for number in (3, 2, 4, 1):
        page.evaluate(f"document.querySelectorAll('#modes > h2 + div button')[{number - 1}].click()")
        until(page, "!page.later")
        lit = page.evaluate(
            "[...document.querySelectorAll('#modes > h2 + div button')].map((each) => each.ariaPressed)"
        )
        assert [k + 1 for k, each in enumerate(lit) if each == "true"] == [number]
        actuators = page.evaluate("page.session.answer.actuators")
        assert np.cos(actuators) == pytest.approx(np.cos(expected[number - 1].actuators), abs=1e-6)


@BOTH
def test_a_finger_drags_on_a_phone(browser: Any, address: Callable[..., str], form: str) -> None:
    page, faults = opened(browser, address(pf.load("five_bar"), form), **PHONE)
    x, y = centre(page)
    before, touch = target(page), page.context.new_cdp_session(page)
    for kind, points in (("Start", [[x, y]]), ("Move", [[x + 30, y + 30]]), ("End", [])):
        places = [{"x": a, "y": b} for a, b in points]
        touch.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": places})
    assert np.abs(target(page) - before).max() > 1.0
    assert not page.evaluate("document.documentElement.scrollWidth > innerWidth")
    assert not faults


def test_within_another_page_it_takes_that_page_s_theme_and_leaves_it_the_wheel(
    browser: Any, address: Callable[..., str], tmp_path: Path
) -> None:
    """Until it was clicked on: then the wheel zooms."""
    around_it = tmp_path / "around.html"
    inside = address(pf.load("five_bar"))
    around_it.write_text(f'<!doctype html><iframe src="{inside}" width="800" height="400"></iframe>')
    around = browser.new_page(viewport=SIZE)
    around.goto(around_it.as_uri())
    (frame,) = around.frames[1:]
    frame.wait_for_function("window.page?.shown")
    for theme in ("dark", "light"):
        around.evaluate("(theme) => frames[0].postMessage({ theme }, '*')", theme)
        frame.wait_for_function("(theme) => document.documentElement.dataset.theme === theme", arg=theme)
    asked, answered = "page.scene.camera.distance", "(before) => page.scene.camera.distance !== before"
    before = frame.evaluate(asked)
    around.mouse.move(60, 250)
    around.mouse.wheel(0, 50)
    around.wait_for_timeout(200)
    assert frame.evaluate(asked) == before
    around.mouse.click(60, 250)
    around.mouse.wheel(0, 50)
    frame.wait_for_function(answered, arg=before)
