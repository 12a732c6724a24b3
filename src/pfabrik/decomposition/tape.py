"""Numbers and vectors whose arithmetic is recorded, so that it can be run again with other numbers.

What is computed from a home configuration is computed by operators of `Scalar` and `Vector`. Each operation is
performed at once, and put on a tape; so is each decision, as of `norm(line) <= 1e-6`, with how it came out. Run again
with other numbers (`kernels.replay`), the same steps give what the same code would compute from them, to the last bit,
as long as all decisions come out alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial, reduce

from ..kernels import tape as K

Triple = tuple[float, float, float]


class Tape:
    """Steps of arithmetic, in the layout of `kernels.replay`, and the values that they gave.

    Attributes
    ----------
    values : the given numbers, then constants and results.
    n_given : how many of them are given.
    used : places of given numbers that count.
    """

    def __init__(self, given: Iterable[float]) -> None:
        self.values: list[float] = list(given)
        self.n_given = len(self.values)
        self.steps: list[tuple[int, int, int, int, int]] = []
        self.used: set[int] = set()
        self._places: dict[tuple[object, ...], int] = {}

    def scalar(self, place: int) -> Scalar:
        """A given number."""
        self.used.add(place)
        return Scalar(self, place)

    def vector(self, place: int) -> Vector:
        """A given vector."""
        self.used.update(range(place, place + 3))
        return Vector(self, place)

    def constant(self, *numbers: float) -> int:
        """The place of constants."""
        key = ("constant", *(float(number).hex() for number in numbers))  # which tells -0 from 0
        if key not in self._places:
            self._places[key] = len(self.values)
            self.values += [float(number) for number in numbers]
        return self._places[key]

    def perform(self, operation: int, a: int, b: int = 0) -> int:
        """The place of the result of a step, which is recorded unless it has been before."""
        key = (operation, a, b)
        if key not in self._places:
            out = self._places[key] = len(self.values)
            self.values += [0.0] * K.SIZES[operation]
            K.perform(operation, self.values, a, b, out)
            outcome = int(self.values[out]) if operation in K.DECISIONS else -1
            self.steps.append((operation, a, b, out, outcome))
        return self._places[key]

    def decide(self, operation: int, a: int, b: int) -> bool:
        """The outcome of a decision."""
        return self.values[self.perform(operation, a, b)] == 1.0


class Recorded:
    """A value on a tape."""

    __hash__ = None  # type: ignore[assignment]
    size = 1

    def __init__(self, tape: Tape, place: int) -> None:
        self.tape, self.place = tape, place

    def __bool__(self) -> bool:
        raise TypeError("a decision needs a comparison, which is recorded")


class Scalar(Recorded):
    """A number on a tape."""

    @property
    def value(self) -> float:
        return self.tape.values[self.place]

    def _performed(self, operation: int, a: int, b: int = 0) -> Scalar:
        return Scalar(self.tape, self.tape.perform(operation, a, b))

    def _of(self, other: Scalar | float) -> int:
        return other.place if isinstance(other, Scalar) else self.tape.constant(other)

    def __add__(self, other: Scalar | float) -> Scalar:
        return self._performed(K.ADD, self.place, self._of(other))

    def __sub__(self, other: Scalar | float) -> Scalar:
        return self._performed(K.SUBTRACT, self.place, self._of(other))

    def __rsub__(self, other: float) -> Scalar:
        return self._performed(K.SUBTRACT, self._of(other), self.place)

    def __mul__(self, other: Scalar | float) -> Scalar:
        return self._performed(K.MULTIPLY, self.place, self._of(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar | float) -> Scalar:
        return self._performed(K.DIVIDE, self.place, self._of(other))

    def __rtruediv__(self, other: float) -> Scalar:
        return self._performed(K.DIVIDE, self._of(other), self.place)

    def __neg__(self) -> Scalar:
        return self * -1.0

    def __abs__(self) -> Scalar:
        return self._performed(K.MAGNITUDE, self.place)

    def __le__(self, other: Scalar | float) -> bool:
        return self.tape.decide(K.AT_MOST, self.place, self._of(other))

    def __lt__(self, other: Scalar | float) -> bool:
        return self.tape.decide(K.BELOW, self.place, self._of(other))

    def __ge__(self, other: Scalar | float) -> bool:
        return self.tape.decide(K.AT_MOST, self._of(other), self.place)

    def __gt__(self, other: Scalar | float) -> bool:
        return self.tape.decide(K.BELOW, self._of(other), self.place)


class Vector(Recorded):
    """Three numbers on a tape."""

    size = 3

    @property
    def value(self) -> Triple:
        x, y, z = self.tape.values[self.place : self.place + 3]
        return x, y, z

    def _performed(self, operation: int, a: int, b: int = 0) -> Vector:
        return Vector(self.tape, self.tape.perform(operation, a, b))

    def __add__(self, other: Vector) -> Vector:
        return self._performed(K.V_ADD, self.place, other.place)

    def __sub__(self, other: Vector) -> Vector:
        return self._performed(K.V_SUBTRACT, self.place, other.place)

    def __mul__(self, factor: Scalar | float) -> Vector:
        place = factor.place if isinstance(factor, Scalar) else self.tape.constant(factor)
        return self._performed(K.V_SCALE, place, self.place)

    def __truediv__(self, divisor: Scalar | float) -> Vector:
        place = divisor.place if isinstance(divisor, Scalar) else self.tape.constant(divisor)
        return self._performed(K.V_DIVIDE, self.place, place)

    def __neg__(self) -> Vector:
        return self * -1.0

    def __matmul__(self, other: Vector) -> Scalar:
        return Scalar(self.tape, self.tape.perform(K.DOT, self.place, other.place))

    def is_same(self, other: Vector) -> bool:
        """True if both have the same components: a decision."""
        return self.tape.decide(K.SAME, self.place, other.place)


def cross(a: Vector, b: Vector) -> Vector:
    return Vector(a.tape, a.tape.perform(K.CROSS, a.place, b.place))


def norm(a: Vector) -> Scalar:
    return Scalar(a.tape, a.tape.perform(K.NORM, a.place))


def length(a: Vector) -> Scalar:
    """The norm of a vector however long or short it is, as of one in a mechanism's own unit."""
    return Scalar(a.tape, a.tape.perform(K.LENGTH, a.place))


