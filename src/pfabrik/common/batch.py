"""A batch: a NamedTuple of arrays, with a row in each of them for every target or configuration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar, cast

import numpy as np

Batch = TypeVar("Batch", bound=tuple[Any, ...])
"""A NamedTuple of arrays, or of such NamedTuples. Arrays without rows say nothing, whichever rows are taken."""


def take(batch: Batch, places: Any) -> Batch:
    """The rows at some places: an integer array or a mask (copied), or a slice (shared)."""
    make = cast(Any, batch)._make
    taken = make(
        take(item, places) if isinstance(item, tuple) else item[places] if len(item) else item for item in batch
    )
    return cast(Batch, taken)


def take_each(batch: Batch, places: Any) -> Batch:
    """The rows at some places; the whole batch if it has a single row, which is common to all."""
    return batch if len(batch[0]) == 1 else take(batch, places)


def aligned(value: Any) -> Any:
    """A value whose arrays kernels can read and write, those of tuples too: others may come so from other processes."""
    if isinstance(value, np.ndarray):
        return np.require(value, requirements=["C", "A", "W"])
    if isinstance(value, tuple):
        make = getattr(value, "_make", tuple)
        return make(map(aligned, value))
    return value


def put(batch: Batch, places: Any, source: Batch, source_places: Any = slice(None)) -> None:
    """Write rows of a source at some places."""
    for item, source_item in zip(batch, source, strict=True):
        if isinstance(item, tuple):
            put(item, places, source_item, source_places)
        elif len(item):
            item[places] = source_item[source_places]


def joined(batches: Sequence[Batch]) -> Batch:
    """The rows of batches one after the other."""
    make = cast(Any, batches[0])._make
    return cast(Batch, make(np.concatenate(arrays) for arrays in zip(*batches, strict=True)))
