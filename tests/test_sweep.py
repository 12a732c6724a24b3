"""Sweeps: the answers of one call, in files; what is there is not answered again."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.errors import InvalidArgument

ROWS = np.random.default_rng(4).uniform([-90, -90, 130], [90, 90, 280], (250, 3))


def read(files: tuple[Path, ...], name: str) -> np.ndarray:
    return np.concatenate([np.load(file)[name] for file in files])


@pytest.mark.parametrize("has_executor", [False, True])
def test_files_have_the_answers_of_one_call(has_executor: bool, tmp_path: Path) -> None:
    machine, done = pf.load("stewart"), []
    with ThreadPoolExecutor(2) as pool:
        executor = pool if has_executor else None
        files = pf.sweep(
            machine,
            ROWS,
            into=tmp_path / "a" / "b",
            chunk=100,
            executor=executor,
            on_progress=lambda *d: done.append(d),
        )
    assert [file.name for file in files] == ["00000000.npz", "00000100.npz", "00000200.npz"]
    assert done == [(100, 250), (200, 250), (250, 250)]
    whole = pf.solve_ik(machine, ROWS)
    for name in ("status", "actuators", "pose", "position_error", "rotation_error"):
        np.testing.assert_array_equal(read(files, name), getattr(whole, name))
    assert {*read(files, "status").tolist()} == {pf.Status.REACHED, pf.Status.PROJECTED}


def test_a_job_that_was_killed_goes_on(tmp_path: Path) -> None:
    machine = pf.load("stewart")

    def stop(done: int, _: int) -> None:
        if done >= 100:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pf.sweep(machine, ROWS, into=tmp_path, chunk=50, on_progress=stop)
    assert len(list(tmp_path.iterdir())) == 2, "whole files alone"
    before = {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()}
    files = pf.sweep(machine, ROWS, into=tmp_path, chunk=50)
    assert len(files) == 5 and all(file.stat().st_mtime_ns == time for file, time in before.items())
    np.testing.assert_array_equal(read(files, "actuators"), pf.solve_ik(machine, ROWS).actuators)


def test_poses_are_read_from_a_file_a_chunk_at_a_time(tmp_path: Path) -> None:
    machine = pf.load("stewart")
    np.save(tmp_path / "poses.npy", pf.pose(ROWS[:60]))
    poses = np.load(tmp_path / "poses.npy", mmap_mode="r")
    files = pf.sweep(machine, poses, into=tmp_path / "out", chunk=25)
    np.testing.assert_array_equal(read(files, "pose"), pf.solve_ik(machine, ROWS[:60]).pose)


def test_answers_of_something_else_are_refused(tmp_path: Path) -> None:
    machine = pf.load("stewart")
    pf.sweep(machine, ROWS[:40], into=tmp_path, chunk=20)
    others = [
        lambda: pf.sweep(pf.load("hexaglide"), ROWS[:40], into=tmp_path, chunk=20),
        lambda: pf.sweep(machine, ROWS[1:41], into=tmp_path, chunk=20),
        lambda: pf.sweep(machine, ROWS[:40], into=tmp_path, chunk=40),
        lambda: pf.sweep(machine, ROWS[:40], into=tmp_path, chunk=20, options=pf.Options(hold=None)),
    ]
    for other in others:
        with pytest.raises(InvalidArgument, match="which has other answers"):
            other()
    (tmp_path / "00000020.npz").write_bytes(b"half")
    with pytest.raises(InvalidArgument, match=r"00000020\.npz"):
        pf.sweep(machine, ROWS[:40], into=tmp_path, chunk=20)
    with pytest.raises(InvalidArgument, match=r"\(n, 4, 4\) or \(n, 3\)"):
        pf.sweep(machine, ROWS[0], into=tmp_path)


@pytest.mark.parametrize("verb", [pf.solve_ik, pf.feasibility])
def test_progress_is_told_and_changes_no_answer(verb: object, monkeypatch: pytest.MonkeyPatch) -> None:
    from pfabrik.common import executors

    machine, done = pf.load("stewart"), []
    whole = verb(machine, ROWS)  # type: ignore[operator]
    monkeypatch.setattr(executors, "POSES_A_BLOCK", 100)
    told = verb(machine, ROWS, on_progress=lambda *d: done.append(d))  # type: ignore[operator]
    assert done == [(100, 250), (200, 250), (250, 250)]
    for name in ("actuators", "pose") if verb is pf.solve_ik else ("margin", "binding"):
        np.testing.assert_array_equal(getattr(told, name), getattr(whole, name))


def test_rows_that_are_no_poses_are_told_by_their_number_in_all(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[[103, 140]] = np.nan
    with pytest.raises(InvalidArgument, match="poses") as refused:
        pf.sweep(pf.load("stewart"), rows, into=tmp_path, chunk=100)
    assert refused.value.rows == (103, 140)


def test_a_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "folder"):
        with pytest.raises(InvalidArgument, match="expected a folder"):
            pf.sweep(pf.load("stewart"), ROWS, into=place)
