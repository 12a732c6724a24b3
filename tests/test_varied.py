"""Machines at other values of their dimensions, against machines that are made anew, and slopes against differences."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
import pfabrik.capabilities.calibration.sensitivity as sensitivities
from pfabrik.common.arrays import Floats
from pfabrik.common.rotations import from_rotvec
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnknownName, UnsupportedMechanism
from pfabrik.kinematics import VariedMachine, varied
from pfabrik.machine.files.reading import read_mechanism

TEMPLATES = sorted((Path(pf.__file__).parent / "machine" / "catalog" / "templates").glob("*.toml"))


@cache
def template(name: str) -> pf.Mechanism:
    return pf.load(next(path for path in TEMPLATES if path.stem == name))


@cache
def all_varied(name: str) -> VariedMachine:
    return varied(template(name))


def drawn(name: str, seed: int, spread: float = 0.05) -> tuple[Floats, pf.Mechanism]:
    """Values of all dimensions at random, near those of the template, and the machine that has them."""
    machine, rng = template(name), np.random.default_rng(seed)
    own = np.array([machine.dimensions[each] for each in all_varied(name).names])
    values = own * rng.uniform(1.0 - spread, 1.0 + spread, len(own))
    return values, machine.with_dimensions(dict(zip(all_varied(name).names, values.tolist(), strict=True)))


def poses_near_home(machine: pf.Mechanism, seed: int, n: int = 60, reach: float = 0.5) -> Floats:
    """Poses in all directions of the task and others, some within all limits and some out of reach."""
    rng, size = np.random.default_rng(seed), machine.characteristic_length
    poses = np.tile(machine.home_pose, (n, 1, 1))
    shares = reach * rng.uniform(0.0, 1.0, (n, 1))
    is_planar = len({joint.at[2] for joint in machine.joints if joint.at is not None}) == 1
    axes, turns = ((1.0, 1.0, 0.0), (0.0, 0.0, 1.0)) if is_planar else ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    poses[:, :3, 3] += size * shares * rng.standard_normal((n, 3)) * axes
    poses[:, :3, :3] = from_rotvec(shares * rng.standard_normal((n, 3)) * turns)
    return poses


@pytest.mark.parametrize("name", [path.stem for path in TEMPLATES])
def test_least_margins_are_those_of_the_machine_made_anew(name: str) -> None:
    """The oracle is the file read with these values, and its legs decomposed and measured by `feasibility`."""
    counts = np.zeros(2, int)
    for seed in range(4):
        values, machine = drawn(name, seed)
        poses, at = poses_near_home(machine, seed), all_varied(name).at(values)
        margins, found = at.margins(poses), pf.feasibility(machine, poses)
        np.testing.assert_allclose(margins.min(axis=1), found.margin, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(at.home_pose, machine.home_pose, atol=1e-9 * machine.characteristic_length)
        named = [all_varied(name).limits[k] for k in margins.argmin(axis=1)]
        alone = np.diff(np.sort(margins, axis=1)[:, :2], axis=1)[:, 0] > 1e-6
        assert all(named[row] == found.limits[found.binding[row]] for row in np.flatnonzero(alone))
        counts += np.count_nonzero(found.margin > 0.0), np.count_nonzero(found.margin < 0.0)
    assert counts.min() > 5


FIELDS = {
    "range": "r",
    "stroke": "r",
    "half_angle": "c",
    "axis": "a",
    "at": "p",
    "base": "p",
    "platform": "p",
    "via": "p",
}


def _opened(said: Any, kind: str, dimensions: dict[str, float]) -> Any:
    """A part of a file with a dimension for every number of a point, a direction or a limit."""
    if isinstance(said, dict):
        kinds = {key: "" if key == "copies" else FIELDS.get(key, kind) for key in said}
        return {key: _opened(part, kinds[key], dimensions) for key, part in said.items()}
    if isinstance(said, list):
        return [_opened(part, kind, dimensions) for part in said]
    if not kind or isinstance(said, bool | str) or said == 0:
        return said
    name = f"{kind}{len(dimensions)}"
    dimensions[name] = float(said)
    return name


@pytest.mark.parametrize(
    "name", ["agile_eye", "ankle_ups", "delta", "five_bar", "orthoglide", "psu", "reachy_mini", "rps", "tricept", "ucu"]
)
def test_every_number_of_a_file_may_be_a_dimension(name: str) -> None:
    """As above, of all numbers at once: points to another scale, cones at random."""
    dimensions: dict[str, float] = {}
    table = tomllib.loads((TEMPLATES[0].parents[1] / f"{name}.toml").read_text(encoding="utf-8"))
    kinds = {"leg": "", "joint": "", "reference_point": "p"}
    parts = {key: _opened(table[key], kind, dimensions) for key, kind in kinds.items() if key in table}
    drawn_machine = read_mechanism(table | parts | {"dimensions": dimensions})
    ours, rng = varied(drawn_machine), np.random.default_rng(7)
    factors = {"p": lambda: 1.2, "c": lambda: rng.uniform(0.9, 1.1)}
    values = {each: factors.get(each[0], lambda: 1.0)() * dimensions[each] for each in ours.names}
    machine = drawn_machine.with_dimensions(values)
    poses = poses_near_home(machine, 7, reach=0.3)
    margins, found = ours.at([*values.values()]).margins(poses), pf.feasibility(machine, poses)
    np.testing.assert_allclose(margins.min(axis=1), found.margin, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", [path.stem for path in TEMPLATES])
def test_slopes_are_those_of_differences(name: str) -> None:
    """Of two central differences the extrapolated one is the oracle, where both agree: not at kinks and dead points."""
    values, machine = drawn(name, 11)
    ours, poses = all_varied(name), poses_near_home(machine, 11, 30)
    slopes, worst, asked = ours.at(values).slopes(poses), 0.0, 0
    for k, value in enumerate(values):
        differences = []
        for step in (2e-4 * abs(value), 1e-4 * abs(value)):
            ends = []
            for sense in (1.0, -1.0):
                moved = values.copy()
                moved[k] += sense * step
                ends.append(ours.at(moved).margins(poses))
            finite = np.where(np.isinf(ends[0]) | np.isinf(ends[1]), np.nan, ends)
            differences.append((finite[0] - finite[1]) / (2.0 * step) * value)
        coarse, fine = differences
        smooth = np.abs(coarse - fine) < 1e-5
        expected, found = ((4.0 * fine - coarse) / 3.0)[smooth], (slopes[:, :, k] * value)[smooth]
        worst, asked = max(worst, float(np.abs(found - expected).max())), asked + int(smooth.sum())
    assert worst < 1e-7 and asked > 0.7 * slopes.size * np.isfinite(ours.at(values).margins(poses)).mean()


@pytest.mark.parametrize("name", ["6-UPS", "6-RUS", "delta", "5-bar", "3-RRR", "3-PRS"])
def test_actuators_and_their_jacobians(name: str) -> None:
    values, machine = drawn(name, 5)
    at, poses = all_varied(name).at(values), poses_near_home(machine, 5, 40, 0.2)
    answer = pf.solve_ik(machine, poses)
    reached = (answer.status == pf.Status.REACHED) & (pf.feasibility(machine, poses).margin > 0.0)
    assert reached.sum() > 5
    size = machine.characteristic_length
    np.testing.assert_allclose(at.actuators(poses)[reached], answer.actuators[reached], rtol=1e-9, atol=1e-9 * size)
    if machine.task == machine.whole_task:
        jacobians, completed = at.inverse_jacobians(poses), poses[reached]
        for column in range(6 if not machine.end_effector_is_joint else 3):
            step, ends = 1e-5 * (size if column < 3 else 1.0), []
            for sense in (1.0, -1.0):
                moved, twist = completed.copy(), sense * step * np.eye(6)[column]
                moved[:, :3, 3] += twist[:3]
                moved[:, :3, :3] = from_rotvec(twist[3:]) @ moved[:, :3, :3]
                ends.append(at.actuators(moved))
            differences = (ends[0] - ends[1]) / (2.0 * step)
            np.testing.assert_allclose(jacobians[reached, :, column], differences, rtol=1e-6, atol=1e-7 * size)


@pytest.mark.parametrize("name", [path.stem for path in TEMPLATES])
def test_along_motions_a_wrench_and_the_actuators_that_hold_it_do_no_work(name: str) -> None:
    """The oracle is statics, at the configurations of the machine made anew."""
    values, machine = drawn(name, 6)
    poses, size = poses_near_home(machine, 6, 40, 0.2), machine.characteristic_length
    answer = pf.solve_ik(machine, poses)
    reached = answer.status == pf.Status.REACHED
    wrench = np.array([1.0, -2.0, 3.0, 0.5 * size, -0.3 * size, 0.2 * size])[
        : 3 if machine.end_effector_is_joint else 6
    ]
    rates, twists = (each[reached] for each in all_varied(name).at(values).motions(poses))
    twists = twists * np.where(np.arange(6) < 3, size, 1.0)[:, None]
    held = np.asarray(pf.forces(answer, wrench).actuators)[reached]
    assert reached.sum() > 5 and rates.shape[2] == len(machine.actuator_names)
    work = np.einsum("na,naf->nf", held, rates) + np.einsum("w,nwf->nf", wrench, twists[:, : len(wrench)])
    np.testing.assert_allclose(work, 0.0, atol=1e-9 * size)


def test_limits_that_home_exceeds_are_numbers() -> None:
    machine = template("6-UPS")
    with pytest.raises(InvalidMechanism):
        machine.with_dimensions(longest=180.0)
    at = varied(machine, "longest").at([180.0])
    home = at.home_pose[None]
    struts = np.linalg.norm(machine.joint("C1").at - np.array(machine.joint("A1").at))
    own = [k for k, limit in enumerate(varied(machine, "longest").limits) if limit == ("B1", "max")]
    expected = (180.0 - struts) / (0.5 * (180.0 - machine.dimensions["shortest"]))
    np.testing.assert_allclose(at.margins(home)[0, own], expected, rtol=1e-12)
    by_longest = 2.0 * (struts - machine.dimensions["shortest"]) / (180.0 - machine.dimensions["shortest"]) ** 2
    np.testing.assert_allclose(at.slopes(home)[0, own, 0], by_longest, rtol=1e-12)


def test_a_decision_that_comes_out_otherwise_has_expressions_noted_anew() -> None:
    machine = pf.load(next(path for path in TEMPLATES if path.stem == "3-RRS"))
    ours, poses = varied(machine), poses_near_home(machine, 3)
    values = np.array([machine.dimensions[name] for name in ours.names])
    expected, other = ours.at(values).margins(poses), varied(machine, ours.names[::-1])
    other._noted[0]._decided = b""
    np.testing.assert_allclose(other.at(values[::-1]).margins(poses), expected, atol=1e-12)


SENSITIVITIES = (
    ("stewart", "points", True),
    ("stewart", "offsets", True),
    ("servo_hexapod", "points", True),
    ("servo_hexapod", "axes", True),
    ("delta", "axes", True),
    ("tricept", "points", True),
    ("prs", "points", False),
    ("orthoglide", "offsets", True),
)


@pytest.mark.parametrize(("name", "kind", "by_legs"), SENSITIVITIES)
def test_sensitivities_by_legs_are_those_of_all_loops(
    name: str, kind: str, by_legs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The oracle differentiates the loops of all joints; where parameters take legs apart, it answers itself."""
    machine = pf.load(name)
    answers = pf.solve_ik(machine, poses_near_home(machine, 2, 30, 0.05))
    answers, free = answers[np.flatnonzero(answers.status == pf.Status.REACHED)], pf.parameters(machine, kind)
    assert (sensitivities.legs_that_stay(free) is not None) == by_legs and answers.shape[0] > 3
    found = pf.sensitivity(answers, free)
    monkeypatch.setattr(sensitivities, "legs_that_stay", lambda _: None)
    expected, size = pf.sensitivity(answers, free), machine.characteristic_length
    for ours, theirs in ((found.pose, expected.pose), (found.actuators, expected.actuators)):
        np.testing.assert_allclose(ours * free.scales, theirs * free.scales, rtol=1e-9, atol=1e-9 * size)


def test_what_cannot_be_varied_is_told() -> None:
    with pytest.raises(UnknownName):
        varied(template("delta"), "elbow")
    with pytest.raises(InvalidArgument, match="finite values"):
        varied(template("delta"), ["arm", "rod"]).at([90.0])
    with pytest.raises(InvalidMechanism):
        varied(template("delta"), "rod").at([100.0])  # shorter than what it bridges at home
    with pytest.raises(UnsupportedMechanism, match="not read from a file with dimensions"):
        varied(pf.load("stewart"))
    assert np.isnan(all_varied("6-UPS").at(drawn("6-UPS", 0)[0]).margins(np.zeros((1, 4, 4)))).all()
