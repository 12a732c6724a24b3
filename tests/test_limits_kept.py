"""Limits are kept in all joints of an answer, passive legs' too, and what stops a machine has a name."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED, assert_feasible
from machines import EVERY, machine
from machines.closure import Z, chain, joint, out, pairs
from oracles import any_values, targets_about
from pfabrik import Mechanism
from pfabrik.machine.motion.displacements import home_coordinates

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

QUICK = ("five_bar", "stewart", "delta", "rps", "serial_arm", "closure.upu", "closure.pinned_delta", "closure.SCARA")
SPARES = ("hinges", "cranks", "cranks with cones", "slides")


def spare(kind: str) -> Mechanism:
    """Four legs, of which the last is passive, with the limits of the others."""
    joints = []
    for leg, angle in enumerate((0, 90, 180, 270), 1):
        outward, across, driven = out(angle), np.cross(Z, out(angle)), "*" if leg < 4 else ""
        foot, elbow, head = 70 * outward, 120 * outward + [0, 0, -20], 40 * outward + [0, 0, 120]
        if kind == "hinges":
            hinge = (f"R{driven}", foot, across, {"range": (-1.0, 1.0)})
            joints += chain(leg, hinge, ("S", 120 * outward + [0, 0, 60]), ("R", foot + [0, 0, 120], across))
            continue
        drive = (f"R{driven}", across, (-0.4, 0.8)) if "cranks" in kind else (f"P{driven}", Z, (-40, 30))
        joints.append(joint(drive[0], f"A{leg}", ("base", f"arm{leg}"), foot, drive[1], range=drive[2]))
        cone = 0.6 if "cones" in kind else None
        joints += pairs(elbow, head, 15 * across, (f"arm{leg}", "platform"), leg, cone=cone)
    task = ("z", "tilt") if kind == "hinges" else ("x", "y", "z")
    return Mechanism(f"four legs with {kind}", joints, "platform", (0, 0, 120), task=task)


@pytest.mark.skipif(INTERPRETED, reason="many searches")
@pytest.mark.parametrize("kind", SPARES)
def test_joints_of_a_leg_that_is_not_driven_keep_every_limit(kind: str) -> None:
    mechanism, rng = spare(kind), np.random.default_rng(2)
    assert_feasible(mechanism, pf.solve_fk(mechanism, any_values(mechanism, 5)))
    for shift, turn in ((0.2, 0.3), (1.5, 1.0)):
        targets = targets_about(mechanism, rng, 5, shift, turn)
        assert_feasible(mechanism, pf.solve_ik(mechanism, targets))
        assert_feasible(mechanism, pf.track(mechanism, targets[:4]))


def test_forward_kinematics_gives_the_distance_from_the_values_asked_for() -> None:
    asked = np.radians([30.0, -75.0])
    answer = pf.solve_fk(pf.load("five_bar"), asked)
    off = np.degrees(np.abs(answer.actuators - asked).max())
    assert answer.reason.startswith(f"actuators up to {off:.3g} deg from the values asked for; ")
    assert answer.active_limits and pf.solve_fk(pf.load("five_bar"), [asked])[0].reason == answer.reason


@pytest.mark.skipif(INTERPRETED, reason="many searches")
@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.campaign] * (n not in QUICK)) for n in EVERY])
def test_what_stops_a_machine_that_travels_has_a_name(name: str) -> None:
    mechanism = machine(name)
    for reach in pf.travel(pf.configuration(mechanism, home_coordinates(mechanism))):
        assert bool(reach.why) is (reach.end is not None)
