"""Dry friction of actuators at rest: the forces there are those of the machine without it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from machines.redescribed import scaled
from pfabrik.common.arrays import Floats
from pfabrik.kinematics import actuator_units

DRY = 0.5
NAMES = (
    "agile_eye",
    "ankle_ups",
    "canfield",
    "delta",
    "five_bar",
    "linear_delta",
    "prs",
    "serial_arm",
    "stewart",
    "ucu",
)


def rubbing(machine: pf.Mechanism, dry: float) -> pf.Mechanism:
    """The machine with masses, and friction of all actuators: some viscous, and so much dry."""
    masses = [
        pf.Mass(body, 0.5, np.mean([j.at for j in machine.joints if body in j.connects and j.at is not None], axis=0))
        for body in machine.bodies[1:]
    ]
    joints = [
        dataclasses.replace(joint, friction=((dry, 0.02),) * 2 if joint.type == "cylindrical" else (dry, 0.02))
        if joint.actuated is True
        else joint
        for joint in machine.joints
    ]
    return machine._with(joints=tuple(joints)).with_masses(masses)


def there_and_on(machine: pf.Mechanism, *, rise: int = 12, stay: int = 9) -> tuple[Any, Any]:
    """Poses that go from home to another place, stay, and go on to home; and the rows that stay."""
    home = pf.solve_ik(machine, machine.home_pose)
    steps = np.random.default_rng(3).uniform(0.01, 0.03, len(home.actuators)) * actuator_units(machine)
    way = np.linspace(0.0, 1.0, rise + 1)
    way = way**3 * (10 - 15 * way + 6 * way**2)
    shares = np.concatenate([way, np.ones(stay), way[::-1]])
    there = pf.solve_fk(machine, home.actuators + shares[:, None] * steps)
    assert (there.status == 0).all()
    return there.pose, slice(rise, rise + stay + 2)


def at_home(machine: pf.Mechanism, n: int) -> pf.Solution:
    """Home, n times."""
    return pf.solve_ik(machine, np.repeat(machine.home_pose[None], n, axis=0))


def of_dry_friction(machine: pf.Mechanism, efforts: Any) -> Floats:
    """What dry friction adds to the forces of a motion."""
    with_it, without = (efforts(rubbing(machine, dry)).actuators for dry in (DRY, 0.0))
    return np.asarray(with_it - without)


@pytest.mark.parametrize("name", [name for name in pf.catalog() if name != "snake60"])  # which takes seconds
def test_in_a_pause_there_is_no_dry_friction(name: str) -> None:
    machine = pf.load(name)
    poses, stay = there_and_on(machine)
    times = 0.002 * np.arange(len(poses))
    efforts = pf.inverse_dynamics(pf.track(rubbing(machine, DRY), poses, times=times))
    added = of_dry_friction(machine, lambda m: pf.inverse_dynamics(pf.track(m, poses, times=times)))
    np.testing.assert_allclose(added[stay], 0.0, atol=1e-9 * np.abs(efforts.actuators).max())
    assert efforts.at_rest[stay].all()
    moving = np.abs(efforts.rates / actuator_units(machine)) > 1e-2
    if not efforts.is_least_norm:
        np.testing.assert_allclose(added[moving], DRY * np.sign(efforts.rates[moving]), rtol=1e-6)
    assert moving[3].any()
    assert not efforts.at_rest[moving].any()
    assert "dry friction counts as 0" in str(efforts)


@pytest.mark.parametrize("name", NAMES)
def test_an_actuator_rubs_where_it_moves_and_by_no_rounding(name: str) -> None:
    machine = pf.load(name)
    units = actuator_units(machine)
    sizes = np.array([1e-17, 1e-13, 1e-9, 1e-7, 1e-5, 10.0])
    alternating = np.outer(sizes, units * (-1.0) ** np.arange(len(units)))
    rates, expected = (
        np.concatenate([alternating, np.diag(units)]),
        np.sign(np.concatenate([alternating, np.diag(units)])),
    )
    expected[:3] = 0.0
    added = of_dry_friction(
        machine, lambda m: pf.inverse_dynamics(at_home(m, len(rates)), twists=rates, at="actuators")
    )
    np.testing.assert_allclose(added, DRY * expected, atol=1e-9)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_motion_rubs_however_slow_it_is(factor: float) -> None:
    machine = pf.load("stewart")
    poses, stay = there_and_on(machine)
    times = 0.002 * np.arange(len(poses))
    fast, slow = (
        of_dry_friction(machine, lambda m, t=each: pf.inverse_dynamics(pf.track(m, poses, times=t)))
        for each in (times, times / factor)
    )
    np.testing.assert_allclose(slow, fast, atol=1e-9)
    np.testing.assert_allclose(np.abs(np.delete(slow, np.r_[0, -1, stay], axis=0)).max(axis=1), DRY, atol=1e-9)


@pytest.mark.parametrize("name", ["delta", "linear_delta", "prs", "stewart"])
def test_a_machine_in_metres_exerts_what_it_does_in_millimetres(name: str) -> None:
    machine = pf.load(name).without_limits()
    assert machine.length_unit == "mm"
    poses, _ = there_and_on(machine)
    times, in_metres = 0.002 * np.arange(len(poses)), poses * np.array([[1.0, 1.0, 1.0, 1e-3]] * 3 + [[1.0] * 4])
    one = pf.inverse_dynamics(pf.track(rubbing(machine, DRY), poses, times=times))
    other = dataclasses.replace(scaled(machine, 1e-3), length_unit="m")
    two = pf.inverse_dynamics(pf.track(rubbing(other, DRY), in_metres, times=times))
    np.testing.assert_array_equal(two.at_rest, one.at_rest)
    np.testing.assert_allclose(two.actuators, one.actuators, atol=1e-6 * np.abs(one.actuators).max())


def test_identify_and_time_path_know_rest_too() -> None:
    """A carriage of a linear delta that stays where it is as the others move."""
    machine = pf.load("linear_delta")
    home = pf.solve_ik(machine, machine.home_pose).actuators
    way = np.linspace(0.0, 1.0, 101)
    way = 0.1 * machine.characteristic_length * np.sin(6.0 * way) ** 2 * way
    poses = pf.solve_fk(machine, home + np.outer(way, [0.0, 1.0, -1.0])).pose
    track = pf.track(rubbing(machine, DRY), poses, times=0.01 * np.arange(101))
    efforts = pf.inverse_dynamics(track)
    assert efforts.at_rest[:, 0].all()
    result = pf.identify(track, efforts.actuators, bodies="platform")
    dry = dict(zip(result.names, zip(result.values, result.deviations, strict=True), strict=True))
    (first, *others) = (dry[f"{name}.dry"] for name in machine.actuator_names)
    np.testing.assert_allclose([value for value, _ in others], DRY, rtol=1e-3)
    assert np.isinf(first[1])  # nothing says how much it rubs
    timed = pf.time_path(track, torque=3.0 * np.abs(efforts.actuators).max())
    smooth = pf.time_path(
        pf.track(rubbing(machine, 0.0), poses, times=0.01 * np.arange(101)),
        torque=3.0 * np.abs(efforts.actuators).max(),
    )
    assert pf.inverse_dynamics(timed).at_rest[:, 0].all()
    assert timed.duration > smooth.duration
