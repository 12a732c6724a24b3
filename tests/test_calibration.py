"""Parameters of real machines: derivatives, values from measurements, and what measurements leave open."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.capabilities.calibration.printer_settings import Printer
from pfabrik.common.rotations import to_rotvec
from pfabrik.errors import InvalidArgument, UnknownName, UnsupportedMechanism
from pfabrik.machine.files import loads
from pfabrik.machine.model import model_of

PROGRAM = Path(__file__).parents[1] / "examples" / "tasks" / "calibrate_printer.py"

FIRMWARE = {
    "delta_radius": 162.76928,
    "angle_a": 210.128266,
    "angle_b": 329.914363,
    "position_endstop_a": 418.72172,
    "position_endstop_b": 417.979258,
    "position_endstop_c": 419.036135,
    "arm_length_a": 345.511546,
    "arm_length_b": 346.790457,
    "arm_length_c": 346.713602,
}
"""What the firmware of that printer identified: github.com/phnxdrgn536/FLSun-v400 @e0368ae (CC0-1.0)."""


def klipper_settings() -> str:
    """The settings of a printer, from the program of the page on calibration."""
    (settings,) = re.findall(r'"printer\.cfg"\)\.write_text\("""\\\n(.*?)"""\)', PROGRAM.read_text("utf-8"), re.DOTALL)
    return str(settings)


@pytest.fixture
def printer(tmp_path: Path) -> Printer:
    (tmp_path / "printer.cfg").write_text(klipper_settings(), encoding="utf-8")
    return pf.read_printer(tmp_path / "printer.cfg")


def off_home(mechanism: pf.Mechanism, seed: int) -> pf.Solution:
    """A configuration near home, without regard to limits."""
    rng, length = np.random.default_rng(seed), mechanism.characteristic_length
    home = np.array([drive.home for drive in mechanism.drives])
    sizes = np.array([0.05 if drive.kind == "angle" else 0.02 * length for drive in mechanism.drives])
    return pf.solve_fk(mechanism, home + sizes * rng.uniform(-1.0, 1.0, len(home)))


# Of overconstrained machines, some changes open the loops: there are no configurations to compare.
OPENED = {("agile_eye", "points"), ("agile_eye", "axes"), ("five_bar", "axes"), ("orthoglide", "points")}
OPENED |= {("orthoglide", "axes"), ("prr", "axes"), ("rpr", "axes"), ("rrr", "axes")}
MACHINES = [name for name in pf.catalog() if name not in ("snake60", "serial_arm")]


KINDS = ("points", "axes", "offsets")
OFTEN = {(name, KINDS[k % 3]) for k, name in enumerate(MACHINES)}
"""One kind a machine, in turn; the others in campaigns."""


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param(name, kind, marks=[pytest.mark.campaign] * ((name, kind) not in OFTEN))
        for name in MACHINES
        for kind in KINDS
    ],
)
def test_sensitivities_are_those_of_machines_made_anew(name: str, kind: str) -> None:
    mechanism = pf.load(name).without_limits()
    solution = off_home(mechanism, 1)
    if (name, kind) == ("stewart", "axes"):
        pytest.skip("its file has no axes")
    own = pf.parameters(mechanism, kind)
    if (name, kind) in OPENED:
        with pytest.raises(UnsupportedMechanism, match="loops do not close with another"):
            pf.sensitivity(solution, own)
        return
    slopes = pf.sensitivity(solution, own)
    home, length = np.array([each.home for each in mechanism.coordinates]), mechanism.characteristic_length
    rng = np.random.default_rng(2)
    for k in rng.choice(len(own), 1):
        step, poses = 1e-5 * own.scales[k], []
        for sign in (1.0, -1.0):
            values = own.values + sign * step * (np.arange(len(own)) == k)
            other = model_of(own.like).with_geometry(*own.geometry(values)).mechanism
            start = solution.q - home + np.array([each.home for each in other.coordinates])
            moved = pf.solve_fk(other, solution.actuators, start=start)
            assert moved
            poses.append(moved.pose)
        turn = to_rotvec((poses[0][:3, :3] @ poses[1][:3, :3].T)[None])[0]
        expected = np.concatenate([poses[0][:3, 3] - poses[1][:3, 3], turn * length]) / (2.0 * step)
        found = slopes.pose[:, k] * np.array([1.0] * 3 + [length] * 3)[: len(slopes.pose)]
        assert np.abs(found - expected[: len(found)]).max() < 1e-6 * length / own.scales[k]


def stewart_with_a_tool() -> pf.Mechanism:
    """A platform whose reference point goes by two dimensions."""
    text = (Path(pf.__file__).parent / "machine" / "catalog" / "stewart.toml").read_text()
    point = 'reference_point = [0, "side", "195 + tool"]'
    return loads(text.replace("reference_point = [0, 0, 195]", point) + "\n[dimensions]\nside = 7\ntool = 20\n")


@pytest.mark.parametrize("make", [partial(pf.load, "stewart"), stewart_with_a_tool], ids=["struts", "tool"])
def test_pose_and_actuators_change_as_those_of_machines_with_other_values(make: Callable[[], pf.Mechanism]) -> None:
    mechanism = make()
    solution = pf.solve_ik(mechanism, mechanism.home_pose @ pf.pose([10, 5, -5], rotvec=[0.1, -0.15, 0.2]))
    assert solution
    own = pf.parameters(mechanism, "dimensions" if mechanism.dimensions else ["points", "offsets"])
    assert own.names == ("side", "tool") or not mechanism.dimensions
    found = pf.sensitivity(solution, own)
    for k in range(0, len(own), 9) if len(own) > 2 else (0, 1):
        ends = [own.apply(own.values + sign * 1e-4 * (np.arange(len(own)) == k)) for sign in (1.0, -1.0)]
        values = [pf.solve_ik(end, solution.pose).actuators for end in ends]
        np.testing.assert_allclose(found.actuators[:, k], (values[0] - values[1]) / 2e-4, atol=1e-7)
        moved = [pf.solve_fk(end, solution.actuators, start=solution.q).pose[:3, 3] for end in ends]
        np.testing.assert_allclose(found.pose[:3, k], (moved[0] - moved[1]) / 2e-4, atol=1e-6)


def test_parameters_change_what_they_name(printer: Printer) -> None:
    delta = pf.load("linear_delta")
    own = pf.parameters(delta, ["lengths", "offsets", "BL1"])
    assert own.names[:4] == ("A1.rod", "A2.rod", "A3.rod", "A1.offset")
    changed = own.apply(own.values + np.array([1.0, 2.0, 3.0] + [0.0] * (len(own) - 3)))
    for number, length in ((1, 274.0), (2, 275.0), (3, 276.0)):
        ends = [np.array(changed.joint(f"{letter}{number}").at) for letter in ("BL", "CL")]
        assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(length, abs=1e-9)
    low = pf.solve_ik(delta, [0.0, 0.0, -5.0]).actuators
    zeroed = pf.parameters(delta, "offsets").apply([0.5, 0.0, -0.25])
    np.testing.assert_allclose(pf.solve_ik(zeroed, [0.0, 0.0, -5.0]).actuators, low + [0.5, 0.0, -0.25], atol=1e-9)
    of_printer = pf.parameters(printer.mechanism, ["delta_radius", "arm_length_a"])
    assert of_printer.apply([164.0, 345.0]).dimensions["delta_radius"] == 164.0
    tied = pf.parameters(pf.load("stewart"), ["points", "offsets"], ties="copies")  # copies vary as one
    assert len(tied) == 14
    changed = tied.apply(tied.values + 0.3)
    assert np.ptp([math.hypot(*changed.joint(f"AL{k}").at[:2]) for k in (1, 2, 3)]) < 1e-9


@cache
def hexapod_data(tilt: float, n: int = 40) -> tuple[pf.Parameters, np.ndarray, np.ndarray, np.ndarray]:
    """A Stewart platform that is not as drawn: its parameters, their true values, and readings at exact poses."""
    rng = np.random.default_rng(3)
    own = pf.parameters(pf.load("stewart"))
    true = own.values + 0.5 * rng.standard_normal(len(own))
    positions = np.array([0.0, 0.0, 180.0]) + rng.uniform(-1.0, 1.0, (n, 3)) * [30.0, 30.0, 20.0]
    poses = pf.pose(positions, rotvec=tilt * rng.uniform(-1.0, 1.0, (n, 3)))
    solution = pf.solve_ik(own.apply(true), poses)
    assert solution
    return own, true, solution.actuators, poses


def test_a_hexapod_without_noise_is_found_exactly() -> None:
    own, true, readings, poses = hexapod_data(tilt=0.15)
    found = pf.calibrate(own.mechanism, pf.Measurements(readings, pose=poses))
    assert len(own) == found.rank == 42 and found.determined.all() and found.undetermined == ()
    assert np.abs(found.values - true).max() < 1e-9
    assert np.abs(pf.solve_ik(found.mechanism, poses).actuators - readings).max() < 1e-9


def test_without_tilt_a_hexapod_shows_what_it_leaves_open() -> None:
    own, true, readings, poses = hexapod_data(tilt=0.0)
    found = pf.calibrate(own.mechanism, pf.Measurements(readings, pose=poses))
    # at one orientation only differences of base and platform points matter: 42 - 18
    assert found.rank == 24 and found.rms < 1e-9
    held = [name for name in own.names if name.startswith("C")]  # named after the points of the base
    assert [name for name, is_known in zip(own.names, found.determined, strict=True) if not is_known] == held
    assert "AL1.x and CL1.x change together" in found.undetermined
    described, offsets = own.values[~found.determined], slice(36, None)
    np.testing.assert_array_equal(found.values[~found.determined], described)
    np.testing.assert_allclose(found.values[offsets], true[offsets], rtol=0, atol=1e-9)
    x, drawn = (dict(zip(found.names, values, strict=True)) for values in (found.values - true, own.values - true))
    assert abs(x["AL1.x"] - drawn["CL1.x"]) < 1e-9
    # points of the base are as wrong as those of the platform, which are taken to be right to 3 in 1000 of L
    errors = (found.values - true)[found.determined] / found.deviations[found.determined]
    assert np.sqrt(np.mean(errors[:18] ** 2)) < 2.5 and np.isinf(found.deviations[~found.determined]).all()
    np.testing.assert_allclose(pf.solve_ik(found.mechanism, poses).actuators, readings, rtol=0, atol=1e-9)


def test_a_printer_gets_the_values_of_its_firmware_and_shows_them(printer: Printer) -> None:
    found = pf.calibrate(printer.mechanism, printer.measurements, free=printer.free)
    assert dict(zip(found.names, found.values, strict=True)) == pytest.approx(FIRMWARE, abs=1e-3)
    assert found.determined.all() and found.rms < found.rms_before
    assert "delta_radius" in found._repr_html_() and "arm_length_a" in str(found)
    assert found.to_dict()["parameters"][0]["name"] == printer.free[0]
    assert len(pf.plot_calibration(found).axes) == 2


def test_heights_alone_leave_the_arms_open(printer: Printer) -> None:
    heights = printer.measurements.without(range(7, printer.measurements.rows))
    few = pf.calibrate(printer.mechanism, heights, free=printer.free)
    assert few.rank == 7 and not few.determined.any() and "arm_length_c change together" in few.undetermined[0]
    np.testing.assert_array_equal(few.values, pf.parameters(printer.mechanism, printer.free).values)
    rng = np.random.default_rng(5)
    angles, radii = rng.uniform(0.0, 2.0 * math.pi, 30), 100.0 * np.sqrt(rng.uniform(0.0, 1.0, 30))
    targets = np.stack([radii * np.cos(angles), radii * np.sin(angles), 0.0 * angles], axis=1)
    other = printer.mechanism.with_dimensions(arm_length_a=346.4, position_endstop_b=417.8)
    readings = pf.solve_ik(other, targets).actuators
    many = pf.Measurements(readings, height=0.01 * rng.standard_normal(30))
    assert pf.calibrate(printer.mechanism, many, free=printer.free).rank == 9
    found = printer.calibrate(many)
    assert found.determined[:6].all() and (found.values[6:] == 346.0).all() and not found.determined[6:].any()


@pytest.mark.parametrize(("repetitions", "within"), [(10, 0.6), pytest.param(200, 0.2, marks=pytest.mark.campaign)])
def test_deviations_are_those_of_repetitions(repetitions: int, within: float) -> None:
    mechanism, rng, sigma = pf.load("linear_delta"), np.random.default_rng(6), 0.02
    own = pf.parameters(mechanism, ["lengths", "offsets"])
    positions = rng.uniform(-40.0, 40.0, (12, 3))
    readings = pf.solve_ik(mechanism, positions).actuators
    repeated = []
    for _ in range(repetitions):
        noisy = pf.Measurements(readings, position=positions + sigma * rng.standard_normal((12, 3)), sigma=sigma)
        found = pf.calibrate(mechanism, noisy, free=own)
        repeated.append(found.values)
    np.testing.assert_allclose(np.std(repeated, axis=0), found.deviations, rtol=within)


def test_an_outlier_is_named_and_can_be_left_out() -> None:
    own, true, readings, poses = hexapod_data(tilt=0.15)
    poses = poses.copy()
    poses[7, 0, 3] += 0.4
    data = pf.Measurements(readings, pose=poses, sigma={"position": 0.01, "orientation": 1e-4})
    found = pf.calibrate(own.mechanism, data)
    assert [(each.row, each.quantity) for each in found.outliers] == [(7, "row")]
    assert "row 8 does not fit" in str(found)
    for without in (data.without([7]), None):
        weights = None if without is not None else 1.0 * (np.arange(40) != 7)
        again = pf.calibrate(own.mechanism, without or data, weights=weights)
        assert np.abs(again.values - true).max() < 1e-8


def test_priors_hold_what_is_open_and_do_not_bias_the_rest() -> None:
    own, true, readings, poses = hexapod_data(tilt=0.0)
    data = pf.Measurements(readings, pose=poses, sigma={"position": 1e-3, "orientation": 1e-5})
    priors = {name: (value, 1.0) for name, value in zip(own.names[:18], true[:18], strict=True)}
    found = pf.calibrate(own.mechanism, data, priors=priors)
    assert np.abs(found.values[:18] - true[:18]).max() < 1e-6  # pulled to themselves
    assert np.abs(found.values[36:] - true[36:]).max() < 1e-6
    assert np.isfinite(found.deviations[:18]).all() and not found.determined[:18].any()


def test_suggested_poses_beat_random_ones() -> None:
    own, _, readings, poses = hexapod_data(tilt=0.15)
    sigma = {"position": 0.01, "orientation": 1e-4}
    found = pf.calibrate(own.mechanism, pf.Measurements(readings, pose=poses, sigma=sigma))

    def information(actuators: np.ndarray) -> np.ndarray:
        slopes = pf.sensitivity(pf.solve_fk(found.mechanism, actuators), pf.parameters(found.mechanism)).pose
        rows = slopes / np.array([0.01] * 3 + [1e-4] * 3)[:, None] * own.scales
        return np.einsum("kmp,kmq->kpq", rows, rows)

    def worst(added: np.ndarray) -> float:
        return float(np.diag(np.linalg.inv(known + added.sum(axis=0))).max())

    rng = np.random.default_rng(8)
    pool = pf.pose(
        np.array([0.0, 0.0, 180.0]) + rng.uniform(-1.0, 1.0, (400, 3)) * [60.0, 60.0, 40.0],
        rotvec=rng.uniform(-0.4, 0.4, (400, 3)),
    )
    solved = pf.solve_ik(found.mechanism, pool)
    known = information(readings).sum(axis=0)
    random = information(solved.actuators[np.asarray(solved.status) == pf.Status.REACHED])
    best = min(worst(random[rng.choice(len(random), 8, replace=False)]) for _ in range(200))
    assert worst(information(found.suggest(8))) < best


def test_tolerances_of_joints_add_to_the_error_of_a_pose() -> None:
    mechanism = pf.load("stewart")
    solution = pf.solve_ik(mechanism, pf.pose([10, 5, 190], rotvec=[0.05, 0.1, 0]))
    own = pf.parameters(mechanism, ["AL1"])
    slopes = pf.sensitivity(solution, own)
    errors = dict.fromkeys(own.names, 0.02) | {"BL1": 0.01}
    worst = pf.accuracy(solution, errors, sensitivity=slopes)
    exact = []
    for signs in np.ndindex(*(2,) * (len(own) + 1)):
        signed = 2.0 * np.array(signs) - 1.0
        other = own.apply(own.values + 0.02 * signed[:-1]).without_limits()
        readings = solution.actuators + 0.01 * signed[-1] * (np.arange(6) == 0)
        moved = pf.solve_fk(other, readings, start=solution.q)
        exact.append(np.linalg.norm(moved.pose[:3, 3] - solution.pose[:3, 3]))
    assert worst.position == pytest.approx(max(exact), rel=2e-3)
    usual = pf.accuracy(solution, errors, "rms", sensitivity=slopes)
    squares = (slopes.pose[:3] ** 2).sum() * 0.02**2 + (pf.forward_jacobian(solution)[:3, 0] ** 2).sum() * 0.01**2
    assert usual.position == pytest.approx(np.sqrt(squares), rel=1e-9)


def test_measurements_from_a_table(tmp_path: Path) -> None:
    mechanism = pf.load("linear_delta")
    solution = pf.solve_ik(mechanism, [[0, 0, 0], [10, 5, -3], [0, 20, 1]])
    lines = ["A1;A2;A3;x;y;z;height;distance;distance_to"]
    for k, (readings, pose) in enumerate(zip(solution.actuators, solution.pose, strict=True)):
        cells = [*readings, *pose[:3, 3], pose[2, 3]]
        between = np.linalg.norm(pose[:3, 3] - solution.pose[0, :3, 3])
        extra = [f"{between:.15g}", "1"] if k else ["", ""]
        lines.append(";".join([*(f"{cell:.15g}" for cell in cells), *extra]))
    file = tmp_path / "data.csv"
    file.write_text("\n".join(lines))
    data = pf.read_measurements(file, mechanism)
    assert data.rows == 3 and data.count == 9 + 3 + 2
    found = pf.calibrate(mechanism, data, free="offsets")
    np.testing.assert_allclose(found.values, 0.0, atol=1e-9)
    lines[1] = lines[1].replace(";", ";x", 1)
    file.write_text("\n".join(lines))
    with pytest.raises(InvalidArgument, match="line 2: column 'A2'"):
        pf.read_measurements(file, mechanism)
    file.write_text("# by hand; in a hurry\nA1,A2,A3,roll,pitch,yaw,roll_rad\n0,0,0,0,0,0,0\n")
    with pytest.raises(InvalidArgument, match="column 'roll' in two units"):
        pf.read_measurements(file, mechanism)
    file.write_text("A1,A2,A3,z_deg\n0,0,0,0\n")
    with pytest.raises(InvalidArgument, match="column 'z_deg', an angle; expected z, a length"):
        pf.read_measurements(file, mechanism)


def test_passive_joints_with_sensors() -> None:
    mechanism = pf.load("five_bar")
    own = pf.parameters(mechanism, "offsets")
    changes = np.random.default_rng(1).uniform(-0.05, 0.05, (8, 2))
    solution = pf.solve_fk(own.apply([0.02, -0.01]), [each.home for each in mechanism.drives] + changes)
    passive = [n for n in mechanism.coordinate_names if n not in mechanism.actuator_names][:2]
    column = [mechanism.coordinate_names.index(name) for name in passive]
    joints = {name: solution.q[:, c] for name, c in zip(passive, column, strict=True)}
    found = pf.calibrate(mechanism, pf.Measurements(solution.actuators, joints=joints), free=own)
    np.testing.assert_allclose(found.values, [0.02, -0.01], atol=1e-7)


def data_with(**changes: object) -> pf.Measurements:
    """Measurements of a hexapod with something else."""
    _, _, readings, poses = hexapod_data(tilt=0.1, n=4)
    return pf.Measurements(**{"actuators": readings, "pose": poses} | changes)  # type: ignore[arg-type]


def fitted(name: str, **more: Any) -> object:
    return pf.calibrate(pf.load(name), data_with(**more.pop("data", {})), **more)


READINGS, POSES = np.full((4, 6), 200.0), np.tile(np.eye(4), (4, 1, 1))
WRONG: list[tuple[type[Exception], str, Callable[[], object]]] = [
    (UnknownName, "no parameter named 'AL9'", lambda: pf.parameters(pf.load("stewart"), ["AL9"])),
    (UnsupportedMechanism, "calibrated by its lengths", lambda: pf.parameters(pf.load("stewart"), "lengths")),
    (InvalidArgument, "dimensions of a machine that has none", lambda: pf.parameters(pf.load("rps"), "dimensions")),
    (InvalidArgument, "turned copies", lambda: pf.parameters(pf.load("five_bar"), "points", ties="copies")),
    (InvalidArgument, "6 actuators a row", lambda: fitted("delta")),
    (InvalidArgument, "priors beside measurements without sigma", lambda: fitted("stewart", priors={"AL1.x": 1.0})),
    (InvalidArgument, "of another machine", lambda: fitted("hexaglide", free=pf.parameters(pf.load("stewart")))),
    (InvalidArgument, "cannot be assembled at", lambda: fitted("stewart", data={"actuators": READINGS / 25.4})),
    (InvalidArgument, "one for every quantity", lambda: fitted("stewart", data={"sigma": {"position": 1.0}})),
    (InvalidArgument, "not a rotation", lambda: data_with(pose=2.0 * POSES)),
    (InvalidArgument, "not finite", lambda: data_with(actuators=READINGS * np.nan)),
    (InvalidArgument, "measurements: found none", lambda: pf.Measurements(READINGS)),
    (InvalidArgument, "rows 2 and 2", lambda: data_with(distances=[(0, 1, 10.0), (2, 2, 3.0)])),
]


@pytest.mark.parametrize(("error", "words", "call"), WRONG, ids=[words for _, words, _ in WRONG])
def test_wrong_calls_say_what_is_wrong(error: type[Exception], words: str, call: Callable[[], object]) -> None:
    with pytest.raises(error, match=words):
        call()


@pytest.mark.parametrize(("name", "free", "has_poses"), [("stewart", "tool", True), ("delta", "frame", False)])
def test_an_instrument_s_frame_and_target_and_scales_are_found(name: str, free: str, has_poses: bool) -> None:
    rng, mechanism = np.random.default_rng(7), pf.load(name)
    own = pf.parameters(mechanism, ["scale", "frame", free] if free == "tool" else ["scale", "frame"])
    true = own.values + rng.uniform(-0.01, 0.01, len(own))
    for place, each in enumerate(own.names):
        if each.startswith(("frame", "tool")):
            true[place] = rng.uniform(-1.4, 1.4) * (1.0 if own.units[place] == "rad" else 100.0)
    positions = mechanism.home_pose[:3, 3] + rng.uniform(-20.0, 20.0, (40, 3))
    solution = pf.solve_ik(mechanism, pf.pose(positions, rotvec=0.15 * has_poses * rng.uniform(-1.0, 1.0, (40, 3))))
    by_name = dict(zip(own.names, true.tolist(), strict=True))
    frame, tool = (
        pf.pose(
            *([by_name.get(f"{of}.{c}", 0.0) for c in "xyz"],), rotvec=[by_name.get(f"{of}.r{c}", 0.0) for c in "xyz"]
        )
        for of in ("frame", "tool")
    )
    seen = frame @ solution.pose @ tool
    readings = solution.actuators / [by_name[f"{each}.scale"] for each in mechanism.actuator_names]
    measured = {"pose": seen} if has_poses else {"position": seen[:, :3, 3]}
    found = pf.calibrate(mechanism, pf.Measurements(readings, **measured), free=own)
    assert found.determined.all() and np.abs(found.values - true).max() < 1e-9


def test_nothing_is_determined_of_which_nothing_says_how_good_it_is() -> None:
    own, _, readings, poses = hexapod_data(tilt=0.15, n=7)
    alone = pf.calibrate(own.mechanism, pf.Measurements(readings, pose=poses))
    assert not alone.determined.any() and np.isinf(alone.deviations).all() and "without sigma" in alone.undetermined[-1]
    known = pf.calibrate(own.mechanism, pf.Measurements(readings, pose=poses, sigma=1e-9))
    assert known.determined.all() and np.isfinite(known.deviations).all()


def test_a_poor_fit_warns_and_its_deviations_grow() -> None:
    own, _, readings, poses = hexapod_data(tilt=0.15)
    far = pf.pose([500.0, -500.0, 250.0], rotvec=[0.75, -0.45, 1.5]) @ poses
    with pytest.warns(UserWarning, match="free 'frame' or 'tool' too"):
        found = pf.calibrate(own.mechanism, pf.Measurements(readings, pose=far, sigma=0.01), free="offsets")
    assert found.deviations.min() > found.rms * 1e-3 and not found.determined.any()


BELTS = """
schema = 1
name = "belts"
units = {{ length = "mm", angle = "deg" }}
base = "frame"
end_effector = "pen"
task = ["x", "y"]
[dimensions]
left = {left}
top = 1900
right = 3100
""" + "".join(
    f"""
