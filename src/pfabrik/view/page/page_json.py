"""Data as JSON that a page reads, also within its text."""

from __future__ import annotations

import json
import re
from typing import Any


def as_json(data: Any) -> str:
    """JSON that ends no script; a number beyond all is written as one that reads as infinite, and none as null."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    text = re.sub(r"(?<=[\[:,])NaN(?=[\],}])", "null", text)
    return re.sub(r"(?<=[\[:,])(-?)Infinity(?=[\],}])", r"\g<1>1e999", text).replace("<", "\\u003c")
