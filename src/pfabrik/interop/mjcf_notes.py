"""What a model that this library wrote says of a mechanism beside what MuJoCo has words for."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

from ..description.joints import Cone
from .driving import Rates
from .mjcf_writing import NOTE


def own_notes(root: ET.Element) -> dict[str, Any]:
    """What this library wrote of a mechanism that MuJoCo has no word for."""
    texts = {text.get("name", ""): text.get("data", "") for text in root.iterfind("custom/text")}
    own = {name.removeprefix(NOTE): data for name, data in texts.items() if name.startswith(NOTE)}
    found: dict[str, Any] = {key: own[key] for key in ("base", "end_effector", "reference_point") if key in own}
    if "task" in own:
        found["task"] = tuple(own["task"].split())
    cones = {
        name.removeprefix("cone."): data.split(maxsplit=4) for name, data in own.items() if name.startswith("cone.")
    }
    found["cones"] = {
        name: Cone(list(map(float, parts[:3])), float(parts[3]), parts[4]) for name, parts in cones.items()
    }
    fast, pushed = (
        {name.removeprefix(what): float(data) for name, data in own.items() if name.startswith(what)}
        for what in ("max_speed.", "max_acceleration.")
    )
    found["rates"] = {name: Rates(fast.get(name), pushed.get(name)) for name in {**fast, **pushed}}
    return found
