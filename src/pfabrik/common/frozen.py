"""A mapping that stays as it is: it goes to other processes and is copied, which `types.MappingProxyType` is not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

K = TypeVar("K")
V = TypeVar("V", covariant=True)


class FrozenMapping(Mapping[K, V]):
    """A read-only copy of a mapping."""

    def __init__(self, given: Mapping[K, V]) -> None:
        self._own = dict(given)

    def __getitem__(self, key: K) -> V:
        return self._own[key]

    def __iter__(self) -> Iterator[K]:
        return iter(self._own)

    def __len__(self) -> int:
        return len(self._own)

    def __repr__(self) -> str:
        return repr(self._own)
