"""Sub-chains to arrays: what the kernels are given, and the names of what they read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..arrays import Floats, Records
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..kernels.reaching import plan as P
from .decompose import SubChain, beyond_positions, decompose
from .forms import BranchForm, TrunkJoint

_CONE_KINDS = {"carrier": P.CARRIER_CONE, "link": P.LINK_CONE, "platform": P.PLATFORM_CONE}


@dataclass(frozen=True)
class JointPoint:
    """Where a joint's centre is read: a node, moved by `shift` along the axis of its hinge."""

    joint: str
    node: int
    shift: float
    axis: Floats
    carrier: int  # what the axis turns with: a carrier, or -1 for the platform


@dataclass(frozen=True)
class CompiledPlan:
    """A mechanism as arrays, and the names that go with them.

    Attributes
    ----------
    plan : the arrays.
    points : how the centres of joints follow from nodes.
    trunk_joints : names of the plan's trunk joints.
    trunk_points : those of them that have a centre, with their places among the plan's.
    home_seed : where home is, (1, ...).
    """

    plan: P.Plan
    points: tuple[JointPoint, ...]
    trunk_joints: tuple[str, ...]
    trunk_points: tuple[tuple[str, int], ...]
    home_seed: P.Seeds


@lru_cache(maxsize=64)
def compile_plan(mechanism: Mechanism) -> CompiledPlan:
    """Compile a mechanism; `UnsupportedMechanism` names every sub-chain that positions cannot express."""
    reasons = beyond_positions(mechanism)
    if reasons:
        raise UnsupportedMechanism(mechanism.name, reasons)
    builder = _Builder(mechanism)
    for chain in decompose(mechanism):
        builder.add_chain(chain)
    return builder.build()


class _Builder:
    """Collects records, numbering nodes, branches and trunk joints as it goes."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.nodes: list[dict[str, Any]] = []
        self.n_stored = 0
        self.branches: list[dict[str, Any]] = []
        self.chains: list[dict[str, Any]] = []
        self.cones: list[dict[str, Any]] = []
        self.trunks: list[dict[str, Any]] = []
        self.trunk_joints: list[dict[str, Any]] = []
        self.points: list[JointPoint] = []
        self.trunk_names: list[str] = []
        self.trunk_points: list[tuple[str, int]] = []

    def add_chain(self, chain: SubChain) -> None:
        trunk = -1
        first = len(self.branches)
        if chain.trunk_joints:
            trunk = len(self.trunks)
            self._add_trunk(chain.trunk_joints)
        for form in chain.branch_forms:
            self._add_branch(form, carrier=trunk + 1 if trunk >= 0 else 0)
        self.chains.append({"first": first, "last": len(self.branches), "trunk": trunk})

    def _add_trunk(self, joints: Sequence[TrunkJoint]) -> None:
        first = len(self.trunk_joints)
        for each in joints:
            if self.mechanism.joint(each.name).at is not None:
                self.trunk_points.append((each.name, len(self.trunk_joints)))
            kind, (lo, hi) = P.SLIDE if each.slides else P.TURN, each.range
            self.trunk_joints.append({"kind": kind, "point": each.point, "axis": each.axis, "lo": lo, "hi": hi})
            self.trunk_names.append(each.name)
        self.trunks.append({"first": first, "last": len(self.trunk_joints)})

    def _add_branch(self, form: BranchForm, carrier: int) -> None:
        first = len(self.nodes)
        for k, node in enumerate(form.nodes):
            self.nodes.append(
                {
                    "home": node.at,
                    "stored": self._store(form, k),
                    "lo": node.stroke[0],
                    "hi": node.stroke[1],
                    "hinge": int(node.hinge),
                    "ranged": int(np.isfinite(node.turn).any()),
                    "angle_home": node.angle_home,
                    "angle_lo": node.turn[0],
                    "angle_hi": node.turn[1],
                }
            )
        cone_first = len(self.cones)
        for cone in form.cones:
            self.cones.append(
                {
                    "kind": _CONE_KINDS[cone.kind],
                    "node": first + cone.node,
                    "axis": cone.axis,
                    "half_angle": cone.half_angle,
                }
            )
        self._add_points(form, first, carrier)
        self.branches.append(
            self._branch_record(form, first, carrier) | {"cone_first": cone_first, "cone_last": len(self.cones)}
        )

    def _store(self, form: BranchForm, k: int) -> int:
        """The place of node k of a branch among the stored ones, or -1 if pose and trunks tell where it is."""
        if k == len(form.nodes) - 1 or (k == 0 and form.rail is None):
            return -1
        self.n_stored += 1
        return self.n_stored - 1

    def _branch_record(self, form: BranchForm, first: int, carrier: int) -> dict[str, Any]:
        nodes, none = form.nodes, np.zeros(3)
        reference = _unit(nodes[1].at - nodes[0].at) if len(nodes) > 1 and form.planar else none
        return {
            "first": first,
            "last": first + len(nodes) - 1,
            "carrier": carrier,
            "planar": form.planar,
            "normal": form.normal,
            "reference": reference,
            "end": nodes[-1].at - np.array(self.mechanism.reference_point),
            "end_plane": int(form.end_normal is not None and not form.align),
            "end_normal": none if form.end_normal is None else form.end_normal,
            "rail": int(form.rail is not None),
            "rail_axis": none if form.rail is None else form.rail,
            "rail_lo": form.rail_range[0],
            "rail_hi": form.rail_range[1],
        }

    def _add_points(self, form: BranchForm, first: int, carrier: int) -> None:
        for k, node in enumerate(form.nodes):
            at_end = k == len(form.nodes) - 1 and form.end_normal is not None
            axis = form.end_normal if at_end and form.end_normal is not None else form.normal
            turning = -1 if at_end else carrier
            self.points += [JointPoint(name, first + k, node.shift, axis, turning) for name in node.joints]

    def build(self) -> CompiledPlan:
        plan = P.Plan(
            nodes=_records(self.nodes, P.NODE),
            branches=_records(self.branches, P.BRANCH),
            chains=_records(self.chains, P.CHAIN),
            cones=_records(self.cones, P.CONE),
            trunks=_records(self.trunks, P.TRUNK_SPAN),
            trunk_joints=_records(self.trunk_joints, P.TRUNK_JOINT),
            length=self.mechanism.characteristic_length,
        )
        home = P.Seeds(
            self.mechanism.home_pose[None].copy(),
            plan.nodes["home"][plan.nodes["stored"] >= 0][None],
            np.zeros((1, len(self.trunk_joints))),
        )
        return CompiledPlan(plan, tuple(self.points), tuple(self.trunk_names), tuple(self.trunk_points), home)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _records(rows: list[dict[str, Any]], dtype: np.dtype[np.void]) -> Records:
    array = np.zeros(len(rows), dtype)
    for i, row in enumerate(rows):
        for name, value in row.items():
            array[i][name] = value
    return array
