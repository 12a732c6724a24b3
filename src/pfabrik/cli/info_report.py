"""What a mechanism is made of and how it is solved, as tables and as plain numbers."""

from __future__ import annotations

import dataclasses
import math
import os
from collections import Counter
from collections.abc import Iterable, Sequence

import pfabrik as pf

from ..chains.serial_chain import is_chain
from ..description.home_mobility import universal_axes
from ..description.joint_types import KINDS
from ..description.mechanism import MOST_JOINTS_FOR_FREEDOM
from ..description.readouts import Readout, readout
from ..meshes import hull_of
from ..model import model_of
from ..printed import aligned, error_text
from ..tolerances import TOLERANCES
from .fitted import line_width

NOT_COUNTED = f"not counted with more than {MOST_JOINTS_FOR_FREEDOM} joints"


def as_object(mechanism: pf.Mechanism) -> dict[str, object]:
    """A mechanism as plain numbers, lists and dicts, angles in radians; None for limits that are not there, and for the
    mobility of more joints than it is counted for."""
    counted = counted_mobility(mechanism)
    mobility = None if counted is None else dataclasses.asdict(counted) | {"redundancy": counted.redundancy}
    return {
        "name": mechanism.name,
        "length_unit": mechanism.length_unit,
        "characteristic_length": mechanism.characteristic_length,
        "base": mechanism.base,
        "end_effector": mechanism.end_effector,
        "reference_point": mechanism.reference_point,
        "task": mechanism.task,
        "actuators": mechanism.actuator_names,
        "coordinates": mechanism.coordinate_names,
        "mobility": mobility,
        "joints": [
            {
                "name": joint.name,
                "type": joint.type,
                "connects": joint.connects,
                "axes": axes_of(joint, mechanism),
                "actuated": joint.actuated,
                "home": mechanism.home_coordinate(joint.name),
                "range": joint.range,
                "max_speed": joint.max_speed,
                "max_acceleration": joint.max_acceleration,
                "cone": None if joint.cone is None else dataclasses.asdict(joint.cone),
            }
            for joint in mechanism.joints
        ],
        "shapes": [
            {name: value for name, value in dataclasses.asdict(shape).items() if value is not None}
            for shape in mechanism.shapes
        ],
        "clearance": mechanism.clearance,
        "sub_chains": [
            {"notation": str(chain), "engine": shown_engine(mechanism), "why": why(mechanism)}
            for chain in pf.decompose(mechanism)
        ],
    }


def axes_of(joint: pf.Joint, mechanism: pf.Mechanism) -> list[object]:
    """The axes that a joint turns about or slides along at home, unit vectors; none of a ball."""
    if joint.type == "universal":
        return [axis.tolist() for axis in universal_axes(mechanism, joint)]
    return [] if KINDS[joint.type].direction is None else [mechanism.home_axis(joint.name)]


def describe(mechanism: pf.Mechanism) -> str:
    """A mechanism in tables, for people."""
    tables = [summary(mechanism), joint_table(mechanism), chain_table(mechanism), parallelogram_table(mechanism)]
    tables.append(shape_table(mechanism))
    return "\n\n".join(table for table in tables if table)


def summary(mechanism: pf.Mechanism) -> str:
    """Name, size, what is moved and by what."""
    kind = "joint" if mechanism.end_effector_is_joint else "body"
    length = mechanism.characteristic_length
    point = ", ".join(f"{clean(value, length):.6g}" for value in mechanism.reference_point)
    return "\n".join(
        [
            mechanism.name,
            f"end effector           {kind} {mechanism.end_effector}, reference point ({point})",
            f"task                   {' '.join(mechanism.task)}",
            *in_columns("actuators              ", mechanism.actuator_names),
            *freedom(counted_mobility(mechanism)),
            f"characteristic length  {length:.6g} {mechanism.length_unit}",
            *kept_clearance(mechanism),
        ]
    )


def kept_clearance(mechanism: pf.Mechanism) -> list[str]:
    """A line on the least distance that answers keep between links; none without."""
    least = mechanism.clearance
    return [] if least is None else [f"clearance              {least:.6g} {mechanism.length_unit} kept between links"]


