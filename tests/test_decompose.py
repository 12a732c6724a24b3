"""Decomposition: how machines fall apart into sub-chains, how those are written, and which engine serves them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED
from machines import MACHINES, closure, machine, ring, struts
from pfabrik import Cone, Joint, Mechanism
from pfabrik.errors import UnsupportedMechanism
from pfabrik.passes.plan import compile_plan

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

NOTATION: dict[str, tuple[list[str], str]] = {
    "five_bar": (["R*-R-R"] * 2, ""),
    "stewart": (["U-P*-S"] * 6, ""),
    "nrpm": (["R*-P*-[U-P*-S, U-P*-S]"] * 3, ""),
    "servo_hexapod": (["R*-U-S"] * 6, ""),
    "ucu": (["U-P*-R-U"] * 6, ""),
    "delta": (["R*-[S-U, S-U]"] * 3, ""),
    "linear_delta": (["P*-[S-S, S-S]"] * 3, ""),
    "orthoglide": (["P*-R-Pa-R"] * 3, "has a loop of its own"),
    "g1_ankle": (["R-R", "R*-S-R-R", "R*-S-R-R"], "carries orientation"),
    "positions.hexapod_rus": (["R*-S-S"] * 6, ""),
    "positions.hexaglide": (["P*-U-S"] * 6, ""),
    "positions.tripod_rps": (["R-P*-S"] * 3, ""),
    "positions.tripod_prs": (["P*-R-S"] * 3, ""),
    "positions.planar_rrr": (["R*-R-R"] * 3, ""),
    "positions.planar_rpr": (["R-P*-R"] * 3, ""),
    "positions.planar_prr": (["P*-R-R"] * 3, ""),
    "positions.serial_planar": (["R*-R*-R*-R*-R"], ""),  # its gripper belongs to no chain
    "positions.serial_spherical": (["P*-S-S-S-S"], ""),
    "positions.mixed": (["U-P*-S", "U-P*-S", "S-P*-R", "R*-U-S", "U-P*-S"], ""),
    "closure.upu": (["U-P*-U"] * 3, "carries orientation"),
    "closure.tricept": (["U-P", *["U-P*-S"] * 3], "P0.2 carries the end effector"),
    "closure.delta_uu": (["R*-[U-U, U-U]"] * 3, "carries orientation"),
    "closure.cru": (["C-R*-U"] * 3, "C1.1 is cylindrical"),
    "closure.four_bar_driven": (["[R*-R-R, R]-R*-R"], "has a loop of its own"),
    "closure.limited_tip": (["R*-R-R"] * 2, "has a limit"),
    "closure.hinge": (["R*"], "ties the end effector to the base"),
    "closure.H4": (["[R*-[S-S, S-S], R*-[S-S, S-S]]-R"] * 2, "has a loop of its own"),
    "files.crank_rocker": (["R*-R", "R-R"], ""),
}
"""Machine -> its chains, and why positions do not suffice for the first of them; "" where they do for all."""


@pytest.mark.parametrize("name", NOTATION)
def test_machines_fall_apart_into_the_legs_the_field_writes(name: str) -> None:
    chains, (written, why) = pf.decompose(machine(name)), NOTATION[name]
    assert [str(chain) for chain in chains] == written
    if why:
        assert why in chains[0].reason
    else:
        assert {chain.reason for chain in chains} == {None}


def test_chains_tell_their_trunks_branches_and_joints() -> None:
    serial, branched = pf.decompose(pf.load("stewart"))[0], pf.decompose(pf.load("nrpm"))[1]
    assert (serial.trunk, serial.joints) == ((), ("AL1", "BL1", "CL1"))
    assert [step.joint.name for step in branched.trunk] == ["A2", "B2"]
    assert [[s.joint.name for s in b] for b in branched.branches] == [["CL2", "DL2", "EL2"], ["CR2", "DR2", "ER2"]]
    assert branched.joints == ("A2", "B2", "CL2", "DL2", "EL2", "CR2", "DR2", "ER2")
    left, right = pf.decompose(pf.load("five_bar"))  # a joint end effector is cut, and ends every chain
    assert (left.joints, right.joints) == (("p1", "p2", "p3"), ("p5", "p4", "p3"))
    assert [step.ends for step in left.steps] == [False, False, True]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["nrpm", "positions.mixed", "five_bar"])
def test_sub_chains_come_in_the_order_of_their_first_joints(name: str, seed: int) -> None:
    original = machine(name)
    order = np.random.default_rng(seed).permutation(len(original.joints))
    shuffled = dataclasses.replace(original, joints=[original.joints[i] for i in order])
    chains = pf.decompose(shuffled)
    place = {joint.name: i for i, joint in enumerate(shuffled.joints)}
    firsts = [min(place[joint] for joint in chain.joints) for chain in chains]
    assert {frozenset(c.joints) for c in chains} == {frozenset(c.joints) for c in pf.decompose(original)}
    assert firsts == sorted(firsts)


# Legs: each as the sixth of a platform on five struts

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FOOT, KNEE, HEAD = (-50, -80, 0), (-80, -70, 70), (-30, -50, 150)
UP = np.subtract(HEAD, FOOT)
AXES = (X, Y)


def some_struts(count: int) -> list[Joint]:
    feet = ring(100, 0, [60 * i + 5 * (i % 2) for i in range(count)])
    return struts(feet, ring(60, 150, [60 * i for i in range(count)]))


def with_leg(*leg: Joint) -> Mechanism:
    return Mechanism("five struts and another leg", [*some_struts(5), *leg], "platform", (0, 0, 150))


def changed(leg: list[Joint], changes: dict[str, dict]) -> list[Joint]:
    return [dataclasses.replace(joint, **changes.get(joint.name, {})) for joint in leg]


def crossing(**changes: dict) -> list[Joint]:
    """An R-R-P*-R-R-R leg that is a U-P*-S leg: two axes cross at (-50, -80, 0), three at (-30, -50, 150)."""
    foot = [("R", FOOT, X), ("R", FOOT, (0, 150, -30))]  # the second square to the strut
    leg = closure.chain(6, *foot, ("P*", None, UP, {"home": 100}), ("R", HEAD, X), ("R", HEAD, Y), ("R", HEAD, Z))
    return changed(leg, {f"R6.{name[1:]}": change for name, change in changes.items()})


PIN, ROD, SIDE = np.array([[1, 2, 2], [2, 1, -2], [2, -2, 1]]) / 3
PINNED = "R*-Pa-R"
LOOP = "R*-[R-R, R-R]-R"


def four_bar(**changes: dict) -> list[Joint]:
    """A leg with a parallelogram of pins: rods of 50, 20 apart, in the plane normal to (1, 2, 2) / 3."""
    b, c = np.array(FOOT), np.array(FOOT) + 50 * ROD
    leg = [
        Joint("QA", "revolute", ("base", "top"), at=b, axis=SIDE, actuated=True),
        Joint("QB1", "revolute", ("top", "rod1"), at=b - 10 * SIDE + 3 * PIN, axis=PIN),
        Joint("QC1", "revolute", ("rod1", "low"), at=c - 10 * SIDE - 7 * PIN, axis=-PIN),
        Joint("QB2", "revolute", ("rod2", "top"), at=b + 10 * SIDE, axis=PIN),
        Joint("QC2", "revolute", ("rod2", "low"), at=c + 10 * SIDE, axis=PIN),
        Joint("QD", "revolute", ("low", "platform"), at=c, axis=SIDE),
    ]
    return changed(leg, changes)


def off_parallel(**off: float) -> list[Joint]:
    """With one rod longer by a share of L, or its axis off by an angle."""
    sound, length = four_bar()[4], with_leg(*four_bar()).characteristic_length
    at = np.array(sound.at) + off.get("length", 0.0) * length * ROD
    return four_bar(QC2={"at": at, "axis": np.array(sound.axis) + off.get("angle", 0.0) * ROD})


def forked(*ends: Joint) -> list[Joint]:
    return [closure.joint("U", "A", ("base", "k"), FOOT), *ends]


CONE = {"cone": Cone((1, 0, 0), 2.0, "6.1")}
RANGES = {"range": ((-1, 1),) * 2}
PINS = {joint.name: joint.at for joint in four_bar()}
LINE = {"QB1": 0, "QC1": 50, "QB2": 20, "QC2": 70}
FOREARM = [
    closure.joint("R*", "A", ("base", "crank"), FOOT, X),
    closure.joint("S", "KB1", ("crank", "rod1"), KNEE),
    closure.joint("S", "KB2", ("crank", "rod2"), np.add(KNEE, (10, 0, 0))),
    closure.joint("S", "KC1", ("rod1", "carrier"), HEAD),
    closure.joint("S", "KC2", ("rod2", "carrier"), np.add(HEAD, (10, 0, 0))),
    closure.joint("R", "D", ("carrier", "platform"), HEAD, X),
]

LEGS: list[tuple[list[Joint], str, str]] = [
    (closure.chain(6, ("S", (0, 0, 150))), "S", ""),
    (closure.chain(6, ("U", (0, 0, 150))), "U", "U6.1"),
    (closure.chain(6, ("U", FOOT), ("P*", None, UP), ("U", HEAD)), "U-P*-U", "carries orientation"),
    # what carries more than positions
    (closure.chain(6, ("R", FOOT, X), ("R", KNEE, Z), ("S", HEAD)), "R-R-S", "revolute joint R6.2"),
    (closure.chain(6, ("U", FOOT), ("C", KNEE, UP), ("S", HEAD)), "U-C-S", "C6.2 is cylindrical"),
    (closure.chain(6, ("U", FOOT), ("P", None, UP), ("P*", None, UP), ("S", HEAD)), "U-P-P*-S", "P6.3"),
    (closure.chain(6, ("U", FOOT), ("P*", None, Z), ("S", HEAD)), "U-P*-S", "P6.2 does not point"),
    (closure.chain(6, ("S", FOOT), ("P*", None, UP)), "S-P*", "P6.2 carries the end effector"),
    (closure.chain(6, ("U", FOOT, AXES, RANGES), ("P*", None, UP), ("S", HEAD)), "U-P*-S", "U6.1 has ranges"),
    (closure.chain(6, ("U", FOOT), ("S", KNEE, None, CONE), ("S", HEAD)), "U-S-S", "S6.2"),
    (
        forked(closure.joint("S", "B", ("k", "platform"), HEAD), closure.joint("S", "C", ("k", "platform"), KNEE)),
        "U-[S, S]",
        "joint A",
    ),
    # hinges that cross are a universal or a ball joint: they have to cross, and to be free
    (crossing(), "R-R-P*-R-R-R", ""),
    (crossing(R2={"at": (-50, -80, 0.5e-4)}), "R-R-P*-R-R-R", ""),  # 0.5e-6 L
    (crossing(R2={"at": (-50, -80, 2e-2)}), "R-R-P*-R-R-R", "R6."),
    (crossing(R2={"range": (-1.0, 1.0)}), "R-R-P*-R-R-R", "R6.2 shares its centre"),
    (crossing(R1={"actuated": True}), "R*-R-P*-R-R-R", "R6.1 shares its centre"),
    (crossing(R5={"range": (-1.0, 1.0)}), "R-R-P*-R-R-R", "R6.5 shares its centre"),
    (closure.chain(6, ("R*", FOOT, X), ("R", KNEE, (1, 0.5e-6, 0)), ("S", HEAD)), "R*-R-S", ""),
    (closure.chain(6, ("R*", FOOT, X), ("R", KNEE, (1, 1e-5, 0)), ("S", HEAD)), "R*-R-S", "R6.2"),
    # parallelograms, wherever on its axis a pin sits; rods that cross or lie in one line make none
    (FOREARM, "R*-[S-S, S-S]-R", "loop of its own"),
    (four_bar(), PINNED, "loop of its own"),
    (four_bar(QB2={"actuated": True}), "R*-Pa*-R", "loop of its own"),
    (off_parallel(length=0.5e-6), PINNED, "loop of its own"),
    (off_parallel(length=2e-6), LOOP, "loop of its own"),
    (off_parallel(angle=0.5e-6), PINNED, "loop of its own"),
    (off_parallel(angle=2e-6), LOOP, "loop of its own"),
    (four_bar(QC1={"at": PINS["QC2"]}, QC2={"at": PINS["QC1"]}), LOOP, "loop of its own"),
    (four_bar(**{name: {"at": FOOT + at * ROD} for name, at in LINE.items()}), LOOP, "loop of its own"),
]
"""A leg, how it is written, and why positions do not suffice for it; "" where they do."""


@pytest.mark.parametrize(("leg", "written", "why"), LEGS)
def test_a_leg_is_written_and_served_by_what_it_is(leg: list[Joint], written: str, why: str) -> None:
    """What positions do not express is for the closure engine, with the joint named; and home is answered."""
    mechanism = with_leg(*leg)
    *others, last = pf.decompose(mechanism)
    assert str(last) == written
    assert {chain.reason for chain in others} == {None}
    assert pf.solve_ik(mechanism, mechanism.home_pose)
    if not why:
        assert last.reason is None
        return
    assert why in last.reason
    with pytest.raises(UnsupportedMechanism) as caught:
        compile_plan(mechanism)
    assert last.reason in str(caught.value) and str(last) in str(caught.value)


@pytest.mark.parametrize(
    ("bodies", "written"),
    [
        ("base-a a-b base-c c-b b-platform", "[R*-R, R-R]-R"),
        ("a-platform base-a base-b c-b c-a", "[R*, R-R-R]-R"),
        ("base-a a-platform a-platform", "R*-[R, R]"),
        ("base-a a-b a-b b-platform", "R*-[R, R]-R"),
        ("base-a a-b b-c b-d c-e d-e a-e e-platform", "R*-[R-[R-R, R-R], R]-R"),
        ("base-a base-b a-b a-c b-c c-platform", "{R*, R, R, R, R}-R"),
        ("base-a base-b a-b a-platform b-platform", "{R*, R, R, R, R}"),
        ("base-a a-b a-c b-platform b-platform c-platform", "R*-[R-[R, R], R-R]"),
        ("base-a a-platform a-b b-c c-a", "R*-R"),
    ],
)
def test_loops_are_written_where_they_open_and_close(bodies: str, written: str) -> None:
    """In brackets, way by way; in braces what is neither in series nor side by side; what leads nowhere, not at all."""
    random, pairs = np.random.default_rng(0), [tuple(pair.split("-")) for pair in bodies.split()]
    driven = next(k for k, pair in enumerate(pairs) if "base" in pair)
    joints = [
        Joint(f"j{k}", "revolute", pair, random.normal(size=3), axis=random.normal(size=3), actuated=k == driven)
        for k, pair in enumerate(pairs)
    ]
    (chain,) = pf.decompose(Mechanism("one leg", joints, "platform", (0, 0, 3)))
    assert str(chain) == written
    assert chain.reason
    assert len(chain.joints) == len(set(chain.joints))


def test_parallelograms_tell_their_rods() -> None:
    forearm, pinned = pf.decompose(with_leg(*FOREARM))[-1], pf.decompose(with_leg(*four_bar()))[-1]
    assert forearm.joints == ("A", "KB1", "KC1", "KB2", "KC2", "D")
    assert [step.inward for step in forearm.steps] == ["base", "crank", "rod1", "crank", "rod2", "carrier"]
    (found,) = forearm.parallelograms
    assert (found.rods, found.width, found.pinned) == ((("KB1", "KC1"), ("KB2", "KC2")), 10, False)
    (found,) = pinned.parallelograms
    assert (found.rods, found.pinned) == ((("QB1", "QC1"), ("QB2", "QC2")), True)
    assert found.joints == ("QB1", "QC1", "QB2", "QC2")
    assert (found.length, found.width) == pytest.approx((50, 20), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "length"), [("delta", 232.0), ("linear_delta", 273.0), ("psu", 265.0), ("nrpm", None)]
)
def test_pairs_of_rods_that_end_on_the_platform_stay_branches_and_are_noted(name: str, length: float | None) -> None:
    for chain in pf.decompose(pf.load(name)):
        assert len(chain.branches) == 2
        assert [found.length for found in chain.parallelograms] == pytest.approx([length] if length else [])
        assert not any(found.pinned for found in chain.parallelograms)


@pytest.mark.parametrize("size, shift", [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e6), (1.0, 5e7), (1e-5, 5e7)])
def test_what_coincides_and_is_parallel_depends_neither_on_the_unit_nor_on_the_origin(
    size: float, shift: float
) -> None:
    """The crank of the R*-U-S leg is 36 of L = 130 long, wherever the machine stands and whatever its unit."""

    def placed(joints: list[Joint], height: float) -> list[pf.SubChain]:
        moved = [
            dataclasses.replace(
                joint,
                at=None if joint.at is None else size * (np.array(joint.at) + shift),
                range=tuple(size * np.array(joint.range)) if joint.type == "prismatic" else joint.range,
            )
            for joint in joints
        ]
        return pf.decompose(Mechanism("placed", moved, "platform", size * (np.array((0, 0, height)) + shift)))

    mixed = placed(list(MACHINES["mixed"]().joints), 180)
    assert [len(chain.branch_forms[0].nodes) for chain in mixed] == [2, 2, 2, 3, 2]
    if shift <= 1e6:
        (chain,) = placed(four_bar(), 150)
        assert str(chain) == PINNED
        assert chain.parallelograms[0].length == pytest.approx(50 * size, rel=1e-7)


# What answers owe to it


def test_a_ball_joint_straight_from_base_to_platform_holds_its_point() -> None:
    pivot = with_leg(*LEGS[0][0])
    assert pf.solve_ik(pivot, pf.pose([0, 0, 150], rotvec=[0.1, -0.2, 0.1]))
    lifted = pf.solve_ik(pivot, pf.pose([0, 0, 160]))
    assert lifted.status is pf.Status.PROJECTED
    np.testing.assert_allclose(lifted.pose[:3, 3], (0, 0, 150), atol=1e-7)


def test_fixed_joints_weld_bodies_into_one() -> None:
    """A foot on the base, a rod in two pieces and a head on the platform change nothing but the list of bodies."""
    welds = [
        Joint("weld1", "fixed", ("foot", "base"), at=(100, 0, 0)),
        Joint("weld2", "fixed", ("rod", "r1"), at=(80, 0, 75)),
        Joint("weld3", "fixed", ("platform", "head"), at=(60, 0, 150)),
    ]
    plain = some_struts(6)
    plain[1] = dataclasses.replace(plain[1], along=None, axis=(-40, 0, 150))
    joints = changed(plain, {"A1": {"connects": ("foot", "c1")}, "C1": {"connects": ("rod", "head")}})
    welded = Mechanism("welded", [*joints[:2], *welds, *joints[2:]], "platform", (0, 0, 150))
    assert [chain.joints for chain in pf.decompose(welded)] == [(f"A{i}", f"B{i}", f"C{i}") for i in range(1, 7)]
    target = pf.pose([5, -3, 155], rotvec=[0.1, 0.05, -0.2])
    expected = pf.solve_ik(Mechanism("plain", plain, "platform", (0, 0, 150)), target)
    np.testing.assert_array_equal(pf.solve_ik(welded, target).actuators, expected.actuators)


def test_what_hangs_on_the_platform_belongs_to_no_chain_and_its_motor_is_named() -> None:
    bearing = Joint("bearing", "revolute", ("platform", "tool"), at=(0, 0, 140), axis=Z)
    spindle = Joint("spindle", "revolute", ("platform", "tool"), at=(0, 0, 160), axis=Z)
    tool = Mechanism("tool", [*some_struts(6), bearing, spindle], "platform", (0, 0, 150))
    assert [chain.joints for chain in pf.decompose(tool)] == [(f"A{i}", f"B{i}", f"C{i}") for i in range(1, 7)]
    driven = dataclasses.replace(tool, joints=[*tool.joints[:-1], dataclasses.replace(spindle, actuated=True)])
    with pytest.raises(UnsupportedMechanism, match="spindle is in no sub-chain"):
        compile_plan(driven)


def test_revolutes_whose_axes_cross_act_at_their_crossing_and_each_has_its_point() -> None:
    separate = with_leg(*crossing())
    target = pf.pose([5, -3, 155], rotvec=[0.1, 0.05, -0.2])
    turned = target[:3, :3] @ [-30, -50, 0] + target[:3, 3]
    stroke = np.linalg.norm(turned - FOOT) - np.linalg.norm(UP)
    assert pf.solve_ik(separate, target).actuators[-1] == pytest.approx(100 + stroke, abs=1e-10)
    points = pf.solve_ik(separate, separate.home_pose).points
    for joint in separate.joints:
        if joint.at is not None:
            np.testing.assert_allclose(points[joint.name], joint.at, atol=1e-9)
    aside = with_leg(*crossing(R1={"at": (-70, -80, 0)}, R2={"at": (-50, -50, -6)}))  # told off their crossing
    assert pf.decompose(aside)[-1].branch_forms[0].nodes["home"][0] == pytest.approx([-50, -80, 0], abs=1e-12)
    assert pf.solve_ik(aside, aside.home_pose)


def test_the_default_axes_of_a_universal_joint_do_not_depend_on_which_body_it_names_first() -> None:
    machine = pf.load("servo_hexapod")
    swapped = [
        dataclasses.replace(joint, connects=joint.connects[::-1]) if joint.type == "universal" else joint
        for joint in machine.joints
    ]
    other = Mechanism("swapped", swapped, machine.end_effector, machine.reference_point)
    target = pf.pose(np.add(machine.reference_point, (5, -4, 3)), rotvec=(0.05, 0.1, -0.02))
    answers = pf.solve_ik(machine, target), pf.solve_ik(other, target)
    np.testing.assert_allclose(answers[0].actuators, answers[1].actuators, atol=1e-9)
    assert max(map(pf.closure_residual, answers)) <= 1e-9 * machine.characteristic_length


def assert_served(mechanism: Mechanism, by_positions: bool, spread: float = 0.0) -> None:
    """Answers in positions would have open loops where they promise what no joint can do: there are none."""
    assert {chain.reason is None for chain in pf.decompose(mechanism)} == {by_positions}
    random, n = np.random.default_rng(0), 4 if INTERPRETED else 60
    targets = pf.pose(np.tile(mechanism.reference_point, (n, 1)), rotvec=random.uniform(-1.2, 1.2, (n, 3)))
    targets[:, :3, 3] += spread * random.uniform(-1, 1, (n, 3)) * mechanism.characteristic_length
    targets[0] = mechanism.home_pose
    answers = pf.solve_ik(mechanism, targets)
    assert pf.closure_residual(answers).max() <= 1e-9 * mechanism.characteristic_length


@pytest.mark.parametrize("skew", [0.0, 0.2, 1.2])
def test_hinges_that_cross_point_anywhere_only_if_their_link_is_square_to_the_second(skew: float) -> None:
    joints = []
    for k, angle in enumerate(np.radians([0, 60, 120, 180, 240, 300])):
        foot = 100.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
        turned = angle + 0.5 * (-1) ** k
        head = np.array([60.0 * np.cos(turned), 60.0 * np.sin(turned), 150.0])
        line = (head - foot) / np.linalg.norm(head - foot)
        first = np.cross(line, [0.3, 0.2, 1.0])
        first /= np.linalg.norm(first)
        second = np.cos(skew) * np.cross(line, first) + np.sin(skew) * line
        joints += closure.chain(k, ("P*", None, Z), ("R", foot, first), ("R", foot, second), ("S", head))
    assert_served(Mechanism("crossing hinges", joints, "platform", (0, 0, 150)), skew == 0.0, spread=0.5)


@pytest.mark.parametrize(
    ("wrist", "by_positions"),
    [
        ([("U", AXES), ("R", Z)], True),
        ([("U", AXES), ("R", (0, 1, 2))], False),
        ([("U", None), ("R", (0.5, 0.5, 1))], False),
        ([("R", Z), ("U", ((1, 0, 1), Y))], False),
        ([("U", (X, (1, 2, 0)))], False),
        ([("R", X), ("R", Y), ("R", Z)], True),
        ([("R", X), ("R", Y), ("R", (0, 1, 1))], False),
        ([("R", X), ("R", (1, 1, 0)), ("R", Z)], False),
    ],
)
def test_joints_act_as_one_only_about_axes_that_are_square(wrist: list[tuple], by_positions: bool) -> None:
    """About others they do not turn everywhere: six struts with such joints at the platform."""
    joints = []
    feet = ring(100, 0, (-12, 12, 108, 132, 228, 252))
    heads = ring(60, 150, (-45, 45, 75, 165, 195, 285))
    for k, (foot, head) in enumerate(zip(feet, heads, strict=True)):
        strut = ("P*", None, np.subtract(head, foot))
        joints += closure.chain(k, ("S", foot), strut, *((kind, head, axes) for kind, axes in wrist))
    assert_served(Mechanism("hexapod", joints, "platform", (0, 0, 150)), by_positions)


@pytest.mark.parametrize(("half_angle", "by_positions"), [(None, False), (60.0, True), (85.0, False)])
def test_a_strut_oblique_to_the_axis_it_carries_does_not_point_anywhere(
    half_angle: float | None, by_positions: bool
) -> None:
    """Unless its cone keeps it away from the other axis by more than it is oblique."""
    free = pf.load("stewart").without_limits()
    cone = None if half_angle is None else Cone(Z, np.radians(half_angle), "base")
    joints = [
        dataclasses.replace(joint, axes=AXES, cone=cone) if joint.type == "universal" else joint
        for joint in free.joints
    ]
    assert_served(dataclasses.replace(free, joints=tuple(joints)), by_positions, spread=1.0)
