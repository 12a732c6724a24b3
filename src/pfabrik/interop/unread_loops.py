"""Elements of a model that bind two bodies in a way that is not read: refused by name, for dropped they open a loop."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from xml.etree import ElementTree as ET

from ..errors import Fault

HARMLESS = ("material", "visual", "inertial", "sensor", "plugin", "transmission", "ros2_control", "group")
"""Elements that may name several bodies and bind none, besides those with `collision` in their names."""


def unread_loops(
    element: ET.Element, bodies: Collection[str], root: str, known: Collection[frozenset[str]], remedy: str
) -> Iterator[Fault]:
    """Yield the innermost elements in one that name two bodies, or a parent and a child, each as a fault.

    Parameters
    ----------
    root : the body that others hang on; what binds it alone, as to the world, closes no loop.
    known : pairs of bodies whose loop is described elsewhere.
    remedy : what is expected in place of such an element.
    """
    tag = _tag(element)
    if tag in HARMLESS or "collision" in tag:
        return
    inner = [fault for child in element for fault in unread_loops(child, bodies, root, known, remedy)]
    yield from (replace(fault, place=f"<{tag}>{fault.place}") for fault in inner)
    names = dict.fromkeys(_names(element, bodies))
    keys = {*element.attrib, *map(_tag, element)}
    is_pair = {"parent", "child"} <= keys and set(names) != {root}
    if not inner and (len(names) > 1 or is_pair) and frozenset(names) not in known:
        between = " and ".join(f"'{name}'" for name in names) or "two bodies"
        name = element.get("name")
        yield Fault(f"<{tag}>" + (f" '{name}'" if name else ""), f"a bond of {between} that is not read", remedy)


def _tag(element: ET.Element) -> str:
    """The name of an element, without its namespace."""
    return str(element.tag).rsplit("}", 1)[-1]


def _names(element: ET.Element, bodies: Collection[str]) -> Iterator[str]:
    """Yield the bodies that attributes and texts in an element name, outside harmless ones."""
    if _tag(element) in HARMLESS or "collision" in _tag(element):
        return
    for text in (*element.attrib.values(), element.text or ""):
        words = [text.strip()] if text.strip() in bodies else text.replace(",", " ").split()
        if all(word in bodies for word in words):
            yield from words
    for child in element:
        yield from _names(child, bodies)
