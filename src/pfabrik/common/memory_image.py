"""Records of arrays as one block of memory, which another program reads as its own."""

from __future__ import annotations

import base64
import gzip
from typing import Any, NamedTuple

import numpy as np

ALIGNED = 16
"""Arrays begin at multiples of this [bytes]."""


class Image(NamedTuple):
    """A block of memory.

    Attributes
    ----------
    data : its bytes up to the last that is not zero, addresses counted from its beginning.
    size : of the whole block [bytes].
    moved : places of the addresses in it, to which where the block lies is to be added.
    places : offset of every record by its name, of every array of it as "name.field", and of where the record has its
        address and shape as "&name.field".
    """

    data: bytes
    size: int
    moved: list[int]
    places: dict[str, int]


def image_of(records: dict[str, tuple[Any, ...]]) -> Image:
    """The image of NamedTuples of arrays, and of such NamedTuples, by their names.

    An array is its address and its shape, eight bytes each; arrays that are in several records are written once.
    """
    arrays: dict[int, Any] = {}
    words = {name: list(_words(record, arrays)) for name, record in records.items()}
    blocks = {name: np.zeros(len(of_record), np.int64) for name, of_record in words.items()}
    contents = [*blocks.values(), *(array for array in arrays.values() if array.view(np.uint8).any())]
    zeros = [array for array in arrays.values() if not array.view(np.uint8).any()]
    offsets, at = {}, ALIGNED
    for array in [*contents, *zeros]:
        offsets[id(array)] = at
        at += -(-max(array.nbytes, 1) // ALIGNED) * ALIGNED
    moved = []
    for name, block in blocks.items():
        for k, word in enumerate(words[name]):
            block[k] = word if isinstance(word, int) else offsets[id(word)]
            if not isinstance(word, int):
                moved.append(offsets[id(block)] + 8 * k)
    data = bytearray(offsets[id(zeros[0])] if zeros else at)
    for array in contents:
        data[offsets[id(array)] : offsets[id(array)] + array.nbytes] = array.tobytes()
    places = {name: offsets[id(block)] for name, block in blocks.items()}
    for name, record in records.items():
        word = places[name]
        for field, value in zip(record._fields, record, strict=True):  # type: ignore[attr-defined]
            if isinstance(value, np.ndarray):
                places[f"{name}.{field}"], places[f"&{name}.{field}"] = offsets[id(arrays[id(value)])], word
            word += 8 * len(list(_words((value,), {})))
    return Image(bytes(data), at, moved, places)


def _words(record: tuple[Any, ...], arrays: dict[int, Any]) -> Any:
    """The words of a record: integers, and arrays in place of their addresses."""
    for item in record:
        if isinstance(item, tuple):
            yield from _words(item, arrays)
        else:
            yield arrays.setdefault(id(item), np.ascontiguousarray(item).reshape(-1))
            yield from item.shape


def packed(data: bytes) -> str:
    """Bytes as text: compressed, and always the same."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()
