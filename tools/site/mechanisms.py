"""Write docs/mechanisms.md and docs/pictures/, the catalogue: `python tools/site/mechanisms.py`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib import pyplot
from PIL import Image

import pfabrik as pf
from pfabrik.common.drawing import Theme
from pfabrik.engines.chains.serial_chain import is_chain
from pfabrik.machine.catalog import catalog_file, description
from pfabrik.machine.model import model_of
from pfabrik.view.looks import LOOKS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "mechanisms.md"
PICTURES = PAGE.parent / "pictures"
MANY = 12  # joints of a chain from which equal ones are counted
COLOURS = 64  # of a picture: enough for smooth edges, and a third of the file
DPI = 110
HEAD = """# Mechanisms of the catalogue

Each is loaded by its name, as in `pf.load("stewart")`; in the [gallery](gallery.md) they are to be dragged. The
pictures show home, the base grey and the end effector blue:
actuated joints are filled, pale bars are rails, a cross marks the reference point. In the sub-chains, `*` marks the
actuated joint and `Pa` a parallelogram of pins; [How it works](how-it-works.md) has more on them, and tells the engines
apart. [Adding a mechanism](adding-a-mechanism.md) says how to bring your own.

| name | mechanism | freedoms | actuators |
|---|---|---|---|
"""


def main() -> None:
    """Write the page and its pictures; pictures of what is no longer in the catalogue go."""
    PICTURES.mkdir(exist_ok=True)
    wanted: dict[Path, tuple[str, Theme]] = {
        picture(name, theme): (name, theme) for name in pf.catalog() for theme in LOOKS
    }
    for stale in set(PICTURES.glob("*.png")) - set(wanted):
        stale.unlink()
    for path, (name, theme) in wanted.items():
        draw_picture(path, name, theme)
    PAGE.write_text(page(), encoding="utf-8")


def page() -> str:
    """The text of the page."""
    names = pf.catalog()
    return HEAD + "".join(map(row, names)) + "".join(map(section, names))


def row(name: str) -> str:
    """A machine's line in the table of contents."""
    counted = pf.mobility(pf.load(name))
    kind = description(name).partition(":")[0]
    return f"| [{name}](#{name}) | {kind} | {counted.platform} | {counted.actuators} |\n"


def section(name: str) -> str:
    """What the file says of a machine, its picture, and what follows from its joints."""
    mechanism = pf.load(name)
    first, *rest = header(name)
    facts = {
        "mobility": mobility(pf.mobility(mechanism)),
        "sub-chains": sub_chains(mechanism),
        "engine": engine(mechanism),
        "actuators": actuators(mechanism.actuator_names),
        "task": " ".join(mechanism.task),
    }
    lines = [
        f"\n## {name}\n",
        f"**{first}**\n",
        *[f"{' '.join(rest)}\n"] * bool(rest),
        f"![{mechanism.name}]({PICTURES.name}/{name}.png)\n",
        "| | |\n|---|---|",
        *[f"| {key} | {fact} |" for key, fact in facts.items()],
    ]
    return "\n".join(lines) + "\n"


def actuators(names: Sequence[str]) -> str:
    """The names of actuators; of many the first, the second and the last."""
    shown = [f"`{name}`" for name in names]
    return ", ".join(shown if len(shown) <= 2 * MANY else [*shown[:2], "...", shown[-1]])


def header(name: str) -> list[str]:
    """The comment that a file begins with, line by line: what the machine is, where its dimensions are from."""
    lines = catalog_file(name).read_text(encoding="utf-8").splitlines()
    end = next(place for place, line in enumerate(lines) if not line.startswith("#"))
    return [line.removeprefix("#").strip() for line in lines[:end]]


def mobility(counted: pf.Mobility) -> str:
    """Motions of the whole, those of the end effector among them, and actuators beyond its freedoms."""
    parts = f"{counted.platform} of the end effector, {counted.internal} internal, {counted.idle} idle"
    return f"{counted.mobility}: {parts}; redundancy {counted.redundancy}"


def sub_chains(mechanism: pf.Mechanism) -> str:
    """The distinct sub-chains, how often each occurs, and how long the rods of its parallelograms are."""
    counts = Counter((short(str(chain)), rods(chain, mechanism)) for chain in pf.decompose(mechanism))
    return ", ".join(f"{count} × `{notation}`{rods}" for (notation, rods), count in counts.items())


def short(notation: str) -> str:
    """A sub-chain's notation; of many equal joints one, and how many."""
    joints = notation.split("-")
    return notation if len(joints) <= MANY or len(set(joints)) > 1 else f"{joints[0]}-... ({len(joints)} times)"


def rods(chain: pf.SubChain, mechanism: pf.Mechanism) -> str:
    """The parallelograms of a sub-chain in words; nothing where it has none."""
    unit = mechanism.length_unit
    words = [f"{each.length:.6g} {unit} long, {each.width:.6g} {unit} apart" for each in chain.parallelograms]
    return f" (parallelogram of rods {'; '.join(words)})" if words else ""


def engine(mechanism: pf.Mechanism) -> str:
    """The engine that answers first, and why it is not the quick one."""
    model = model_of(mechanism)
    if not model.why_no_legs:
        return "legs"
    return "chains" if is_chain(model) else f"closure, without closed forms: {model.why_no_legs}"


def picture(name: str, theme: str = "light") -> Path:
    """The picture of a machine for pages of a theme."""
    return PICTURES / (f"{name}.png" if theme == "light" else f"{name}-{theme}.png")


def draw_picture(path: Path, name: str, theme: Theme) -> None:
    """Draw a machine at home in few colours, for dark pages on no ground; the file names neither program nor time."""
    matplotlib.use("Agg")
    is_clear = theme == "dark"
    figure = pf.plot(pf.load(name), theme=theme).figure
    for ground in (figure.patch, *(axes.patch for axes in figure.axes)) if is_clear else ():
        ground.set_alpha(0.0)
    figure.set_dpi(DPI)
    figure.canvas.draw()
    image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba()))
    pyplot.close(figure)
    if is_clear:
        few = image.quantize(COLOURS, method=Image.Quantize.FASTOCTREE)  # the only way that knows what is clear
    else:
        few = image.convert("RGB").quantize(COLOURS)
    few.save(path, optimize=True)


if __name__ == "__main__":
    main()
