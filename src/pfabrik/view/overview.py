"""What a mechanism is made of and how it is solved, as tables and as plain numbers."""

from __future__ import annotations

import dataclasses
import math
import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ..answers.differential import Mobility, NearlyFree, mobility
from ..capabilities.clearance.clearance import clearance
from ..common.printed import Printed, ResultTable, error_text
from ..ik import solve_ik
from ..kinematics import kind_of_engine
from ..machine.decomposition.decompose import decompose
from ..machine.description.home_mobility import universal_axes
from ..machine.description.joints import DRIVE_FIELDS, KINDS
from ..machine.description.links import has_pairs
from ..machine.description.mechanism import MOST_JOINTS_FOR_FREEDOM, Joint, Mechanism, Shape
from ..machine.description.readouts import readout
from ..machine.meshes import hull_of
from ..machine.model import model_of
from ..tolerances import TOLERANCES

NOT_COUNTED = f"not counted with more than {MOST_JOINTS_FOR_FREEDOM} joints"


@dataclass(frozen=True)
class Overview(Printed):
    """What a mechanism is made of and how it is solved."""

    mechanism: Mechanism

    def table(self) -> ResultTable:
        """Name, size, freedoms and actuators; the joints, sub-chains, parallelograms and shapes."""
        parts = (joint_table, chain_table, parallelogram_table, shape_table)
        tables = [table for table in (part(self.mechanism) for part in parts) if table.rows]
        lines = [self.mechanism.name, *(f"{name:<23}{text}" for name, text in _facts(self.mechanism))]
        return ResultTable(self.mechanism.name, lines, more=tables)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and dicts, angles in radians; None for limits that are not there, and for the mobility
        of more joints than it is counted for."""
        mechanism, counts = self.mechanism, counted_mobility(self.mechanism)
        names = ("name", "length_unit", "characteristic_length", "base", "end_effector", "reference_point", "task")
        engine, reason = kind_of_engine(mechanism), why(mechanism)
        return {
            **{name: getattr(mechanism, name) for name in names},
            "actuators": mechanism.actuator_names,
            "coordinates": mechanism.coordinate_names,
            "mobility": None if counts is None else counts.to_dict(),
            "joints": [_joint_as_dict(joint, mechanism) for joint in mechanism.joints],
            "shapes": [
                {name: value for name, value in dataclasses.asdict(shape).items() if value is not None}
                for shape in mechanism.shapes
            ],
            "clearance": mechanism.clearance,
            "sub_chains": [{"notation": str(chain), "engine": engine, "why": reason} for chain in decompose(mechanism)],
        }


def _joint_as_dict(joint: Joint, mechanism: Mechanism) -> dict[str, Any]:
    """A joint, with the axes that it turns about or slides along at home, unit vectors; none of a ball."""
    axes: list[Any] = [] if KINDS[joint.type].direction is None else [mechanism.home_axis(joint.name)]
    if joint.type == "universal":
        axes = [axis.tolist() for axis in universal_axes(mechanism, joint)]
    return {
        "name": joint.name,
        "type": joint.type,
        "connects": joint.connects,
        "axes": axes,
        "actuated": joint.actuated,
        "home": mechanism.home_coordinate(joint.name),
        "range": joint.range,
        **{field: getattr(joint, field) for field in DRIVE_FIELDS},
        "cone": None if joint.cone is None else dataclasses.asdict(joint.cone),
    }


def _facts(mechanism: Mechanism) -> list[tuple[str, str]]:
    """What is moved and by what, freedoms, and size."""
    kind, length = "joint" if mechanism.end_effector_is_joint else "body", mechanism.characteristic_length
    unit, least = mechanism.length_unit, mechanism.clearance
    point = ", ".join(f"{clean(value, length):.6g}" for value in mechanism.reference_point)
    facts = [
        ("end effector", f"{kind} {mechanism.end_effector}, reference point ({point})"),
        ("task", " ".join(mechanism.task)),
        ("actuators", " ".join(mechanism.actuator_names)),
        *_freedom(counted_mobility(mechanism)),
        ("characteristic length", f"{length:.6g} {unit}"),
    ]
    return facts if least is None else [*facts, ("clearance", f"{least:.6g} {unit} kept between links")]


def counted_mobility(mechanism: Mechanism) -> Mobility | None:
    """Its freedoms; None with so many joints that counting them would take minutes, or hours."""
    return mobility(mechanism) if len(mechanism.joints) <= MOST_JOINTS_FOR_FREEDOM else None


def _freedom(counts: Mobility | None) -> list[tuple[str, str]]:
    """What moves, what drives it, and what nothing holds; in general, where home may be special."""
    if counts is None:
        return [("mobility", NOT_COUNTED)]
    parts = f"{counts.platform} of the end effector, {counts.internal} internal, {counts.idle} idle"
    drives = f"actuators {counts.actuators}, freedoms {counts.platform}"
    facts = [("mobility", f"{counts.mobility}: {parts}"), ("redundancy", f"{counts.redundancy}: {drives}")]
    if counts.uncontrolled:
        facts.append(("uncontrolled", f"{counts.uncontrolled} of the freedoms, with all actuators locked"))
    return facts + [("nearly free", nearly_free(motion)) for motion in counts.nearly_free]


def nearly_free(motion: NearlyFree) -> str:
    """A motion that the loops hardly resist: its joints, its singular value, and if it was counted."""
    counted = "counted" if motion.singular_value <= TOLERANCES.alignment else "not counted"
    value = error_text(motion.singular_value, ".1e")
    return f"{', '.join(motion.joints)}: singular value {value}, {counted} as a motion"


def joint_table(mechanism: Mechanism) -> ResultTable:
    """Every joint with what it connects, its coordinate and its limits; ``*`` marks the actuated ones."""
    rows = [
        (
            joint.name + "*" * bool(joint.actuated),
            joint.type,
            " - ".join(joint.connects),
            _coordinate(joint, mechanism),
            _limits(joint, mechanism),
        )
        for joint in mechanism.joints
    ]
    return ResultTable("Joints", (), ("joint", "type", "connects", "coordinate", "limits"), rows)


def _coordinate(joint: Joint, mechanism: Mechanism) -> str:
    """The distance, angle or displacement that the joint's coordinate is."""
    if joint.type == "universal":
        return f"angles about {' and '.join(map(vector, universal_axes(mechanism, joint)))}"
    if joint.along:
        return f"distance {joint.along[0]} to {joint.along[1]}"
    if joint.axis is None:
        return ""
    kinds = KINDS[joint.type].coordinates
    driven = joint.driven if len(kinds) > 1 else ()
    names = ["angle" if kind == "angle" else "displacement" for kind in kinds]
    shown = " and ".join(name + "*" * (place in driven) for place, name in enumerate(names))
    return f"{shown} {'about' if joint.type == 'revolute' else 'on'} {vector(joint.axis)}"


