"""What a path says that its machine does not ask for: notes of it, and refusals."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import click

from ..errors import near_miss
from .projecting import note_left_out

if TYPE_CHECKING:
    from ..arrays import Floats
    from ..description.mechanism import Mechanism
    from ..paths import path as paths


def checked(blocks: Iterable[paths.Path], mechanism: Mechanism, is_timed: bool) -> Iterator[paths.Path]:
    """Blocks of a path that sets something of the task, with notes of what it sets for nothing; see `Moves`."""
    moves = Moves(mechanism)
    for number, block in enumerate(blocks):
        if number == 0:
            if is_timed and block.times is None:
                raise click.UsageError("--speed says nothing without --sample-time, or a path with times")
            note_misspelt(block.others)
        moves.add(block.targets)
        yield block
    moves.tell()


class Moves:
    """What a path changes of a pose, against home."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._found = {"x": False, "y": False, "z": False, "turned": False, "tilted": False}

    def add(self, targets: Floats) -> None:
        """Targets (n, 4, 4) as well."""
        off = (targets != self._mechanism.home_pose).any(axis=0)
        found = (*off[:3, 3], off[:3, :3].any(), off[:3, 2].any())
        self._found = {name: was or bool(now) for (name, was), now in zip(self._found.items(), found, strict=True)}

    def tell(self) -> None:
        """Say so when the task leaves out columns that are not as at home; refuse a path that sets nothing else."""
        found, task = self._found, set(self._mechanism.task)
        columns = [axis for axis in "xyz" if found[axis] and axis not in task]
        if found["turned"] and not task - set("xyz"):
            columns += ["roll", "pitch", "yaw"]
        elif "yaw" in task and found["tilted"]:
            columns += ["roll", "pitch"]
        sets_some = any(found[axis] for axis in task & set("xyz"))
        if columns and not sets_some and not (found["turned"] and task - set("xyz")):
            raise click.ClickException(
                f"the path sets {', '.join(columns)} only, none of which the task has: {' '.join(self._mechanism.task)}"
            )
        note_left_out((f"column {name}" for name in columns), self._mechanism)


def note_misspelt(others: Iterable[str]) -> None:
    """Say so where a further column is named nearly like one of a pose."""
    from ..paths.csv_table import NUMERIC

    for name in others:
        hint = "" if name in NUMERIC else near_miss(name, NUMERIC)
        if hint:
            click.echo(f"pfabrik: note: column '{name}' goes out as it came in{hint}", err=True)
