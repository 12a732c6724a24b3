"""Verbs on the workers of an executor: the same answers as here."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.common import executors


@contextmanager
def dask_workers() -> Iterator[Executor]:
    """Two worker processes of a Dask cluster on this machine."""
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "processes": True}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        yield client.get_executor()


class Unaligned(Executor):
    """An executor that hands large arrays on as clusters may: read from a stream, at any address."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        function, block = received((fn, args))
        future.set_result(received(function(*block)))
        return future


def received(sent: Any) -> Any:
    """What comes out at the other end of a stream."""
    buffers: list[pickle.PickleBuffer] = []
    text = pickle.dumps(sent, protocol=5, buffer_callback=buffers.append)
    streams = [memoryview(b"-" + bytes(each.raw()))[1:] for each in buffers]
    return pickle.loads(text, buffers=streams)


EXECUTORS: dict[str, Callable[[], AbstractContextManager[Executor]]] = {
    "threads": partial(ThreadPoolExecutor, 2),
    "processes": partial(ProcessPoolExecutor, 2),
    "dask": dask_workers,
    "unaligned": Unaligned,
}


@pytest.fixture(params=["threads", "processes", "unaligned", pytest.param("dask", marks=pytest.mark.campaign)])
def executor(request: pytest.FixtureRequest) -> Iterator[Executor]:
    with EXECUTORS[request.param]() as workers:
        yield workers


