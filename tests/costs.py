"""What tests cost, and which of them `make test` leaves to `make test-all`.

`pytest --costs` writes `costs.toml`: the processor's time of each item that takes more than `MOST`, its children's
included. Such an item is `slow` where its function has a cheaper sister, or costs more than `ALONE` by itself, and no
seeded fault counts on it; so are two thirds of what `test_matrix` asks, by a hash of machine and question.
"""

from __future__ import annotations

import tomllib
import zlib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

COSTS = Path(__file__).with_name("costs.toml")
FAULTS = Path(__file__).with_name("seeded_faults.toml")
MOST, ALONE = 0.15, 0.5
"""Processor's time from which an item is for `make test-all`, if its function has a cheaper one, and if not [s]."""

THIRDS = "test_matrix.py"
"""The file whose questions are asked by thirds."""

BEGAN = pytest.StashKey[float]()


def used() -> float:
    """The processor's time of this process and of those that it has waited for [s]."""
    import resource

    ours, theirs = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return ours.ru_utime + ours.ru_stime + theirs.ru_utime + theirs.ru_stime


class Costs:
    """Measures items in each worker, and writes what they cost where the run ends."""

    def __init__(self, is_worker: bool) -> None:
        self.is_worker, self.seconds = is_worker, dict[str, float]()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        item.stash[BEGAN] = used()
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
        if call.when == "teardown":
            item.user_properties.append(("seconds", used() - item.stash[BEGAN]))
        return (yield)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "teardown":
            self.seconds[report.nodeid] = float(dict(report.user_properties)["seconds"])  # type: ignore[arg-type]

    def pytest_sessionfinish(self) -> None:
        if self.is_worker:
            return
        by_file = defaultdict[str, dict[str, float]](dict)
        for nodeid, seconds in sorted(self.seconds.items()):
            file, _, item = nodeid.partition("::")
            if seconds >= MOST:
                by_file[file][item] = round(seconds, 2)
        tables = [
            "\n".join([f'["{file}"]', *(f"{quoted(item)} = {seconds}" for item, seconds in items.items())])
            for file, items in by_file.items()
        ]
        total = f"{sum(self.seconds.values()):.0f} s of {len(self.seconds)} items"
        head = f"# Processor's time of items that take {MOST} s or more, of {total}: `pytest --costs` writes it.\n"
        COSTS.write_text("\n\n".join([head, *tables]) + "\n", encoding="utf-8")


def quoted(key: str) -> str:
    """A key of TOML."""
    return "'" + key + "'" if "'" not in key else '"' + key.replace("\\", "\\\\").replace('"', '\\"') + '"'


def function_of(nodeid: str) -> str:
    """The function of an item, without its parameters."""
    return nodeid.partition("[")[0]


def counted_on() -> set[str]:
    """Items, or functions, that seeded faults name."""
    return {fault["test"] for fault in tomllib.loads(FAULTS.read_text(encoding="utf-8"))["fault"]}


def slow_items(nodeids: list[str]) -> set[str]:
    """The items that are left to `make test-all`."""
    costs = {
        f"{file}::{item}": seconds
        for file, items in tomllib.loads(COSTS.read_text(encoding="utf-8")).items()
        for item, seconds in items.items()
    }
    kept, sisters = counted_on(), defaultdict[str, list[str]](list)
    for nodeid in nodeids:
        sisters[function_of(nodeid)].append(nodeid)
    slow = set()
    for function, items in sisters.items():
        cheapest = min(items, key=lambda nodeid: (costs.get(nodeid, 0.0), nodeid))
        for nodeid in items:
            is_dear = costs.get(nodeid, 0.0) >= (MOST if nodeid != cheapest else ALONE)
            asked = nodeid.partition("[")[2]  # machine and question, answered once for all that is checked of them
            is_of_others = THIRDS in nodeid and zlib.crc32(asked.encode()) % 3 > 0 and nodeid != cheapest
            is_counted_on = nodeid in kept or (function in kept and nodeid == cheapest)
            if (is_dear or is_of_others) and not is_counted_on:
                slow.add(nodeid)
    return slow
