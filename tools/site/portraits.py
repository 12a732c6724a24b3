"""Write docs/pictures/live, machines as their pages show them, and a film: `python tools/site/portraits.py [NAME]...`.

The film alone is called "film".


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
FILM_SIZE = {"width": 400, "height": 420}
FILM_WIDTH = 560  # pixels
QUALITY, FILM_QUALITY = 75, 30  # of WebP, of 100
STEPS, DURATION = 50, 160  # of the film, and milliseconds of each
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


TITLES = "each target alone", "live"
TITLED = """(title) => {
  const style = "position: fixed; top: 8px; left: 0; right: 0; text-align: center; font-size: 17px; font-weight: 600";
  document.body.append(made("div", { textContent: title, style }));
}"""
TICKED = """([target, seconds]) => {
  const { session } = page;
  session.target = target;
  session.driver.goOn(seconds);
}"""


def main() -> None:
    """Write the pictures of the machines that are named, or of all, and the film."""
    PICTURES.mkdir(exist_ok=True)
    chromium = next(found for name in ("chromium", "google-chrome") if (found := shutil.which(name)))
    sandbox = ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)
    with sync_playwright() as started, tempfile.TemporaryDirectory() as folder:
        browser = started.chromium.launch(executable_path=chromium, args=[*SOFTWARE, *sandbox])
        films = sys.argv[1:] in ([], ["film"])
        for name in [each for each in sys.argv[1:] if each != "film"] or (() if sys.argv[1:] else pf.catalog()):
            file = Path(folder) / f"{name}.html"
            try:
                pf.export_web(pf.load(name), file)
            except InvalidArgument:
                continue
            for scheme, end in (("light", ""), ("dark", "-dark")):
                page = opened(browser, file, scheme, SIZE, BARE)
                portrait(page).save(PICTURES / f"{name}{end}.webp", quality=QUALITY, alpha_quality=QUALITY, method=6)
                page.close()
        for scheme, end in (("light", ""), ("dark", "-dark")) if films else ():
            file = Path(folder) / "film.html"
            pf.export_web(pf.load("stewart"), file)
            first, *frames = film([opened(browser, file, scheme, FILM_SIZE, STAGED) for _ in TITLES])
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


def film(pages: list[Any]) -> list[Image.Image]:
    """A platform follows a stream that leaves its reach by far: each target alone, and live, side by side."""
    machine, phase = pf.load("stewart"), np.linspace(0.0, 2.0 * np.pi, STEPS, endpoint=False)
    shifts = np.stack([0.9 * np.sin(phase), 0.8 * np.sin(2 * phase + 0.4), 0.9 * np.sin(3 * phase + 1.0)], axis=1)
    turns = np.stack([0.7 * np.sin(2 * phase), 0.7 * np.sin(phase + 0.7), 0.5 * np.sin(3 * phase)], axis=1)
    targets = pf.pose(machine.home_pose[:3, 3] + machine.characteristic_length * shifts, rotvec=turns)
    for page, title in zip(pages, TITLES, strict=True):
        page.evaluate(TITLED, title)
    pages[1].evaluate("() => document.querySelector('#pace button').click()")
    frames = []
    for target in targets.reshape(-1, 16).tolist():
        pages[0].evaluate("(target) => page.session.ask(target)", target)
        pages[1].evaluate(TICKED, [target, 1e-3 * DURATION])
        width, height = FILM_SIZE["width"] * len(pages), FILM_SIZE["height"]
        both = Image.new("RGB", (width, height))
        for k, page in enumerate(pages):
            page.evaluate(SEEN)
            both.paste(Image.open(io.BytesIO(page.screenshot())), (k * FILM_SIZE["width"], 0))
        frames.append(both.resize((FILM_WIDTH, round(height * FILM_WIDTH / width)), Image.Resampling.LANCZOS))
    return frames


if __name__ == "__main__":
    main()
