"""Answers of a hundred machines, recorded and compared: so that a change of the code can be shown to change none.

python benchmarks/answers.py record FILE.npz
python benchmarks/answers.py compare FILE.npz [--tolerance 1e-12] [--only NAME …]

The file holds what was asked (the machines themselves, targets, starts), and what was answered, to the last bit.
Comparing asks the same again, and prints for every question how many rows are the same to the last bit, how many are
not, the largest difference, and how many statuses changed; it ends with 1 where anything differs by more than the
tolerance.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import pfabrik as pf
from answers_asked import Asked, affordable, as_machine, asked_of, machines
from answers_given import Table, given

A = TypeVar("A")
B = TypeVar("B")

TRIED = 24
"""Targets by which it is told how long a machine takes for one."""


def record(path: Path, only: list[str] | None) -> int:
    """Ask every machine, and keep what it answers."""
    kept: dict[str, Any] = {}
    names = [name for name in machines() if wanted(name, only)]
    for name, asked, answered, seconds in on_all_cores(asked_anew, names):
        kept |= {f"{name}/asked/{field}": np.asarray(value) for field, value in asked._asdict().items()}
        for question, table in answered.items():
            kept[f"{name}/given/{question}"] = shuffled(table.numbers)
            kept[f"{name}/words/{question}"] = np.array(json.dumps([table.columns, table.words]))
        print(f"{name:32s} {len(asked.targets):4d} targets {seconds:6.1f} s", flush=True)
    np.savez_compressed(path, **kept)
    print(f"{path}: {len(names)} machines, {path.stat().st_size / 1e6:.1f} MB")
    return 0


def asked_anew(name: str) -> tuple[str, Asked, dict[str, Table], float]:
    """A machine, what it is asked, what it answers, and the processor's time that takes [s]."""
    began, text = time.process_time(), machines()[name]()
    asked = asked_of(text, affordable(seconds_a_target(text)))
    return name, asked, dict(given(asked)), time.process_time() - began


def asked_again(asked: Asked) -> dict[str, Table]:
    """What a machine of a file answers now."""
    return dict(given(asked))


def on_all_cores(ask: Callable[[A], B], what: list[A]) -> Iterator[B]:
    """Ask several machines at a time, each in a process; answers in order."""
    with ProcessPoolExecutor(initializer=warnings.simplefilter, initargs=("ignore", pf.errors.MobilityWarning)) as pool:
        yield from pool.map(ask, what)


def wanted(name: str, only: list[str] | None) -> bool:
    """Whether a machine is one of those asked for."""
    return not only or any(word in name for word in only)


def seconds_a_target(text: str) -> float:
    """About how long a target takes a machine, of the processor's time [s]."""
    mechanism = as_machine(text)
    targets = asked_of(text, TRIED).targets
    pf.solve_ik(mechanism, targets)  # compiled, and prepared
    began = time.process_time()
    pf.solve_ik(mechanism, targets)
    return (time.process_time() - began) / len(targets)


def shuffled(numbers: np.ndarray) -> np.ndarray:
    """Numbers as bytes, the first bytes of all first: these are much the same, and take less room so."""
    packed = np.ascontiguousarray(numbers.T).view(np.uint8).reshape(-1, 8)
    return np.ascontiguousarray(packed.T).reshape(8, *numbers.T.shape)


def unshuffled(packed: np.ndarray) -> np.ndarray:
    numbers = np.ascontiguousarray(packed.reshape(8, -1).T).view(np.float64)
    return numbers.reshape(packed.shape[1:]).T


def recorded(kept: Any) -> Iterator[tuple[str, Asked, dict[str, Table]]]:
    """Every machine of a file: its name, what it was asked, and what it answered."""
    names: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for key in kept.files:
        name, kind, what = key.split("/", 2)
        names[name][kind].append(what)
    for name, kinds in names.items():
        asked = Asked(**{field: kept[f"{name}/asked/{field}"] for field in kinds["asked"]})
        tables = {}
        for question in kinds["given"]:
            columns, words = json.loads(str(kept[f"{name}/words/{question}"]))
            tables[question] = Table(columns, unshuffled(kept[f"{name}/given/{question}"]), words)
        yield name, asked._replace(text=str(asked.text)), tables


