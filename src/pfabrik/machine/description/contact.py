"""How one body touches another: the joint that a contact is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import require_known
from ...errors import InvalidArgument
from .form_faults import shown
from .joints import Joint, JointType

ContactType: TypeAlias = Literal["point", "edge", "pinned", "flat"]

JOINTS: dict[str, JointType] = {"point": "spherical", "edge": "revolute", "pinned": "revolute", "flat": "fixed"}
"""What each contact is: a point stays and turns freely, an edge is rolled about, what is pinned turns about one line
without friction, and what is flat stays as it is."""


class ContactFields(TypedDict, total=False):
    """A contact in full, in the frame of the part that touches: see `Contact`."""

    type: ContactType
    at: ArrayLike
    axis: ArrayLike


ContactLike: TypeAlias = ContactType | ContactFields


class Contact(NamedTuple):
    """A contact of a part, in the part's own frame.

    Attributes
    ----------
    type : a key of `JOINTS`.
    at : where it touches, (3,) [length].
    axis : of an edge along it, of what is pinned the line it turns about, (3,); None for the normal of the ground.
    """

    type: ContactType
    at: Floats
    axis: Floats | None

    def scaled(self, factor: float) -> Contact:
        """The contact with lengths in another unit."""
        return self._replace(at=factor * self.at)

    def joint(self, name: str, connects: tuple[str, str], frame: Floats, normal: Floats) -> Joint:
        """The joint that it is.

        Parameters
        ----------
        frame : of the part, in base coordinates at home, (4, 4) [length].
        normal : of what it touches, (3,).
        """
        kind = JOINTS[self.type]
        at = frame[:3, :3] @ self.at + frame[:3, 3]
        axis = None if kind != "revolute" else normal if self.axis is None else frame[:3, :3] @ self.axis
        return Joint(name, kind, connects, at, axis)


def as_contact(argument: str, given: Any) -> Contact:
    """A contact from its type, or from its fields; InvalidArgument for anything else."""
    fields: Mapping[str, Any] = given if isinstance(given, Mapping) else {"type": given}
    require_known(f"field of {argument}", fields, ("type", "at", "axis"))
    kind = fields.get("type")
    if not isinstance(kind, str) or kind not in JOINTS:
        raise InvalidArgument(
            argument, shown(given), f"{_either(list(JOINTS))}, or a mapping with `type`, `at`, `axis`"
        )
    at = array(f"{argument}: at", fields.get("at", (0.0, 0.0, 0.0)), "3")
    axis = fields.get("axis")
    if (axis is None and kind == "edge") or (axis is not None and JOINTS[kind] != "revolute"):
        found, expected = (
            ("none", "the direction of the edge") if axis is None else (shown(axis), f"none, for a {kind}")
        )
        raise InvalidArgument(f"{argument}: axis", found, expected)
    if axis is not None:
        axis = array(f"{argument}: axis", axis, "3")
        if not np.any(axis):
            raise InvalidArgument(f"{argument}: axis", "a zero vector", "a direction")
    return Contact(kind, at, axis)  # type: ignore[arg-type]


def as_contacts(argument: str, given: Any, default: ContactType = "point") -> dict[str, Contact]:
    """Contacts by the names of parts: of a list of names, all as the default."""
    if isinstance(given, Iterable) and not isinstance(given, str | bytes | Mapping):
        names = list(given)
        given = dict.fromkeys(names, default) if all(isinstance(each, str) for each in names) else names
    if not isinstance(given, Mapping) or not given:
        raise InvalidArgument(argument, shown(given), "contacts by the names of what touches, such as {'FL': 'point'}")
    return {name: as_contact(f"{argument}['{name}']", value) for name, value in given.items()}


def _either(words: list[str]) -> str:
    return f"{', '.join(map(repr, words[:-1]))} or {words[-1]!r}"
