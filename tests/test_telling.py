"""Progress: shares never fall, whatever estimates do; a line on a terminal, steps on a pipe."""

from __future__ import annotations

import io
import sys
import time
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

import pfabrik as pf
from pfabrik.capabilities.workspace.measuring import MapProgress
from pfabrik.common.telling import in_words, lines_on_pipes, telling


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@given(st.lists(st.tuples(st.integers(0, 10**6), st.integers(1, 10**6)), min_size=2))
def test_a_share_never_falls_whatever_estimates_do(estimates: list[tuple[int, int]]) -> None:
    told: list[tuple[int, int]] = []
    done = 0
    with telling("", lambda *each: told.append(each)) as tell:
        assert tell is not None
        for more, ahead in estimates:
            done += more
            tell(done, done + ahead)
    assert all(x * n <= y * m for (x, m), (y, n) in pairwise(told))
    assert all(done <= total for done, total in told)


def said(monkeypatch: pytest.MonkeyPatch, stream: io.StringIO, total: int) -> str:
    """What is written of a hundred steps."""
    monkeypatch.setattr("pfabrik.common.telling.PATIENCE", 0.0)
    monkeypatch.setattr("pfabrik.common.telling.SECONDS_A_LINE", 0.0)
    monkeypatch.setattr(sys, "stderr", stream)
    with telling("count") as tell:
        for done in range(101) if tell else ():
            tell(done, total)
    return stream.getvalue()


def test_a_terminal_has_one_line_that_is_gone_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    written = said(monkeypatch, Terminal(), 100)
    assert "\n" not in written and "\rcount: 50%, " in written
    assert not written.removesuffix("\r").rpartition("\r")[2].strip()


def test_a_pipe_has_a_line_each_ten_per_cent_in_a_command_and_none_else(monkeypatch: pytest.MonkeyPatch) -> None:
    assert said(monkeypatch, io.StringIO(), 100) == ""
    with lines_on_pipes():
        lines = said(monkeypatch, io.StringIO(), 100).splitlines()
    assert [line.partition(",")[0] for line in lines] == [f"pfabrik: count: {k}%" for k in range(10, 100, 10)]


def test_what_is_left_goes_by_the_share_done() -> None:
    assert in_words(1, 4, 30.0) == "25%, 30 s, about 1 min 30 s left"
    assert in_words(7, 0, 3.0) == "7 done, 3 s"


def test_a_map_whose_level_is_slower_than_the_one_before_expects_so_of_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A hundred cells took 1 s, the next take 9 s and more: so will the hundred after these."""
    clock, told = [0.0], list[tuple[int, int]]()
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    progress = MapProgress(lambda *each: told.append(each), 3, 1.0)
    progress.begin(100, 100.0, 2)
    for clock[0], halved in ((0.0, [100.0, 100.0]), (1.0, [100.0])):
        progress.expect(25, halved, 0)
    clock[0] = 10.0
    progress.add(1000)
    done, total = told[-1]
    assert clock[0] * (total - done) / done == pytest.approx(9.0)


def test_proofs_report_too() -> None:
    told: list[tuple[int, int]] = []
    machine = pf.load("stewart")
    middle = machine.home_pose[:3, 3]
    pf.certify(machine, pf.PoseRegion.box(middle - 5.0, middle + 5.0), on_progress=lambda *each: told.append(each))
    assert told and told[-1][0] == told[-1][1]
    asked = {"centre": middle, "extents": (1, 1, 1), "accuracy": 0.1}
    pf.largest(machine, "box", **asked, on_progress=lambda *each: told.append(each))
    assert len(told) > 2
