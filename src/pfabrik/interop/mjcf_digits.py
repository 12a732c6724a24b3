"""How exactly the digits of a MuJoCo model place its bodies, joints and equalities."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from .digits import FEWEST, NOTHING, Rounding, digits_of

STRAIGHT = 1e-12
"""How far from a coordinate axis, or from no rotation, what a file gives in whole numbers is at most."""


class ModelDigits:
    """The roundings of a compiled model, from the numbers in its text; lengths in metres."""

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
        """Of a joint of the model."""
        is_skew = np.abs(self.model.jnt_axis[index]).max() < 1.0 - STRAIGHT
        body = self.bodies[self.model.jnt_bodyid[index]]
        return self._placed(body, self.model.jnt_pos[index], self._axis if is_skew else 0.0)

    def site(self, index: int) -> Rounding:
        """Of a site."""
        body = self.bodies[self.model.site_bodyid[index]]
        return self._placed(body, self.model.site_pos[index], self._turned(self.model.site_quat[index]))

    def anchor(self, body: int, offset: ArrayLike, is_computed: bool) -> Rounding:
        """Of a point of a body, at an offset (3,); that of the second body of an equality is computed by MuJoCo."""
        return self.bodies[body].on(offset, 0.0, 0.0) if is_computed else self._placed(self.bodies[body], offset, 0.0)

    def _placed(self, body: Rounding, offset: ArrayLike, angle: float) -> Rounding:
        return body.on(offset, float(np.linalg.norm(self._length.errors(offset))), angle)

    def _turned(self, quat: Floats) -> float:
        """Of the rotation of a body or site in its parent [rad]."""
        if abs(quat[0]) >= 1.0 - STRAIGHT:
            return 0.0
        return max(self._turn, 2.0 * float(np.linalg.norm(self._quat.errors(quat))))


def _texts(plain: ET.Element, *keys: str) -> Iterator[str]:
    for element in plain.iter():
        yield from (element.attrib[key] for key in keys if key in element.attrib)


def _turns(plain: ET.Element) -> Iterator[float]:
    """By how much rounding turned what is turned in each other way than by a quaternion, at most [rad]."""
    compiler = plain.find("compiler")
    radian = compiler is not None and compiler.get("angle") == "radian"
    unit, fewest = (1.0, FEWEST - 1) if radian else (np.pi / 180.0, FEWEST)
    euler, about = list(_texts(plain, "euler")), list(_texts(plain, "axisangle"))
    for texts in (euler, [" ".join(text.split()[3:]) for text in about]):
        digits = digits_of(texts, fewest)
        yield from (unit * float(np.linalg.norm(digits.errors(_numbers(text), fewest))) for text in texts)
    yield from _of_vectors([" ".join(text.split()[:3]) for text in about])
    yield from _of_vectors(list(_texts(plain, "zaxis")))
    both = list(_texts(plain, "xyaxes"))
    yield from _of_vectors([part for text in both for part in (" ".join(text.split()[:3]), " ".join(text.split()[3:]))])


def _of_vectors(texts: list[str]) -> Iterator[float]:
    """By how much rounding turned directions that are given in texts [rad]."""
    digits = digits_of(texts)
    for vector in map(_numbers, texts):
        if np.count_nonzero(vector) > 1:
            yield float(np.linalg.norm(digits.errors(vector)) / np.linalg.norm(vector))


def _numbers(text: str) -> Floats:
    return np.array([float(word) for word in text.split()])
