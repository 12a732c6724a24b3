"""Certificates: the verdict on a region, with what proves or refutes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats, Mask
from ...common.printed import Printed, ResultTable
from ...common.rotations import to_rpy
from ...errors import counted
from ...ik import solve_ik
from ...kernels.certify.pose_cells import STEPS, CellParameters, is_beside
from ...kernels.certify.prove import DONE, HALF, PROVED_LEGS
from ...kinematics import model_of
from ...machine.description.mechanism import Mechanism
from .pose_region import PoseRegion
from .subdividing import Subdividing, first_cells, step_poses, units_of

Verdict = Literal["PROVED", "REFUTED", "OPEN"]
PROVED: Final = "PROVED"
REFUTED: Final = "REFUTED"
OPEN: Final = "OPEN"

SINGULARITY: Final = ("end effector", "singularity")
"""In place of a limit: a pose on the other side of the parallel singularities than home."""

REPLAYED_HALVINGS = 64
"""Cells that `replay` may look at for each proved one."""

REPLAYED_POSES = 1000
"""Most random poses of proved cells that `replay` solves."""


class Refutation(NamedTuple):
    """A pose that is not reached; or, where singularities count, one that is beyond a parallel singularity.

    Attributes
    ----------
    pose : array (4, 4)
        The pose [length].
    limit : tuple of str
        The pair (joint, bound), as in `Feasibility`; ("end effector", "singularity") of a singularity.
    margin : float
        By how far the limit is broken, as in `margins`: negative; 0 of a singularity.
    answer : Solution
        Answer of `solve_ik`: PROJECTED, with its distances from the pose; REACHED beyond a singularity.
    """

    pose: Floats
    limit: tuple[str, str]
    margin: float
    answer: Solution


@dataclass(frozen=True, eq=False, repr=False)
class Certificate(Printed):
    """The verdict on a region of poses.

    Attributes
    ----------
    mechanism : Mechanism
        The machine, with the limits that count.
    region : PoseRegion or None
        The region; None for a track.
    poses : array (n, 4, 4) or None
        Poses of the track; None for a region.
    verdict : {"PROVED", "REFUTED", "OPEN"}
        "PROVED": every pose is reached in home's working mode, and none is singular if that was asked for. "REFUTED":
        `refutation` is not reached, or beyond a singularity. "OPEN".
    margin : float
        A proved lower bound of the margins of all poses, as in `margins`; minus infinity if not proved.
    least_found : float
        The least margin of a pose that the search measured; infinite if it measured none.
    reason : str
        Why it is open; empty otherwise.
    refutation : Refutation or None
        A pose that is not reached, of a refuted region.
    n_cells : int
        Number of cells looked at.
    is_whole : bool
        True if all proved boxes were kept; beyond 100,000 they are not.
    has_bounds : bool
        False if it is open whatever the budget: legs, limits or links have no bounds over this region.
    """

    mechanism: Mechanism
    region: PoseRegion | None
    poses: Floats | None
    verdict: Verdict
    margin: float
    least_found: float
    reason: str
    refutation: Refutation | None
    n_cells: int
    is_whole: bool
    has_bounds: bool
    _parameters: CellParameters
    _proved: Floats
    _left: Floats

    def __bool__(self) -> bool:
        """True if proved."""
        return self.verdict == PROVED

    @cached_property
    def boxes(self) -> Floats:
        """The boxes on which all limits are proved, (n, 2, 6): low and high ends of the region's parameters [length,
        rad]. Coordinates that follow from the legs are as in the region.

        Of a track, (n, 2, 2): number of the step and share of the way along it.
        """
        return self._ends(self._proved)

    @cached_property
    def open_boxes(self) -> Floats:
        """The boxes that are neither proved nor refuted; see `boxes`."""
        return self._ends(self._left)

    def replay(self) -> bool:
        """Check the proof again: proved boxes cover the region, each is proved by itself, poses in them are reached.

        Of up to 1,000 random poses in the boxes, `solve_ik` has to reach all. False if not proved, or not `is_whole`.
        """
        if self.verdict != PROVED or not self.is_whole:
            return False
        cells, first = self._proved.copy(), first_cells(self._parameters)
        follows = np.flatnonzero(self._parameters.implicit)  # where the search begins there, of each cell
        cells[:, follows] = self._parameters.middle[follows]
        if not all(self._is_covered(root, cells[self._are_in(root, cells)]) for root in first):
            return False
        budget = REPLAYED_HALVINGS * len(cells)  # bounds of a cell may be a little worse than those of its whole
        again = Subdividing(
            model_of(self.mechanism), self._parameters, self._proved[:, :PROVED_LEGS], math.inf, budget, 0
        )
        if again.proceed(None) != DONE:
            return False
        poses = self._random_poses(np.random.default_rng(0))
        return not len(poses) or bool((np.asarray(solve_ik(self.mechanism, poses).status) == Status.REACHED).all())

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and dicts, ready for JSON."""
        refutation = self.refutation
        plain: dict[str, Any] = {
            "verdict": self.verdict,
            "margin": self.margin if math.isfinite(self.margin) else None,
            "reason": self.reason,
            "cells": self.n_cells,
            "boxes": len(self._proved),
            "open_boxes": len(self._left),
            "refutation": None,
        }
        if refutation is not None:
            plain["refutation"] = {
                "pose": refutation.pose.tolist(),
                "joint": refutation.limit[0],
                "bound": refutation.limit[1],
                "margin": refutation.margin,
                "position_error": float(refutation.answer.position_error),
                "rotation_error": float(refutation.answer.rotation_error),
            }
        return plain

    def table(self) -> ResultTable:
        """The verdict and its evidence."""
        lines = [f"{self.verdict}  {counted(self.n_cells, 'cell')}"]
        unit, refutation = self.mechanism.length_unit, self.refutation
        if self:
            more = ", and none is singular" if self._parameters.kinds[4] else ""
            lines.append(f"every pose is reached{more}; margin at least {self.margin:.4g}")
        elif refutation is not None:
            joint, bound = refutation.limit
            x, y, z = refutation.pose[:3, 3].tolist()
            roll, pitch, yaw = np.degrees(to_rpy(refutation.pose[:3, :3])).tolist()
            answer = refutation.answer
            off, turned = float(answer.position_error), math.degrees(float(answer.rotation_error))
            words = "beyond a singularity" if refutation.limit == SINGULARITY else "not reached"
            lines += [
                f"{words}: {x:.6g} {y:.6g} {z:.6g} {unit}, roll {roll:.4g}, pitch {pitch:.4g}, yaw {yaw:.4g} deg",
                f"{joint} {bound}: margin {refutation.margin:.4g}; "
                f"nearest pose {off:.4g} {unit} and {turned:.4g} deg away",
            ]
        else:
            lines.append(f"open: {self.reason}")
        return ResultTable(f"Certificate of {self.mechanism.name}", lines)

    def __repr__(self) -> str:
        words = f"margin at least {self.margin:.4g}" if self.verdict == PROVED else self.reason
        if self.refutation is not None:
            joint, bound = self.refutation.limit
            words = f"{joint} {bound}, margin {self.refutation.margin:.4g}"
        return f"<Certificate of '{self.mechanism.name}': {self.verdict}, {words}; {self.n_cells} cells>"

    def _ends(self, cells: Floats) -> Floats:
        middle, half = cells[:, :HALF], cells[:, HALF:PROVED_LEGS]
        if self._parameters.kinds[0] == STEPS:
            ends = np.stack([middle - half, middle + half], axis=1)[:, :, 1::-1]
        else:
            assert self.region is not None
            units, origin = units_of(model_of(self.mechanism), self.region)
            middle = np.where(self._parameters.implicit, self._parameters.middle, middle)
            ends = np.stack([middle - half, middle + half], axis=1) * units + origin
        ends = np.ascontiguousarray(ends)
        ends.setflags(write=False)
        return ends

    def _are_in(self, root: Floats, cells: Floats) -> Mask:
        """Which cells are in a root, of a track those of its step."""
        if self._parameters.kinds[0] != STEPS:
            return np.ones(len(cells), bool)
        return np.asarray(cells[:, 1] == root[1])

    def _is_covered(self, root: Floats, cells: Floats) -> bool:
        """True if cells, halves of halves of the root, cover all of it that is in the region."""
        pending = [(root, cells)]
        while pending:
            box, inside = pending.pop()
            if is_beside(self._parameters, box[:HALF], box[HALF:]):
                continue
            if not len(inside):
                return False
            if len(inside) == 1 and (inside[0, :PROVED_LEGS] == box).all():
                continue
            halves = self._halves(box, inside)
            if halves is None:
                return False
            pending += halves
        return True

    def _halves(self, box: Floats, cells: Floats) -> list[tuple[Floats, Floats]] | None:
        """Both halves of a box across an axis that no cell crosses, each with its cells."""
        for axis in np.flatnonzero(box[HALF:] > 0.0).tolist():
            half = 0.5 * box[HALF + axis]
            is_low = cells[:, axis] < box[axis]
            if (cells[:, HALF + axis] > half).any():
                continue
            parts = []
            for shift, chosen in ((-half, is_low), (half, ~is_low)):
                part = box.copy()
                part[axis] += shift
                part[HALF + axis] = half
                parts.append((part, cells[chosen]))
            return parts
        return None

    def _random_poses(self, rng: np.random.Generator) -> Floats:
        """Random poses in random proved boxes, and in the region."""
        boxes = self.boxes[rng.permutation(len(self.boxes))[:REPLAYED_POSES]]
        points = rng.uniform(boxes[:, 0], boxes[:, 1])
        if self.region is not None:
            points = points[np.asarray(self.region.contains(points))]
            return self.region.pose(points)
        return step_poses(model_of(self.mechanism), self._parameters, points)
