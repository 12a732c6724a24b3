"""A joint of a sub-chain, as closed forms read it."""

from __future__ import annotations

from typing import Protocol

from pfabrik import Joint


class Step(Protocol):
    """A joint on the way of a sub-chain, from the base outward: what `SubChain.steps` and its branches hold."""

    @property
    def joint(self) -> Joint: ...

    @property
    def sign(self) -> float:
        """+1 if the joint's coordinate moves the body it leads to relative to the one before, else -1."""

    @property
    def inward(self) -> str:
        """The body that the way comes from."""

    @property
    def back(self) -> Step:
        """The same joint, the other way round."""