def in_columns(title: str, names: Sequence[str]) -> list[str]:
    """Names behind a title; where a line of the terminal is too short, in aligned columns below each other."""
    room = (line_width() or 10_000) - len(title)
    if len(line := " ".join(names)) <= room:
        return [title + line]
    width = max(map(len, names)) + 1
    n = max(room // width, 1)
    rows = ["".join(name.ljust(width) for name in names[place : place + n]) for place in range(0, len(names), n)]
    return [(" " * len(title) if place else title) + row.rstrip() for place, row in enumerate(rows)]


def counted_mobility(mechanism: pf.Mechanism) -> pf.Mobility | None:
    """Its freedoms; None with so many joints that counting them would take minutes, or hours."""
    return pf.mobility(mechanism) if len(mechanism.joints) <= MOST_JOINTS_FOR_FREEDOM else None


def freedom(counted: pf.Mobility | None) -> list[str]:
    """Lines on what moves, what drives it, and what nothing holds; in general, where home may be special."""
    if counted is None:
        return [f"mobility               {NOT_COUNTED}"]
    parts = f"{counted.platform} of the end effector, {counted.internal} internal, {counted.idle} idle"
    lines = [
        f"mobility               {counted.mobility}: {parts}",
        f"redundancy             {counted.redundancy}: actuators {counted.actuators}, freedoms {counted.platform}",
    ]
    if counted.uncontrolled:
        lines.append(f"uncontrolled           {counted.uncontrolled} of the freedoms, with all actuators locked")
    return lines + [f"nearly free            {nearly_free(motion)}" for motion in counted.nearly_free]


def nearly_free(motion: pf.NearlyFree) -> str:
    """A motion that the loops hardly resist: its joints, its singular value, and if it was counted."""
    counted = "counted" if motion.singular_value <= TOLERANCES.alignment else "not counted"
    return (
        f"{', '.join(motion.joints)}: singular value {error_text(motion.singular_value, '.1e')}, {counted} as a motion"
    )


def joint_table(mechanism: pf.Mechanism) -> str:
    """Every joint with what it connects, its coordinate and its limits; ``*`` marks the actuated ones."""
    rows = []
    for joint in mechanism.joints:
        name = joint.name + "*" * bool(joint.actuated)
        rows.append(
            (name, joint.type, " - ".join(joint.connects), coordinate(joint, mechanism), limits(joint, mechanism))
        )
    return aligned(("joint", "type", "connects", "coordinate", "limits"), rows)


def coordinate(joint: pf.Joint, mechanism: pf.Mechanism) -> str:
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
    measured = " and ".join(name + "*" * (place in driven) for place, name in enumerate(names))
    return f"{measured} {'about' if joint.type == 'revolute' else 'on'} {vector(joint.axis)}"


def limits(joint: pf.Joint, mechanism: pf.Mechanism) -> str:
    """The joint's range and cone, in degrees and the mechanism's length unit."""
    coordinates = mechanism.coordinates if joint.range is not None else ()
    parts = [interval(readout(one, mechanism.length_unit)) for one in coordinates if one.joint is joint]
    if joint.cone:
        half_angle = math.degrees(joint.cone.half_angle)
        parts.append(f"cone {half_angle:.6g} deg about {vector(joint.cone.axis)} of {joint.cone.fixed_to}")
    return "; ".join(parts)


def interval(shown: Readout) -> str:
    """``140 to 250 mm``."""
    low, high = shown.limits
    return f"{low + 0.0:.6g} to {high + 0.0:.6g} {shown.unit}"


def vector(components: Iterable[float]) -> str:
    """A direction: ``(0, 0, 1)``."""
    return f"({', '.join(f'{clean(component):.4g}' for component in components)})"


def clean(value: float, scale: float = 1.0) -> float:
    """A number rounded to twelve digits below the scale; zero has no sign."""
    return round(value / scale, 12) * scale + 0.0


def chain_table(mechanism: pf.Mechanism) -> str:
    """The distinct sub-chains in the field's notation, how often each occurs, the engine that answers, and why."""
    counts = Counter((str(chain), why(mechanism)) for chain in pf.decompose(mechanism))
    engine = shown_engine(mechanism)
    rows = [(str(count), notation, engine, reason) for (notation, reason), count in counts.items()]
    return aligned(("count", "sub-chain", "engine", "why"), rows)


def shown_engine(mechanism: pf.Mechanism) -> str:
    """The engine that answers first."""
    model = model_of(mechanism)
    return "legs" if model.has_legs else "chains" if is_chain(model) else "closure"


def why(mechanism: pf.Mechanism) -> str:
    """The reason why an engine answers for a mechanism."""
    model = model_of(mechanism)
    if not model.why_no_legs:
        return "closed forms; closure where they do not reach"
    if is_chain(model):
        return "no loops, no closed form; closure where they do not reach"
    return f"no closed forms: {model.why_no_legs}"


def shape_table(mechanism: pf.Mechanism) -> str:
    """The shapes of bodies, and how far apart the nearest two are at home; empty without any."""
    from .report import clearance_line

    if not mechanism.shapes:
        return ""
    rows = [(shape.body, shape.kind, sizes(shape), " - ".join(shape.between or ())) for shape in mechanism.shapes]
    table = aligned(("body", "shape", f"size [{mechanism.length_unit}]", "between"), rows)
    return "\n".join(
        [table, *(f"at home {line}" for line in clearance_line(pf.solve_ik(mechanism, mechanism.home_pose)))]
    )


def sizes(shape: pf.Shape) -> str:
    """The lengths of a shape: ``thickness 8``."""
    if shape.file is not None:
        return hull_in_words(shape)
    named = (("size", shape.size), ("diameter", shape.diameter), ("thickness", shape.thickness))
    return ", ".join(
        f"{name} {' x '.join(f'{part:.6g}' for part in (value if isinstance(value, tuple) else (value,)))}"
        for name, value in named
        if value is not None
    )


def hull_in_words(shape: pf.Shape) -> str:
    """The file of a mesh, how many vertices its hull has, and how much larger it is made: ``head.stl, 40 vertices``."""
    hull = hull_of(shape.file or "")
    larger = f", up to {(shape.scale or 1.0) * hull.margin:.2g} larger" if hull.margin else ""
    return f"{os.path.basename(shape.file or '')}, {len(hull.vertices)} vertices{larger}"


def parallelogram_table(mechanism: pf.Mechanism) -> str:
    """The parallelograms in sub-chains: joints of their rods, lengths and distances of these; empty without any."""
    unit, counts = mechanism.length_unit, Counter[tuple[str, ...]]()
    for shape in (shape for chain in pf.decompose(mechanism) for shape in chain.parallelograms):
        rods = ["-".join(KINDS[mechanism.joint(name).type].letter for name in rod) for rod in shape.rods]
        counts[", ".join(rods), f"{shape.length:.6g} {unit}", f"{shape.width:.6g} {unit}"] += 1
    rows = [(str(count), *cells) for cells, count in counts.items()]
    return aligned(("count", "parallelogram", "rods", "apart"), rows) if rows else ""