def around_home(machine: pf.Mechanism, n: int) -> np.ndarray:
    """Poses (n, 4, 4) within a third of L of home, many of them out of reach, and one that is none."""
    rng, poses = np.random.default_rng(0), np.repeat(machine.home_pose[None], n, axis=0)
    poses[:, :3, 3] += rng.uniform(-0.35, 0.35, (n, 3)) * machine.characteristic_length
    poses[n // 2, 0, 0] = np.nan
    return poses


def assert_same(there: Any, here: Any) -> None:
    """Every field of two answers is the same to the last bit."""
    for name in ("status", "pose", "actuators", "q", "position_error", "residual", "limit_excess", "iterations"):
        assert np.array_equal(getattr(there, name), getattr(here, name), equal_nan=name != "status"), name


@pytest.mark.compiled
@pytest.mark.filterwarnings("default")
def test_answers_are_the_same_wherever_they_are_worked_out(executor: Executor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "POSES_A_BLOCK", 900)  # large enough for clusters to send arrays by themselves
    options = pf.Options(on_invalid="mark")
    for name, n in (("delta", 1500), ("nrpm", 600), ("canfield", 20), ("panda", 600)):
        machine = pf.load(name)
        poses = around_home(machine, n)
        here = pf.solve_ik(machine, poses, options=options)
        there = pf.solve_ik(machine, poses, options=options, executor=executor)
        assert_same(there, here)
        assert there[0].active_limits == here[0].active_limits
        starts = here[:8] if (here.status[:8] < pf.Status.FAILED).all() else None
        again = [pf.solve_ik(machine, poses[:8], start=starts, options=options, executor=e) for e in (executor, None)]
        assert_same(*again)
        if name == "delta":
            margins = [pf.feasibility(machine, poses, executor=e) for e in (executor, None)]
            assert np.array_equal(margins[0].margin, margins[1].margin, equal_nan=True)
            assert np.array_equal(margins[0].binding, margins[1].binding)
            assert pf.feasibility(machine, poses[:0], executor=executor).margin.shape == (0,)
    with pytest.raises(pf.errors.InvalidArgument) as error:
        pf.solve_ik(pf.load("delta"), around_home(pf.load("delta"), 1500), executor=executor)
    assert error.value.rows == (750,)


@pytest.mark.compiled
@pytest.mark.filterwarnings("default")
def test_maps_are_the_same_wherever_they_are_worked_out(executor: Executor) -> None:
    for name, asked in (("five_bar", {"resolution": 4.0}), ("rpr", {"resolution": 0.2, "orientation": "any"})):
        there = pf.workspace(pf.load(name), executor=executor, **asked)
        here = pf.workspace(pf.load(name), **asked)
        for field in ("vertices", "faces", "face_limit"):
            assert np.array_equal(getattr(there, field), getattr(here, field))


@pytest.mark.compiled
@pytest.mark.filterwarnings("default")
def test_verdicts_are_the_same_wherever(executor: Executor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.capabilities.certify.question.CELLS_A_BLOCK", 20)
    machine = pf.load("hexaglide")
    home, size = machine.home_pose[:3, 3], 0.06 * machine.characteristic_length
    for rotation, budget, verdict in ((0.13, 10_000, "PROVED"), (0.15, 10_000, "REFUTED"), (0.13, 5, "OPEN")):
        region = pf.PoseRegion.box(home - size, home + size, rotation=rotation)
        there, here = (
            pf.certify(machine, region, tolerance=0.005 if verdict == "PROVED" else None, budget=budget, executor=e)
            for e in (executor, None)
        )
        assert there.verdict == here.verdict == verdict
        assert not there or (there.margin >= there.least_found - 0.005 and there.replay())
        assert there.n_cells <= budget + executors_turn(there)


def executors_turn(certificate: pf.Certificate) -> int:
    """Cells that may be looked at beyond a budget, one for each on the last turn."""
    return len(certificate.open_boxes) + 1


class Refusing(Executor):
    """An executor whose second block fails; blocks wait until they are asked for."""

    def __init__(self, most: int = 100) -> None:
        self.futures: list[Future[Any]] = []
        self._most = most

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        if len(self.futures) == self._most:
            raise RuntimeError("cannot schedule new futures: shut down")
        future: Future[Any] = Future()
        self.futures.append(future)
        if len(self.futures) == 1:
            future.set_result(fn(*args, **kwargs))
        if len(self.futures) == 2 and self._most > 3:
            future.set_exception(OSError("the worker is gone"))
        return future


def test_a_failure_on_a_worker_drops_the_blocks_that_have_not_begun() -> None:
    machine, refusing = pf.load("delta"), Refusing()
    with pytest.raises(OSError, match="the worker is gone"):
        pf.feasibility(machine, np.zeros((5 * executors.POSES_A_BLOCK, 3)), executor=refusing)
    assert [future.cancelled() for future in refusing.futures] == [False, False, True, True, True]


def test_blocks_that_have_not_begun_are_dropped_where_submitting_fails() -> None:
    refusing = Refusing(most=3)
    with pytest.raises(RuntimeError, match="shut down"):
        pf.feasibility(pf.load("delta"), np.zeros((5 * executors.POSES_A_BLOCK, 3)), executor=refusing)
    assert [future.cancelled() for future in refusing.futures] == [False, True, True]


def test_an_answer_from_a_stream_is_a_start() -> None:
    machine = pf.load("stewart")
    answers = pf.solve_ik(machine, around_home(machine, 1500), options=pf.Options(on_invalid="mark"))
    there = received(answers[:700])
    assert_same(pf.solve_ik(machine, there.pose, start=there), pf.solve_ik(machine, there.pose, start=answers[:700]))
    assert there[0].active_limits == answers[0].active_limits


def test_what_is_no_executor_is_refused() -> None:
    machine = pf.load("delta")
    with pytest.raises(pf.errors.InvalidArgument, match="the class ThreadPoolExecutor"):
        pf.solve_ik(machine, [0, 0, 0], executor=ThreadPoolExecutor)  # type: ignore[arg-type]
    for ask in (pf.solve_ik, pf.feasibility):
        with pytest.raises(pf.errors.InvalidArgument, match="executor: found 3; expected an executor of concurrent"):
            ask(machine, [0, 0, 0], executor=3)  # type: ignore[operator]


def test_functions_that_use_the_package_are_sent_to_other_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of a script or a notebook are sent as they are, with the modules that they use by name."""
    cloudpickle = pytest.importorskip("cloudpickle")

    def reached(machine: pf.Mechanism) -> bool:
        return bool(pf.solve_ik(machine, machine.home_pose))

    with ProcessPoolExecutor(1) as pool:
        assert pool.submit(call, cloudpickle.dumps(reached), pf.load("delta")).result()


def call(function: bytes, machine: pf.Mechanism) -> Any:
    return pickle.loads(function)(machine)
