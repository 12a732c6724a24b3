"""Notes of an import: what it left out, changed or found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
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


def note_names(notes: list[Note], what: str, names: Iterable[object]) -> None:
    """Add a note of some names, unless there are none."""
    if texts := tuple(map(str, names)):
        notes.append(Note(what, texts))


def counted_names(counts: Counter[str]) -> list[str]:
    """Things that have no names, or too many: ``geom (30)``."""
    return [f"{name} ({count})" for name, count in sorted(counts.items())]


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
