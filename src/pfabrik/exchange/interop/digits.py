"""The digits of a file, and how exactly they place the bodies and joints of a model."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from ...common.arrays import Floats

FEWEST = 4
"""Significant digits from which a number was rounded: one typed in full (`0.25`) rarely has more than three."""

HALF = 0.5
"""Units of its last digit by which rounding changes a number at most."""

STRAIGHT = 1e-12
"""Distance from a coordinate axis, or from no rotation, up to which a file gives it in whole numbers."""


class Rounding(NamedTuple):
    """The largest error that the digits of a file put on a joint: on its point [length] and its axis [rad]."""

    length: float
    angle: float

    def on(self, offset: ArrayLike, length: float, angle: float) -> Rounding:
        """The rounding of something on a body of this rounding, at an offset (3,), with a length and an angle more."""
        arm = float(np.linalg.norm(offset))
        return Rounding(self.length + self.angle * arm + length, self.angle + angle)


NOTHING = Rounding(0.0, 0.0)


def worst(roundings: Iterable[Rounding]) -> Rounding:
    """The largest length and the largest angle; nothing of none."""
    each = [NOTHING, *roundings]
    return Rounding(max(one.length for one in each), max(one.angle for one in each))


@dataclass(frozen=True)
class Digits:
    """The rounding of numbers of one kind: to significant digits, or to decimals (`decimals` is then not None)."""

    significant: int = 17
    decimals: int | None = None

    def error(self, values: ArrayLike, fewest: int | None = None) -> float:
        """The largest error of numbers together, the norm of theirs, from their rounding.

        Parameters
        ----------
        fewest : significant digits from which a number counts as rounded at its own last digit, even where others of
            the file have more; None where it does not.
        """
        return math.hypot(*(self._error(float(value), fewest) for value in np.ravel(values)))

    def _error(self, value: float, fewest: int | None) -> float:
        if self.decimals is not None:
            places = self.decimals
        elif value == 0.0:
            return 0.0
        else:
            places = self.significant - 1 - math.floor(math.log10(abs(value)))
        if fewest is not None:
            shape = _shape(repr(value))
            if shape is not None and shape[0] >= fewest:
                places = shape[1]
        return HALF * 10.0 ** -min(places, 300)


def digits_of(texts: Iterable[str], fewest: int = FEWEST - 1) -> Digits:
    """The rounding of the numbers in some texts, with blanks between them.

    The number of digits that most long numbers have: significant ones, or, if more of them agree in these, decimals.
    Numbers that are all short are taken as rounded if some have `fewest` significant digits, else as exact.
    """
    shapes = [shape for text in texts for word in text.split() if (shape := _shape(word)) is not None]
    long = [shape for shape in shapes if shape[0] >= FEWEST]
    if not long:
        long = [shape for shape in shapes if shape[0] >= fewest]
        return Digits(significant=max(n for n, _ in long)) if long else Digits()
    significant, agree = _most_common(n for n, _ in long)
    decimals, agree_fixed = _most_common(d for _, d in long)
    return Digits(significant, decimals if agree_fixed > agree else None)


def _most_common(counts: Iterable[int]) -> tuple[int, int]:
    """The value met most often, of several the largest, and how often."""
    return max(Counter(counts).items(), key=lambda each: (each[1], each[0]))


def _shape(word: str) -> tuple[int, int] | None:
    """Significant digits and decimals of a number as it is written, without the zeros at its end; None of 0."""
    try:
        parts = Decimal(word).normalize().as_tuple()
    except InvalidOperation:
        return None
    if not isinstance(parts.exponent, int) or not any(parts.digits):
        return None
    return len(parts.digits), -parts.exponent


class ModelDigits:
    """The roundings of a compiled model, from the numbers in its text [m, rad]; `bodies` has those of all bodies."""

    def __init__(self, plain: ET.Element, model: Any) -> None:
        self.model = model
        self._length = digits_of(_texts(plain, "pos", "anchor"))
        self._quat = digits_of(_texts(plain, "quat"))
        self._turn = max(_turns(plain), default=0.0)
        self._axis = max(_of_vectors(list(_texts(plain, "axis"))), default=0.0)
        self.bodies: list[Rounding] = [NOTHING]
        for index in range(1, model.nbody):
            parent = self.bodies[model.body_parentid[index]]
            self.bodies.append(self._placed(parent, model.body_pos[index], self._turned(model.body_quat[index])))

    def joint(self, index: int) -> Rounding:
        """The rounding of a joint."""
        is_skew = np.abs(self.model.jnt_axis[index]).max() < 1.0 - STRAIGHT
        body = self.bodies[self.model.jnt_bodyid[index]]
        return self._placed(body, self.model.jnt_pos[index], self._axis if is_skew else 0.0)

    def site(self, index: int) -> Rounding:
        """The rounding of a site."""
        body = self.bodies[self.model.site_bodyid[index]]
        return self._placed(body, self.model.site_pos[index], self._turned(self.model.site_quat[index]))

    def anchor(self, body: int, offset: ArrayLike, is_computed: bool) -> Rounding:
        """The rounding of a point on a body, at an offset (3,); MuJoCo computes that on an equality's second body."""
        return self.bodies[body].on(offset, 0.0, 0.0) if is_computed else self._placed(self.bodies[body], offset, 0.0)

    def _placed(self, body: Rounding, offset: ArrayLike, angle: float) -> Rounding:
        return body.on(offset, self._length.error(offset), angle)

    def _turned(self, quat: Floats) -> float:
        """The error of the rotation of a body or site in its parent [rad]."""
        if abs(quat[0]) >= 1.0 - STRAIGHT:
            return 0.0
        return max(self._turn, 2.0 * self._quat.error(quat))


def _texts(plain: ET.Element, *keys: str) -> Iterator[str]:
    for element in plain.iter():
        yield from (element.attrib[key] for key in keys if key in element.attrib)


def _turns(plain: ET.Element) -> Iterator[float]:
    """Yield the errors of rotations that are given otherwise than by a quaternion [rad]."""
    compiler = plain.find("compiler")
    radian = compiler is not None and compiler.get("angle") == "radian"
    unit, fewest = (1.0, FEWEST - 1) if radian else (np.pi / 180.0, FEWEST)
    euler, about = list(_texts(plain, "euler")), list(_texts(plain, "axisangle"))
    for texts in (euler, [" ".join(text.split()[3:]) for text in about]):
        digits = digits_of(texts, fewest)
        yield from (unit * digits.error(_numbers(text), fewest) for text in texts)
    yield from _of_vectors([" ".join(text.split()[:3]) for text in about])
    yield from _of_vectors(list(_texts(plain, "zaxis")))
    both = list(_texts(plain, "xyaxes"))
    yield from _of_vectors([part for text in both for part in (" ".join(text.split()[:3]), " ".join(text.split()[3:]))])


def _of_vectors(texts: list[str]) -> Iterator[float]:
    """Yield the errors of directions that are given in texts [rad]."""
    digits = digits_of(texts)
    for vector in map(_numbers, texts):
        if np.count_nonzero(vector) > 1:
            yield digits.error(vector) / float(np.linalg.norm(vector))


def _numbers(text: str) -> Floats:
    return np.array([float(word) for word in text.split()])
