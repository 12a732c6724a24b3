"""A headless Chromium for tests of pages, without a graphics card."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install '.[dev]'")

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), ""
)
MARKS = [
    pytest.mark.compiled,
    pytest.mark.skipif(not CHROMIUM, reason="needs Chromium, which is not installed (apt install chromium)"),
]
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
PATIENCE = 60_000  # milliseconds


def chromium() -> Iterator[Any]:
    """The browser, for a fixture; a test that finds none that starts is left out."""
    with playwright.sync_playwright() as started:
        sandbox = ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)
        try:
            browser = started.chromium.launch(executable_path=CHROMIUM, args=[*SOFTWARE, *sandbox])
        except playwright.Error as error:
            pytest.skip(f"Chromium is there and does not start: {str(error).splitlines()[0]}")
        yield browser
        browser.close()


def until(page: Any, holds: str) -> None:
    """Wait until an expression of a page is true; pages that forbid `eval` cannot be waited for otherwise."""
    end = time.monotonic() + PATIENCE / 1e3
    while not _is_true(page, holds):
        assert time.monotonic() < end, holds
        page.wait_for_timeout(20)


def _is_true(page: Any, holds: str) -> bool:
    try:
        return bool(page.evaluate(holds))
    except playwright.Error as error:
        if "navigation" in str(error):  # it is loaded again
            return False
        raise


def opened(browser: Any, address: str, *, draws: bool = False, **options: Any) -> tuple[Any, list[str]]:
    """A page, and its errors and what it asks for from elsewhere; that of a file has no network.

    It is drawn once, and from then on only with `draws`: without a graphics card a picture takes longer than all else.
    """
    is_file = address.startswith("file:")
    context = browser.new_context(offline=is_file, **options)
    page, faults = context.new_page(), list[str]()
    own = "file:" if is_file else "/".join(address.split("/")[:4])
    page.set_default_timeout(PATIENCE)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: faults.extend([request.url] * (not request.url.startswith((own, "data:")))))
    page.goto(address)
    until(page, "!!window.page?.shown")
    page.evaluate("page.view.render = () => {}" if not draws else "page.isCoarse = true")
    return page, faults


def centre(page: Any) -> list[float]:
    """Where the handles are on the screen."""
    found: list[float] = page.evaluate("page.scene.camera.look().onScreen(page.gizmo.centre)")
    return found


def target(page: Any) -> Any:
    """What is asked for, (4, 4) [length]."""
    return np.reshape(page.evaluate("page.session.target"), (4, 4))
