"""The page of the catalogue is what its generator writes, its pictures exist, and the page on adding one is true."""

from __future__ import annotations

import importlib.util
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main

pytest.importorskip("matplotlib")

DOCS = Path(__file__).parents[1] / "docs"
ADDING = (DOCS / "adding-a-mechanism.md").read_text(encoding="utf-8")
LARGEST_PICTURE = 25_000  # bytes


def generator() -> ModuleType:
    """The script docs/mechanisms.py as a module."""
    spec = importlib.util.spec_from_file_location("mechanisms_page", DOCS / "mechanisms.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# The page.


def test_the_page_is_what_its_generator_writes() -> None:
    written = (DOCS / "mechanisms.md").read_text(encoding="utf-8")
    assert written == generator().page(), "run: python docs/mechanisms.py"


def test_every_machine_has_a_small_picture_and_no_other_has_one() -> None:
    pictures = {path.stem: path.stat().st_size for path in (DOCS / "pictures").glob("*.png")}
    assert set(pictures) == set(pf.catalog()), "run: python docs/mechanisms.py"
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
    assert [path.name for path in module.PICTURES.iterdir()] == ["five_bar.png"]
    assert module.picture("five_bar").read_bytes() == first


# Adding a mechanism.


def test_commands_on_the_new_machine_print_what_the_page_shows(tmp_path: Path) -> None:
    (text,) = re.findall(r'write_text\("""\\\n(.*?)"""\)', ADDING, re.DOTALL)
    (tmp_path / "four_rpr.toml").write_text(text, encoding="utf-8")
    shown = re.findall(r"^\$ pfabrik (.*?)\n(.*?)^```$", ADDING, re.DOTALL | re.MULTILINE)
    assert len(shown) == 2
    for line, expected in shown:
        words = [word.replace("four_rpr.toml", str(tmp_path / "four_rpr.toml")) for word in shlex.split(line)]
        printed = CliRunner().invoke(main, words).output
        parts = expected.rstrip("\n").split("\n...\n")
        assert all(part in printed for part in parts), printed
        assert len(parts) > 1 or printed.rstrip("\n") == parts[0]
