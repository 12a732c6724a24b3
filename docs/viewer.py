"""Take docs/figures/viewer.png: the viewer in headless Chromium. Run it as `python docs/viewer.py`."""

from __future__ import annotations

import shutil
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

import pfabrik as pf

PICTURE = Path(__file__).parent / "figures" / "viewer.png"
SIZE = {"width": 1000, "height": 560}
SETTLED = 15_000  # milliseconds, without a graphics card
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
WITHOUT_NOTICES = "[class*=Notification] { display: none !important }"
COLOURS = 64  # enough for smooth edges, and a third of the file


def main() -> None:
    """Write the picture: a target beyond a machine's strokes."""
    machine = pf.load("stewart")
    with pf.view(machine) as viewer, sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        page = chromium.new_page(viewport=SIZE)
        page.goto(viewer.url)
        page.add_style_tag(content=WITHOUT_NOTICES)
        page.locator("[data-pfabrik=status]").wait_for()
        page.wait_for_timeout(SETTLED)
        viewer.show(pf.solve_ik(machine, pf.pose((60, 30, 270), rpy=(0, 10, 0), degrees=True)))
        page.wait_for_timeout(SETTLED)
        page.screenshot(path=PICTURE, timeout=0)
        chromium.close()
    Image.open(PICTURE).convert("RGB").quantize(COLOURS).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
