"""Files that are drawn open close in the pose nearest to the drawing, of all that a search from everywhere finds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import root

import pfabrik as pf
from in_mujoco import notes_of
from pfabrik.exchange.interop import Imported, Loop, OpenMechanism, assemble, from_urdf

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

Z = (0.0, 0.0, 1.0)


def turned(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def angle_of(vector: np.ndarray) -> float:
    return float(np.arctan2(vector[1], vector[0]))


@dataclass
class Drawn:
    """A planar machine of three legs as it is drawn: the first holds the platform, the others end next to it.

    Cranks stand from `base` to `knees`, and do not move; rods go on to `ends`, which are to meet `corners`.
    """

    base: np.ndarray
    knees: np.ndarray
    ends: np.ndarray
    corners: np.ndarray

    @classmethod
    def at_random(cls, rng: np.random.Generator, gap: float, is_straight: bool) -> Drawn:
        angles = 2.0 * np.pi * np.arange(3) / 3.0 + rng.uniform(-0.3, 0.3, 3)
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        base, centre = directions * rng.uniform(1.0, 1.5, (3, 1)), rng.uniform(-0.2, 0.2, 2)
        corners = centre + 0.4 * directions * rng.uniform(0.6, 1.2, (3, 1)) @ turned(rng.uniform(-0.3, 0.3)).T
        legs = corners - base
        across = (
            np.stack([-legs[:, 1], legs[:, 0]], axis=1) * rng.choice([-1, 1], (3, 1)) * rng.uniform(0.2, 0.6, (3, 1))
        )
        knees = base + 0.5 * legs + across * (0.0 if is_straight else 1.0)
        rods = corners - knees
        if is_straight:  # and too long, so that they bend one way or the other
            ends = knees + rods * (1.0 + rng.uniform(0.2, 1.0, (3, 1)) * gap)
        else:
            ends = knees + np.array([turned(gap * rng.normal()) @ rod for rod in rods])
        return cls(base, knees, ends, corners + ends[0] - corners[0])

    def opened(self) -> OpenMechanism:
        at = lambda point: (*point, 0.0)  # noqa: E731
        joints, loops = [], []
        for k in range(3):
            joints += [
                pf.Joint(f"A{k}", "revolute", ("base", f"crank{k}"), at=at(self.base[k]), axis=Z, actuated=True),
                pf.Joint(f"K{k}", "revolute", (f"crank{k}", f"rod{k}"), at=at(self.knees[k]), axis=Z),
            ]
            points = [at(self.ends[k]), at(self.corners[k])]
            loops += [Loop(f"P{k}", "spherical", (f"rod{k}", "platform"), points)] if k else []
        joints.append(pf.Joint("P0", "revolute", ("rod0", "platform"), at=at(self.ends[0]), axis=Z))
        return OpenMechanism("drawn", tuple(joints), tuple(loops), "platform", at(self.corners.mean(axis=0)))

    def closed_poses(self, rng: np.random.Generator) -> Iterator[tuple[np.ndarray, float]]:
        """Yield the corners of the platform in all closed poses that are found, and how far it is from the drawing.

        The distance is that of the documentation, written again: of each body, how far the middle of its joints is from
        where it is drawn, and the chord of its turn.
        """
        middle = self.corners.mean(axis=0)
        lengths = np.linalg.norm(self.ends - self.knees, axis=1)
        points = np.concatenate([self.base, self.knees, self.ends[:1], self.ends[1:], self.corners[1:]])
        size = np.linalg.norm(points - points.mean(axis=0), axis=1).max()

        def corners(pose: np.ndarray) -> np.ndarray:
            return middle + pose[:2] + (self.corners - middle) @ turned(pose[2]).T

        def errors(pose: np.ndarray) -> np.ndarray:
            return np.linalg.norm(corners(pose) - self.knees, axis=1) - lengths

        for _ in range(150):
            found = root(errors, rng.uniform([-0.6, -0.6, -np.pi], [0.6, 0.6, np.pi]) * rng.uniform(0.05, 1.0))
            if np.abs(found.fun).max() > 1e-10:
                continue
            at, squares = corners(found.x), 0.0
            for k in range(3):
                rod = at[k] - self.knees[k]
                turn = angle_of(rod) - angle_of(self.ends[k] - self.knees[k])
                shift = 0.5 * (at[k] - self.ends[k])
                squares += shift @ shift / size**2 + 4.0 * np.sin(turn / 2.0) ** 2
            own = np.array([self.ends[0], self.corners[1], self.corners[2]]).mean(axis=0) - middle
            shift = found.x[:2] + turned(found.x[2]) @ own - own
            squares += shift @ shift / size**2 + 4.0 * np.sin(found.x[2] / 2.0) ** 2
            yield at, float(np.sqrt(squares / 7.0))  # of three cranks, three rods, and the platform


def corners_of(found: Imported) -> np.ndarray:
    return np.array([found.mechanism.joint(f"P{k}").at[:2] for k in range(3)])


SEEDS = [*range(2), *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(2, 60))]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("gap", [0.02, 0.1, 0.25])
@pytest.mark.parametrize("is_straight", [False, True])
def test_a_machine_that_is_drawn_open_closes_in_the_pose_nearest_to_the_drawing(
    is_straight: bool, gap: float, seed: int
) -> None:
    rng = np.random.default_rng([seed, round(100 * gap)])
    drawn = Drawn.at_random(rng, gap, is_straight)
    poses = sorted(drawn.closed_poses(rng), key=lambda each: each[1])
    if not poses:
        pytest.skip("no pose closes this drawing with its cranks where they are")
    found = assemble(drawn.opened())
    assert found.mechanism.joint("A1").home == 0.0
    apart = [(float(np.abs(corners_of(found) - at).max()), distance) for at, distance in poses]
    ours = min(apart)
    assert ours[0] <= 1e-7 and ours[1] <= poses[0][1] + 1e-7  # what `root` leaves open
    others = [distance for at, distance in poses if np.abs(at - poses[0][0]).max() > 1e-3]
    if others and others[0] <= 1.02 * poses[0][1]:
        assert "another pose closes the loops about as near" in notes_of(found)


def hanging(height: float, length: float, bar: float, across: float) -> tuple[str, dict]:
    """A bar that floats, drawn below or above two rods that lie flat, of a length, with a hinge at each end."""
    links = "".join(f'<link name="{name}"/>' for name in ("base", "bar", "left", "right"))
    free = '<joint name="free" type="floating"><parent link="base"/><child link="bar"/>'
    joints = f'{free}<origin xyz="0 0 {height}"/></joint>'
    for name, sign in (("left", -1), ("right", 1)):
        joints += f'<joint name="{name}_hinge" type="continuous"><parent link="base"/><child link="{name}"/>'
        joints += f'<origin xyz="{sign * across} 0 0"/><axis xyz="0 1 0"/></joint>'
    loops = [
        {"name": f"{name}_end", "type": "hinge", "axis": [[0, 1, 0], [0, 1, 0]], "links": [name, "bar"], "at": at}
        for name, at in (
            ("left", [[length, 0, 0], [-bar, 0, 0]]),
            ("right", [[-length, 0, 0], [bar, 0, 0]]),
        )
    ]
    return f'<robot name="t">{links}{joints}</robot>', {"loops": loops, "actuated": ["left_hinge"]}


@pytest.mark.parametrize(("length", "bar", "across"), [(0.2, 0.1, 0.1), (0.2, 0.1, 0.15), (0.15, 0.05, 0.06)])
@pytest.mark.parametrize("height", [0.15, 0.05])
def test_a_platform_that_floats_closes_on_the_side_on_which_it_is_drawn(
    height: float, length: float, bar: float, across: float
) -> None:
    """And its mirror image, drawn above, is closed as the mirror image."""
    below, above = (
        from_urdf(*hanging(side * height, length, bar, across), end_effector="bar").mechanism.reference_point
        for side in (-1.0, 1.0)
    )
    assert below[2] < 0.0 < above[2]
    np.testing.assert_allclose(below, np.multiply(above, [1, 1, -1]), atol=1e-5)