class Tally:
    """How the rows of one question compare, over all machines."""

    def __init__(self) -> None:
        self.rows = self.equal = self.statuses = 0
        self.largest = 0.0
        self.differing: dict[str, int] = {}

    def add(self, machine: str, before: Table, now: Table, tolerance: float) -> None:
        """Compare a machine's answers; what has other columns or another number of rows differs in all rows."""
        self.rows += len(before.words)
        if before.columns != now.columns or len(before.words) != len(now.words):
            self.differing[machine] = len(before.words)
            self.largest = np.inf
            return
        same = before.numbers.view(np.int64) == np.ascontiguousarray(now.numbers).view(np.int64)
        off = np.where(same, 0.0, differences(before.numbers, now.numbers))
        worst = off.max(axis=1, initial=0.0)
        other = np.array(before.words) != np.array(now.words)
        if "status" in before.columns:  # the first column
            changed = before.numbers[:, 0] != now.numbers[:, 0]
            self.statuses += int(changed.sum())
            other |= changed
        self.equal += int((same.all(axis=1) & ~other).sum())
        self.largest = max(self.largest, float(worst.max(initial=0.0)))
        beyond = other | ((worst > tolerance) if tolerance else ~same.all(axis=1))
        if beyond.any():
            self.differing[machine] = int(beyond.sum())


def differences(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """By how much numbers differ, relative to those above 1; infinite where one of the two is not finite."""
    known = np.isfinite(before) & np.isfinite(now)
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(now - before) / np.maximum(np.abs(before), 1.0)
    alike = (before == now) | (np.isnan(before) & np.isnan(now))
    return np.where(known, off, np.where(alike, 0.0, np.inf))


def compare(path: Path, tolerance: float, only: list[str] | None) -> int:
    """Ask again, and print how the answers differ."""
    tallies: dict[str, Tally] = {}
    machines = [machine for machine in recorded(np.load(path)) if wanted(machine[0], only)]
    answers = on_all_cores(asked_again, [asked for _, asked, _ in machines])
    for (name, _, before), now in zip(machines, answers, strict=True):
        for question, table in before.items():
            tally = tallies.setdefault(question, Tally())
            tally.add(name, table, now.get(question, Table({}, np.zeros((0, 0)), [])), tolerance)
    print(f"{'question':36s} {'rows':>7s} {'equal':>7s} {'differ':>7s} {'largest':>8s} {'statuses':>8s}")
    for question, tally in tallies.items():
        off = tally.rows - tally.equal
        line = f"{question:36s} {tally.rows:7d} {tally.equal:7d} {off:7d} {tally.largest:8.1g} {tally.statuses:8d}"
        worst = sorted(tally.differing.items(), key=lambda each: -each[1])
        print(line + "".join(f"  {name} {count}" for name, count in worst[:4]) + (" …" if len(worst) > 4 else ""))
    failed = sum(sum(tally.differing.values()) for tally in tallies.values())
    print(f"\n{failed} rows differ" if failed else f"\nall answers are the same{within(tolerance)}")
    return int(failed > 0)


def within(tolerance: float) -> str:
    return f" within {tolerance:g}" if tolerance else " to the last bit"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["record", "compare"])
    parser.add_argument("file", type=Path)
    parser.add_argument("--tolerance", type=float, default=0.0, help="difference that counts as none, relative above 1")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="machines whose name contains one of these")
    asked = parser.parse_args()
    if asked.what == "record":
        return record(asked.file, asked.only)
    return compare(asked.file, asked.tolerance, asked.only)


if __name__ == "__main__":
    sys.exit(main())
