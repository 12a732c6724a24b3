"""Write docs/pictures/live, machines as their pages show them: `python tools/site/portraits.py [NAME]...`; a film too.

Pages are opened in headless Chromium, light and dark, with nothing but the machine on them. The pictures have no
ground, so that cards of any colour carry them.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

import pfabrik as pf
from pfabrik.errors import InvalidArgument

PICTURES = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "live"
SIZE = {"width": 720, "height": 600}  # pixels of a page
WIDTH, ASPECT, MARGIN = 360, 6 / 5, 0.06  # of a picture: pixels, width by height, and the share left at each side
FILM_SIZE = {"width": 560, "height": 480}
QUALITY, FILM_QUALITY = 75, 50  # of WebP, of 100
STEPS, DURATION = 45, 60  # of the film, and milliseconds of each
RADIUS = 62.0  # of the film's circle about (0, 0, 232) [mm]: its upper third is out of reach
PATIENCE = 60_000  # milliseconds
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
ALONE = "aside, header, #help { display: none !important } canvas { width: 100% !important; height: 100% !important }"
BARE = f"{ALONE} body {{ background: none !important }} #names {{ display: none !important }}"
STAGED = f"{ALONE} #names :is(.x, .y, .z) {{ display: none !important }}"
WITHOUT_GROUND = """() => {
  const draw = page.view.draw;
  page.view.draw = function (each) { if (each.kind !== GROUND) draw.call(this, each); };
}"""
SEEN = "() => new Promise((go) => { page.redraw(); requestAnimationFrame(() => requestAnimationFrame(go)); })"
"""Waits until the machine is drawn."""
WITHOUT_HANDLES = """() => {
  page.gizmo.handles = () => [];
  page.hidesSlice = true;
  page.adapt = page.keepInView = () => {};
  page.scene.camera.reset();
}"""


def main() -> None:
    """Write the pictures of the machines that are named, or of all, and the film."""
    PICTURES.mkdir(exist_ok=True)
    chromium = next(found for name in ("chromium", "google-chrome") if (found := shutil.which(name)))
    sandbox = ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)
    with sync_playwright() as started, tempfile.TemporaryDirectory() as folder:
        browser = started.chromium.launch(executable_path=chromium, args=[*SOFTWARE, *sandbox])
        for name in sys.argv[1:] or pf.catalog():
            file = Path(folder) / f"{name}.html"
            try:
                pf.export_web(pf.load(name), file)
            except InvalidArgument:
                continue
            for scheme, end in (("light", ""), ("dark", "-dark")):
                page = opened(browser, file, scheme, SIZE, BARE)
                portrait(page).save(PICTURES / f"{name}{end}.webp", quality=QUALITY, alpha_quality=QUALITY, method=6)
                page.close()
        if not sys.argv[1:]:
            for scheme, end in (("light", ""), ("dark", "-dark")):
                page = opened(browser, Path(folder) / "stewart.html", scheme, FILM_SIZE, STAGED)
                first, *frames = film(page)
                options = {"duration": DURATION, "loop": 0, "quality": FILM_QUALITY, "method": 6}
                first.save(PICTURES / f"film{end}.webp", save_all=True, append_images=frames, **options)
        browser.close()


def opened(browser: Any, file: Path, scheme: str, size: dict[str, int], style: str) -> Any:
    """A page with nothing on it but the machine."""
    page = browser.new_page(viewport=size, color_scheme=scheme)
    page.set_default_timeout(PATIENCE)
    page.goto(file.as_uri())
    page.wait_for_function("window.page?.shown")
    page.add_style_tag(content=style)
    page.evaluate(WITHOUT_HANDLES)
    page.evaluate(SEEN)
    return page


def portrait(page: Any) -> Image.Image:
    """The machine on no ground, as large as the picture allows."""
    page.evaluate(WITHOUT_GROUND)
    page.evaluate(SEEN)
    whole = Image.open(io.BytesIO(page.screenshot(omit_background=True)))
    left, top, right, bottom = whole.getbbox()
    width = max(right - left, ASPECT * (bottom - top)) * (1 + 2 * MARGIN)
    x, y, height = (left + right - width) / 2, (top + bottom - width / ASPECT) / 2, width / ASPECT
    part = whole.crop((round(x), round(y), round(x + width), round(y + height)))
    return part.resize((WIDTH, round(WIDTH / ASPECT)), Image.Resampling.LANCZOS)


def film(page: Any) -> list[Image.Image]:
    """The platform follows a circle that leaves its workspace."""
    frames = []
    for angle in np.linspace(0.0, 2.0 * np.pi, STEPS, endpoint=False):
        target = pf.pose([0.0, RADIUS * np.sin(angle), 232.0 - RADIUS * np.cos(angle)])
        page.evaluate("(target) => page.session.ask(target)", target.ravel().tolist())
        page.evaluate(SEEN)
        frames.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    return frames


if __name__ == "__main__":
    main()
