"""Write docs/gallery.md, all machines and tasks as pictures: `python tools/site/gallery.py`, when there are new ones.

`python tools/site/portraits.py NAME` takes the picture of a new machine before. On the site each machine of the gallery
has a page that this module writes too: the machine live, as `pf.export_web` makes it, its file, and six lines of Python
with what they print.
"""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import cards
import numpy as np

import pfabrik as pf
from pfabrik.engines.chains.serial_chain import is_chain
from pfabrik.errors import InvalidArgument
from pfabrik.machine.catalog import catalog_file, description
from pfabrik.machine.description.plane import plane_of
from pfabrik.machine.model import model_of

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "gallery.md"
HEAD = """# Gallery

Machines of the catalogue. On the site that `make docs` builds each opens live: drag the platform, and see how far it
goes and what stops it. `pfabrik export NAME --web page.html` makes such a page of any machine of legs, yours too.

"""
LIVE_HEAD = """# Gallery

Click a machine and drag it, here in the page: it goes where it can, and says what stops it. No server is asked: the
page has the library's own kernels in it. `pfabrik export my_machine.toml --web page.html` makes such a page of yours.

"""
KINDS = SIX, SLIDING, TILTING, PLANAR, ARMS = (
    "Move and turn",
    "Move without turning",
    "Tilt",
    "In a plane",
    "Arms",
)
TASKS = "\n## Done with it\n\nEach is a program that runs, with what it prints and draws.\n\n"
MANY = 12  # actuators that a page lists
BENT = 0.2  # of a stretched machine's length: to the side
NEAR, FAR = 0.5, 1.4  # of the way to a limit: a target within reach, and one beyond
ROUNDING = 1e-9  # of coordinates at home, which is exact to some digits less


def page() -> str:
    """The page as it is kept: pictures with links to the catalogue and to the tasks."""
    return HEAD + machines("mechanisms.md#{}") + TASKS + cards.table(tasks())


def machines(page_of: str) -> str:
    """The machines of the catalogue by what they do, as tables of pictures."""
    groups: dict[str, list[cards.Card]] = {kind: [] for kind in KINDS}
    for name in pf.catalog():
        groups[kind_of(pf.load(name))].append(cards.Card(title(name), picture(name), page_of.format(name)))
    return "\n".join(f"## {kind}\n\n{cards.table(group)}" for kind, group in groups.items() if group)


def kind_of(machine: pf.Mechanism) -> str:
    """What a machine does, as one of `KINDS`."""
    if is_chain(model_of(machine)):
        return ARMS
    if plane_of(machine) is not None:
        return PLANAR
    if {"x", "y", "z"} <= set(machine.task):
        return SIX if "rotation" in machine.task else SLIDING
    return TILTING


def picture(name: str) -> str:
    """A machine as its live page shows it, if it has one."""
    live = f"pictures/live/{name}.webp"
    return live if (DOCS / live).exists() else f"pictures/{name}.png"


def title(name: str) -> str:
    """What a machine is, in a few words."""
    return description(name).partition(":")[0]


def tasks() -> list[cards.Card]:
    """The pages of tasks, each with its first picture."""
    made = []
    for path in sorted((DOCS / "tasks").glob("*.md")):
        text = path.read_text(encoding="utf-8")
        picture = re.search(r"^!\[.*?\]\((.*?)\)", text, re.MULTILINE)
        assert picture, path
        made.append(cards.Card(text.partition("\n")[0].removeprefix("# "), f"tasks/{picture[1]}", f"tasks/{path.name}"))
    return made


def write(site: Path) -> None:
    """The gallery of the site, and a page for each machine."""
    text = cards.grid(LIVE_HEAD + machines("gallery/{}.md") + TASKS + cards.table(tasks()), site)
    (site / "gallery.md").write_text(f"---\nhide: [navigation, toc]\n---\n{text}", encoding="utf-8")
    (site / "gallery" / "live").mkdir(parents=True)
    for name in pf.catalog():
        (site / "gallery" / f"{name}.md").write_text(machine_page(name, site), encoding="utf-8")


