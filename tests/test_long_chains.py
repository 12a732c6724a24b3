"""Chains of hundreds of joints are answered in bounded work, within reach and out of it."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED
from pfabrik import Cone, Joint, Mechanism, Status

pytestmark = [
    pytest.mark.skipif(INTERPRETED, reason="cubes of hundreds take minutes in plain Python"),
    pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning"),
]
LENGTHS = [300, pytest.param(999, marks=pytest.mark.slow)]


def bodies(i: int, n: int) -> tuple[str, str]:
    return ("base" if i == 0 else f"b{i}", "tip" if i == n - 1 else f"b{i + 1}")


def planar(n: int, most: float) -> Mechanism:
    """Hinges in a plane, one unit apart, each of which turns by so much [rad]."""
    bound = {} if most == np.inf else {"range": (-most, most)}
    joints = [
        Joint(f"j{i}", "revolute", bodies(i, n), (i, 0, 0), (0, 0, 1), actuated=True, **bound)  # type: ignore[arg-type]
        for i in range(n)
    ]
    return Mechanism("hinges", joints, "tip", (n, 0, 0))


def tip_of(angles: np.ndarray) -> tuple[np.ndarray, float]:
    """Where the tip of unit links is that turn by angles, each against the one before, and how far it is turned."""
    turned = np.cumsum(angles)
    return np.array([np.cos(turned).sum(), np.sin(turned).sum()]), float(turned[-1])


def in_space(n: int) -> Mechanism:
    """A hinge, then universal joints whose links keep within a cone about the one before."""
    joints = [Joint("j0", "revolute", bodies(0, n), (0, 0, 0), (0, 0, 1), actuated=True)]
    for i in range(1, n):
        body, after = bodies(i, n)
        bound = {"cone": Cone((1, 0, 0), 0.2, body)} if i < n - 1 else {}
        joints.append(Joint(f"j{i}", "universal", (body, after), (i, 0, 0), axes=((0, 1, 0), (0, 0, 1)), **bound))  # type: ignore[arg-type]
    return Mechanism("universal joints", joints, "tip", (n, 0, 0))


@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("most", [np.inf, np.radians(10.0)])
def test_targets_within_reach_of_many_hinges_are_reached(n: int, most: float) -> None:
    answer = pf.solve_ik(planar(n, most), (0.98 * n, 0.05 * n, 0.0))
    assert answer.status == Status.REACHED
    assert np.abs(answer.q).max() <= most + 1e-9
    tip, turned = tip_of(answer.q)
    np.testing.assert_allclose(tip, (0.98 * n, 0.05 * n), atol=2e-9 * n)
    assert abs(turned) <= 1e-8


@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("most", [np.inf, np.radians(10.0)])
def test_targets_out_of_reach_of_many_hinges_are_approached(n: int, most: float) -> None:
    """The tip is at most n away from the base: nothing comes nearer than the difference, and nothing ends farther than
    where it starts."""
    target = np.array((0.9 * n, 0.6 * n))
    answer = pf.solve_ik(planar(n, most), (*target, 0.0))
    assert answer.status == Status.PROJECTED
    assert np.abs(answer.q).max() <= most + 1e-9
    tip, turned = tip_of(answer.q)
    np.testing.assert_allclose(answer.pose[:2, 3], tip, atol=1e-9 * n)
    away = np.linalg.norm(tip - target)
    assert np.linalg.norm(target) - n <= away + 1e-9 * n
    assert away <= 1.1 * (np.linalg.norm(target) - n)
    assert abs(turned) == pytest.approx(answer.rotation_error, abs=1e-7)


def test_targets_within_reach_of_universal_joints_are_reached() -> None:
    n = 200
    answer = pf.solve_ik(in_space(n), (0.97 * n, 0.05 * n, 0.03 * n))
    assert answer.status == Status.REACHED
    along = np.diff([answer.points[f"j{i}"] for i in range(n)], axis=0)
    assert np.allclose(np.linalg.norm(along, axis=1), 1.0)
    assert np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0)).max() <= 0.2 + 1e-6


@pytest.mark.parametrize("n", LENGTHS)
def test_angles_beyond_the_ranges_of_many_hinges_are_projected_onto_them(n: int) -> None:
    most = np.radians(10.0)
    answer = pf.solve_fk(planar(n, most), np.full(n, 0.2))
    assert answer.status == Status.PROJECTED
    assert np.abs(answer.q).max() <= most + 1e-9
    assert answer.actuator_error <= 0.2 - most + 1e-3
