"""Decomposition: how machines fall apart into sub-chains, how those are written, and which engine serves them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from machines import MACHINES, closure, planar, ring, struts
from pfabrik import Cone, Joint, Mechanism
from pfabrik.cli import main
from pfabrik.decomposition.plan import compile_plan
from pfabrik.errors import UnsupportedMechanism

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

NOTATION = {
    "five_bar": ["R*-R-R"] * 2,
    "stewart": ["U-P*-S"] * 6,
    "nrpm": ["R*-P*-[U-P*-S, U-P*-S]"] * 3,
    "hexapod_ups": ["U-P*-S"] * 6,
    "hexapod_rus": ["R*-S-S"] * 6,
    "hexaglide": ["P*-U-S"] * 6,
    "tripod_rps": ["R-P*-S"] * 3,
    "tripod_prs": ["P*-R-S"] * 3,
    "planar_rrr": ["R*-R-R"] * 3,
    "planar_rpr": ["R-P*-R"] * 3,
    "planar_prr": ["P*-R-R"] * 3,
    "serial_planar": ["R*-R*-R*-R*-R"],
    "serial_spherical": ["P*-S-S-S-S"],
    "mixed": ["U-P*-S", "U-P*-S", "S-P*-R", "R*-U-S", "U-P*-S"],
}


def machine(name: str) -> Mechanism:
    return MACHINES[name]() if name in MACHINES else pf.load(name)


def some_struts(count: int) -> list[Joint]:
    feet = ring(100, 0, [60 * i + 5 * (i % 2) for i in range(count)])
    return struts(feet, ring(60, 150, [60 * i for i in range(count)]))


def with_leg(*leg: Joint) -> Mechanism:
    """Five struts, and the leg in question as the sixth."""
    return Mechanism("five struts and another leg", [*some_struts(5), *leg], "platform", (0, 0, 150))


def last_chain(*leg: Joint) -> pf.SubChain:
    return pf.decompose(with_leg(*leg))[-1]


def serves(chain: pf.SubChain) -> str:
    """What serves a chain: joint positions, or only the coordinates of its joints."""
    return "reaching" if chain.reason is None else "closure"


@pytest.mark.parametrize("name", NOTATION)
def test_machines_fall_apart_into_the_legs_the_field_writes(name: str) -> None:
    chains = pf.decompose(machine(name))
    assert [str(chain) for chain in chains] == NOTATION[name]
    assert {serves(chain) for chain in chains} == {"reaching"}
    assert {chain.reason for chain in chains} == {None}


def test_every_machine_has_its_notation_checked() -> None:
    assert set(NOTATION) == {*MACHINES, "five_bar", "nrpm", "stewart"}


def test_a_serial_chain_has_one_branch_and_no_trunk() -> None:
    chain = pf.decompose(pf.load("stewart"))[0]
    assert chain.trunk == ()
    assert chain.joints == ("AL1", "BL1", "CL1")


def test_a_branched_chain_shares_its_trunk() -> None:
    chain = pf.decompose(pf.load("nrpm"))[1]
    assert [step.joint.name for step in chain.trunk] == ["A2", "B2"]
    assert [[s.joint.name for s in b] for b in chain.branches] == [["CL2", "DL2", "EL2"], ["CR2", "DR2", "ER2"]]
    assert chain.joints == ("A2", "B2", "CL2", "DL2", "EL2", "CR2", "DR2", "ER2")


def test_a_joint_end_effector_is_cut_and_belongs_to_every_chain_that_ends_there() -> None:
    left, right = pf.decompose(pf.load("five_bar"))
    assert left.joints == ("p1", "p2", "p3")
    assert right.joints == ("p5", "p4", "p3")
    assert [step.ends for step in left.steps] == [False, False, True]


def test_a_ball_joint_straight_from_base_to_platform_is_a_chain_without_links() -> None:
    pivot = with_leg(Joint("pivot", "spherical", ("base", "platform"), at=(0, 0, 150)))
    chain = pf.decompose(pivot)[-1]
    assert (str(chain), serves(chain)) == ("S", "reaching")
    assert chain.branch_forms[0].joints == (("pivot",),)
    turned = pf.solve_ik(pivot, pf.pose([0, 0, 150], rotvec=[0.1, -0.2, 0.1]))
    assert turned
    lifted = pf.solve_ik(pivot, pf.pose([0, 0, 160]))
    assert lifted.status is pf.Status.PROJECTED
    np.testing.assert_allclose(lifted.pose[:3, 3], (0, 0, 150), atol=1e-7)


def test_another_joint_straight_from_base_to_platform_carries_orientation() -> None:
    chain = last_chain(Joint("pivot", "universal", ("base", "platform"), at=(0, 0, 150)))
    assert (str(chain), serves(chain)) == ("U", "closure")
    assert "pivot" in chain.reason


def test_fixed_joints_weld_bodies_into_one() -> None:
    """A foot on the base, a rod in two pieces and a head on the platform change nothing but the list of bodies."""
    welds = [
        Joint("weld1", "fixed", ("foot", "base"), at=(100, 0, 0)),
        Joint("weld2", "fixed", ("rod", "r1"), at=(80, 0, 75)),
        Joint("weld3", "fixed", ("platform", "head"), at=(60, 0, 150)),
    ]
    plain = some_struts(6)
    plain[1] = dataclasses.replace(plain[1], along=None, axis=(-40, 0, 150))
    renamed = {"A1": ("foot", "c1"), "C1": ("rod", "head")}
    joints = [dataclasses.replace(j, connects=renamed.get(j.name, j.connects)) for j in plain]
    welded = Mechanism("welded", [*joints[:2], *welds, *joints[2:]], "platform", (0, 0, 150))
    assert [chain.joints for chain in pf.decompose(welded)] == [(f"A{i}", f"B{i}", f"C{i}") for i in range(1, 7)]
    target = pf.pose([5, -3, 155], rotvec=[0.1, 0.05, -0.2])
    expected = pf.solve_ik(Mechanism("plain", plain, "platform", (0, 0, 150)), target)
    np.testing.assert_array_equal(pf.solve_ik(welded, target).actuators, expected.actuators)


def crossing(**changes: object) -> list[Joint]:
    """An R-R-P*-R-R-R leg that is a U-P*-S leg: two axes cross at (-50, -80, 0), three at (-30, -50, 150)."""
    foot, head = (-50, -80, 0), (-30, -50, 150)
    leg = [
        Joint("Ra", "revolute", ("base", "gimbal"), at=foot, axis=(1, 0, 0)),
        Joint("Rb", "revolute", ("gimbal", "c"), at=foot, axis=(0, 150, -30)),  # square to the strut
        Joint("P", "prismatic", ("c", "r"), axis=np.subtract(head, foot), actuated=True, home=100),
        Joint("Rc", "revolute", ("r", "yoke"), at=head, axis=(1, 0, 0)),
        Joint("Rd", "revolute", ("yoke", "ring"), at=head, axis=(0, 1, 0)),
        Joint("Re", "revolute", ("ring", "platform"), at=head, axis=(0, 0, 1)),
    ]
    return [dataclasses.replace(j, **changes.get(j.name, {})) for j in leg]


def test_revolutes_whose_axes_cross_are_a_universal_or_a_ball_joint() -> None:
    separate = with_leg(*crossing())
    chain = pf.decompose(separate)[-1]
    assert (str(chain), serves(chain)) == ("R-R-P*-R-R-R", "reaching")
    assert chain.branch_forms[0].nodes["home"].tolist() == [[-50, -80, 0], [-30, -50, 150]]
    target = pf.pose([5, -3, 155], rotvec=[0.1, 0.05, -0.2])
    answer = pf.solve_ik(separate, target)
    turned = target[:3, :3] @ [-30, -50, 0] + target[:3, 3]
    home = np.linalg.norm((20, 30, 150))
    assert answer.actuators[-1] == pytest.approx(100 + np.linalg.norm(turned - (-50, -80, 0)) - home, abs=1e-10)


def test_joints_that_share_a_centre_each_have_their_point() -> None:
    separate = with_leg(*crossing())
    points = pf.solve_ik(separate, separate.home_pose).points
    for joint in separate.joints:
        if joint.at is not None:
            np.testing.assert_allclose(points[joint.name], joint.at, atol=1e-9)


def test_joints_described_off_the_crossing_of_their_axes_are_reported_at_it() -> None:
    aside = with_leg(*crossing(Ra={"at": (-70, -80, 0)}, Rb={"at": (-50, -50, -6)}))
    assert pf.decompose(aside)[-1].branch_forms[0].nodes["home"][0] == pytest.approx([-50, -80, 0], abs=1e-12)
    assert pf.solve_ik(aside, aside.home_pose)


@pytest.mark.parametrize("skew", [0.0, 0.2, 1.2])
def test_what_acts_as_a_universal_joint_points_anywhere_only_if_its_link_is_square_to_it(skew: float) -> None:
    """Elsewhere answers in positions would have open loops: there are none, whichever engine answers."""
    joints = []
    for k, angle in enumerate(np.radians([0, 60, 120, 180, 240, 300])):
        foot = 100.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
        turned = angle + 0.5 * (-1) ** k
        head = np.array([60.0 * np.cos(turned), 60.0 * np.sin(turned), 150.0])
        line = (head - foot) / np.linalg.norm(head - foot)
        first = np.cross(line, [0.3, 0.2, 1.0])
        first /= np.linalg.norm(first)
        second = np.cos(skew) * np.cross(line, first) + np.sin(skew) * line
        joints += [
            Joint(f"A{k}", "prismatic", ("base", f"c{k}"), axis=(0, 0, 1), actuated=True),
            Joint(f"B{k}", "revolute", (f"c{k}", f"d{k}"), at=foot, axis=first),
            Joint(f"C{k}", "revolute", (f"d{k}", f"r{k}"), at=foot, axis=second),
            Joint(f"D{k}", "spherical", (f"r{k}", "platform"), at=head),
        ]
    hexapod = Mechanism("crossing hinges", joints, "platform", (0, 0, 150))
    assert {serves(chain) for chain in pf.decompose(hexapod)} == {"reaching" if skew == 0.0 else "closure"}
    answers = pf.solve_ik(hexapod, [[x, y, 150] for x in (-60, 0, 60) for y in (-60, 0, 60)])
    assert pf.closure_residual(answers).max() <= 1e-9 * hexapod.characteristic_length


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


@pytest.mark.parametrize("gap, engine", [(0.5e-6, "reaching"), (2e-4, "closure")])
def test_axes_that_pass_each_other_do_not_cross(gap: float, engine: str) -> None:
    """The gap is a share of L, about 100 here."""
    chain = last_chain(*crossing(Rb={"at": (-50, -80, 100 * gap)}))
    assert serves(chain) == engine


@pytest.mark.parametrize(
    "name, change", [("Rb", {"range": (-1.0, 1.0)}), ("Ra", {"actuated": True}), ("Rd", {"range": (-1.0, 1.0)})]
)
def test_coincident_joints_with_a_motor_or_a_limit_are_left_to_the_closure_engine(name: str, change: dict) -> None:
    chain = last_chain(*crossing(**{name: change}))
    assert serves(chain) == "closure"
    assert f"joint {name} shares its centre" in chain.reason


@pytest.mark.parametrize("size, shift", [(1.0, 0.0), (1e-8, 0.0), (1e8, 0.0), (1.0, 5e7), (1e-5, 5e7)])
def test_what_coincides_depends_neither_on_the_unit_nor_on_the_origin(size: float, shift: float) -> None:
    """The crank of the R*-U-S leg is 36 of L = 130 long, wherever the machine stands and whatever its unit."""
    mixed = MACHINES["mixed"]()

    def place(joint: Joint) -> Joint:
        at = None if joint.at is None else size * (np.array(joint.at) + shift)
        stroke = tuple(size * np.array(joint.range)) if joint.type == "prismatic" else joint.range
        return dataclasses.replace(joint, at=at, range=stroke)

    placed = Mechanism("placed", [place(j) for j in mixed.joints], "platform", size * (np.array((0, 0, 180)) + shift))
    forms = [chain.branch_forms[0] for chain in pf.decompose(placed)]
    assert [len(form.nodes) for form in forms] == [2, 2, 2, 3, 2]


def test_hinges_with_parallel_axes_lie_in_one_plane_whatever_their_heights() -> None:
    machine = planar("RRR")
    for chain in pf.decompose(machine):
        (form,) = chain.branch_forms
        places, normal = form.nodes["home"], form.record["normal"]
        assert np.ptp(places[:, 2]) <= 1e-12
        for place, shift, (name, *_) in zip(places, form.shifts, form.joints, strict=True):
            np.testing.assert_allclose(place + shift * normal, machine.joint(name).at, atol=1e-12)
    shifts = [chain.branch_forms[0].shifts for chain in pf.decompose(machine)]
    assert np.ptp(shifts) > 10


def with_spindle(driven: bool) -> Mechanism:
    """A hexapod with a tool that turns in two bearings on the platform."""
    bearings = [
        Joint(
            name, "revolute", ("platform", "tool"), at=(0, 0, height), axis=(0, 0, 1), actuated=driven and height > 150
        )
        for name, height in (("bearing", 140), ("spindle", 160))
    ]
    return Mechanism("with spindle", [*some_struts(6), *bearings], "platform", (0, 0, 150))


def test_a_tool_on_the_platform_and_a_gripper_on_the_tip_belong_to_no_chain() -> None:
    joints = [chain.joints for chain in pf.decompose(with_spindle(driven=False))]
    assert joints == [(f"A{i}", f"B{i}", f"C{i}") for i in range(1, 7)]
    assert pf.decompose(MACHINES["serial_planar"]())[0].joints == ("j1", "j2", "j3", "j4", "tip")


def test_a_motor_that_no_chain_contains_is_named() -> None:
    with pytest.raises(UnsupportedMechanism, match="spindle is in no sub-chain"):
        compile_plan(with_spindle(driven=True))


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FOOT, KNEE, HEAD = (-50, -80, 0), (-80, -70, 70), (-30, -50, 150)
UP = np.subtract(HEAD, FOOT)

AXES = ((1, 0, 0), (0, 1, 0))
BEYOND_POSITIONS = {
    "revolute on a moving link": (2, ("R", FOOT, X), ("R", KNEE, Z), ("S", HEAD)),
    "cylindrical joint": (2, ("U", FOOT), ("C", KNEE, UP), ("S", HEAD)),
    "two prismatic joints in a row": (3, ("U", FOOT), ("P", None, UP), ("P*", None, UP), ("S", HEAD)),
    "prismatic joint aside of its neighbours": (2, ("U", FOOT), ("P*", None, Z), ("S", HEAD)),
    "prismatic joint that carries the platform": (2, ("S", FOOT), ("P*", None, UP)),
    "universal joint with ranges": (1, ("U", FOOT, AXES, {"range": ((-1, 1),) * 2}), ("P*", None, UP), ("S", HEAD)),
    "cone that turns with a link of unknown twist": (
        2, ("U", FOOT), ("S", KNEE, None, {"cone": Cone((1, 0, 0), 2.0, "6.1")}), ("S", HEAD)
    ),
}  # fmt: skip
"""Legs, and the place of the joint that positions do not express."""


def assert_beyond_positions(mechanism: Mechanism, culprit: str) -> None:
    """Its last chain alone is for the closure engine, with the joint named; and home is answered."""
    *others, last = pf.decompose(mechanism)
    assert [serves(each) for each in others] == ["reaching"] * 5
    assert serves(last) == "closure"
    assert culprit in last.reason.replace(",", " ").split()
    with pytest.raises(UnsupportedMechanism) as caught:
        compile_plan(mechanism)
    assert last.reason in str(caught.value)
    assert str(last) in str(caught.value)
    assert pf.solve_ik(mechanism, mechanism.home_pose)


@pytest.mark.parametrize("name", BEYOND_POSITIONS)
def test_a_chain_that_needs_more_than_positions_names_the_joint_and_the_reason(name: str) -> None:
    place, *steps = BEYOND_POSITIONS[name]
    assert_beyond_positions(with_leg(*closure.chain(6, *steps)), f"{steps[place - 1][0][0]}6.{place}")


def test_a_universal_joint_below_a_branching_body_is_named() -> None:
    branch = [closure.joint("U", "A", ("base", "k"), FOOT), closure.joint("S", "B", ("k", "platform"), HEAD)]
    assert_beyond_positions(with_leg(*branch, closure.joint("S", "C", ("k", "platform"), KNEE)), "A")


def test_two_universal_joints_carry_orientation() -> None:
    leg = [
        Joint("A", "universal", ("base", "k"), at=FOOT),
        Joint("B", "prismatic", ("k", "r"), axis=UP, actuated=True),
        Joint("C", "universal", ("r", "platform"), at=HEAD),
    ]
    chain = last_chain(*leg)
    assert (str(chain), serves(chain)) == ("U-P*-U", "closure")
    assert "carries orientation" in chain.reason


def test_a_loop_within_a_leg_is_found() -> None:
    """A parallelogram forearm: two rods side by side between crank and platform carrier."""
    loop = [
        Joint("A", "revolute", ("base", "crank"), at=FOOT, axis=(1, 0, 0), actuated=True),
        Joint("KB1", "spherical", ("crank", "rod1"), at=KNEE),
        Joint("KB2", "spherical", ("crank", "rod2"), at=np.add(KNEE, (10, 0, 0))),
        Joint("KC1", "spherical", ("rod1", "carrier"), at=HEAD),
        Joint("KC2", "spherical", ("rod2", "carrier"), at=np.add(HEAD, (10, 0, 0))),
        Joint("D", "revolute", ("carrier", "platform"), at=HEAD, axis=(1, 0, 0)),
    ]
    chain = last_chain(*loop)
    assert (str(chain), serves(chain)) == ("R*-[S-S, S-S]-R", "closure")
    assert "loop of its own" in chain.reason
    assert chain.joints == ("A", "KB1", "KC1", "KB2", "KC2", "D")
    assert [step.inward for step in chain.steps] == ["base", "crank", "rod1", "crank", "rod2", "carrier"]
    (found,) = chain.parallelograms
    assert (found.rods, found.width, found.pinned) == ((("KB1", "KC1"), ("KB2", "KC2")), 10, False)


@pytest.mark.parametrize("sine, engine", [(0.5e-6, "reaching"), (1e-5, "closure")])
def test_axes_count_as_parallel_up_to_the_stated_angle(sine: float, engine: str) -> None:
    leg = [
        Joint("A", "revolute", ("base", "k"), at=FOOT, axis=(1, 0, 0), actuated=True),
        Joint("B", "revolute", ("k", "r"), at=KNEE, axis=(1, sine, 0)),
        Joint("C", "spherical", ("r", "platform"), at=HEAD),
    ]
    assert serves(last_chain(*leg)) == engine


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["nrpm", "mixed", "five_bar"])
def test_sub_chains_come_in_the_order_of_their_first_joints(name: str, seed: int) -> None:
    original = machine(name)
    order = np.random.default_rng(seed).permutation(len(original.joints))
    shuffled = dataclasses.replace(original, joints=[original.joints[i] for i in order])
    chains = pf.decompose(shuffled)
    place = {joint.name: i for i, joint in enumerate(shuffled.joints)}
    firsts = [min(place[joint] for joint in chain.joints) for chain in chains]
    assert {frozenset(c.joints) for c in chains} == {frozenset(c.joints) for c in pf.decompose(original)}
    assert firsts == sorted(firsts)


def hexapod_with(*wrist: Joint) -> Mechanism:
    """Six struts; the joints of each at the platform are those given, numbered, at its upper end."""
    joints = []
    feet = ring(100, 0, (-12, 12, 108, 132, 228, 252))
    heads = ring(60, 150, (-45, 45, 75, 165, 195, 285))
    for i, (foot, head) in enumerate(zip(feet, heads, strict=True), 1):
        joints += [
            Joint(f"A{i}", "spherical", ("base", f"c{i}"), at=foot),
            Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", f"{wrist[0].name}{i}"), actuated=True),
        ]
        bodies = [f"r{i}", *(f"{each.name}x{i}" for each in wrist[1:]), "platform"]
        for place, each in enumerate(wrist):
            own = (bodies[place], bodies[place + 1])
            joints.append(dataclasses.replace(each, name=f"{each.name}{i}", connects=own, at=head))
    return Mechanism("hexapod", joints, "platform", (0, 0, 150))


def turning(name: str, *axes: tuple[float, float, float]) -> Joint:
    """A joint to be placed: universal about two axes or about its default ones, revolute about one."""
    if len(axes) == 1:
        return Joint(name, "revolute", ("", ""), axis=axes[0])
    return Joint(name, "universal", ("", ""), axes=axes or None)


@pytest.mark.parametrize(
    "wrist, engine",
    [
        ([turning("U", X, Y), turning("R", Z)], "reaching"),
        ([turning("U", X, Y), turning("R", (0, 1, 2))], "closure"),
        ([turning("U"), turning("R", (0.5, 0.5, 1))], "closure"),
        ([turning("R", Z), turning("U", (1, 0, 1), Y)], "closure"),
        ([turning("U", X, (1, 2, 0))], "closure"),
        ([turning("P", X), turning("Q", Y), turning("R", Z)], "reaching"),
        ([turning("P", X), turning("Q", Y), turning("R", (0, 1, 1))], "closure"),
        ([turning("P", X), turning("Q", (1, 1, 0)), turning("R", Z)], "closure"),
    ],
)
def test_joints_act_as_one_only_about_axes_that_are_square(wrist: list[Joint], engine: str) -> None:
    """About others they do not turn everywhere: positions would promise what no joint can do."""
    mechanism = hexapod_with(*wrist)
    assert {serves(chain) for chain in pf.decompose(mechanism)} == {engine}
    rng = np.random.default_rng(1)
    targets = np.array([pf.pose((0, 0, 150), rotvec=turn) for turn in rng.uniform(-1.0, 1.0, (12, 3))])
    answer = pf.solve_ik(mechanism, targets)
    assert pf.closure_residual(answer).max() <= 1e-9 * mechanism.characteristic_length


@pytest.mark.parametrize("half_angle, engine", [(None, "closure"), (60.0, "reaching"), (85.0, "closure")])
def test_a_strut_oblique_to_the_axis_it_carries_does_not_point_anywhere(half_angle: float | None, engine: str) -> None:
    """Unless its cone keeps it away from the other axis by more than it is oblique."""
    stewart = pf.load("stewart").without_limits()
    joints = []
    for joint in stewart.joints:
        if joint.type == "universal":
            cone = None if half_angle is None else Cone((0, 0, 1), np.radians(half_angle), "base")
            joint = dataclasses.replace(joint, axes=((1, 0, 0), (0, 1, 0)), cone=cone)
        joints.append(joint)
    mechanism = dataclasses.replace(stewart, joints=tuple(joints))
    chains = pf.decompose(mechanism)
    assert engine in {serves(chain) for chain in chains}
    rng = np.random.default_rng(0)
    n = 4 if INTERPRETED else 400
    turns = rng.uniform(-1.2, 1.2, (n, 3))
    targets = np.array([pf.pose(mechanism.reference_point, rotvec=turn) for turn in turns])
    targets[:, :3, 3] += rng.uniform(-1, 1, (n, 3)) * mechanism.characteristic_length
    answer = pf.solve_ik(mechanism, targets)
    assert pf.closure_residual(answer).max() <= 1e-9 * mechanism.characteristic_length


# Loops within a leg


def revolutes(*bodies: tuple[str, str], driven: str = "j0") -> list[Joint]:
    """Revolutes j0, j1, … between pairs of bodies, no two of their centres or axes alike; one is driven."""
    random = np.random.default_rng(0)
    return [
        Joint(
            f"j{k}", "revolute", pair, at=random.normal(size=3), axis=random.normal(size=3), actuated=driven == f"j{k}"
        )
        for k, pair in enumerate(bodies)
    ]


@pytest.mark.parametrize(
    "bodies, written",
    [
        ((("base", "a"), ("a", "b"), ("base", "c"), ("c", "b"), ("b", "platform")), "[R*-R, R-R]-R"),
        ((("a", "platform"), ("base", "a"), ("base", "b"), ("c", "b"), ("c", "a")), "[R*, R-R-R]-R"),
        ((("base", "a"), ("a", "platform"), ("a", "platform")), "R*-[R, R]"),
        ((("base", "a"), ("a", "b"), ("a", "b"), ("b", "platform")), "R*-[R, R]-R"),
        (
            (("base", "a"), ("a", "b"), ("b", "c"), ("b", "d"), ("c", "e"), ("d", "e"), ("a", "e"), ("e", "platform")),
            "R*-[R-[R-R, R-R], R]-R",
        ),
        ((("base", "a"), ("base", "b"), ("a", "b"), ("a", "c"), ("b", "c"), ("c", "platform")), "{R*, R, R, R, R}-R"),
        ((("base", "a"), ("base", "b"), ("a", "b"), ("a", "platform"), ("b", "platform")), "{R*, R, R, R, R}"),
        (
            (("base", "a"), ("a", "b"), ("a", "c"), ("b", "platform"), ("b", "platform"), ("c", "platform")),
            "R*-[R-[R, R], R-R]",
        ),
        ((("base", "a"), ("a", "platform"), ("a", "b"), ("b", "c"), ("c", "a")), "R*-R"),
    ],
)
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_loops_are_written_where_they_open_and_close(bodies: tuple[tuple[str, str], ...], written: str) -> None:
    """In brackets, way by way; in braces what is neither in series nor side by side; what leads nowhere, not at all."""
    driven = "j0" if bodies[0][0] == "base" else "j1"
    (chain,) = pf.decompose(Mechanism("one leg", revolutes(*bodies, driven=driven), "platform", (0, 0, 3)))
    assert str(chain) == written
    assert serves(chain) == "closure"
    assert len(chain.joints) == len(set(chain.joints))


def four_bar(**changes: object) -> list[Joint]:
    """A leg with a parallelogram of pins: rods of 50, 20 apart, in the plane normal to (1, 2, 2) / 3."""
    normal, rod, side = np.array([[1, 2, 2], [2, 1, -2], [2, -2, 1]]) / 3
    b, c = np.array(FOOT), np.array(FOOT) + 50 * rod
    leg = [
        Joint("QA", "revolute", ("base", "top"), at=b, axis=side, actuated=True),
        Joint("QB1", "revolute", ("top", "rod1"), at=b - 10 * side + 3 * normal, axis=normal),
        Joint("QC1", "revolute", ("rod1", "low"), at=c - 10 * side - 7 * normal, axis=-normal),
        Joint("QB2", "revolute", ("rod2", "top"), at=b + 10 * side, axis=normal),
        Joint("QC2", "revolute", ("rod2", "low"), at=c + 10 * side, axis=normal),
        Joint("QD", "revolute", ("low", "platform"), at=c, axis=side),
    ]
    return [dataclasses.replace(j, **changes.get(j.name, {})) for j in leg]


@pytest.mark.parametrize("driven, written", [(None, "R*-Pa-R"), ("QB2", "R*-Pa*-R")])
def test_a_parallelogram_of_pins_is_recognised_wherever_on_its_axis_a_pin_sits(
    driven: str | None, written: str
) -> None:
    chain = last_chain(*four_bar(**({driven: {"actuated": True}} if driven else {})))
    assert (str(chain), serves(chain)) == (written, "closure")
    (found,) = chain.parallelograms
    assert found.rods == (("QB1", "QC1"), ("QB2", "QC2"))
    assert found.joints == ("QB1", "QC1", "QB2", "QC2")
    assert (found.length, found.width) == pytest.approx((50, 20), abs=1e-12)
    assert found.pinned


@pytest.mark.parametrize("size, shift", [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e6)])
def test_a_parallelogram_is_one_in_any_unit_and_anywhere(size: float, shift: float) -> None:
    leg = [dataclasses.replace(j, at=size * (np.array(j.at) + shift)) for j in with_leg(*four_bar()).joints if j.at]
    bare = [j for j in leg if j.name in {"QA", "QB1", "QC1", "QB2", "QC2", "QD"}]
    (chain,) = pf.decompose(Mechanism("leg", bare, "platform", size * (np.array((0, 0, 150)) + shift)))
    assert str(chain) == "R*-Pa-R"
    assert chain.parallelograms[0].length == pytest.approx(50 * size, rel=1e-7)


ROD = np.array([2, 1, -2]) / 3


@pytest.mark.parametrize("share, written", [(0.5e-6, "R*-Pa-R"), (2e-6, "R*-[R-R, R-R]-R")])
@pytest.mark.parametrize("what", ["length", "axis"])
def test_rods_count_as_equal_and_parallel_up_to_the_stated_tolerance(share: float, what: str, written: str) -> None:
    """An offset as a share of L = 100.3 here (that of the struts), an axis off by an angle."""
    length = with_leg(*four_bar()).characteristic_length
    sound = {joint.name: joint for joint in four_bar()}["QC2"]
    axis = np.array(sound.axis) + share * ROD
    change = {"at": np.array(sound.at) + share * length * ROD} if what == "length" else {"axis": axis}
    assert str(last_chain(*four_bar(QC2=change))) == written


def test_rods_that_cross_are_no_parallelogram() -> None:
    pins = {joint.name: joint for joint in four_bar()}
    crossed = {"QC1": {"at": pins["QC2"].at}, "QC2": {"at": pins["QC1"].at}}
    assert str(last_chain(*four_bar(**crossed))) == "R*-[R-R, R-R]-R"


def test_rods_in_one_line_are_no_parallelogram() -> None:
    """They may open into one, or cross."""
    places = {"QB1": 0, "QC1": 50, "QB2": 20, "QC2": 70}
    flat = {name: {"at": np.array(FOOT) + place * ROD} for name, place in places.items()}
    assert str(last_chain(*four_bar(**flat))) == "R*-[R-R, R-R]-R"


@pytest.mark.parametrize("name", ["delta", "linear_delta", "psu", "nrpm"])
def test_pairs_of_rods_that_end_on_the_platform_stay_branches_and_are_noted(name: str) -> None:
    rods = {"delta": 232.0, "linear_delta": 273.0, "psu": 265.0}  # as the files say
    for chain in pf.decompose(pf.load(name)):
        assert len(chain.branches) == 2
        assert [found.length for found in chain.parallelograms] == pytest.approx([rods[name]] if name in rods else [])
        assert not any(found.pinned for found in chain.parallelograms)


def test_the_leg_of_an_orthoglide_is_written_as_its_inventors_do() -> None:
    for number, chain in enumerate(pf.decompose(pf.load("orthoglide")), 1):
        assert str(chain) == "P*-R-Pa-R"
        assert chain.parallelograms[0].rods == ((f"CL{number}", f"DL{number}"), (f"CR{number}", f"DR{number}"))
        assert chain.parallelograms[0].length == pytest.approx(310.582854123025)


HIP, REDUNDANT, FOREARM, TURN = 100.0, 80.0, 220.0, 2 * np.pi / 3


def pinned_delta(offset: float) -> str:
    """The file of a rotary delta with parallelograms of pins; these are `offset` from the hinges at either end."""
    elbow = np.array([HIP + REDUNDANT, 0, 0])
    along = np.array([-3, 0, -4]) / 5
    wrist = elbow + FOREARM * along
    normal, inner, outer = np.array([-4, 0, 3]) / 5, elbow + offset * along, wrist - offset * along

    def hinge(name: str, bodies: str, at: np.ndarray, axis: object, more: str = "") -> str:
        return (
            f'[[joint]]\nname = "{name}"\ntype = "revolute"\nconnects = [{bodies}]\nat = {list(map(float, at))}\n'
            f"axis = {list(axis)}\ncopies = {{ count = 3, axis = [0, 0, 1] }}\n{more}\n"
        )

    tangent, side = (0, 1, 0), np.array([0, 25, 0])
    return (
        'schema = 1\nname = "pinned delta"\nunits = { length = "mm", angle = "deg" }\nbase = "base"\n'
        f'end_effector = "platform"\nreference_point = [0, 0, {wrist[2]}]\ntask = ["x", "y", "z"]\n'
        + hinge("A", '"base", "arm"', np.array([HIP, 0, 0]), tangent, "actuated = true\nrange = [-50, 70]")
        + hinge("B", '"arm", "top"', elbow, tangent)
        + hinge("CL", '"top", "rodL"', inner + side, map(float, normal), "range = [-45, 45]")
        + hinge("DL", '"rodL", "low"', outer + side, map(float, normal))
        + hinge("CR", '"top", "rodR"', inner - side, map(float, normal))
        + hinge("DR", '"rodR", "low"', outer - side, map(float, normal))
        + hinge("E", '"low", "platform"', wrist, tangent)
    )


@pytest.mark.parametrize("offset", [0.0, 15.0], ids=["clavel", "tsai"])
def test_a_delta_with_parallelograms_of_pins_is_described_and_solved(offset: float, tmp_path: Path) -> None:
    """Legs R*-R-Pa-R, with the pins on the hinges as in Clavel's, or set off as in Tsai's.

    By hand: a parallelogram shifts its outer body by a rod, which swings sideways; in the plane of the arm the forearm
    is as long as the rod's share of it and the two offsets.
    """
    path = tmp_path / "delta.toml"
    path.write_text(pinned_delta(offset), encoding="utf-8")
    checked = CliRunner().invoke(main, ["check", str(path)])
    assert (checked.exit_code, checked.stderr) == (0, "")
    mechanism = pf.load(str(path))
    counted = pf.mobility(mechanism)
    assert (counted.platform, counted.mobility, counted.uncontrolled) == (3, 3, 0)
    for chain in pf.decompose(mechanism):
        assert (str(chain), serves(chain), chain.reason) == ("R*-R-Pa-R", "closure", "has a loop of its own")
        assert chain.parallelograms[0].length == pytest.approx(FOREARM - 2 * offset)
        assert chain.parallelograms[0].width == pytest.approx(50)
    n = 4 if INTERPRETED else 40
    moves = np.random.default_rng(2).uniform(-1, 1, (n, 3)) * (40, 40, 30)
    answer = pf.solve_ik(mechanism, mechanism.home_pose[:3, 3] + moves)
    assert (answer.status == pf.Status.REACHED).all()
    assert pf.closure_residual(answer).max() <= 1e-9 * mechanism.characteristic_length
    for leg in range(3):
        turned = Rotation.from_rotvec([0, 0, -leg * TURN]).apply(answer.pose[:, :3, 3] - mechanism.home_pose[:3, 3])
        lowered = answer.actuators[:, leg]
        elbow = np.array([HIP, 0, 0]) + REDUNDANT * np.stack([np.cos(lowered), 0 * lowered, -np.sin(lowered)], axis=1)
        forearm = turned + (HIP + REDUNDANT - 0.6 * FOREARM, 0, -0.8 * FOREARM) - elbow
        expected = 2 * offset + np.sqrt((FOREARM - 2 * offset) ** 2 - forearm[:, 1] ** 2)
        np.testing.assert_allclose(np.hypot(forearm[:, 0], forearm[:, 2]), expected, rtol=1e-9)
    back = pf.solve_fk(mechanism, answer.actuators, start=answer)
    np.testing.assert_allclose(back.pose, answer.pose, atol=1e-6)
    below = pf.solve_ik(mechanism, (0, 0, -400))
    assert below.status is pf.Status.PROJECTED
    assert pf.closure_residual(below) <= 1e-9 * mechanism.characteristic_length
