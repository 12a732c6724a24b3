"""Dead points of linkages are told one loop at a time: with fingers side by side, and with balls for pins."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from machines.small import PINS, four_bar, gripper
from pfabrik import Options, Status

Z = (0, 0, 1)
PIVOT, CRANK, ROD, PAD = (np.array(PINS[name][:2], float) for name in ("drv0", "rod1", "rod0", "drv1"))


def end_of_travel() -> float:
    """How far the left pad goes until its rod and crank are in line, at the first angle of either line-up [mm]."""
    crank, rod, ends = np.linalg.norm(CRANK - PIVOT), np.linalg.norm(CRANK - ROD), []
    for reach, sign in ((rod + crank, -1), (rod - crank, 1)):
        pin = np.array([ROD[0], PIVOT[1] - np.sqrt(reach**2 - (PIVOT - ROD)[0] ** 2)])
        aim = sign * (PIVOT - pin) / reach  # from the pivot to the pin of the crank: onward, or back
        turn = np.arctan2(*aim[::-1]) - np.arctan2(*(CRANK - PIVOT)[::-1])
        ends.append((turn + np.pi) % (2 * np.pi) - np.pi)
    turn, arm = min(end for end in ends if end > 0), PAD - PIVOT
    return float(arm[0] - (np.cos(turn) * arm[0] - np.sin(turn) * arm[1]))


@pytest.mark.parametrize(
    "balls", [(), ("rod1",), ("rod0", "rod1"), ("drv1",), ("fol0", "fol1"), ("rod0", "rod1", "fol1")]
)
@pytest.mark.parametrize("sides", [1, 2])
def test_fingers_end_where_a_rod_is_in_line_with_its_crank(sides: int, balls: tuple[str, ...]) -> None:
    machine, far = gripper(sides, balls), end_of_travel()
    home = pf.solve_fk(machine, [0.0])
    travel = pf.travel(home, along=(1, 0, 0))[0]
    assert travel.why == "dead point" and travel.distance == pytest.approx(far, abs=1e-3)
    out = np.arange(-30.0, 66.0, 3.0)
    targets = np.stack([out, np.full(len(out), 92.0), np.zeros(len(out))], axis=1)
    expected = out + 30.0 <= far
    for answer in (
        pf.solve_ik(machine, targets, start=home),
        pf.solve_ik(machine, targets, options=Options(working_mode="keep")),
    ):
        np.testing.assert_array_equal(answer.status == Status.REACHED, expected)
    there_and_back = pf.track(machine, np.concatenate([targets, targets[::-1]]), start=home)
    np.testing.assert_array_equal(there_and_back.status == Status.REACHED, [*expected, *expected[::-1]])
    pinned = [c.column for c in machine.coordinates if c.joint.type != "spherical"]  # rods between balls may turn
    np.testing.assert_allclose(there_and_back.q[-1][pinned], 0.0, atol=1e-9)


@pytest.mark.parametrize("balls", ["", "BC", "C"])
def test_a_drag_link_turns_fully(balls: str) -> None:
    """Grashof: the ground is the shortest link, so there is no dead point, though the coupler turns far on balls."""
    machine = four_bar((0, 0), (45, 0), (40, -20), (3, 6), end="crank", at=(45, 0), balls=balls, task=("yaw",))
    home = pf.solve_fk(machine, [0.0])
    assert all(np.isinf(each.distance) for each in pf.travel(home, about=[Z, (0, 0, -1)]))
    turns = pf.pose(np.zeros((18, 3)), rpy=np.radians(np.arange(0, 360, 20.0))[:, None] * np.array(Z))
    turns[:, :3, 3] = turns[:, :3, :3] @ np.array(machine.reference_point)
    assert (pf.solve_ik(machine, turns, start=home).status == Status.REACHED).all()
    assert (pf.track(machine, turns, start=home).status == Status.REACHED).all()


@pytest.mark.parametrize("driven", ["A", "D"])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 20))])
def test_balls_for_pins_change_no_travel(seed: int, driven: str) -> None:
    """The oracle is the same four-bar on pins, whose signs are those of a determinant alone."""
    rng = np.random.default_rng(seed)
    for _ in range(6):
        pins = [(0.0, 0.0), *map(tuple, rng.uniform(-60, 60, (3, 2)))]
        machines = [
            four_bar(*pins, end="crank", at=pins[1], balls=balls, driven=driven, task=("yaw",)) for balls in ("", "BC")
        ]
        ends = [pf.travel(pf.solve_fk(machine, [0.0]), about=[Z, (0, 0, -1)]) for machine in machines]
        pinned, spun = (np.array([each.distance for each in of_one]) for of_one in ends)
        np.testing.assert_allclose(spun, pinned, atol=1e-4)
