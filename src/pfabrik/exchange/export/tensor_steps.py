"""Noted steps as the text of functions of tensors: a line for each step, over all legs that are alike.

Steps that differ in their leaves only, as those of legs that are alike do, are one operation on arrays whose first axis
counts them; the axes behind it are those of the batch. What is used once stands within the line that uses it. Names are
those that the kernels' routines have for their numbers, and comments name the routines.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from ...kernels import noted_steps as K
from ...machine.noted_numbers import Number, numbers_behind

TEXTS = {
    K.ADD: "{} + {}",
    K.SUBTRACT: "{} - {}",
    K.MULTIPLY: "{} * {}",
    K.DIVIDE: "_over({}, {})",
    K.LARGER: "_larger({}, {})",
    K.SMALLER: "-_larger(-({}), -({}))",
    K.MAGNITUDE: "abs({})",
    K.COPYSIGN: "abs({}) * _sign({})",
    K.ANGLE: "_atan2({}, {})",
    K.ROOT: "_root({})",
    K.SINE: "xp.sin({})",
    K.COSINE: "xp.cos({})",
    K.FLOOR: "xp.floor({})",
    K.BELOW: "{} < {}",
    K.AT_MOST: "{} <= {}",
    K.CHOOSE: "xp.where({}, {}, {})",
}
"""Text of a step, from those of its operands."""

SUM, PRODUCT, ATOM = 1, 2, 3
BINDS = {
    K.ADD: SUM,
    K.SUBTRACT: SUM,
    K.MULTIPLY: PRODUCT,
    K.COPYSIGN: PRODUCT,
    K.BELOW: 0,
    K.AT_MOST: 0,
    K.SMALLER: SUM,
}
"""How closely a text binds."""

WIDEST = 106
"""Columns of a line, as far as it can be."""


class Variable(NamedTuple):
    """A variable of a file: its text, how many numbers it has along its first axis, and if the batch's axes follow.

    Of one number, the first axis may be missing.
    """

    text: str
    size: int
    is_open: bool


Places = dict[int, tuple[Variable, int]]
"""Where the numbers of a trace are: a variable, and the place there."""


class _Step:
    """Steps that are alike."""

    def __init__(self, operation: int, members: list[Number]) -> None:
        self.operation, self.members = operation, members
        self.n_uses, self.is_kept = 0, False


class Body:
    """The lines of a function that computes numbers.

    Attributes
    ----------
    lines : without the names of what is given.
    places : where numbers are now, those given included.
    """

    def __init__(
        self,
        outputs: Sequence[Any],
        given: Places,
        names: Mapping[int, tuple[str, str]],
        like: str,
        size: float,
        keep: Sequence[Any] = (),
    ) -> None:
        """Text for outputs, and for numbers to keep in variables, from those given.

        Parameters
        ----------
        names : of numbers, and the routine that has them.
        like : a variable with the type of numbers.
        size : the number that files name SIZE.
        """
        self.places, self.lines, self._names, self._like = dict(given), list[str](), names, like
        self._sizes = {size: "SIZE"} if size != 1.0 else {}
        self._waiting: dict[int, tuple[_Step, str, int]] = {}
        self._taken = {variable.text for variable, _ in given.values()}
        self._routine = ""
        wanted = [each for each in (*outputs, *keep) if isinstance(each, Number)]
        steps = self._steps(wanted)
        for step in steps.values():
            step.is_kept = any(each.place in steps and steps[each.place] is step for each in wanted)
        for step in dict.fromkeys(steps.values()):
            self._write(step, steps)

    def _steps(self, wanted: Sequence[Number]) -> dict[int, _Step]:
        """The steps behind numbers, by the places of their members; those that are alike are one."""
        alike: dict[Any, _Step] = {}
        steps: dict[int, _Step] = {}
        for each in numbers_behind(wanted, lambda each: each.place in self.places):
            if each.place in self.places:
                continue
            operation, parts = each.trace.steps[each.place]
            if operation not in TEXTS:
                raise NotImplementedError(f"no text for operation {operation}")
            key = operation, *(self._label(part, steps) for part in parts)
            step = alike.setdefault(key, _Step(operation, []))
            step.members.append(each)
            steps[each.place] = step
        for step in dict.fromkeys(steps.values()):
            for operand in _operands(step.members):
                if isinstance(operand[0], Number) and operand[0].place in steps:
                    behind = steps[operand[0].place]
                    is_whole = [part.place for part in operand] == [each.place for each in behind.members]
                    behind.n_uses += 1 if is_whole else 2
        return steps

    def _label(self, part: Any, steps: Mapping[int, _Step]) -> Any:
        if not isinstance(part, Number):
            return None
        return id(steps[part.place]) if part.place in steps else self.places[part.place][0].text

    def _write(self, step: _Step, steps: Mapping[int, _Step]) -> None:
        first = step.members[0]
        columns = _operands(step.members)
        operands = [self._operand(column) for column in columns]
        text, binds = self._text(step.operation, operands, columns)
        if len(text) > WIDEST:
            for column, (own, _) in zip(columns, operands, strict=True):
                if isinstance(column[0], Number) and len(own) > WIDEST // 4:
                    self._put(column[0].place)
            operands = [self._operand(column) for column in columns]
            text, binds = self._text(step.operation, operands, columns)
        name, _ = self._names.get(first.place, ("", ""))
        if step.n_uses == 1 and not step.is_kept and not name and len(text) <= WIDEST:
            for each in step.members:
                self._waiting[each.place] = step, text, binds
            return
        self._assign(step, text)

    def _put(self, place: int) -> None:
        """Give a step that waits to be used a line of its own."""
        if place in self._waiting:
            step, text, _ = self._waiting[place]
            self._assign(step, text)

    def _assign(self, step: _Step, text: str) -> None:
        first = step.members[0]
        name, routine = self._names.get(first.place, ("", ""))
        name, stem, n = name or "t", name or "t", 1
        while name in self._taken or (stem == "t" and n == 1):
            n += 1
            name = f"{stem}_{n}" if stem != "t" else f"t{n - 1}"
        self._taken.add(name)
        if routine and routine != self._routine:
            self._routine = routine
            self.lines.append(f"# {routine}")
        self.lines.append(f"{name} = {text}")
        variable = Variable(name, len(step.members), any(each.is_open for each in step.members))
        for k, each in enumerate(step.members):
            self.places[each.place] = variable, k
            self._waiting.pop(each.place, None)

    def _operand(self, parts: list[Any]) -> tuple[str, int]:
        """The text of an operand for all members, and how closely it binds."""
        first = parts[0]
        if not isinstance(first, Number):
            if all(part == first for part in parts):
                return self._sizes.get(float(first), repr(float(first))), ATOM
            return f"_column({tuple(map(float, parts))!r}, {self._like})", ATOM
        if first.place in self._waiting:
            return self._waiting[first.place][1:]
        variable, places = self.places[first.place][0], [self.places[part.place][1] for part in parts]
        return picked(variable, places), ATOM

    def _text(
        self, operation: int, operands: Sequence[tuple[str, int]], columns: Sequence[list[Any]]
    ) -> tuple[str, int]:
        texts = [text for text, _ in operands]
        if operation == K.MULTIPLY and texts[1] == "-1.0":
            return "-" + self._within(operands[0], PRODUCT), PRODUCT
        if operation == K.DIVIDE and self._is_never_zero(columns[1]):
            return f"{self._within(operands[0], PRODUCT)} / {self._within(operands[1], ATOM)}", PRODUCT
        if operation == K.ROOT and (inner := self._at_least_zero(columns[0])) is not None:
            texts = [inner]
        if operation == K.CHOOSE and not any(isinstance(part, Number) for column in columns[1:] for part in column[:1]):
            texts[1] = f"_column(({texts[1]},), {self._like})"
        binds = BINDS.get(operation, ATOM)
        if operation in (K.ADD, K.SUBTRACT):
            if operation == K.ADD and texts[1].startswith("-") and operands[1][1] == PRODUCT:
                return f"{texts[0]} - {texts[1][1:]}", SUM
            texts = [self._within(operands[0], SUM), self._within(operands[1], PRODUCT)]
        elif operation == K.MULTIPLY:
            texts = [self._within(operands[0], PRODUCT), self._within(operands[1], ATOM)]
        return TEXTS[operation].format(*texts), binds

    @staticmethod
    def _within(operand: tuple[str, int], least: int) -> str:
        text, binds = operand
        return text if binds >= least and not (text.startswith("-") and least > SUM) else f"({text})"

    def _is_never_zero(self, parts: list[Any]) -> bool:
        """True of constants, and of what was chosen in place of a zero."""
        first = parts[0]
        if not isinstance(first, Number):
            return all(part != 0.0 for part in parts)
        chosen = [part.trace.steps[part.place] for part in parts]
        return all(step == K.CHOOSE and not isinstance(of[2], Number) and of[2] != 0.0 for step, of in chosen)

    def _at_least_zero(self, parts: list[Any]) -> str | None:
        """The text of what a root is of, where negative numbers were replaced by 0: `_root` does so itself."""
        first = parts[0]
        if not isinstance(first, Number) or first.place not in self._waiting:
            return None
        step, text, _ = self._waiting[first.place]
        if step.operation != K.LARGER or not text.endswith(", 0.0)"):
            return None
        return text.removeprefix("_larger(").removesuffix(", 0.0)")

    def order(self, columns: Sequence[Sequence[Any]]) -> list[int]:
        """The order of rows in which those that are alike in all columns are neighbours."""
        rows = list(zip(*columns, strict=True))
        at = [[self.places.get(x.place) if isinstance(x, Number) else x for x in row] for row in rows]
        keys = [repr([each[0].text if isinstance(each, tuple) else each for each in row]) for row in at]
        first = {key: keys.index(key) for key in keys}
        return sorted(range(len(rows)), key=lambda row: first[keys[row]])

    def output(self, numbers: Sequence[Any]) -> str:
        """The text of numbers as one array, along its first axis."""
        runs: list[tuple[Variable | float, list[int]]] = []
        for each in numbers:
            variable, place = self.places[each.place] if isinstance(each, Number) else (float(each), 0)
            if runs and runs[-1][0] == variable:
                runs[-1][1].append(place)
            else:
                runs.append((variable, [place]))
        whole, places = runs[0]
        if len(runs) == 1 and isinstance(whole, Variable) and whole.is_open and whole.size == len(places) > 1:
            return picked(whole, places)
        if len(runs) > 2 * len({run for run, _ in runs}):
            return self._reordered(runs)
        return self._joined(runs)

    def _reordered(self, runs: Sequence[tuple[Variable | float, list[int]]]) -> str:
        """The text of numbers that variables have in other orders."""
        of: dict[Variable | float, list[int]] = {}
        for run, places in runs:
            of.setdefault(run, []).extend(places)
        starts, n = dict[Variable | float, int](), 0
        for run, places in of.items():
            starts[run], n = n, n + len(places)
        order = [starts[run] + of[run].index(place) for run, places in runs for place in places]
        return f"_picked({self._joined(list(of.items()))}, {tuple(order)!r})"

    def _joined(self, runs: Sequence[tuple[Variable | float, list[int]]]) -> str:
        """The text of numbers of several variables."""
        parts = ", ".join(f"({picked(v, at) if isinstance(v, Variable) else repr(v)}, {len(at)})" for v, at in runs)
        return f"_joined(({parts}{',' * (len(runs) == 1)}), {self._like})"


def _operands(members: Sequence[Number]) -> list[list[Any]]:
    """Of each operand of a step, what it is of all members."""
    return [list(column) for column in zip(*(each.trace.steps[each.place][1] for each in members), strict=True)]


def picked(variable: Variable, places: list[int]) -> str:
    """The text of some numbers of a variable, in an order."""
    n, text = variable.size, variable.text
    if n == 1 or places == list(range(n)):
        return text
    first, step = places[0], places[1] - places[0] if len(places) > 1 else 1
    if step > 0 and places == list(range(first, places[-1] + 1, step)):
        end = places[-1] + 1
        return f"{text}[{first}:{end}]" if step == 1 else f"{text}[{first}:{end}:{step}]"
    if len(set(places)) == 1:
        return f"{text}[{first}:{first + 1}]"
    return f"_picked({text}, {tuple(places)!r})"


@contextmanager
def names_of_routines(names: dict[int, tuple[str, str]]) -> Iterator[None]:
    """Note the names that kernels' routines have for numbers, and the routines, while these run on them."""

    def look(frame: Any, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "return" or "kernels" not in code.co_filename:
            return
        values = frame.f_locals
        for name in code.co_varnames[code.co_argcount :]:
            if len(name) > 1 or name in "uxC":
                note_names(names, name, values.get(name), code.co_name)

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        yield
    finally:
        sys.setprofile(before)


def note_names(names: dict[int, tuple[str, str]], name: str, value: Any, routine: str = "") -> None:
    """Note the name of a number, or of a vector's components, if they have none."""
    if isinstance(value, Number):
        names.setdefault(value.place, (name, routine))
    elif isinstance(value, tuple | np.ndarray) and len(value) == 3:
        letters = "012" if isinstance(value[0], np.ndarray) else "xyz"
        for letter, each in zip(letters, value, strict=True):
            note_names(names, f"{name}_{letter}", each, routine)
