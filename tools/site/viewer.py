"""Take docs/figures/viewer.png, viewer_singular.png and page.png: pages, served and alone, in headless Chromium.

Run it as `python tools/site/viewer.py`.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

import pfabrik as pf

FIGURES = Path(__file__).resolve().parents[2] / "docs" / "figures"
SIZE = {"width": 1280, "height": 760}
SETTLED = 2_000  # milliseconds
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
COLOURS = 256


def main() -> None:
    """Write the pictures."""
    with sync_playwright() as started, tempfile.TemporaryDirectory() as folder:
        chromium = started.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        with pf.view("stewart") as viewer:
            take(chromium, f"{viewer.url}#p=0,0,195,0,0,0", "viewer", lambda page: found(page, "#workspace"))
        with pf.view(pf.solve_ik(pf.load("five_bar").without_limits(), (0, 0, 62))) as viewer:
            take(chromium, viewer.url, "viewer_singular", lambda page: found(page, "#locus"))
        file = Path(folder) / "stewart.html"
        pf.export_web(pf.load("stewart"), file)
        take(chromium, f"{file.as_uri()}#p=75,-20,250,-9,12,6", "page")
        chromium.close()


def found(page: Page, switch: str) -> None:
    """Switch a border on, and wait until it is there."""
    page.click(switch)
    page.locator("#note", has_text="mm").wait_for()


def take(chromium: Browser, address: str, name: str, prepare: Callable[[Page], None] | None = None) -> None:
    """A picture of a page."""
    page, picture = chromium.new_page(viewport=SIZE), FIGURES / f"{name}.png"
    page.goto(address)
    page.locator("#travel .travel").first.wait_for()
    if prepare is not None:
        prepare(page)
    page.mouse.move(0, 0)
    page.wait_for_timeout(SETTLED)
    page.screenshot(path=picture, timeout=0)
    Image.open(picture).convert("RGB").quantize(COLOURS, kmeans=3).save(picture, optimize=True)


if __name__ == "__main__":
    main()
