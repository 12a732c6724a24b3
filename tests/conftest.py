"""What all tests share: the same random examples in every run, and which code the kernels are, in each process."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import settings

from costs import Costs, slow_items
from pfabrik.kernels._shipped import IS_INTERPRETED as INTERPRETED

os.environ.setdefault("MPLBACKEND", "Agg")  # pictures open no window, whatever the user's settings
os.environ.pop("COLUMNS", None)  # workers have that of a terminal, which output would be fitted to
if INTERPRETED:
    os.environ["PFABRIK_KERNELS"] = "python"  # asked for: no process that a test starts warns of it

settings.register_profile("fixed", derandomize=True, deadline=None, database=None, max_examples=2 if INTERPRETED else 8)
settings.register_profile("explore", deadline=None, max_examples=500)
settings.load_profile(os.environ.get("PFABRIK_HYPOTHESIS", "fixed"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--costs", action="store_true", help="measure what items cost, and write tests/costs.toml")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--costs"):
        config.pluginmanager.register(Costs(hasattr(config, "workerinput")))


@pytest.hookimpl(tryfirst=True)  # before marks are asked for
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is left to `make test-all`; `-m ''` asks for all."""
    slow = slow_items([item.nodeid for item in items])
    for item in items:
        if item.nodeid in slow:
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish() -> None:
    """Thousands of tests stay to the end: the garbage collector need not look through them again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def figures_are_closed() -> Iterator[None]:
    """No figure stays open behind a test: pyplot warns of the twenty-first."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of solids have few pixels, and are drawn quickly."""
    sizes = {"solid_picture": ("ACROSS", "ACROSS_BELOW"), "singular_picture": ("PIXELS", "HULL_PIXELS")}
    for module, names in sizes.items():
        for name in names:
            monkeypatch.setattr(import_module(f"pfabrik.view.{module}"), name, 120)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of one's own to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
