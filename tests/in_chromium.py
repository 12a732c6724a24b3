"""A headless Chromium for tests of pages, without a graphics card."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

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
