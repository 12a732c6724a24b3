"""Take docs/figures/viewer.png, viewer_singular.png and page.png: the viewer, and a page, in headless Chromium.

Run it as `python tools/site/viewer.py`.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

import pfabrik as pf

FIGURES = Path(__file__).resolve().parents[2] / "docs" / "figures"
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
        machine, free = pf.load("stewart"), pf.load("five_bar").without_limits()
        beyond = pf.solve_ik(machine, pf.pose((60, 30, 270), rpy=(0, 10, 0), degrees=True))
        take_viewer(chromium, beyond, FIGURES / "viewer.png")
        take_viewer(chromium, pf.solve_ik(free, (0, 0, 62)), FIGURES / "viewer_singular.png", "singularities")
        take_page(chromium, FIGURES / "page.png")
        Image.open(FIGURES / "page.png").convert("RGB").quantize(256, kmeans=3).save(
            FIGURES / "page.png", optimize=True
        )
        chromium.close()


def take_viewer(chromium: Browser, solution: pf.Solution, picture: Path, *switches: str) -> None:
    """An answer in the viewer, after home, with some switches on."""
    with pf.view(solution.mechanism) as viewer:
        page = chromium.new_page(viewport=SIZE)
        page.goto(viewer.url)
        page.add_style_tag(content=WITHOUT_NOTICES)
        page.locator("[data-pfabrik=status]").wait_for()
        page.wait_for_timeout(SETTLED)
        for switch in switches:
            page.get_by_label(switch, exact=True).click(force=True)
        page.locator("[data-pfabrik=status]").scroll_into_view_if_needed()
        page.mouse.move(0, 0)
        viewer.show(solution)
        page.wait_for_timeout(SETTLED)
        page.screenshot(path=picture, timeout=0)
    Image.open(picture).convert("RGB").quantize(COLOURS).save(picture, optimize=True)


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
