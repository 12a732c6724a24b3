"""Random functions of the subset whose parts change what other parts read: order of evaluation matters everywhere."""

from __future__ import annotations

from random import Random

HEAD = """from typing import Any
from pfabrik.kernels._jit import routine


@routine
def move(x: Any, k: int) -> float:
    x[k] = 0.5 * x[k] + 1.0
    x[(k + 1) % 6] -= 0.25
    return float(x[k])


@routine
def two(a: float, b: float) -> tuple[float, float]:
    return b, a


@routine
def row(x: Any) -> float:
    x[0] += 0.125
    return float(x[1])
"""


class Writer:
    """Writes functions of an array `x` of six floats and an array `n` of two integers, for a seed."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)

    def program(self, count: int) -> str:
        """A module of functions `f0`, `f1`, …"""
        bodies = ["\n".join(self.block(3, [], 1)) for _ in range(count)]
        return HEAD + "".join(f"\n\n@routine\ndef f{k}(x: Any, n: Any) -> None:\n{b}\n" for k, b in enumerate(bodies))

    def number(self, depth: int, known: list[str]) -> str:
        """An expression of a number."""
        choice, place, either = self.random.choice, self.random.randrange(6), self.random.randrange(2)
        leaves = [
            *known,
            f"x[{place}]",
            f"{self.random.uniform(-2, 2):.2f}",
            f"float(n[{either}])",
            "x[n[0] % 6]",
            "x[-1]",
        ]
        kind = self.random.randrange(10) if depth > 0 else 0
        if kind < 2:
            return choice(
                [choice(leaves), choice(leaves), f"move(x, {place})", f"row(x[{place // 2} :])"][: 4 if kind else 2]
            )
        a, b = self.number(depth - 1, known), self.number(depth - 1, known)
        if kind < 6:
            return f"({a} {choice('+-*')} {b})"
        if kind == 6:
            return choice([f"(-{a})", f"abs({a})"])
        if kind == 7:
            return f"({a} if {self.truth(depth - 2, known)} else {b})"
        return choice([f"max({a}, {b})", f"min({a}, {b})", f"two({a}, {b})[{either}]", f"({a}, {b})[{either}]"])

    def truth(self, depth: int, known: list[str]) -> str:
        """An expression of a truth value."""
        a, b, c = (self.number(depth - 1, known) for _ in range(3))
        sign, least, kind = (
            self.random.choice(["<", ">", "<=", ">="]),
            self.random.randrange(3),
            self.random.randrange(5),
        )
        if kind == 0 and depth > 0:
            joint = self.random.choice(["and", "or"])
            return f"({self.truth(depth - 1, known)} {joint} {self.truth(depth - 1, known)})"
        if kind == 1 and depth > 0:
            return f"not {self.truth(depth - 1, known)}"
        return [f"{a} < {b} <= {c}", f"n[0] % {least + 1} == {least}", f"{a} {sign} {b}"][min(kind, 2)]

    def block(self, depth: int, known: list[str], indent: int, in_loop: bool = False) -> list[str]:
        """Some statements; what they set is known to those after them."""
        lines, known = [], list(known)
        for _ in range(self.random.randrange(1, 4)):
            lines += [f"{'    ' * indent}{line}" for line in self.statement(depth, known, indent, in_loop)]
        return lines

    def statement(self, depth: int, known: list[str], indent: int, in_loop: bool) -> list[str]:
        """The lines of a statement; blocks are indented to their place already within."""
        random, number = self.random, self.number
        p, q = random.randrange(6), random.randrange(6)
        a, b = number(2, known), number(2, known)
        kind = random.randrange(11 if depth > 0 else 7)
        if kind == 0:
            name = f"v{random.randrange(6)}"
            line = f"{name} = {number(3, known)}"
            known += [] if name in known else [name]
            return [line]
        if kind == 1:
            return [f"x[{p}] {random.choice(['=', '+=', '-=', '*='])} {number(3, known)}"]
        if kind == 2:
            return [f"x[{p}], x[{q}] = {a}, {b}"]
        if kind == 3:
            return [f"x[{p}], x[{q}] = two({a}, {b})"]
        names = [name for name in known if name.startswith("v")]
        if kind == 4 and names:
            return [f"{random.choice(names)} += {a}"]
        if kind == 5 and len(names) > 1:
            return [f"{', '.join(random.sample(names, 2))} = {a}, {b}"]
        if kind == 6:
            return [f"x[{p}], x[{q}] = ({a}, {b}) if {self.truth(1, known)} else ({b}, {a})"]
        if kind == 7 and in_loop:
            return [f"if {self.truth(1, known)}:", f"    {random.choice(['break', 'continue'])}"]
        if kind == 8:
            ends = random.choice(["3", "n[1] % 4", "len(x) - 3", "4, 0, -2"])
            own = [*known, f"float(i{indent})", f"x[i{indent}]"]
            return [f"for i{indent} in range({ends}):", *self.inner(depth, own, indent, True)]
        if kind == 9:
            head = [f"c{indent} = 0", f"while c{indent} < 3 and {self.truth(1, known)}:", f"    c{indent} += 1"]
            return head + self.inner(depth, known, indent, True)
        if depth <= 0:
            return ["pass"]
        lines = []
        for head in [f"if {self.truth(2, known)}:", f"elif {self.truth(2, known)}:", "else:"][: random.randrange(1, 4)]:
            lines += [head, *self.inner(depth, known, indent, in_loop)]
        return lines

    def inner(self, depth: int, known: list[str], indent: int, in_loop: bool) -> list[str]:
        """A block within a statement."""
        return [line[4 * indent :] for line in self.block(depth - 1, known, indent + 1, in_loop)]
