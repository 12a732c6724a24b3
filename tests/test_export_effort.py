"""Forces of motion in exported C: those of `inverse_dynamics`, by the compiled file."""

from __future__ import annotations

import dataclasses
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from exported import STRICT, compiled, needs_compiler, survives
from pfabrik.errors import InvalidArgument, UnsupportedMechanism
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.source import targets_around_home

DRIVER = Path(__file__).parent / "data" / "run_effort.c"
EXACT = {"double": 1e-9, "float": 1e-4}
KEEP = pf.Options(working_mode="keep")
GRAVITY = np.array([1.0, -2.0, -9.0])
SINGULAR = -7


def weighed(machine: pf.Mechanism) -> pf.Mechanism:
    """Random masses, rotors and friction; of rods, slender ones, round about their lines."""
    random, length, masses = np.random.default_rng(2), machine.characteristic_length, []
    for body in machine.bodies:
        points = [np.array(joint.at) for joint in machine.joints if body in joint.connects and joint.at is not None]
        centre = np.mean(points or [machine.reference_point], axis=0)
        size = 0.2 * length
        turns = np.linalg.qr(random.standard_normal((3, 3)))[0]
        inertia = size**2 * turns @ np.diag([1.0, 1.3, 1.8]) @ turns.T
        if len(points) == 2 and (span := np.linalg.norm(points[1] - points[0])) > 0.0:
            line = (points[1] - points[0]) / span
            inertia = size**2 * (np.eye(3) - 0.9 * np.outer(line, line))
        else:
            centre = centre + 0.05 * length * random.standard_normal(3)
        mass = random.uniform(0.3, 2.0)
        masses.append(pf.Mass(body, mass, centre, 0.5 * mass * (inertia + inertia.T)))
    joints = [
        dataclasses.replace(joint, rotor_inertia=1e-4, gear=3.0, friction=(0.1, 0.02))
        if joint.actuated is True
        else joint
        for joint in machine.joints
    ]
    return machine._with(joints=tuple(joints)).with_masses(masses)


def moving(machine: pf.Mechanism) -> tuple[pf.Solution, Any, Any, Any]:
    """Configurations around home, twists that their actuators make, accelerations, and the forces of these."""
    random = np.random.default_rng(1)
    solution = pf.solve_ik(machine, targets_around_home(machine, 20, random), options=KEEP)
    solution = solution[np.flatnonzero(solution.status == 0)]
    maps = pf.forward_jacobian(solution)
    rates, gains = random.standard_normal((2, *solution.actuators.shape))
    rates[:4] *= np.array([[0.0], [1e-17], [1e-13], [1e-10]])  # at rest, to rounding
    twists, accelerations = (np.zeros((len(maps), 6)) for _ in range(2))
    width = maps.shape[1]
    twists[:, :width] = np.einsum("nra,na->nr", maps, rates)
    accelerations[:, :width] = np.einsum("nra,na->nr", maps, gains)
    found = pf.inverse_dynamics(
        solution, twists=twists[:, :width], accelerations=accelerations[:, :width], gravity=GRAVITY
    )
    return solution, twists, accelerations, found


def asked(program: Path, poses: Any, twists: Any, accelerations: Any) -> Any:
    """Codes and forces that a compiled file says, a row for each pose."""
    gravity = np.tile(GRAVITY, (len(poses), 1))
    turns = poses[:, :3, :3].reshape(-1, 9)
    rows = np.concatenate([poses[:, :3, 3], turns, twists, accelerations, gravity], axis=1)
    text = "\n".join(" ".join(f"{number:.17g}" for number in row) for row in rows)
    said = subprocess.run([str(program)], input=text, capture_output=True, text=True, check=True).stdout
    return np.array([[float(word) for word in line.split()] for line in said.splitlines()])


@needs_compiler
@pytest.mark.parametrize(
    ("name", "precision"),
    [
        *(
            (name, "double")
            for name in ("stewart", "delta", "linear_delta", "rps", "prs", "agile_eye", "tricept", "psu")
        ),
        *((name, "double") for name in ("five_bar", "rrr")),
        *((name, "float") for name in ("stewart", "delta", "prs")),
    ],
)
def test_forces_of_a_compiled_file_are_those_of_inverse_dynamics(name: str, precision: Any) -> None:
    machine = weighed(pf.load(name).without_limits())
    program = compiled(c_source(machine, parts=("bodies", "effort"), precision=precision), *STRICT, driver=DRIVER)
    survives(program)
    solution, twists, accelerations, expected = moving(machine)
    said = asked(program, solution.pose, twists, accelerations)
    is_made = np.asarray(expected.reason) == ""
    assert is_made.any()
    np.testing.assert_array_equal(said[:, 0], np.where(is_made, 0, SINGULAR))
    size = np.nanmax(np.abs(expected.actuators))
    np.testing.assert_allclose(said[is_made, 1:], expected.actuators[is_made], atol=EXACT[precision] * size)


def test_machines_whose_bodies_the_file_cannot_place_are_refused_with_the_reason() -> None:
    with pytest.raises(InvalidArgument, match="no mass of"):
        c_source(pf.load("stewart"), parts=("effort",))
    with pytest.raises(UnsupportedMechanism, match="place of body 'rodK1' follows from no leg"):
        c_source(weighed(pf.load("ucu")), parts=("effort",))
    delta = weighed(pf.load("linear_delta"))
    lopsided = [dataclasses.replace(mass, inertia=(3.0, 1.0, 2.0, 0.0, 0.0, 0.0)) for mass in delta.masses]
    with pytest.raises(UnsupportedMechanism, match="spins in a way that follows from no leg"):
        c_source(delta.with_masses(lopsided), parts=("effort",))
