"""The viewer as a user meets it: in headless Chromium, the mouse on the handles, the limit's name in the page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

import pfabrik as pf
from in_chromium import MARKS, PATIENCE, chromium

pytest.importorskip("viser", reason="needs the extra view")
pytestmark = MARKS
SIZE = {"width": 640, "height": 320}  # few pixels: they are drawn without a graphics card
WITHOUT_NOTICES = "[class*=Notification] { display: none !important }"
POINTS = np.array([[0.0, -116.0, 88.0], [0.0, 116.0, 88.0], [0.0, 0.0, 175.0]])  # of a 5-bar: elbows, tip
UPWARD = 0.3  # where on the upright arrow the mouse takes hold, in the scene's units from its foot


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from chromium()


def opened(browser: Any, url: str, **options: Any) -> tuple[Any, list[str]]:
    """A page at an address, and everything it asks for from then on."""
    context = browser.new_context(**({"viewport": SIZE} | options))
    page, asked = context.new_page(), []
    page.set_default_timeout(PATIENCE)
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda websocket: asked.append(websocket.url))
    page.goto(url)
    return page, asked


def hosts(asked: list[str]) -> set[str]:
    return {urlparse(url).hostname or "" for url in asked if urlparse(url).scheme not in ("data", "blob", "file")}


def on_screen(viewer: pf.Viewer, point: np.ndarray) -> tuple[float, float]:
    """Where a point of the scene is in the page [pixels]: the camera is at the left upper corner."""
    (client,) = viewer._server.get_clients().values()
    camera = client.camera
    w, x, y, z = camera.wxyz
    seen = Rotation.from_quat([x, y, z, w]).inv().apply(point - camera.position)
    focal = 0.5 * camera.image_height / np.tan(0.5 * camera.fov)
    across, down = focal * seen[:2] / seen[2] + np.array([camera.image_width, camera.image_height]) / 2.0
    return float(across), float(down)


def in_the_scene(page: Any, path: Path) -> np.ndarray:
    """What the page looks like now, (height, width, 3)."""
    page.screenshot(path=path, timeout=PATIENCE)
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), float)


def test_a_target_dragged_beyond_a_stroke_names_the_limit_and_nothing_leaves_this_computer(browser: Any) -> None:
    machine = pf.load("stewart")
    with pf.view(machine, port=18180) as viewer:
        page, asked = opened(browser, viewer.url)
        page.add_style_tag(content=WITHOUT_NOTICES)
        status, held = (page.locator(f"[data-pfabrik={name}]") for name in ("status", "held"))
        status.filter(has_text="reached").wait_for()
        foot = machine.home_pose[:3, 3] / machine.characteristic_length
        end = time.monotonic() + PATIENCE / 1e3
        while viewer.target[2, 3] == machine.home_pose[2, 3]:  # the handles are there some time after the page
            assert time.monotonic() < end, "the handle was not caught"
            across, down = on_screen(viewer, foot + [0.0, 0.0, UPWARD])
            page.mouse.move(across, down)
            page.wait_for_timeout(500)
            page.mouse.down()
            for step in range(1, 12):
                page.mouse.move(across, down + 10 * step)
                page.wait_for_timeout(30)
            page.mouse.up()
            page.wait_for_timeout(500)
        status.filter(has_text="projected").wait_for()
        assert viewer.solution.status == pf.Status.PROJECTED
        assert viewer.target[:2, 3] == pytest.approx(machine.home_pose[:2, 3], abs=1e-3)
        assert viewer.target[2, 3] < 140.0
        names = {limit.joint for limit in viewer.solution.active_limits}
        told = held.inner_text()
        assert names
        assert all(name in told for name in names), told
        assert page.locator("[data-pfabrik=pose]").input_value() == viewer._stage.session.pose_as_python
        assert hosts(asked) == {"127.0.0.1"}
        page.context.close()


def test_a_page_says_when_the_program_behind_it_has_ended(browser: Any) -> None:
    viewer = pf.view(pf.load("stewart"), port=18182)
    page, asked = opened(browser, viewer.url)
    gone = page.locator("[data-pfabrik=gone]")
    gone.wait_for(state="attached")
    before = list(asked)
    page.wait_for_timeout(3000)
    assert not gone.is_visible()
    assert asked == before  # nothing is asked again and again
    viewer.close()
    gone.wait_for(state="visible")
    assert "has ended" in gone.inner_text()
    page.context.close()


def test_a_phone_shows_the_machine_first_and_a_dark_system_a_dark_page(browser: Any) -> None:
    with pf.view("five_bar", port=18184) as viewer:
        phone = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
        page, _ = opened(browser, viewer.url, color_scheme="dark", **phone)
        status = page.locator("[data-pfabrik=status]")
        page.wait_for_function("document.documentElement.dataset.mantineColorScheme === 'dark'")
        status.wait_for(state="hidden")
        page.get_by_text(viewer.mechanism.name).click()
        status.wait_for(state="visible")
        (client,) = viewer._server.get_clients().values()
        ends = np.array([on_screen(viewer, point / viewer.mechanism.characteristic_length) for point in POINTS])
        assert (ends > 0.0).all() and (ends < [client.camera.image_width, client.camera.image_height]).all()
        page.context.close()


def test_a_saved_page_shows_the_machine_without_a_network(browser: Any, tmp_path: Path) -> None:
    with pf.view("five_bar", port=18180) as viewer:
        viewer.save(tmp_path / "five_bar.html")
    page, asked = opened(browser, (tmp_path / "five_bar.html").as_uri(), offline=True)
    page.add_style_tag(content=WITHOUT_NOTICES)
    end = time.monotonic() + PATIENCE / 1e3
    while (in_the_scene(page, tmp_path / "page.png").max(axis=2) < 120).sum() < 50:  # it comes out of white
        assert time.monotonic() < end, "nothing is shown"
        page.wait_for_timeout(500)
    assert hosts(asked) == set()
    page.context.close()
