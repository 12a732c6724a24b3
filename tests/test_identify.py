"""Masses from efforts: against the machine that they were simulated of, and inverse dynamics with other masses."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.machine.files import dumps
from tests.command import pfabrik
from tests.test_dynamics import units, weighed


def rubbing(machine: pf.Mechanism, friction: Any = (0.05, 0.02), rotor: float | None = 1e-4) -> pf.Mechanism:
    joints = [replace(j, friction=friction, rotor_inertia=rotor, gear=5.0) if j.actuated else j for j in machine.joints]
    return machine._with(joints=tuple(joints))


def wandering(machine: pf.Mechanism, seed: int, n: int = 150) -> tuple[pf.Solution, dict[str, Any]]:
    """Configurations near home, and how they move: sines of actuators."""
    random, home = np.random.default_rng(seed), pf.solve_ik(machine, machine.home_pose).actuators
    t, x, v, a = np.linspace(0.0, 4.0, n)[:, None], home, 0.0, 0.0
    for k in range(3):
        size = 0.08 * units(machine)[0] * random.standard_normal(len(home)) / (k + 1)
        speed, phase = (1.3, 2.9, 5.1)[k] * random.uniform(0.8, 1.2, len(home)), random.uniform(0, 6, len(home))
        x = x + size * np.sin(speed * t + phase)
        v, a = v + size * speed * np.cos(speed * t + phase), a - size * speed**2 * np.sin(speed * t + phase)
    solution = pf.solve_fk(machine, x)
    assert solution
    return solution, {"twists": v, "accelerations": a, "at": "actuators"}


def moved(machine: pf.Mechanism, solution: pf.Solution) -> pf.Solution:
    return pf.solve_fk(machine, solution.actuators)


def drawn(truth: pf.Mechanism) -> pf.Mechanism:
    """The machine as its drawing has it: other masses, no friction."""
    shift = 0.03 * truth.characteristic_length
    return rubbing(
        truth.with_masses(
            pf.Mass(each.body, 1.2 * each.mass, np.array(each.centre) + shift, 1.1 * np.array(each.inertia))
            for each in truth.masses
        ),
        None,
        None,
    )


def parameters(result: pf.Identification, machine: pf.Mechanism) -> dict[str, float]:
    """The parameters of a machine about the points of a result, by the definition of moments."""
    found = {}
    for each in machine.masses:
        if each.body in result.points:
            c, (xx, yy, zz, xy, xz, yz) = np.array(each.centre) - result.points[each.body], each.inertia or ()
            about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + each.mass * (
                c @ c * np.eye(3) - np.outer(c, c)
            )
            values = [each.mass, *(each.mass * c), *about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]]
            names = ("mass", "x", "y", "z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
            found |= {f"{each.body}.{name}": value for name, value in zip(names, values, strict=True)}
    for drive in machine.drives:
        joint: Any = drive.joint
        found |= {f"{drive.name}.{k}": v for k, v in zip(("dry", "viscous"), joint.friction or (0, 0), strict=True)}
        found[f"{drive.name}.rotor"] = joint.rotor_inertia or 0.0
    return found


@pytest.mark.parametrize("name", ["five_bar", "delta", "stewart", "hexaglide"])
def test_what_efforts_determine_is_within_its_deviation_and_other_motions_are_predicted(name: str) -> None:
    truth = rubbing(weighed(pf.load(name)))
    solution, how = wandering(truth, 1)
    efforts = pf.inverse_dynamics(solution, **how).actuators
    noise = 0.01 * np.abs(efforts).max()
    measured = efforts + noise * np.random.default_rng(3).standard_normal(efforts.shape)
    result = pf.identify(moved(drawn(truth), solution), measured, rotors=True, **how)
    true = parameters(result, truth)
    for each in result.combinations:
        assert abs(sum(f * true[n] for n, f in each.factors.items()) - each.value) < 3.0 * each.deviation, each.name
    assert result.rank > 8
    np.testing.assert_allclose(result.rms, noise, rtol=0.25)
    assert (result.rms < 0.4 * result.rms_before).all()
    other, how = wandering(truth, 7)
    predicted = pf.inverse_dynamics(moved(result.mechanism, other), **how).actuators
    assert np.sqrt(np.mean((predicted - pf.inverse_dynamics(other, **how).actuators) ** 2)) < noise


@pytest.mark.parametrize("name", ["delta", "nrpm", "rrr"])
def test_efforts_are_linear_in_the_parameters(name: str) -> None:
    """Differences of inverse dynamics with other masses, friction and rotors: the columns are exact."""
    machine, other = rubbing(weighed(pf.load(name))), rubbing(weighed(pf.load(name), 2), (0.3, 0.1), 2e-4)
    solution, how = wandering(machine, 1, 60)
    efforts = [pf.inverse_dynamics(moved(m, solution), **how).actuators for m in (machine, other)]
    result = pf.identify(solution, efforts[0], rotors=True, sigma=1.0, **how)
    more = np.array(list(map(parameters(result, other).get, result.names)), float) - result.described
    scaled = np.linalg.solve(result._unknowns.by_scaled, more)
    change = result._fit._columns @ scaled
    np.testing.assert_allclose(change, efforts[1] - efforts[0], atol=1e-9 * np.abs(efforts[0]).max())


def test_what_no_motion_excites_is_reported_and_stays() -> None:
    truth = rubbing(weighed(pf.load("five_bar")))
    solution, how = wandering(truth, 1)
    efforts = pf.inverse_dynamics(solution, **how).actuators
    start = drawn(truth)
    result = pf.identify(moved(start, solution), efforts, sigma=0.01, **how)
    by_name = dict(zip(result.names, zip(result.determined, result.values, result.described, strict=True), strict=True))
    assert {"link1.x", "link3.Izz", "link4.Ixz"} <= set(result.unseen)  # it moves in the y-z plane
    assert not any(by_name[name][0] for name in result.unseen)
    assert "no effort depends on link1 (x" in str(result)
    assert by_name["p1.dry"][0]
    assert by_name["p1.dry"][1] == pytest.approx(0.05, abs=0.01)
    still = pf.identify(moved(start, solution), pf.inverse_dynamics(moved(start, solution), **how).actuators, **how)
    np.testing.assert_allclose(still.values, still.described, atol=1e-9 * np.abs(still.described).max())


def test_a_path_with_times_tells_the_mass_of_its_load_and_every_body_is_possible() -> None:
    machine = weighed(pf.load("delta"), own={"platform": 0.5, "arm1": 0.2, "arm2": 0.2, "arm3": 0.2})
    t = np.linspace(0.0, 3.0, 300)
    points = np.stack([30 * np.sin(3 * t), 25 * np.cos(5 * t), -190 + 15 * np.sin(7 * t)], axis=1)
    path = pf.track(machine, points, times=t)
    load = {"platform": (0.3, (0.0, 0.0, -190.0))}
    efforts = pf.inverse_dynamics(path, loads=load).actuators
    efforts[7] = np.nan
    result = pf.identify(path, efforts, bodies="platform", friction=False)
    assert result.names[result.determined.argmax()] == "platform.mass" and result.rank == 1
    assert result.values[0] == pytest.approx(0.8, rel=1e-3)
    assert np.isnan(result.residuals[[0, 1, 7, -2, -1]]).all() and np.isfinite(result.residuals[2:7]).all()
    loaded = pf.identify(path, efforts, bodies="platform", friction=False, loads=load)
    assert loaded.values[0] == pytest.approx(0.5, rel=1e-3)
    points_only = [pf.Mass(each.body, each.mass, each.centre) for each in machine.masses]
    path = pf.track(machine.with_masses(points_only), points, times=t)
    found = pf.identify(path, efforts, bodies="platform", friction=False).mechanism.masses[-1]
    assert found.body == "platform" and found.inertia == (0.0,) * 6
    path = pf.track(machine, points, times=t)
    random = np.random.default_rng(0)
    rough = pf.identify(path, efforts + random.standard_normal(efforts.shape) * 0.05)
    assert rough.adjusted and "likeliest" in str(rough)
    assert min(each.mass for each in rough.mechanism.masses) >= 0.0  # and moments that its description takes
    timed = pf.time_path(path, torque=1.0)
    again = pf.identify(timed, pf.inverse_dynamics(timed).actuators, bodies=["platform"], friction=False)
    assert again.values[0] == pytest.approx(0.5, rel=1e-9)


def test_more_actuators_than_motions_tell_masses_however_they_share_the_load() -> None:
    truth = weighed(pf.load("nrpm"))
    solution, how = wandering(truth, 1)
    efforts = pf.inverse_dynamics(solution, **how).actuators
    result = pf.identify(moved(drawn(truth), solution), efforts, friction=False, **how)
    true = parameters(result, truth)
    for each in result.combinations:
        assert abs(sum(f * true[n] for n, f in each.factors.items()) - each.value) < 3.0 * each.deviation, each.name


def test_efforts_that_no_machine_makes_are_doubted() -> None:
    truth = rubbing(weighed(pf.load("five_bar")))
    solution, how = wandering(truth, 1)
    efforts = pf.inverse_dynamics(solution, **how).actuators
    efforts += 0.002 * np.random.default_rng(0).standard_normal(efforts.shape)
    assert pf.identify(solution, efforts, **how).doubt == ""
    turned = pf.identify(solution, -efforts, **how)  # of friction that drives
    assert "no possible bodies explain these efforts" in str(turned)
    assert "missed by" in pf.identify(solution, 1e3 * efforts, sigma=0.01, friction=False, **how).doubt


def test_a_body_far_from_the_file_is_doubted() -> None:
    truth = weighed(pf.load("delta"))
    solution, how = wandering(truth, 1)
    efforts = pf.inverse_dynamics(solution, **how).actuators

    def doubt(times: float) -> str:
        own = {"platform": times}
        other = [pf.Mass(m.body, own.get(m.body, 1.0) * m.mass, m.centre, m.inertia) for m in truth.masses]
        described = moved(truth.with_masses(other), solution)
        return pf.identify(described, efforts, bodies="platform", friction=False, sigma=0.01, **how).doubt

    assert doubt(0.25) == ""
    assert re.search(r"'\w+' would differ from the file by [\d.]+ times", doubt(0.02))


Measured = tuple[pf.Solution, Any, dict[str, Any]]


def recorded(name: str, seed: int) -> tuple[pf.Mechanism, Measured, Any]:
    """The machine as its drawing has it, how it moved, its exact efforts, and their noise: six seconds at 50 Hz."""
    random, truth = np.random.default_rng(seed), rubbing(weighed(pf.load(name)), rotor=None)
    home, t, v, a = pf.solve_ik(truth, truth.home_pose).actuators, np.linspace(0.0, 6.0, 300)[:, None], 0.0, 0.0
    x = home
    for k in range(3):
        size = 0.03 * units(truth)[0] * random.standard_normal(len(home)) / (k + 1)
        speed, phase = random.uniform(3.0, 9.0, len(home)), random.uniform(0.0, 6.0, len(home))
        x = x + size * np.sin(speed * t + phase)
        v, a = v + size * speed * np.cos(speed * t + phase), a - size * speed**2 * np.sin(speed * t + phase)
    solution, how = pf.solve_fk(truth, x), {"twists": v, "accelerations": a, "at": "actuators"}
    assert solution
    efforts = pf.inverse_dynamics(solution, **how).actuators
    off = [pf.Mass(m.body, m.mass * random.uniform(0.8, 1.2), m.centre, m.inertia) for m in truth.masses]
    noise = 0.01 * np.abs(efforts).max() * random.standard_normal(efforts.shape)
    return rubbing(truth.with_masses(off), None, None), (solution, efforts, how), noise


def by_columns(efforts: Any, factor: float, column: int = 0) -> Any:
    return np.where(np.arange(efforts.shape[1]) == column, factor, 1.0) * efforts


WRONG = {
    "late": lambda y: np.roll(y, 3, axis=0),
    "exchanged": lambda y: y[:, [1, 0, *range(2, y.shape[1])]],
    "noise": lambda y: 0.3 * np.abs(y).max() * np.random.default_rng(0).standard_normal(y.shape),
    "backwards": lambda y: y[::-1],
    "half": lambda y: 0.5 * y,
    "double": lambda y: 2.0 * y,
    "five times": lambda y: 5.0 * y,
    "a thousandth": lambda y: 1e-3 * y,
    "opposite": lambda y: -y,
    "one opposite": lambda y: by_columns(y, -1.0),
    "clipped": lambda y: np.clip(y, -0.5 * np.abs(y).max(axis=0), 0.5 * np.abs(y).max(axis=0)),
}
"""What goes wrong with efforts."""

RECORDED = ("five_bar", "delta", "hexaglide", "orthoglide", "prr")


def doubt_of(drawing: pf.Mechanism, measured: Measured, efforts: Any, **options: Any) -> str:
    solution, _, how = measured
    return pf.identify(moved(drawing, solution), efforts, **how, **options).doubt


@pytest.mark.parametrize("wrong", ["late", "exchanged", "noise", "double"])
def test_efforts_of_other_times_actuators_or_gears_are_doubted(wrong: str) -> None:
    drawing, measured, noise = recorded("five_bar", 3)
    assert doubt_of(drawing, measured, measured[1] + noise) == ""
    assert doubt_of(drawing, measured, WRONG[wrong](measured[1]) + noise)


def test_masses_of_other_bodies_that_are_wrong_are_doubted() -> None:
    drawing, measured, noise = recorded("five_bar", 3)
    exact = [m for m in weighed(pf.load("five_bar")).masses if m.body != "link1"]
    right = drawing.with_masses([*exact, *(m for m in drawing.masses if m.body == "link1")])
    assert doubt_of(right, measured, measured[1] + noise, bodies="link1") == ""
    wrong = [pf.Mass(m.body, 2.0 * m.mass, m.centre, m.inertia) if m.body == "link3" else m for m in right.masses]
    assert doubt_of(drawing.with_masses(wrong), measured, measured[1] + noise, bodies="link1")


def test_deviations_count_rows_whose_noise_follows_from_the_row_before_for_less() -> None:
    """Of noise e' = r e + white, a mean of n rows is as good as of n (1 - r) / (1 + r)."""
    drawing, measured, white = recorded("five_bar", 3)
    solution, efforts, how = measured
    found, follows = [], 0.8
    for seed in range(6):
        noise = np.std(white) * np.random.default_rng(seed).standard_normal(white.shape)
        for row in range(1, len(noise)):
            noise[row] = follows * noise[row - 1] + np.sqrt(1.0 - follows**2) * noise[row]
        result = pf.identify(moved(drawing, solution), efforts + noise, **how)
        dry = [list(result.names).index(f"{name}.viscous") for name in ("p1", "p5")]
        found.append((result.values[dry] - 0.02) / result.deviations[dry])
    assert 0.4 < np.sqrt(np.mean(np.square(found))) < 1.6


