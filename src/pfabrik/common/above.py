"""What a method of a result offers though it lies in a layer above."""

from importlib import import_module
from typing import Any


def above(name: str) -> Any:
    """What a module of the package has, by its name below the package: imported when it is asked for, as by a user."""
    module, _, part = name.rpartition(".")
    return getattr(import_module(f"pfabrik.{module}"), part)
