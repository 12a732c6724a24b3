"""The gallery has every machine and every task, and what its pages print of machines is what they promise."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest

import pfabrik as pf
from pfabrik.errors import InvalidArgument

pytest.importorskip("matplotlib")

DOCS = Path(__file__).parents[1] / "docs"
LIVE = DOCS / "pictures" / "live"


@pytest.fixture
def gallery(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS.parent / "tools" / "site")
    return importlib.import_module("gallery")


def is_live(name: str, folder: Path) -> bool:
    try:
        pf.export_web(pf.load(name), folder / f"{name}.html")
    except InvalidArgument:
        return False
    return True


def test_the_gallery_is_what_its_generator_writes(gallery: ModuleType) -> None:
    assert (DOCS / "gallery.md").read_text(encoding="utf-8") == gallery.page(), "run: python tools/site/gallery.py"


@pytest.mark.compiled
def test_every_machine_with_a_live_page_has_a_picture_of_it_for_light_and_for_dark_pages(tmp_path: Path) -> None:
    live = {name for name in pf.catalog() if is_live(name, tmp_path)}
    expected = {f"{name}{end}" for name in (*live, "film") for end in ("", "-dark")}
    assert {path.stem for path in LIVE.glob("*.webp")} == expected, "run: python tools/site/portraits.py NAME"


@pytest.mark.parametrize("name", ["delta", "g1_ankle", "serial_arm", "snake60"])
def test_six_lines_reach_one_target_and_say_what_keeps_them_from_the_other(gallery: ModuleType, name: str) -> None:
    first, *_, last = gallery.printed(gallery.six_lines(name)).splitlines()
    assert first.lower().startswith("reached")
    assert any(word in last for word in ("maximum", "minimum", "cone", "stretched"))


def test_a_table_of_pictures_becomes_a_grid_of_cards(gallery: ModuleType, tmp_path: Path) -> None:
    cards = gallery.cards
    (tmp_path / "a.png").write_bytes((DOCS / "pictures" / "five_bar.png").read_bytes())
    made = [cards.Card(f"title {k}", "a.png", f"page{k}.md") for k in range(cards.COLUMNS + 1)]
    grid = cards.grid(f"before\n\n{cards.table(made)}\nafter | all\n", tmp_path)
    assert grid.startswith("before\n")
    assert "after | all" in grid
    assert [line.partition("](page")[2][0] for line in grid.splitlines() if "{ .card }" in line] == list("01234")
    assert (tmp_path / "small" / "a.webp").stat().st_size < (tmp_path / "a.png").stat().st_size
