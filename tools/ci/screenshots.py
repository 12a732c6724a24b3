"""Open the site as visitors do: pictures of its first pages in out/shots, and an error for what they would not forgive.

    make docs && .venv/bin/python tools/ci/screenshots.py

Each page is opened on a desk and on a phone, light and dark, scrolled to its end. Nothing may be asked of another host,
no error told, no picture missing, nothing wider than the screen, and no page heavier than `HEAVIEST`. The gallery and
the search are tried from files too, without a server. Links of all pages within the site have to lead somewhere;
without Chromium only these are tried, which is said.
"""

from __future__ import annotations

import functools
import gzip
import http.server
import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parents[2]
SITE, SHOTS = ROOT / "site", ROOT / "out" / "shots"
LIVE = "gallery/stewart.html"
SEARCHES = {
    "singularity": "singularities.html",
    "teach": "teach.html",
    "ROS 2 node": "ros2-node.html",
    "cluster": "cluster.html",
}
"""What visitors search for, and the page that has to be the first answer, if the site has it."""
PAGES = ("index.html", "gallery.html", LIVE, "teach.html", "map.html")
SCREENS = {"desk": {"width": 1280, "height": 800}, "phone": {"width": 390, "height": 844}}
HEAVIEST = 460_000  # bytes that a page transfers, with all that it needs: a good second at 3 Mbit/s
PATIENCE = 60_000  # milliseconds
SETTLING = 800  # milliseconds, until what slides and fades is at rest
TYPING, SEARCHING = 60, 1500  # milliseconds of a letter, and until answers are there
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
COMPRESSED = (".css", ".html", ".js", ".json", ".svg")
"""What hosts of pages send compressed."""

FAULTS_OF_A_PAGE = """() => [
  ...[...document.images].filter((each) => each.checkVisibility() && !each.naturalWidth)
    .map((each) => `no picture: ${each.currentSrc}`),
  ...document.documentElement.scrollWidth > innerWidth
    ? [`${document.documentElement.scrollWidth} pixels wide on a screen of ${innerWidth}`] : [],
]"""
FIRST_ANSWER = """() => {
  const links = (root) => [...root.querySelectorAll("*")].flatMap((each) =>
    each.shadowRoot ? links(each.shadowRoot) : each.matches("ol a") ? [each.href.split("/").pop()] : []);
  return links(document)[0];
}"""
TO_ITS_END = """async () => {
  for (const each of document.querySelectorAll("img, iframe")) {
    if (!each.checkVisibility()) continue;
    each.scrollIntoView();
    await (each.decode?.().catch(() => {}) ?? new Promise((go) => setTimeout(go, 100)));
  }
  scrollTo(0, 0);
}"""


class Host(http.server.SimpleHTTPRequestHandler):
    """Serves the site as hosts do: text is compressed."""

    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        path = Path(self.translate_path(self.path))
        if not path.is_file():
            self.send_error(404)
            return
        content, is_text = path.read_bytes(), path.suffix in COMPRESSED
        self.send_response(200)
        self.send_header("Content-Type", self.guess_type(str(path)))
        if is_text:
            content = gzip.compress(content)
            self.send_header("Content-Encoding", "gzip")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a server of this computer's own."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Host, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


def main() -> int:
    """Try the pages; 1 if something is wrong."""
    faults = [*dead_links()]
    chromium = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if chromium is None:
        print(*faults, "no pictures of the site: Chromium is not installed", sep="\n")
        return bool(faults)
    from playwright.sync_api import sync_playwright

    shutil.rmtree(SHOTS, ignore_errors=True)
    SHOTS.mkdir(parents=True)
    sandbox = ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)
    software = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    with sync_playwright() as started, served(SITE) as address:
        browser = started.chromium.launch(executable_path=chromium, args=[*software, *sandbox])
        for screen, size in SCREENS.items():
            for scheme in ("light", "dark"):
                for page in PAGES:
                    name = f"{Path(page).stem}-{screen}-{scheme}"
                    faults += visited(browser, address, page, name, viewport=size, color_scheme=scheme)
        for page in (LIVE, "gallery.html"):
            faults += visited(browser, f"{SITE.as_uri()}/", page, f"{Path(page).stem}-files", viewport=SCREENS["desk"])
        for place in (address, f"{SITE.as_uri()}/"):
            faults += not_found(browser, place)
        browser.close()
    print(*faults, sep="\n")
    print(f"{len(list(SHOTS.glob('*.png')))} pictures in {SHOTS.relative_to(ROOT)}; {len(faults)} faults")
    return bool(faults)


