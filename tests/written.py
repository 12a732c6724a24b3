"""What is in a file that was written, by its ending: pictures that show something, rows with numbers, machines."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import pfabrik as pf
from command import rows_of


def check_written(path: Path) -> None:
    """Fail if a file is empty, or has no more than what all files of its kind begin with."""
    CHECKS.get(path.suffix, check_text)(path)


def drawn(image: Any) -> float:
    """The share of pixels that differ from the ground, the colour of most."""
    counts = [count for count, _ in image.convert("RGB").getcolors(1 << 24) or []]
    return 1.0 - max(counts) / sum(counts)


def check_png(path: Path) -> None:
    from PIL import Image

    with Image.open(path) as image:
        assert drawn(image) > 0.01


def check_gif(path: Path) -> None:
    from PIL import Image, ImageSequence

    with Image.open(path) as film:
        frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(film)]
    assert all(drawn(frame) > 0.01 for frame in frames)
    assert len({frame.tobytes() for frame in frames}) > 1


STROKES = 20
"""Lines, areas and letters that are more than the ground of a picture, its axes, and their ground."""


def check_svg(path: Path) -> None:
    tags = [each.tag.rpartition("}")[2] for each in ElementTree.parse(path).iter()]
    assert sum(tag in ("path", "use") for tag in tags) > STROKES


def check_pdf(path: Path) -> None:
    """Operators that fill, stroke, or show text, in streams that can be read."""
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", path.read_bytes(), re.DOTALL)
    texts = [zlib.decompress(each) for each in streams if each[:1] == b"\x78"]
    assert sum(len(re.findall(rb"(?m)^(?:[SfB]\*?|.* Tj|.* TJ)$", text)) for text in texts) > STROKES


def check_csv(path: Path) -> None:
    rows = rows_of(path)
    assert rows
    for row in rows:
        numbers = [float(cell) for cell in row.values() if re.fullmatch(r"[-+0-9.e]+|nan|inf", cell or "")]
        assert numbers and all(map(math.isfinite, numbers))


def check_npz(path: Path) -> None:
    with np.load(path) as arrays:
        assert arrays["size"] > 0.0
        assert all(arrays[name].size and np.isfinite(arrays[name]).all() for name in ("vertices", "faces"))


def check_toml(path: Path) -> None:
    assert pf.load(path).joints


def check_source(path: Path) -> None:
    compile(path.read_text(encoding="utf-8"), path.name, "exec")
    assert "def " in path.read_text(encoding="utf-8")


def check_mesh(path: Path) -> None:
    """Far more than the head of such a file."""
    assert path.stat().st_size > 1000


def check_text(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").split()) > 10


CHECKS: dict[str, Callable[[Path], None]] = {
    ".png": check_png,
    ".gif": check_gif,
    ".svg": check_svg,
    ".pdf": check_pdf,
    ".csv": check_csv,
    ".npz": check_npz,
    ".toml": check_toml,
    ".py": check_source,
    ".stl": check_mesh,
    ".ply": check_mesh,
}