@pytest.mark.campaign
def test_wrong_efforts_are_doubted_on_four_machines_of_five_and_right_ones_on_one_in_twenty() -> None:
    doubted = dict.fromkeys([*WRONG, "other motion", "other masses"], 0)
    for name in RECORDED:
        drawing, measured, noise = recorded(name, 3)
        for wrong, made in WRONG.items():
            doubted[wrong] += bool(doubt_of(drawing, measured, made(measured[1]) + noise))
        doubted["other motion"] += bool(doubt_of(drawing, measured, recorded(name, 80)[1][1] + noise))
        body = drawing.masses[-1].body
        off = [
            pf.Mass(m.body, (1.0 + (-1.0) ** k * 0.4) * m.mass, m.centre, m.inertia)
            for k, m in enumerate(drawing.masses)
        ]
        doubted["other masses"] += bool(doubt_of(drawing.with_masses(off), measured, measured[1] + noise, bodies=body))
    assert min(doubted.values()) >= 4, doubted
    right = [recorded(name, 100 + seed) for name in ("five_bar", "prr") for seed in range(50)]
    assert sum(bool(doubt_of(drawing, measured, measured[1] + noise)) for drawing, measured, noise in right) <= 5


def with_thin_rods(machine: pf.Mechanism, seed: int) -> pf.Mechanism:
    """Bodies of random masses between their joints, those with two joints as thin rods on the line between these."""
    random, masses = np.random.default_rng(seed), []
    for body in machine.bodies[1:]:
        ends = [np.array(j.at) for j in machine.joints if body in j.connects and j.at is not None]
        along = ends[1] - ends[0] if len(ends) == 2 else 0.1 * machine.characteristic_length * np.eye(3)
        mass, second = random.uniform(0.2, 0.5), np.atleast_2d(along).T @ np.atleast_2d(along) / 12.0
        inertia = mass * (np.trace(second) * np.eye(3) - second)
        masses.append(pf.Mass(body, mass, np.mean(ends, axis=0), inertia))
    return machine.with_masses(masses)


