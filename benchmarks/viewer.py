"""What a motion of the mouse in the viewer costs: the answer in the page, and until it is on the screen."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf
from table import Row

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
SIZE = {"width": 1000, "height": 600}
MOTIONS, PAUSE = 40, 150  # motions that are timed, and milliseconds after each

WATCHED = """() => {
    window.delays = []
    let moved = null
    addEventListener('pointermove', () => { moved ??= performance.now() }, {capture: true})
    const show = page.session.onChange
    page.session.onChange = () => {
        show()
        const began = moved
        moved = null
        if (began !== null) requestAnimationFrame(() => setTimeout(() => window.delays.push(performance.now() - began)))
    }
}"""
"""Notes how long after a motion of the mouse another answer has been drawn [ms]."""


def viewer(runs: int) -> Iterator[Row]:
    """A hexapod's target, and that of an arm that Python answers for, dragged up and down."""
    for name, label in (("stewart", "6-UPS"), ("panda", "7-R arm, answered by Python")):
        with pf.view(name, port=18280) as shown:
            delays = in_a_browser(shown)
        if len(delays):
            yield Row(f"viewer, {label}: mouse to answer on the screen, median", 1, float(np.median(delays)))
            yield Row(f"viewer, {label}: the same, longest but for a tenth", 1, float(np.quantile(delays, 0.9)))


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
        page.goto(shown.url)
        page.locator("#travel .travel").first.wait_for()
        across, down = page.evaluate("page.scene.camera.look().onScreen(page.gizmo.centre)")
        page.evaluate(WATCHED)
        page.mouse.move(across, down)
        page.mouse.down()
        for motion in range(1, MOTIONS + 1):
            page.mouse.move(across, down + 60.0 * np.sin(0.3 * motion))
            page.wait_for_timeout(PAUSE)
        delays = page.evaluate("window.delays")
        browser.close()
    return 1e-3 * np.array(delays)
