"""`pfabrik info`: numbers without dust, and the engine that really answers."""

from __future__ import annotations

import math
import re

import pytest

import pfabrik as pf
from command import pfabrik
from machines import MACHINES
from pfabrik.engines.chains.chain_engine import ChainEngine
from pfabrik.engines.engine import engine_of as answering_engine
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.engines.pose.legs_engine import LegsEngine
from pfabrik.machine.decomposition.decompose import beyond_positions
from pfabrik.machine.description.home_mobility import universal_axes
from pfabrik.view.overview import chain_table, clean, vector


def test_directions_are_cleaned_of_rounding_and_nothing_else() -> None:
    assert vector((1.665e-16, 1.0, -0.0)) == "(0, 1, 0)"
    assert vector((-3e-13, 4e-12, 1e-6)) == "(0, 4e-12, 1e-06)"


def test_lengths_are_cleaned_relative_to_the_machine() -> None:
    assert (clean(1e-10, 300.0), clean(-1e-10, 300.0)) == (0.0, 0.0)
    assert clean(1e-10, 0.1) == pytest.approx(1e-10)
    assert str(clean(-0.0)) == "0.0"


@pytest.mark.parametrize("name", pf.catalog())
def test_the_engine_shown_is_the_one_that_answers(name: str) -> None:
    mechanism = pf.load(name)
    engine = answering_engine(mechanism)
    kinds = {LegsEngine: "legs", ChainEngine: "chains", ClosureEngine: "closure"}
    expected = kinds[type(engine)]
    lines = str(chain_table(mechanism)).splitlines()[1:]
    assert {re.split(r" {2,}", line.strip())[2] for line in lines} == {expected}


def test_an_engine_is_told_with_the_reason() -> None:
    assert "3  R-P*-S     legs    closed forms; closure where they do not reach" in str(chain_table(pf.load("rps")))
    whole = MACHINES["tripod_rps"]()
    assert str(chain_table(whole)).endswith("3  R-P*-S     legs    closed forms; closure where they do not reach")
    assert "legs    closed forms; closure where they do not reach" in str(chain_table(pf.load("nrpm")))
    assert "chains  no loops, no closed form; closure where" in str(chain_table(MACHINES["serial_planar"]()))
    axes = [(0.0, 0.0, 1.0), (0.0, 1.0, 0.2), (1.0, 0.3, 0.1), (0.2, 1.0, 0.4), (1.0, 0.1, 0.6), (0.3, 0.2, 1.0)]
    bodies = ["base", "one", "two", "three", "four", "five", "platform"]
    arm = [
        pf.Joint(f"arm{i}", "revolute", (bodies[i], bodies[i + 1]), at=(10 * i, 7 * (i % 3), 30 * i), axis=axis)
        for i, axis in enumerate(axes)
    ]
    beside = pf.Mechanism("struts and an arm", [*pf.load("stewart").joints, *arm], "platform", (0, 0, 195))
    assert str(chain_table(beside)).count("closure  no closed forms: sub-chain R-R-R-R-R-R: ") == 2


def test_a_motor_in_no_sub_chain_is_why_the_closure_engine_answers() -> None:
    stewart = pf.load("stewart")
    bearings = [
        pf.Joint(name, "revolute", ("platform", "tool"), at=(0, 0, z), axis=(0, 0, 1), actuated=name == "spindle")
        for name, z in (("bearing", 180), ("spindle", 195))
    ]
    mechanism = pf.Mechanism("with a spindle", [*stewart.joints, *bearings], "platform", (0, 0, 195))
    assert beyond_positions(mechanism) == ("actuated joint spindle is in no sub-chain",)
    assert "closure  no closed forms: joint spindle has a motor" in str(chain_table(mechanism))


def carrier(eye: tuple[float, float, float]) -> pf.Mechanism:
    """A link that carries a strut, between a universal and a spherical joint; slides hold its hub."""
    place = (40, 300, 10)
    joints = [
        pf.Joint("in", "universal", ("base", "link"), at=(0, 0, 0)),
        pf.Joint("out", "spherical", ("link", "hub"), at=place),
        pf.Joint("gx", "prismatic", ("base", "sx"), axis=(1, 0, 0), actuated=True),
        pf.Joint("gz", "prismatic", ("sx", "sz"), axis=(0, 0, 1), actuated=True),
        pf.Joint("gy", "prismatic", ("sz", "hub"), axis=(0, 1, 0)),
    ]
    strut = pf.Leg("S-P-S", base=(0, 150, 200), platform=eye, connects=("base", "link"), stroke=(50, 400))
    return pf.Mechanism.from_legs(
        strut, joints=joints, name="carrier", end_effector="hub", reference_point=place, task=("x", "z")
    )


@pytest.mark.usefixtures("folder")
def test_axes_of_a_link_on_whose_line_several_joints_are_keep_it_from_spinning() -> None:
    """The hub is on a sphere about the first joint: y = sqrt(r^2 - x^2 - z^2)."""
    machine = carrier((20, 150, 5))
    axes = universal_axes(machine, machine.joint("in"))
    assert axes @ [40, 300, 10] == pytest.approx([0.0, 0.0], abs=1e-10)
    for x, z in ((100.0, 60.0), (-80.0, -70.0)):
        solution = pf.solve_ik(machine, [x, 0.0, z])
        assert solution
        assert solution.pose[1, 3] == pytest.approx(math.sqrt(40**2 + 300**2 + 10**2 - x**2 - z**2))
    pf.save(machine, "on.toml")
    pf.save(carrier((60, 150, 5)), "off.toml")
    shown = ", ".join(f"{value:.4g}" for value in axes[0])
    assert f"angles about ({shown})" in pfabrik("info on.toml").stdout
    assert "has no `axes`" not in pfabrik("check on.toml").output
    assert "universal joint 'in' has no `axes`" in pfabrik("check off.toml").output
