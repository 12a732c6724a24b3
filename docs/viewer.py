"""Take docs/figures/viewer.png and page.png: the viewer, and a page, in headless Chromium.

Run it as `python docs/viewer.py`.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

import pfabrik as pf

FIGURES = Path(__file__).parent / "figures"
SIZE = {"width": 1000, "height": 560}
PAGE_SIZE = {"width": 1280, "height": 760}
SETTLED, SETTLED_PAGE = 15_000, 2_000  # milliseconds, without a graphics card
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
WITHOUT_NOTICES = "[class*=Notification] { display: none !important }"
COLOURS = 64  # enough for smooth edges, and a third of the file


def main() -> None:
    """Write the pictures."""
    with sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        take_viewer(chromium, FIGURES / "viewer.png")
        Image.open(FIGURES / "viewer.png").convert("RGB").quantize(COLOURS).save(FIGURES / "viewer.png", optimize=True)
        take_page(chromium, FIGURES / "page.png")
        Image.open(FIGURES / "page.png").convert("RGB").quantize(256, kmeans=3).save(
            FIGURES / "page.png", optimize=True
        )
        chromium.close()


def take_viewer(chromium: Browser, picture: Path) -> None:
    """A target beyond a machine's strokes, in the viewer."""
    machine = pf.load("stewart")
    with pf.view(machine) as viewer:
        page = chromium.new_page(viewport=SIZE)
        page.goto(viewer.url)
        page.add_style_tag(content=WITHOUT_NOTICES)
        page.locator("[data-pfabrik=status]").wait_for()
        page.wait_for_timeout(SETTLED)
        viewer.show(pf.solve_ik(machine, pf.pose((60, 30, 270), rpy=(0, 10, 0), degrees=True)))
        page.wait_for_timeout(SETTLED)
        page.screenshot(path=picture, timeout=0)


def take_page(chromium: Browser, picture: Path) -> None:
    """Another in a page."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "stewart.html"
        pf.export_web(pf.load("stewart"), file)
        page = chromium.new_page(viewport=PAGE_SIZE)
        page.goto(f"{file.as_uri()}#p=75,-20,250,-9,12,6")
        page.wait_for_function("window.page?.shown")
        page.wait_for_timeout(SETTLED_PAGE)
        page.screenshot(path=picture, timeout=0)


if __name__ == "__main__":
    main()
