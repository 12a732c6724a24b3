"""What is known of a sub-chain once it is expressed in positions: nodes, strokes, hinges, cones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

from ..arrays import Floats

Interval: TypeAlias = tuple[float, float]
FREE: Interval = (-math.inf, math.inf)


class NotExpressible(Exception):
    """Positions alone cannot express this chain; the text says why."""


@dataclass(frozen=True)
class NodeForm:
    """A node at home; `stroke` is the length allowed to the segment before it, `turn` the range of the hinge in it.

    `joints` are those with their centre here; several where they act as one.
    """

    joints: tuple[str, ...]
    at: Floats
    shift: float = 0.0
    stroke: Interval = (0.0, 0.0)
    hinge: bool = False
    turn: Interval = FREE
    angle_home: float = 0.0

    @property
    def joint(self) -> str:
        """The first of the node's joints, for messages."""
        return self.joints[0]


@dataclass(frozen=True)
class ConeForm:
    """A cone at a node: about an axis of the carrier, of the link before it, or of the platform."""

    joint: str
    kind: Literal["carrier", "link", "platform"]
    node: int
    axis: Floats
    half_angle: float


@dataclass(frozen=True)
class TrunkJoint:
    """A joint between the base and the body that carries several branches; its range counts from home."""

    name: str
    point: Floats
    axis: Floats
    slides: bool
    range: Interval


@dataclass(frozen=True)
class BranchForm:
    """One branch as nodes and restrictions, at home, in base coordinates; `told` are joints whose value follows."""

    nodes: tuple[NodeForm, ...]
    planar: int
    normal: Floats
    end_normal: Floats | None
    align: bool
    rail: Floats | None
    rail_range: Interval
    cones: tuple[ConeForm, ...]
    told: tuple[str, ...]
