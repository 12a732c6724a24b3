"""The exported C driven by a stream: the library's ticks in double precision, and in single precision as safe."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from checks import actuator_units
from exported import KEEP, flat, machine, needs_compiler
from pfabrik import Status
from pfabrik.errors import InvalidArgument, UnsupportedMechanism
from pfabrik.exchange.export.export_c import c_source
from test_live import SPAN, live_of
from test_streams import smooth

PARTS: Any = ("ik", "limits", "live")
DRIVER = Path(__file__).parent / "data" / "run_live.c"
STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")
CODES = {0: Status.REACHED, -4: Status.PROJECTED, -1: Status.INVALID}

pytestmark = needs_compiler


def driven(name: str, precision: Any, ticks: int, targets: np.ndarray, folder: Path) -> np.ndarray:
    """What a compiled file answers to targets, a row a tick: the code, actuators, the pose."""
    mechanism = machine(name)
    (folder / "exported.c").write_text(c_source(mechanism, precision=precision, parts=PARTS))
    command = ["cc", *STRICT, f'-DEXPORTED="{folder}/exported.c"', str(DRIVER), "-o", str(folder / "live"), "-lm"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    speeds = SPAN * actuator_units(mechanism) / ticks
    given = np.concatenate([speeds, 0.0 * speeds, [1.0], flat(targets).ravel()])
    asked = subprocess.run([str(folder / "live")], input=given.tobytes(), capture_output=True)
    assert asked.returncode == 0
    return np.frombuffer(asked.stdout).reshape(len(targets), -1)


def stream(name: str) -> np.ndarray:
    """Targets with one in the middle that is none."""
    targets = smooth(machine(name), 200)
    targets[100] = np.nan
    return targets


@pytest.mark.parametrize("name", ["stewart", "five_bar", "rps"])
def test_ticks_in_c_are_those_of_the_library(name: str, tmp_path: Path) -> None:
    mechanism, targets = machine(name), stream(name)
    rows, live = driven(name, "double", 40, targets, tmp_path), live_of(mechanism, 40)
    for row, target in zip(rows, targets, strict=True):
        assert live.tick(target, 1.0) is CODES[int(row[0])]
        np.testing.assert_allclose(
            row[1 : 1 + len(live.actuators)], live.actuators, atol=1e-9 * actuator_units(mechanism).max(), rtol=0.0
        )


@pytest.mark.parametrize("name", ["stewart", "delta"])
def test_in_single_precision_speeds_and_limits_are_kept_and_targets_as_near(name: str, tmp_path: Path) -> None:
    mechanism, targets, length = machine(name), stream(name), machine(name).characteristic_length
    rows, live = driven(name, "float", 40, targets, tmp_path), live_of(mechanism, 40)
    n, units, lag = len(live.actuators), actuator_units(mechanism), []
    values, places = rows[:, 1 : 1 + n], rows[:, 1 + n : 4 + n]
    assert (np.abs(np.diff(values, axis=0)) <= SPAN * units / 40 * (1.0 + 1e-3)).all()
    for target in targets:
        live.tick(target, 1.0)
        lag.append(np.linalg.norm(live.pose[:3, 3] - target[:3, 3]))
    far = np.linalg.norm(places - targets[:, :3, 3], axis=1)
    assert np.nanmean(far) <= 1.03 * np.nanmean(lag)
    led = pf.solve_fk(mechanism, values[::20], options=KEEP)
    assert (np.abs(led.pose[:, :3, 3] - places[::20]) <= 1e-4 * length).all()
    assert (led.limit_excess <= 1e-4).all()


def test_parts_that_make_no_sense_are_refused() -> None:
    with pytest.raises(InvalidArgument, match="'live' is made of them"):
        c_source(machine("stewart"), parts=("live",))
    for name in ("nrpm", "files.crank_rocker"):
        with pytest.raises(UnsupportedMechanism):
            c_source(machine(name), parts=PARTS)