def machine_page(name: str, site: Path) -> str:
    """The page of a machine."""
    code = six_lines(name)
    names = pf.catalog()
    place = names.index(name)
    before, after = names[place - 1], names[(place + 1) % len(names)]
    sentence = description(name).partition(":")[2].strip()
    return f"""---
title: {title(name)}
hide: [navigation, toc]
---
# {title(name)}

{sentence[:1].upper()}{sentence[1:]}

{stage(name, site)}

<div class="beside" markdown>
<div markdown>
### In Python

```python
{code}
```

```text
{printed(code)}
```
</div>
<div markdown>
### Its file

```toml title="{name}.toml"
{catalog_file(name).read_text(encoding="utf-8").strip()}
```
</div>
</div>

[← {title(before)}]({before}.md) · [All machines](../gallery.md) · [What is counted of it](../mechanisms.md#{name}) ·
[{title(after)} →]({after}.md)
{{ .others }}
"""


def stage(name: str, site: Path) -> str:
    """The machine, live; or a picture of one that needs the program."""
    file = site / "gallery" / "live" / f"{name}.html"
    try:
        pf.export_web(pf.load(name), file)
    except InvalidArgument:
        return f"""![{title(name)} at home](../pictures/{name}.png)

A page cannot answer for this machine, whose chains have no closed form. The viewer, where the program answers, can:

```
pfabrik view {name}
```"""
    size = round(file.stat().st_size / 1000)
    return f"""{frame(name, title(name))}

[The machine alone](live/{name}.html): one file of {size} kB, which works without a network. Made by
`pfabrik export {name} --web {name}.html`.
{{ .under }}"""


def write_free(name: str, site: Path) -> str:
    """Write the page of a machine whose joints have no limits; its name."""
    free = f"{name}_without_limits"
    pf.export_web(pf.load(name).without_limits(), site / "gallery" / "live" / f"{free}.html")
    return free


def frame(file: str, name: str, gallery: str = "") -> str:
    """A page of a machine in another page, which the folder of the gallery is named relative to."""
    source = f"{gallery}live/{file}.html"
    return f'<iframe class="live" src="{source}" title="{name}, live" loading="lazy"></iframe>'


def six_lines(name: str) -> str:
    """A program about a machine: a target within reach, and one beyond a limit."""
    machine = pf.load(name)
    near, far = targets(machine)
    shown = "near.table()" if len(machine.drives) <= MANY else "near.status.name, near.position_error < 1e-6"
    return f"""import pfabrik as pf

machine = pf.load("{name}")
near = pf.solve_ik(machine, {near})
far = pf.solve_ik(machine, {far})
print({shown})
print(far.reason)"""


def targets(machine: pf.Mechanism) -> tuple[str, str]:
    """A target within reach and one beyond, in Python: along the axis that fewest limits end, or else about one."""
    place = machine.home_pose[:3, 3]
    home = pf.solve_ik(machine, machine.home_pose)
    reaches = [reach for reach in pf.travel(home) if reach.stopped_by] if len(machine.drives) <= MANY else []
    for reach in sorted(reaches, key=lambda reach: (reach.kind != "along", len(reach.stopped_by), -reach.distance)):
        near, far = (share * reach.distance * np.array(reach.direction) for share in (NEAR, FAR))
        if reach.kind == "along":
            if pf.solve_ik(machine, place + far).status != pf.Status.REACHED:  # it may be reached from another side
                return _numbers(place + near), _numbers(place + far)
        else:
            assert np.allclose(machine.home_pose[:3, :3], np.eye(3)), machine
            return _turned(near), _turned(far)
    across = np.array([0, BENT * np.linalg.norm(place), 0])  # a snake at home is stretched
    return _numbers(NEAR * place + across), _numbers(FAR * place + across)


def _turned(way: np.ndarray) -> str:
    """The pose at home turned by a rotation vector along an axis, in whole degrees."""
    return f"pf.pose(machine.home_pose[:3, 3], rpy={_numbers(np.degrees(way).round())}, degrees=True)"


def _numbers(values: np.ndarray) -> str:
    """Three numbers of three digits."""
    rounded = [0.0 if abs(value) < ROUNDING else float(f"{value:.3g}") for value in values]
    return f"[{', '.join(f'{value:g}' for value in rounded)}]"


def printed(code: str) -> str:
    """What a program prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, "<gallery>", "exec"), {"__name__": "__main__"})
    return out.getvalue().rstrip()


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
