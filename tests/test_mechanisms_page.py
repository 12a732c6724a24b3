"""The page of the catalogue is what its generator writes, and its pictures exist."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

import pfabrik as pf

pytest.importorskip("matplotlib")

DOCS = Path(__file__).parents[1] / "docs"
LARGEST_PICTURE = 25_000  # bytes


def generator() -> ModuleType:
    """The script tools/site/mechanisms.py as a module."""
    spec = importlib.util.spec_from_file_location("mechanisms_page", DOCS.parent / "tools" / "site" / "mechanisms.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_what_its_generator_writes() -> None:
    written = (DOCS / "mechanisms.md").read_text(encoding="utf-8")
    assert written == generator().page(), "run: python tools/site/mechanisms.py"


def test_every_machine_has_small_pictures_for_light_and_dark_pages_and_no_other_has_one() -> None:
    pictures = {path.stem: path.stat().st_size for path in (DOCS / "pictures").glob("*.png")}
    assert set(pictures) == {f"{name}{ending}" for name in pf.catalog() for ending in ("", "-dark")}, (
        "run: python tools/site/mechanisms.py"
    )
    assert max(pictures.values()) < LARGEST_PICTURE


def test_pictures_are_the_same_every_time_and_stale_ones_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = generator()
    monkeypatch.setattr(module, "PICTURES", tmp_path / "pictures")
    monkeypatch.setattr(module, "PAGE", tmp_path / "mechanisms.md")
    monkeypatch.setattr(module.pf, "catalog", lambda: ("five_bar",))
    module.main()
    first = module.picture("five_bar").read_bytes()
    module.picture("gone").touch()
    module.main()
    assert {path.name for path in module.PICTURES.iterdir()} == {"five_bar.png", "five_bar-dark.png"}
    assert module.picture("five_bar").read_bytes() == first
