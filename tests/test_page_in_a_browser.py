"""A page as a visitor meets it: in headless Chromium without a network, by mouse, finger and keys."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from in_chromium import MARKS, PATIENCE, chromium

pytestmark = MARKS
SIZE = {"width": 900, "height": 500}
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
FOLLOWS = 0.5  # of a millimetre: a pixel is larger


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from chromium()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    for name in ("stewart", "five_bar"):
        pf.export_web(pf.load(name), folder / f"{name}.html")
    return folder


def opened(browser: Any, file: Path, link: str = "", **options: Any) -> tuple[Any, list[str]]:
    """A page without a network, and its errors and what it asks for from elsewhere."""
    context = browser.new_context(offline=True, **({"viewport": SIZE} | options))
    page, faults = context.new_page(), list[str]()
    page.set_default_timeout(PATIENCE)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: faults.extend([request.url] * request.url.startswith(("http", "ws"))))
    page.goto(file.as_uri() + link)
    page.wait_for_function("window.page?.shown")
    return page, faults


def target(page: Any) -> Any:
    return np.reshape(page.evaluate("page.session.target"), (4, 4))


def centre(page: Any) -> list[float]:
    """Where the handles are on the screen."""
    found: list[float] = page.evaluate("page.scene.camera.look().onScreen(page.gizmo.centre)")
    return found


def test_the_platform_follows_the_mouse_and_what_stops_it_is_named(browser: Any, pages: Path) -> None:
    page, faults = opened(browser, pages / "stewart.html")
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


def test_a_link_opens_at_the_pose_that_it_was_copied_at(browser: Any, pages: Path) -> None:
    page, _ = opened(browser, pages / "stewart.html", "#p=10,-20,200,5,0,10")
    page.locator("canvas").press("ArrowRight")
    page.wait_for_function("page.session.past.length === 1")
    again, _ = opened(browser, pages / "stewart.html", page.evaluate("location.hash"))
    assert target(again) == pytest.approx(target(page), abs=1e-6)
    page.keyboard.press("Control+z")
    assert target(page)[:3, 3] == pytest.approx([10.0, -20.0, 200.0], abs=1e-6)


def test_a_slider_drives_an_actuator(browser: Any, pages: Path) -> None:
    page, _ = opened(browser, pages / "five_bar.html")
    slider = page.locator("#actuators input").first
    slider.focus()
    for _ in range(3):
        slider.press("PageUp")
    machine = pf.load("five_bar")
    expected = pf.solve_fk(machine, page.evaluate("page.session.answer.actuators"))
    assert np.reshape(page.evaluate("page.session.answer.pose"), (4, 4)) == pytest.approx(expected.pose, abs=1e-6)
    assert page.evaluate("page.session.answer.actuators[0]") > machine.drives[0].home


def test_a_drag_through_a_parallel_singularity_keeps_its_mode_and_the_page_says_that_it_passed(
    browser: Any, pages: Path
) -> None:
    pf.export_web(pf.load("five_bar").without_limits(), pages / "free.html")
    page, faults = opened(browser, pages / "free.html")
    x, y = centre(page)
    shares, mode = [], page.evaluate("page.session.mode")
    page.mouse.move(x, y)
    page.mouse.down()
    for down in range(8, 130, 8):
        page.mouse.move(x, y + down)
        page.wait_for_function("!page.later")
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
    page.wait_for_function("!page.later")
    assert not page.locator("#crossing").inner_text()
    assert not faults


def test_buttons_of_modes_keep_their_numbers(browser: Any, pages: Path) -> None:
    page, _ = opened(browser, pages / "five_bar.html", "#p=0,10,180,0,0,0")
    expected = pf.working_modes(pf.load("five_bar"), [0.0, 10.0, 180.0])
    page.wait_for_function("document.querySelectorAll('#modes button').length === 4")
    for number in (3, 2, 4, 1):
        page.evaluate(f"document.querySelectorAll('#modes button')[{number - 1}].click()")
        page.wait_for_function("!page.later")
        lit = page.evaluate("[...document.querySelectorAll('#modes button')].map((each) => each.ariaPressed)")
        assert [k + 1 for k, each in enumerate(lit) if each == "true"] == [number]
        actuators = page.evaluate("page.session.answer.actuators")
        assert np.cos(actuators) == pytest.approx(np.cos(expected[number - 1].actuators), abs=1e-6)


def test_a_finger_drags_on_a_phone(browser: Any, pages: Path) -> None:
    page, faults = opened(browser, pages / "five_bar.html", **PHONE)
    x, y = centre(page)
    before, touch = target(page), page.context.new_cdp_session(page)
    for kind, points in (("Start", [[x, y]]), ("Move", [[x + 30, y + 30]]), ("End", [])):
        places = [{"x": a, "y": b} for a, b in points]
        touch.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": places})
    assert np.abs(target(page) - before).max() > 1.0
    assert not page.evaluate("document.documentElement.scrollWidth > innerWidth")
    assert not faults


def test_within_another_page_it_takes_that_page_s_theme_and_leaves_it_the_wheel(browser: Any, pages: Path) -> None:
    """Until it was clicked on: then the wheel zooms."""
    (pages / "around.html").write_text('<!doctype html><iframe src="five_bar.html" width="800" height="400"></iframe>')
    around = browser.new_page(viewport=SIZE)
    around.goto((pages / "around.html").as_uri())
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
