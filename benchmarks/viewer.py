"""What a motion of the mouse in the viewer costs: to solve, to send, and until the answer is in the page."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf
from table import Row
from timing import best_times

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
SIZE = {"width": 1000, "height": 600}
MOTIONS, PAUSE = 40, 150  # motions that are timed, and milliseconds after each

WATCHED = """() => {
    const pose = () => document.querySelector('[data-pfabrik=pose]')?.getAttribute('value')
    let before = pose(), moved = null
    window.delays = []
    addEventListener('pointermove', () => { moved ??= performance.now() }, {capture: true})
    new MutationObserver(() => {
        if (pose() === before || moved === null) return
        const began = moved
        before = pose(), moved = null
        requestAnimationFrame(() => setTimeout(() => window.delays.push(performance.now() - began)))
    }).observe(document.body, {subtree: true, childList: true, attributes: true})
}"""
"""Notes how long after a motion of the mouse another pose has been drawn [ms]."""


def viewer(runs: int) -> Iterator[Row]:
    """A hexapod's target, dragged up and down within reach and beyond."""
    if find_spec("viser") is None:
        return
    machine = pf.load("stewart")
    with pf.view(machine, port=18280) as shown:
        targets = [pf.pose((0.0, 0.0, z)) for z in np.linspace(150.0, 290.0, 50)]

        def solve() -> None:
            for target in targets:
                shown._stage.session.go_to(target)

        def solve_and_send() -> None:
            for target in targets:
                shown._answer(lambda stage, target=target: stage.session.go_to(target))

        solving, sending = best_times(runs, solve, solve_and_send)
        shown.show(pf.solve_ik(machine, machine.home_pose))
        n = len(targets)
        yield Row("viewer, 6-UPS: a motion, solved", n, solving / n)
        yield Row("viewer, 6-UPS: a motion, solved and sent", n, sending / n)
        delays = in_a_browser(shown)
        if len(delays):
            yield Row("viewer, 6-UPS: mouse to answer on the screen, median", 1, float(np.median(delays)))
            yield Row("viewer, 6-UPS: the same, longest but for a tenth", 1, float(np.quantile(delays, 0.9)))


def in_a_browser(shown: pf.Viewer) -> NDArray[np.float64]:
    """Times from motions of the mouse to their answers in headless Chromium [s]; none where it is not installed."""
    chromium = next(filter(None, map(shutil.which, BROWSERS)), None)
    if chromium is None or find_spec("playwright") is None:
        return np.zeros(0)
    from playwright.sync_api import sync_playwright

    sandbox = ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[*SOFTWARE, *sandbox])
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(60_000)
        page.goto(shown.url)
        page.locator("[data-pfabrik=pose]").wait_for()
        page.wait_for_timeout(3000)
        across, down = caught(shown, page)
        page.evaluate(WATCHED)
        for motion in range(1, MOTIONS + 1):
            page.mouse.move(across, down + 60.0 * np.sin(0.3 * motion))
            page.wait_for_timeout(PAUSE)
        delays = page.evaluate("() => window.delays")
        browser.close()
    return 1e-3 * np.array(delays)


def caught(shown: pf.Viewer, page: Any) -> tuple[float, float]:
    """Where the mouse has hold of the upright arrow [pixels]."""
    from scipy.spatial.transform import Rotation

    home = shown.target[:3, 3].copy()
    point = home / shown.mechanism.characteristic_length + [0.0, 0.0, 0.3]
    for _ in range(20):
        (client,) = shown._server.get_clients().values()
        camera = client.camera
        seen = Rotation.from_quat(np.roll(camera.wxyz, -1)).inv().apply(point - camera.position)
        focal = 0.5 * camera.image_height / np.tan(0.5 * camera.fov)
        across, down = focal * seen[:2] / seen[2] + 0.5 * np.array([camera.image_width, camera.image_height])
        page.mouse.move(across, down)
        page.wait_for_timeout(500)
        page.mouse.down()
        page.mouse.move(across, down + 5)
        page.wait_for_timeout(1000)
        if not np.array_equal(shown.target[:3, 3], home):
            return float(across), float(down)
        page.mouse.up()
    raise RuntimeError("the handle was not caught")