@pytest.mark.parametrize("name", ["linear_delta", "delta"])
def test_the_identified_machine_exerts_what_the_fit_says_where_rods_may_spin(name: str) -> None:
    truth = rubbing(with_thin_rods(pf.load(name), 1), rotor=None)
    solution, how = wandering(truth, 1)
    efforts = pf.inverse_dynamics(solution, **how).actuators
    noise = 0.01 * np.abs(efforts).max() * np.random.default_rng(0).standard_normal(efforts.shape)
    drawing = rubbing(with_thin_rods(pf.load(name), 2), None, None)
    result = pf.identify(moved(drawing, solution), efforts + noise, **how)
    exerted = pf.inverse_dynamics(moved(result.mechanism, solution), **how).actuators
    np.testing.assert_allclose(efforts + noise - exerted, result.residuals, atol=1e-6 * np.std(noise))
    np.testing.assert_allclose(result.rms, np.std(noise), rtol=0.25)


def test_refusals_name_what_is_wrong() -> None:
    machine = weighed(pf.load("five_bar"))
    solution, how = wandering(machine, 1, 20)
    efforts = pf.inverse_dynamics(solution, **how).actuators
    with pytest.raises(pf.errors.InvalidArgument, match=r"efforts.*shape \(20, 1\).*p1, p5"):
        pf.identify(solution, efforts[:, :1], **how)
    with pytest.raises(pf.errors.UnknownName, match="link9"):
        pf.identify(solution, efforts, bodies="link9", **how)
    with pytest.raises(pf.errors.UnknownName, match="p7"):
        pf.identify(solution, efforts, sigma={"p7": 1.0}, **how)
    with pytest.raises(pf.errors.InvalidArgument, match="no row with efforts"):
        pf.identify(solution, np.full_like(efforts, np.nan), **how)
    with pytest.raises(pf.errors.InvalidArgument, match="nothing says how good they are"):
        pf.identify(solution[:3], efforts[:3], **{**how, "twists": 0.0 * efforts[0], "accelerations": efforts[:3]})


