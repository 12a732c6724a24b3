"""The public API as a user of mypy meets it, without casts: `make check` checks it, and a test runs it."""

from __future__ import annotations

from typing import assert_type

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf

Floats = NDArray[np.float64]


def of_an_answer(machine: pf.Mechanism) -> list[str]:
    """A pose in; status, pose, actuators, all joints and what holds it back out."""
    target = pf.pose([0, 0, 300], rpy=[0, 5, 0], degrees=True)
    answer = pf.solve_ik(machine, target, options=pf.Options(hold="position"))
    assert_type(answer, pf.Solution)
    assert_type(target, Floats)
    assert_type(answer.pose, Floats)
    assert_type(answer.actuators, Floats)
    assert_type(answer.q, Floats)
    assert_type(answer.status, pf.Status | NDArray[np.int64])
    assert_type(answer.position_error, float | Floats)
    assert_type(answer.joints["AL1"], Floats)
    words = [str(answer.status), f"{answer.position_error:.2f}"]
    if isinstance(answer.active_limits, tuple):
        words += [f"{limit.joint} {limit.bound} {limit.value:.2f}" for limit in answer.active_limits]
    return words


def of_a_batch(machine: pf.Mechanism) -> int:
    """Rows of a batch, picked by masks and slices; its binding limits as an array."""
    batch = pf.solve_ik(machine, np.array([[0, 0, 190.0], [0, 0, 300.0]]))
    reached = np.asarray(batch.status == pf.Status.REACHED)
    assert_type(batch[reached], pf.Solution)
    assert_type(batch[0], pf.Solution)
    names: list[str] = batch.binding["joint"].tolist()
    return int(reached.sum()) + len(batch[1:]) + len([name for name in names if name])


def of_a_path(machine: pf.Mechanism, start: pf.Solution) -> float:
    """A path is always a batch, so that its fields are arrays."""
    followed = pf.track(machine, np.linspace([0, 0, 190.0], [0, 0, 200.0], 5), start=start, sample_time=0.1)
    assert_type(followed.status, NDArray[np.int64])
    assert_type(followed.position_error, Floats)
    assert_type(followed.speeds, Floats | None)
    limits = [limit.joint for row in followed.active_limits for limit in row]
    return float(followed.position_error.max()) + len(limits) + int(followed.jumps.sum())


def of_configurations(machine: pf.Mechanism, answer: pf.Solution) -> list[float]:
    """Joint vectors as starts and as configurations; what functions of a Solution tell."""
    again = pf.solve_ik(machine, answer.pose, start=answer.q)
    there = pf.configuration(machine.without_limits(), again.q)
    back = pf.solve_fk(machine, dict(zip(machine.actuator_names, there.actuators, strict=True)), start=there.q)
    found = pf.travel(back, along=(0, 0, 1), about=[(0, 0, 1), (0, 0, -1)], pivot=(0, 0, 0))
    stops = [limit.joint for reach in found for limit in reach.stopped_by]
    margins = [float(margin) for margin in pf.margins(back).values()]
    return [*(reach.distance for reach in found), min(margins), float(pf.closure_residual(back)), float(len(stops))]


def of_descriptions() -> pf.Mechanism:
    """Legs in short, with points as lists, tuples and arrays."""
    angles = np.radians([0, 120, 240])
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    cone = pf.Cone(np.array([0, 0, 1.0]), 0.5, fixed_to="link")
    slide = pf.Joint("P", "prismatic", ["base", "link"], axis=ring[0], actuated=True, range=[0, 10], max_speed=5)
    wrist = pf.Joint("S", "spherical", ["link", "tool"], at=[50, 0, 0])
    assert_type(pf.Joint("S", "spherical", ("base", "rod"), at=(0, 0, 0), cone=cone).cone, pf.Cone | None)
    assert_type(slide.connects, tuple[str, str])
    slider = pf.Mechanism("slider", [slide, wrist], end_effector="S", task=["x"])
    assert_type(slider.reference_point, tuple[float, float, float])
    assert_type(slider.with_limits(P=(0, 5)).actuator_names, tuple[str, ...])
    return pf.Mechanism.from_legs(
        "R-P*-S",
        base=100 * ring,
        platform=(60 * ring + [0, 0, 150]).tolist(),
        stroke=(100, 250),
        A={"axis": "tangential"},
        reference_point=[0, 0, 150],
        task=["z", "tilt"],
    )


def main() -> None:
    stewart = pf.load("stewart")
    here = pf.solve_ik(stewart, (0, 0, 195))
    assert of_an_answer(stewart)[0] == "PROJECTED"
    assert of_a_batch(stewart) == 3
    assert of_a_path(stewart, here) < 1e-6
    assert len(of_configurations(stewart, here)) == 6
    modes = pf.assembly_modes(pf.load("five_bar"), [-0.3, 0.3])
    assert_type(modes[0], pf.Solution)
    assert_type(pf.mobility(of_descriptions()).platform, int)


if __name__ == "__main__":
    main()