def _limits(joint: Joint, mechanism: Mechanism) -> str:
    """The joint's range and cone, in degrees and the mechanism's length unit: ``140 to 250 mm``."""
    coordinates = [one for one in mechanism.coordinates if joint.range is not None and one.joint is joint]
    shown = [readout(one, mechanism.length_unit) for one in coordinates]
    parts = [f"{each.limits[0] + 0.0:.6g} to {each.limits[1] + 0.0:.6g} {each.unit}" for each in shown]
    if joint.cone:
        half_angle = math.degrees(joint.cone.half_angle)
        parts.append(f"cone {half_angle:.6g} deg about {vector(joint.cone.axis)} of {joint.cone.fixed_to}")
    return "; ".join(parts)


def vector(components: Iterable[float]) -> str:
    """A direction: ``(0, 0, 1)``."""
    return f"({', '.join(f'{clean(component):.4g}' for component in components)})"


def clean(value: float, scale: float = 1.0) -> float:
    """A number rounded to twelve digits below the scale; zero has no sign."""
    return round(value / scale, 12) * scale + 0.0


def chain_table(mechanism: Mechanism) -> ResultTable:
    """The distinct sub-chains in the field's notation, how often each occurs, the engine that answers, and why."""
    engine, reason = kind_of_engine(mechanism), why(mechanism)
    counts = Counter(map(str, decompose(mechanism)))
    rows = [(str(count), notation, engine, reason) for notation, count in counts.items()]
    return ResultTable("Sub-chains", (), ("count", "sub-chain", "engine", "why"), rows)


def why(mechanism: Mechanism) -> str:
    """The reason why an engine answers for a mechanism."""
    reason = model_of(mechanism).why_no_legs
    if not reason:
        return "closed forms; closure where they do not reach"
    if kind_of_engine(mechanism) == "chains":
        return "no loops, no closed form; closure where they do not reach"
    return f"no closed forms: {reason}"


def parallelogram_table(mechanism: Mechanism) -> ResultTable:
    """The parallelograms in sub-chains: joints of their rods, lengths and distances of these."""
    unit, counts = mechanism.length_unit, Counter[tuple[str, ...]]()
    for shape in (shape for chain in decompose(mechanism) for shape in chain.parallelograms):
        rods = ["-".join(KINDS[mechanism.joint(name).type].letter for name in rod) for rod in shape.rods]
        counts[", ".join(rods), f"{shape.length:.6g} {unit}", f"{shape.width:.6g} {unit}"] += 1
    rows = [(str(count), *cells) for cells, count in counts.items()]
    return ResultTable("Parallelograms", (), ("count", "parallelogram", "rods", "apart"), rows)


def shape_table(mechanism: Mechanism) -> ResultTable:
    """The shapes of bodies, and how far apart the nearest two are at home."""
    rows = [(shape.body, shape.kind, _sizes(shape), " - ".join(shape.between or ())) for shape in mechanism.shapes]
    remarks = []
    if has_pairs(mechanism):
        remarks.append(f"at home {clearance(solve_ik(mechanism, mechanism.home_pose)).in_words}")
    return ResultTable("Shapes", (), ("body", "shape", f"size [{mechanism.length_unit}]", "between"), rows, remarks)


def _sizes(shape: Shape) -> str:
    """The lengths of a shape: ``thickness 8``; of a mesh its file and hull: ``head.stl, 40 vertices``."""
    if shape.file is not None:
        hull = hull_of(shape.file)
        larger = f", up to {(shape.scale or 1.0) * hull.margin:.2g} larger" if hull.margin else ""
        return f"{os.path.basename(shape.file)}, {len(hull.vertices)} vertices{larger}"
    named = (("size", shape.size), ("diameter", shape.diameter), ("thickness", shape.thickness))
    return ", ".join(
        f"{name} {' x '.join(f'{part:.6g}' for part in (value if isinstance(value, tuple) else (value,)))}"
        for name, value in named
        if value is not None
    )
