"""Machines of every kind of leg, their dimensions drawn at random."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from pfabrik import Joint, Mechanism, Shape

from .closure import POSITION, TURNS, X, Y, Z, _pin_parallelogram, around, chain, joint, out, pairs, strut
from .positions import ring, struts
from .redescribed import moved

Draw = np.random.Generator
Angles = Sequence[float]


def _anywhere(machine: Mechanism, rng: Draw, *, upright: bool = False) -> Mechanism:
    """The machine somewhere else, about any axis or about z."""
    turn = rng.uniform(-3.0, 3.0, 3) * ((0, 0, 1) if upright else 1)
    return moved(machine, Rotation.from_rotvec(turn).as_matrix(), rng.uniform(-100.0, 100.0, 3))


def _pairs_on_arms(
    rng: Draw, carrier: str, kinds: str = "SS", start: str = "base", end: str = "platform", angles: Angles = TURNS
) -> tuple[list[Joint], float]:
    """Pairs of rods on cranks (R) or carriages (P), every leg of its own dimensions; and the height of the platform."""
    joints, height = [], -rng.uniform(180.0, 260.0)
    for leg, nominal in enumerate(angles, 1):
        angle = nominal + rng.uniform(-10.0, 10.0)
        outward, side = out(angle), np.cross(Z, out(angle))
        hip, arm, wrist = rng.uniform(70, 110), rng.uniform(50, 90), rng.uniform(25, 45)
        elbow = (hip + arm) * outward - [0, 0, rng.uniform(0, 50)]
        if carrier == "R":
            joints.append(joint("R*", f"A{leg}", (start, f"arm{leg}"), hip * outward, side, range=(-0.9, 1.2)))
        else:
            rail = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3)).as_matrix() @ Z
            joints.append(joint("P*", f"A{leg}", (start, f"arm{leg}"), None, rail, range=(-80, 80)))
        joints += pairs(
            elbow, wrist * outward + [0, 0, height], rng.uniform(12, 28) * side, (f"arm{leg}", end), leg, kinds,
            rng.choice([None, 0.9]),
        )  # fmt: skip
    return joints, height


def _delta(carrier: str, kinds: str, rng: Draw) -> Mechanism:
    joints, height = _pairs_on_arms(rng, carrier, kinds)
    return _anywhere(Mechanism("delta", joints, "platform", (0, 0, height), task=POSITION), rng)


def _apart(rng: Draw) -> Mechanism:
    """A delta whose rods keep apart."""
    machine = _delta("R", "SS", rng)
    shapes = [Shape(body, thickness=6.0) for body in machine.bodies if body.startswith("rod")]
    return machine.with_shapes(shapes, ()).with_clearance(2.0)


def _uneven(rng: Draw) -> Mechanism:
    """A delta as it is measured: no two rods are equal."""
    machine = _delta("R", "SS", rng)
    shift = 1e-3 * machine.characteristic_length
    joints = [
        dataclasses.replace(each, at=each.at + rng.uniform(-shift, shift, 3)) if each.type == "spherical" else each
        for each in machine.joints
    ]
    return dataclasses.replace(machine, joints=joints)


def _on_a_slide(rng: Draw) -> Mechanism:
    """A delta under a driven carriage."""
    joints, height = _pairs_on_arms(rng, "R", start="carriage")
    slide = joint("P*", "slide", ("base", "carriage"), None, X, range=(-100, 100))
    return _anywhere(Mechanism("delta on a slide", [slide, *joints], "platform", (0, 0, height), task=POSITION), rng)


def _with_wrist(rng: Draw) -> Mechanism:
    """A delta that carries a driven hinge."""
    joints, height = _pairs_on_arms(rng, "R", end="plate")
    joints.append(joint("R*", "wrist", ("plate", "platform"), (0, 0, height), Z, range=(-2.0, 2.0)))
    machine = Mechanism("delta with a wrist", joints, "platform", (0, 0, height), task=(*POSITION, "yaw"))
    return _anywhere(machine, rng, upright=True)


def _with_shaft(rng: Draw) -> Mechanism:
    """A delta whose tool a shaft turns."""
    joints, height = _pairs_on_arms(rng, "R", end="plate")
    joints.append(joint("R", "bearing", ("plate", "tool"), (0, 0, height), Z))
    joints += chain(
        "shaft",
        ("R*", (0, 0, 0), Z, {"range": (-3.0, 3.0)}),
        ("U", (0, 0, -20), (X, Y)),
        ("P", None, (0, 0, -1), {"range": (-150, 150)}),
        ("U", (0, 0, height + 20), (Y, X)),
        end="tool",
    )
    machine = Mechanism("delta with a shaft", joints, "tool", (0, 0, height - 20), task=(*POSITION, "yaw"))
    return _anywhere(machine, rng, upright=True)


def _pinned(rng: Draw) -> Mechanism:
    joints, height = [], -rng.uniform(180.0, 260.0)
    for leg, nominal in enumerate(TURNS, 1):
        outward = out(nominal + rng.uniform(-10.0, 10.0))
        side, elbow = np.cross(Z, outward), rng.uniform(130, 190) * outward - [0, 0, 50]
        joints.append(joint("R*", f"A{leg}", ("base", f"arm{leg}"), 90 * outward, side, range=(-0.9, 1.2)))
        wrist = rng.uniform(25, 45) * outward + [0, 0, height]
        joints += _pin_parallelogram(leg, f"arm{leg}", elbow, wrist, side, "platform")
    return _anywhere(Mechanism("delta with pins", joints, "platform", (0, 0, height), task=POSITION), rng)


def _two_halves(rng: Draw, *, bars: bool) -> Mechanism:
    """H4, or Par4 with bars: pairs of rods on two half platforms."""
    angles = (35, 145, 215, 325)
    joints, height = _pairs_on_arms(rng, "R", end="front", angles=angles)
    back = {"C" + mark + str(leg) for leg in (3, 4) for mark in "LR"}
    joints = [
        dataclasses.replace(each, connects=(each.connects[0], "back")) if each.name in back else each for each in joints
    ]
    if bars:
        for bar, x in ((1, -30.0), (2, 30.0)):
            limit = {"range": (-1.5, 1.5)} if bar == 1 else {}
            joints.append(joint("R", f"P{bar}", ("front", f"bar{bar}"), (x, 15, height), Z, **limit))
            joints.append(joint("R", f"Q{bar}", ("back", f"bar{bar}"), (x, -15, height), Z))
        end = "bar1", (-30, 0, height)
    else:
        joints.append(joint("R", "Q1", ("front", "platform"), (0, 15, height), Z, range=(-1.4, 1.4)))
        joints.append(joint("R", "Q2", ("back", "platform"), (0, -15, height), Z))
        end = "platform", (0, 0, height)
    return _anywhere(Mechanism("halves", joints, *end, task=(*POSITION, "yaw")), rng, upright=True)


def _hexapod(rng: Draw) -> Mechanism:
    turns = np.repeat(TURNS, 2) + np.tile([-20.0, 20.0], 3) + rng.uniform(-8, 8, 6)
    feet, heads = ring(100, 0, turns), ring(60, rng.uniform(150, 200), turns + np.tile([-25.0, 25.0], 3))
    joints = struts(feet, heads, range=(130, 250))
    return _anywhere(Mechanism("hexapod", joints, "platform", tuple(np.mean(heads, axis=0))), rng)


def _cranked_hexapod(rng: Draw) -> Mechanism:
    joints, height = [], rng.uniform(110.0, 140.0)
    for leg in range(6):
        angle = 60.0 * leg + rng.uniform(-12, 12)
        foot = 100 * out(angle)
        axis = np.cross(Z, out(angle + rng.uniform(-20, 20)))
        horn = foot + rng.uniform(25, 40) * np.cross(axis, Z)
        head = 65 * out(angle + (20 if leg % 2 else -20)) + [0, 0, height]
        joints += chain(leg, ("R*", foot, axis, {"range": (-1.2, 1.2)}), ("S", horn), ("S", head))
    return _anywhere(Mechanism("6-RSS", joints, "platform", (0, 0, height)), rng)


def _tripod(kind: str, rng: Draw) -> Mechanism:
    radius, top, height = rng.uniform(90, 120), rng.uniform(50, 70), rng.uniform(150, 190)
    if kind == "RPS":
        legs = strut((radius, 0, 0), (top, 0, height), ("R", Y), ("S",), range=(110, 230))
    else:
        legs = (("P*", None, Z, {"range": (-60, 60)}), ("R", (radius, 0, 0), Y), ("S", (top, 0, height)))
    machine = Mechanism(kind, around(*legs, angles=np.add(TURNS, rng.uniform(-10, 10, 3))), "platform", (0, 0, height))
    return _anywhere(machine, rng, upright=True)


def _planar(rng: Draw) -> Mechanism:
    joints = []
    for leg, angle in enumerate(TURNS):
        foot, head = 120 * out(angle), 40 * out(angle + rng.uniform(-20, 20))
        elbow = 0.5 * (foot + head) + rng.uniform(30, 60) * np.cross(Z, out(angle))
        joints += chain(leg, ("R*", foot, Z, {"range": (-1.0, 1.0)}), ("R", elbow, Z), ("R", head, Z))
    return _anywhere(Mechanism("3-RRR", joints, "platform", (0, 0, 0)), rng, upright=True)


DRAWN: dict[str, Callable[[Draw], Mechanism]] = {
    "delta of balls": partial(_delta, "R", "SS"),
    "delta of balls and cardans": partial(_delta, "R", "SU"),
    "delta of cardans": partial(_delta, "R", "UU"),
    "delta on rails": partial(_delta, "P", "SS"),
    "delta on rails, of cardans and balls": partial(_delta, "P", "US"),
    "delta, rods apart": _apart,
    "delta, measured": _uneven,
    "delta on a slide": _on_a_slide,
    "delta with a wrist": _with_wrist,
    "delta with a shaft": _with_shaft,
    "delta with pins": _pinned,
    "H4": partial(_two_halves, bars=False),
    "Par4": partial(_two_halves, bars=True),
    "6-UPS": _hexapod,
    "6-RSS": _cranked_hexapod,
    "3-RPS": partial(_tripod, "RPS"),
    "3-PRS": partial(_tripod, "PRS"),
    "3-RRR": _planar,
}
"""Machines by kind, each from a generator of random numbers."""
