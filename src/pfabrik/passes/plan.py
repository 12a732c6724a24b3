"""Sub-chains as arrays for the kernels of `passes`, with the names that go with them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Sized
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints, Records
from ..common.derived import derived
from ..errors import UnsupportedMechanism
from ..kernels.passes import plan as P
from ..machine.decomposition.decompose import beyond_positions, decompose
from ..machine.decomposition.positions import BranchForm, express_trunk
from ..machine.description.graph import Step
from ..machine.description.mechanism import Mechanism


@dataclass(frozen=True)
class JointPoint:
    """A joint's centre: a node, moved by `shift` along the axis of its hinge."""

    joint: str
    node: int
    shift: float
    axis: Floats
    carrier: int  # the body that the axis turns with: as of `kernels.passes.plan`, or -1 for the platform


class Lock(NamedTuple):
    """Place of an actuator's coordinate q in the arrays, where its value is sign * (q - origin)."""

    what: Literal["stroke", "hinge", "rail", "end", "trunk"]  # as of `JointMeasure`, or a joint of a trunk
    place: int  # of the node, the branch of the rail, or the trunk joint
    origin: float
    sign: float


@dataclass(frozen=True)
class CompiledPlan:
    """A mechanism as arrays, with the names that go with them.

    Attributes
    ----------
    plan : the arrays.
    points : the centres of joints, as they follow from nodes.
    trunk_joints : names of the plan's trunk joints.
    trunk_points : those of them that have a centre, with their places among the plan's.
    locks : of the actuators, in their order.
    home_seed : home, (1, ...).
    """

    plan: P.Plan
    points: tuple[JointPoint, ...]
    trunk_joints: tuple[str, ...]
    trunk_points: tuple[tuple[str, int], ...]
    locks: tuple[Lock, ...]
    home_seed: P.Seeds


@derived
def compile_plan(mechanism: Mechanism) -> CompiledPlan:
    """Compile a mechanism; `UnsupportedMechanism` names each sub-chain that positions cannot express."""
    reasons = beyond_positions(mechanism)
    if reasons:
        raise UnsupportedMechanism(mechanism.name, reasons)
    return _compiled(mechanism, [(chain.trunk, chain.branch_forms) for chain in decompose(mechanism)])


def _compiled(mechanism: Mechanism, chains: Sequence[tuple[Sequence[Step], Sequence[BranchForm]]]) -> CompiledPlan:
    """Arrays of chains, each with the joints of its trunk, if it has one, and its branches."""
    has_trunk = np.array([bool(trunk) for trunk, _ in chains])
    carriers = np.cumsum(has_trunk) * has_trunk
    forms = [form for _, branches in chains for form in branches]
    carried_by = np.repeat(carriers, [len(branches) for _, branches in chains])
    trunks = [trunk for trunk, _ in chains if trunk]
    steps = [step for trunk in trunks for step in trunk]
    plan = P.Plan(
        nodes=np.concatenate([form.nodes for form in forms]),
        branches=_branches(forms, carried_by),
        chains=_spans([branches for _, branches in chains], P.CHAIN),
        cones=_cones(forms),
        trunks=_spans(trunks, P.TRUNK_SPAN),
        trunk_joints=express_trunk(mechanism, steps),
        length=mechanism.characteristic_length,
        is_literal=0,
    )
    plan.chains["trunk"] = carriers - 1
    return CompiledPlan(
        plan,
        tuple(_points(forms, plan.branches)),
        tuple(step.joint.name for step in steps),
        tuple((step.joint.name, place) for place, step in enumerate(steps) if step.joint.at is not None),
        tuple(_locks(mechanism, steps, forms, plan.branches)),
        P.Seeds(mechanism.home_pose[None].copy(), plan.nodes["home"][None].copy(), np.zeros((1, len(steps)))),
    )


def _locks(
    mechanism: Mechanism, trunks: Sequence[Step], forms: Sequence[BranchForm], branches: Records
) -> Iterator[Lock]:
    """Locks of the actuators, in their order; each is in a trunk or a branch."""
    locks = {}
    for b, (form, branch) in enumerate(zip(forms, branches, strict=True)):
        for measure in form.measures:
            place = b if measure.what == "rail" else int(branch["first"]) + measure.node
            locks[measure.joint] = Lock(measure.what, place, measure.origin, measure.sign)
    for place, step in enumerate(trunks):
        home = mechanism.home_coordinate(step.joint.name)
        assert isinstance(home, float)
        locks[step.joint.name] = Lock("trunk", place, home, 1.0)
    yield from (locks[drive.joint.name] for drive in mechanism.drives)


def _offsets(parts: Iterable[Sized]) -> Ints:
    """The offset of each part in their concatenation, and the end of the last."""
    return np.cumsum([0, *map(len, parts)])


def _spans(parts: Sequence[Sized], dtype: np.dtype[np.void]) -> Records:
    """Records of the first element of each part, and the one after its last."""
    spans, starts = np.zeros(len(parts), dtype), _offsets(parts)
    spans["first"], spans["last"] = starts[:-1], starts[1:]
    return spans


def _cones(forms: Sequence[BranchForm]) -> Records:
    """The cones of all branches, with nodes numbered over all of them."""
    cones = np.concatenate([form.cones for form in forms])
    cones["node"] += np.repeat(_offsets(form.nodes for form in forms)[:-1], [len(form.cones) for form in forms])
    return cones


def _branches(forms: Sequence[BranchForm], carried_by: Ints) -> Records:
    """The records of all branches, with the trunks that carry them and the offsets of their parts."""
    branches = np.array([form.record for form in forms], P.BRANCH)
    nodes, cones = _offsets(form.nodes for form in forms), _offsets(form.cones for form in forms)
    branches["first"], branches["last"], branches["carrier"] = nodes[:-1], nodes[1:] - 1, carried_by
    branches["cone_first"], branches["cone_last"] = cones[:-1], cones[1:]
    return branches


def _points(forms: Sequence[BranchForm], branches: Records) -> Iterator[JointPoint]:
    """The centres of all joints, as they follow from nodes."""
    for form, branch in zip(forms, branches, strict=True):
        for node, (names, shift) in enumerate(zip(form.joints, form.shifts.tolist(), strict=True), branch["first"]):
            at_end = node == branch["last"] and branch["end_normal"].any()
            axis, carrier = branch["end_normal" if at_end else "normal"], -1 if at_end else int(branch["carrier"])
            yield from (JointPoint(name, node, shift, axis, carrier) for name in names)