[[joint]]
name = "{name}A"
type = "revolute"
connects = ["frame", "{name}T"]
at = [{x}, {y}, 0]
axis = [0, 0, 1]
[[joint]]
name = "{name}"
type = "prismatic"
actuated = {driven}
connects = ["{name}T", "{name}R"]
along = ["{name}A", "{end}"]
[[joint]]
name = "{end}"
type = "revolute"
connects = ["{name}R", "sled"]
at = [1500, 900, 0]
axis = [0, 0, 1]
"""
    for name, x, y, driven, end in (
        ("b", '"left - {shift}"', "0", "true", "pen"),
        ("r", '"right"', "0", "true", "rP"),
        ("t", "0", '"top"', "false", "tP"),
    )
)  # fmt: skip


@pytest.mark.parametrize("described", [0.0, 1e-6, -1e-3, 5.0])
def test_what_a_dimension_counts_from_does_not_matter(described: float) -> None:
    """The same machine with its left corner counted from elsewhere: the same values and deviations, all determined."""
    machine = loads(BELTS.format(left=described, shift=0))
    far = loads(BELTS.format(left=described + 700.0, shift=700))
    true = machine.with_dimensions(left=30.0, top=1815.0, right=3000.0)
    rng = np.random.default_rng(2)
    places = np.column_stack([rng.uniform(400, 2600, 14), rng.uniform(300, 1500, 14), np.zeros(14)])
    solution = pf.solve_ik(true.without_limits(), places)
    belts = solution.joints["t"] + rng.normal(0.0, 0.5, 14)
    data = pf.Measurements(solution.actuators, joints={"t": belts}, sigma=0.5)
    found, other = (pf.calibrate(m, data, free=["left", "top", "right"]) for m in (machine, far))
    assert found.determined.all() and other.determined.all()
    np.testing.assert_allclose(found.values, other.values - [700.0, 0.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(found.deviations, other.deviations, rtol=1e-6)
    assert (np.abs(found.values - [30.0, 1815.0, 3000.0]) < 4.5 * found.deviations).all()


FIVE_BAR = """
schema = 1
name = "five-bar"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "tip"
dimensions = { rod = 120 }
""" + "".join(
    f"""