def test_the_command_reads_efforts_beside_a_path_and_writes_the_machine(tmp_path: Path) -> None:
    machine = weighed(pf.load("delta"), own={"platform": 0.5, "arm1": 0.2, "arm2": 0.2, "arm3": 0.2})
    t = np.linspace(0.0, 3.0, 300)
    points = np.stack([30 * np.sin(3 * t), 25 * np.cos(5 * t), -190 + 15 * np.sin(7 * t)], axis=1)
    efforts = pf.inverse_dynamics(
        pf.track(machine, points, times=t), loads={"platform": (0.3, (0.0, 0.0, -190.0))}
    ).actuators
    (tmp_path / "delta.toml").write_text(dumps(machine))
    cells = [[f"{value!r}" for value in row] for row in np.column_stack([t, points, efforts]).tolist()]
    cells[7][-1] = ""
    header = "time,x,y,z,tau1,effort_A2,effort_A3"
    (tmp_path / "data.csv").write_text("\n".join([header, *map(",".join, cells)]) + "\n")
    words = ["identify", tmp_path / "delta.toml", tmp_path / "data.csv", "--body", "platform", "--no-friction"]
    result = pfabrik([*words, "--columns", "t=time,effort_A1=tau1", "-o", tmp_path / "new.toml", "--json"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["parameters"][0]["value"] == pytest.approx(0.8, rel=1e-3)
    found = {each.body: each.mass for each in pf.load(tmp_path / "new.toml").masses}
    assert found["platform"] == pytest.approx(0.8, rel=1e-3) and found["arm1"] == pytest.approx(0.2)
    assert "no column effort_A1" in pfabrik([*words, "--columns", "t=time"]).stderr
    late = [[*row[:4], *cells[(place + 30) % 300][4:]] for place, row in enumerate(cells)]
    (tmp_path / "data.csv").write_text("\n".join([header, *map(",".join, late)]) + "\n")
    result = pfabrik([*words, "--columns", "t=time,effort_A1=tau1"])
    assert result.exit_code == 1 and "from row to row" in result.stdout + result.stderr


@pytest.mark.filterwarnings("error")
def test_efforts_of_zero_are_doubted_without_a_warning() -> None:
    machine = weighed(pf.load("stewart"))
    motion = pf.solve_ik(machine, pf.pose(machine.home_pose[:3, 3] + [[0, 0, 2.0], [5, 0, 0], [0, 5, 5.0], [3, 3, 0]]))
    result = pf.identify(motion, np.zeros((4, 6)))
    assert "no possible bodies explain these efforts" in str(result)
