"""Notes of an import: what it left out, changed or found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from ..errors import PfabrikError


@dataclass(frozen=True)
class Note:
    """Something that an import left out, changed, or found, with the names of what it is about."""

    what: str
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.what}: {', '.join(self.names)}" if self.names else self.what


@contextmanager
def noting(notes: Sequence[Note]) -> Iterator[None]:
    """Have an error carry the notes made before it, as `__notes__`."""
    try:
        yield
    except PfabrikError as error:
        carried = getattr(error, "__notes__", [])
        for note in notes:
            if f"note: {note}" not in carried:
                error.add_note(f"note: {note}")
        raise