class Anchors(HTMLParser):
    """Where a page leads, and the places in it that links can name."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.links |= {link for name in ("href", "src") if (link := given.get(name))}
        self.names |= {place for name in ("id", "name") if (place := given.get(name))}


def dead_links() -> Iterator[str]:
    """Links within the site that lead to no file, or to no place in a page."""
    pages = {
        page: Anchors(page.read_text(encoding="utf-8")) for page in SITE.rglob("*.html") if page.name != "404.html"
    }
    for page, anchors in sorted(pages.items()):
        for link in sorted(anchors.links):
            address = urlsplit(link)
            if address.scheme or address.netloc:
                continue
            file = (page.parent / unquote(address.path)).resolve() if address.path else page
            file = file / "index.html" if file.is_dir() else file
            is_there = file.is_file() and (
                not address.fragment or file not in pages or unquote(address.fragment) in pages[file].names
            )
            if not is_there:
                yield f"{page.relative_to(SITE)}: {link} leads nowhere"


def visited(browser: Any, address: str, name: str, shot: str, **options: Any) -> list[str]:
    """Open a page in a new browser, scroll to its end, and take its picture; its faults."""
    context = browser.new_context(**options)
    context.set_default_timeout(PATIENCE)
    page, faults = context.new_page(), list[str]()
    weights = weighed(context, page)
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))
    page.on("console", lambda said: faults.extend([f"console: {said.text}"] * (said.type == "error")))
    page.on("request", lambda asked: faults.extend([f"asks for {asked.url}"] * is_elsewhere(asked.url, address)))
    page.goto(address + name)
    page.evaluate(TO_ITS_END)
    for frame in page.frames:
        if "/live/" in frame.url:
            frame.wait_for_function("window.page?.shown")
    page.wait_for_timeout(SETTLING)
    faults += page.evaluate(FAULTS_OF_A_PAGE)
    page.screenshot(path=SHOTS / f"{shot}.png", full_page=True)
    weight = weights()
    if weight > HEAVIEST and address.startswith("http"):
        faults.append(f"{weight / 1000:.0f} kB are more than {HEAVIEST / 1000:.0f}")
    print(f"{shot:30} {weight / 1000:4.0f} kB")
    context.close()
    return [f"{shot}: {fault}" for fault in faults]


def is_elsewhere(url: str, address: str) -> bool:
    """True for what is asked of another host."""
    return not url.startswith((address, "data:", "blob:"))


def weighed(context: Any, page: Any) -> Callable[[], int]:
    """Counts the bytes that a page transfers, headers too."""
    weights = dict[str, int]()
    session = context.new_cdp_session(page)
    session.send("Network.enable")
    session.on(
        "Network.loadingFinished", lambda event: weights.update({event["requestId"]: event["encodedDataLength"]})
    )
    return lambda: int(sum(weights.values()))


def not_found(browser: Any, address: str) -> Iterator[str]:
    """Words of `SEARCHES` whose page is not the first that the search of the site answers."""
    for words, wanted in SEARCHES.items():
        if not (SITE / wanted).exists():
            continue
        page = browser.new_page(viewport=SCREENS["desk"])
        page.goto(f"{address}index.html")
        page.keyboard.press("/")
        page.keyboard.type(words, delay=TYPING)
        page.wait_for_timeout(SEARCHING)
        answer = page.evaluate(FIRST_ANSWER)
        if wanted not in answer:
            yield f"'{words}' finds {answer or 'nothing'}; expected {wanted}"
        page.close()


if __name__ == "__main__":
    sys.exit(main())
