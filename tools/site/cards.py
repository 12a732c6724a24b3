"""Tables of pictures, as any reader of Markdown shows them, made grids of cards with small pictures for the site."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from PIL import Image

COLUMNS = 4
WIDTH, QUALITY = 360, 60  # of a small picture: pixels, and WebP's own measure of 100
WHITE = 250  # of 255: a lighter ground is white
CELL = re.compile(r"\[!\[([^\]]*)\]\(([^)]+)\)\]\(([^)]+)\)")
"""A picture that is a link: its title, its file, and where it leads."""


class Card(NamedTuple):
    """A picture with a title, a text below it, and where it leads."""

    title: str
    picture: str
    link: str
    text: str = ""


def table(cards: list[Card]) -> str:
    """Cards as a table of Markdown, its rows pictures and titles by turns."""
    lines = []
    for first in range(0, len(cards), COLUMNS):
        row = cards[first : first + COLUMNS]
        empty = [""] * (COLUMNS - len(row))
        pictures = [f"[![{card.title}]({card.picture})]({card.link})" for card in row]
        lines += [[*pictures, *empty], [*(f"[{card.title}]({card.link})" for card in row), *empty]]
    lines.insert(1, [":--:"] * COLUMNS)
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def grid(text: str, folder: Path) -> str:
    """The text with its tables of pictures as grids of cards; their small pictures are written into the folder."""
    return re.sub(r"(?:^\|.*\|$\n?)+", lambda found: _grid(found[0], folder), text, flags=re.MULTILINE)


def _grid(text: str, folder: Path) -> str:
    cards = list(_cards(text))
    if not cards:
        return text
    return "\n".join(['<div class="cards" markdown>', *(_shown(card, folder) for card in cards), "</div>\n"])


def _cards(text: str) -> Iterator[Card]:
    rows = [
        re.split(r"\s*\|\s*", line.strip("| \n")) for line in text.splitlines() if not re.fullmatch(r"[|:\- ]+", line)
    ]
    for pictures, captions in zip(rows[::2], rows[1::2], strict=True):
        for picture, caption in zip(pictures, captions, strict=False):
            if found := CELL.fullmatch(picture):
                yield Card(found[1], found[2], found[3], re.sub(r"^\**\[.*?\]\(.*?\)\**:?\s*", "", caption))


def _shown(card: Card, folder: Path) -> str:
    """A card as a link with a picture for light pages and one for dark ones, or one for both."""
    path = folder / card.picture
    dark = path.with_name(f"{path.stem}-dark{path.suffix}")
    if dark.exists():
        pictures = _small(path, folder, "#only-light") + _small(dark, folder, "#only-dark")
    else:
        pictures = _small(path, folder)
    text = f" <small>{card.text}</small>" if card.text else ""
    return f"[{pictures} **{card.title}**{text}]({card.link}){{ .card }}"


def _small(path: Path, folder: Path, only: str = "") -> str:
    """A small copy of a picture, written beside the pages, in Markdown."""
    name = f"{'-'.join(path.relative_to(folder).with_suffix('').parts)}.webp"
    (folder / "small").mkdir(exist_ok=True)
    with Image.open(path) as picture:
        picture = picture.convert("RGBA")
        picture.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
        picture.save(folder / "small" / name, quality=QUALITY, alpha_quality=QUALITY, method=6)
        size = f"width={picture.width} height={picture.height}"
    classes = ".on-white " * is_on_white(path)
    return f"![](small/{name}{only}){{ {classes}loading=lazy {size} }}"


def is_on_white(path: Path) -> bool:
    """True if a picture has a white ground, as its corners show."""
    with Image.open(path) as picture:
        corners = picture.convert("RGBA")
        places = [(x, y) for x in (0, corners.width - 1) for y in (0, corners.height - 1)]
        return all(min(corners.getpixel(place)) >= WHITE for place in places)
