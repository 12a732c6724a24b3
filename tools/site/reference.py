"""Write docs/reference/: the pages of the public names. Run it as `python tools/site/reference.py`."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pfabrik as pf

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "reference"
START = """# Python

Everything is in the package itself: `import pfabrik as pf`. Lengths are in the machine's own unit, angles in radians; a
pose is a 4x4 matrix from platform to base coordinates; batch axes come first. L is the characteristic length of a
machine; `Floats`, `Ints` and `Mask` are NumPy arrays of float, int and bool. These pages have the docstring of every
public name, on the site that `make docs` builds in `site/`; in Python, `help(pf.solve_ik)` says the same.

| page | names |
|---|---|
"""


class Page(NamedTuple):
    """A page: its title, its first sentences, and the names on it, without the `pf.` before them.

    `parts` are classes that only results have, by the files that they are in.
    """

    title: str
    words: str
    names: str
    parts: str = ""


PAGES = {
    "machines": Page(
        "Machines",
        "A machine is a `Mechanism`: joints between bodies, read from a file by `load`, or made of joints or legs "
        "in Python. It never changes; methods with `with_` in their names return another one.",
        "Mechanism Joint Cone Leg Shape Mass load save catalog decompose SubChain stand grasp join",
        "machine.description.joint_coordinates.JointCoordinate machine.decomposition.decompose.Split "
        "machine.decomposition.positions.Parallelogram",
    ),
    "solving": Page(
        "Solving",
        "`solve_ik` goes from poses to actuators and `solve_fk` back; both return a `Solution` that says what was "
        "reached. The other names follow a path, repeat calls without allocation, or list all solutions.",
        "pose solve_ik solve_fk track sweep Options Solver Live configuration feasibility Feasibility working_modes "
        "WorkingModes assembly_modes AssemblyModes search_log SearchLog",
        "engines.joints.attempts.Attempt",
    ),
    "answers": Page(
        "Answers",
        "An answer is a `Solution`, of one target or of a batch, with a `Status` for each. What stops it is an "
        "`ActiveLimit`, and `margins` says how far every limit is.",
        "Solution Status ActiveLimit Track margins closure_residual",
        "answers.along.Extremes common.printed.ResultTable",
    ),
    "reach": Page(
        "Reach",
        "How far an end effector goes from where it is, what it can reach in all, and how near links come to each "
        "other. Each result names the limits that end it.",
        "travel Travel workspace Workspace Inscribed clearance Clearance",
        "travel.Reach",
    ),
    "proofs": Page(
        "Proofs",
        "`certify` proves for every pose of a region that it is reached; `largest` finds the largest region of a "
        "shape for which it can. Both are for machines whose legs have closed forms.",
        "certify Certificate PoseRegion Enclosure largest Largest",
        "capabilities.certify.certificates.Refutation",
    ),
    "design": Page(
        "Design",
        "`design` finds dimensions for what a machine must do, with a proof of its margins. Requirements are in "
        "`pf.keep`.",
        "design Design Designs " + " ".join(f"keep.{name}" for name in pf.keep.__all__),
        "capabilities.design.found_design.Binding capabilities.design.found_design.DesignRound",
    ),
    "first-order": Page(
        "First order",
        "What holds to first order at a configuration: freedoms, Jacobians, and distances from singularities. "
        "`singularity_map` shows these over a workspace or along a path.",
        "mobility Mobility NearlyFree inverse_jacobian forward_jacobian singularity Singularity singularity_map "
        "SingularityMap SingularityTrack",
    ),
    "statics": Page(
        "Forces, stiffness, accuracy",
        "What actuators exert and can hold, how far the end effector gives way, and how far off it may be. All of "
        "it is to first order, at a configuration or a batch of them.",
        "forces Forces wrench_capacity WrenchCapacity transmission Transmission Factors stiffness Stiffness "
        "accuracy PoseAccuracy",
    ),
    "dynamics": Page(
        "Inverse dynamics",
        "What actuators exert to move the masses of a machine, along a path or at a configuration. Forces are in N, "
        "moments in N m, whatever the machine's unit of length.",
        "inverse_dynamics Efforts Sizing mass_matrix identify Identification BaseParameter",
    ),
    "calibration": Page(
        "Calibration",
        "A real machine differs from its drawing by `parameters`; `calibrate` finds them from `Measurements`. The "
        "result says which of them the measurements determine, and how well.",
        "parameters Parameters sensitivity Sensitivity Measurements read_measurements read_printer calibrate "
        "Calibration plot_calibration",
        "capabilities.calibration.calibration.ParameterValue capabilities.calibration.calibration.Suspect "
        "capabilities.calibration.printer_settings.Printer",
    ),
    "paths": Page(
        "Paths and time",
        "`read_path` makes targets of a table or of G-code, which `track` follows; `time_path` is how fast that "
        "may be. `platform_speed` is the highest speed at one configuration.",
        "read_path time_path Timed platform_speed PlatformSpeed",
        "capabilities.paths.path.Path capabilities.timing.platform_speed.PlatformSpeeds "
        "capabilities.timing.timed.Exceeded",
    ),
    "controllers": Page(
        "Controllers and learning",
        "`actuation` maps the joints of a serial model to motors, and back. The exports write kinematics that need "
        "this library no more: C for a controller, tensors for learning, a page for a browser.",
        "actuation Actuation export_c export_ros2_control export_ros2_node export_web export_tensors export_numpy "
        "export_torch export_jax",
        "capabilities.actuation.named_values.Mapped capabilities.actuation.actuation.Gains "
        "capabilities.actuation.actuation.LimitMargin capabilities.actuation.drive_limits.HalfSpaces "
        "capabilities.actuation.hull.Hull capabilities.actuation.sample.Sample",
    ),
    "pictures": Page(
        "Pictures",
        "Drawings of machines, answers, paths and travel with Matplotlib, films, and a viewer in the browser. "
        "Orange is what is at a limit.",
        "plot plot_track plot_travel animate view Viewer",
    ),
    "errors": Page(
        "Errors",
        "Every error that the library raises on purpose is a `pf.errors.PfabrikError`, and also the `ValueError`, "
        "`KeyError` or `ImportError` that one would expect. Its message names the culprit, what was found and what "
        "was expected.",
        " ".join(f"errors.{name}" for name in pf.errors.__all__),
    ),
    "passes": Page(
        "The paper's method",
        "P-FABRIK as its paper has it: forward and backward passes over joint positions. `solve_ik` and `track` do "
        "not use it.",
        " ".join(f"passes.{name}" for name in pf.passes.__all__),
    ),
    "interop": Page(
        "MuJoCo and URDF",
        "Mechanisms from MuJoCo models, URDF and SDF, and back. `from_sdf` is `from_urdf` under another name.",
        " ".join(f"interop.{name}" for name in pf.interop.__all__ if name != "from_sdf"),
        "exchange.interop.referee.Travelled",
    ),
}


def main() -> None:
    """Write the pages; those that are no longer there go."""
    FOLDER.mkdir(exist_ok=True)
    for stale in set(FOLDER.glob("*.md")) - {FOLDER / name for name in pages()}:
        stale.unlink()
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


def pages() -> dict[str, str]:
    """The texts of the pages by the names of their files."""
    lines = [f"| [{page.title}]({name}.md) | {names_of(page)} |\n" for name, page in PAGES.items()]
    return {"index.md": START + "".join(lines)} | {f"{name}.md": text_of(page) for name, page in PAGES.items()}


def names_of(page: Page) -> str:
    """The names on a page, in one line."""
    return ", ".join(f"`{name.rpartition('.')[2]}`" for name in page.names.split())


def parts_of(page: Page) -> list[tuple[str, str]]:
    """The classes that only results have: their names, and where they are."""
    return [(place.rpartition(".")[2], f"pfabrik.{place}") for place in page.parts.split()]


def text_of(page: Page) -> str:
    """The text of a page: its first sentences, a table of its names, and where each docstring goes."""
    public_names = [(f"pf.{name}", place_of(name)) for name in page.names.split()]
    rows = [f"| [{name}][{place}] | {first_line(place)} |\n" for name, place in public_names]
    head = f"# {page.title}\n\n{page.words}\n\n| name | |\n|---|---|\n"
    return head + "".join(rows) + "".join(section(*each) for each in public_names + parts_of(page))


def section(heading: str, place: str) -> str:
    """Where the docstring of a name goes, below its own heading."""
    return f"\n::: {place}\n    options:\n      heading: {heading}\n      toc_label: {heading}\n"


def place_of(name: str) -> str:
    """A name as the site finds it: public, but where a file or folder has this name too."""
    place, head = Path(pf.__file__).parent / name.replace(".", "/"), name.partition(".")[0]
    is_elsewhere = head != name and public(head).__name__ != f"pfabrik.{head}"  # a module that lies deeper
    if place.exists() or place.with_suffix(".py").exists() or is_elsewhere:
        return f"{public(name).__module__}.{name.rpartition('.')[2]}"
    return f"pfabrik.{name}"


def first_line(place: str) -> str:
    """The first line of the docstring of what is at a place."""
    return (inspect.getdoc(at(place)) or "").partition("\n")[0]


def at(place: str) -> object:
    """What a module has under a name."""
    module, _, name = place.rpartition(".")
    return getattr(importlib.import_module(module), name)


def public(name: str) -> object:
    """What a name stands for."""
    value: object = pf
    for part in name.split("."):
        value = getattr(value, part)
    return value


def public_names() -> Iterator[str]:
    """All public names, without the `pf.` before them."""
    for name in pf.__all__:
        if inspect.ismodule(getattr(pf, name)):
            yield from (f"{name}.{inner}" for inner in getattr(pf, name).__all__)
        elif name != "__version__":
            yield name


if __name__ == "__main__":
    main()