def area(a: Vector, b: Vector) -> Scalar:
    """Area between two vectors; of unit vectors, the sine of the angle between them."""
    return norm(cross(a, b))


def square_to(a: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors square to a vector, and to each other."""
    place = a.tape.perform(K.SQUARE, a.place, length(a).place)
    return Vector(a.tape, place), Vector(a.tape, place + 3)


def sign(a: Scalar) -> Scalar:
    """+1 or -1; of a zero, the sign that it has."""
    return Scalar(a.tape, a.tape.perform(K.SIGN, a.place))


def angle_of(sine: Scalar, cosine: Scalar) -> Scalar:
    """The angle of a vector with these components, in (-pi, pi]."""
    return Scalar(sine.tape, sine.tape.perform(K.ANGLE, sine.place, cosine.place))


def largest(numbers: Iterable[Scalar]) -> Scalar:
    """The largest of some numbers, whichever it is."""
    return reduce(lambda a, b: Scalar(a.tape, a.tape.perform(K.MAXIMUM, a.place, b.place)), numbers)


def spread(vectors: Sequence[Vector]) -> Scalar:
    """The most by which one component differs among vectors."""
    tape, (most, least) = (
        vectors[0].tape,
        (
            reduce(partial(vectors[0].tape.perform, operation), (vector.place for vector in vectors))
            for operation in (K.V_MAXIMUM, K.V_MINIMUM)
        ),
    )
    return Scalar(tape, tape.perform(K.LARGEST, tape.perform(K.V_SUBTRACT, most, least)))