[[joint]]
name = "{name}"
type = "revolute"
actuated = {driven}
connects = {bodies}
at = {at}
axis = [0, 0, 1]
"""
    for name, driven, bodies, at in (
        ("A", "true", '["base", "left"]', "[-40, 0, 0]"),
        ("B", "false", '["left", "left_rod"]', "[-100, 80, 0]"),
        ("C", "true", '["base", "right"]', "[40, 0, 0]"),
        ("D", "false", '["right", "right_rod"]', "[100, 80, 0]"),
        ("tip", "false", '["left_rod", "right_rod"]', '[0, "80 + sqrt(rod**2 - 10000)", 0]'),
    )
)


def test_readings_at_which_only_the_real_machine_can_be_assembled() -> None:
    """Rods that are longer than described: at some readings those described do not meet."""
    machine = loads(FIVE_BAR)
    true = machine.with_dimensions(rod=123)
    q = np.array([[-0.1, 0.2], [0.1, 0.1], [0.3, -0.1], [0.2, -0.2], [-0.3, 0.3], [0.29, -0.29], [0.3, -0.3]])
    there = pf.solve_fk(true, q)
    assert there.status.tolist() == [0] * 7 and pf.solve_fk(machine, q).status[-1] == pf.Status.PROJECTED
    found = pf.calibrate(machine, pf.Measurements(q, position=there.pose[:, :3, 3]), free="rod")
    assert found.values == pytest.approx([123.0], abs=1e-8)
    with pytest.raises(InvalidArgument, match="as calibrated cannot be assembled at"):
        pf.calibrate(machine, pf.Measurements(q, height=np.zeros(7)), free="rod")
