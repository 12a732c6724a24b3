"""``pfabrik import`` and ``verify``: mechanisms of MuJoCo models and robot descriptions, and MuJoCo as the referee."""

from __future__ import annotations

import dataclasses
import math
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import pfabrik as pf

from ..common.cells import is_finite
from .arguments import MECH, Finite, comma_separated, load
from .outputs import OUTPUT, STANDARD, check_outputs, force_option, refuse_existing, whole_file
from .printing import complain, json_option, note, print_json, printing_result

if TYPE_CHECKING:
    from ..exchange.interop import Choice, Imported

DEFAULTS: tuple[object, ...] = ("m", (), [])
"""Values of options that need not be said."""


@click.command("import")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--base", metavar="BODY", help="The body that rests. Default: the world, or the root link.")
@click.option("--end-effector", "--body", metavar="NAME", help="A body, a site, or a joint. Without it: what there is.")
@click.option(
    "--stand",
    metavar="FOOT[:CONTACT],...",
    help="The robot on its feet, each a point, flat, or pinned: a turn is left.",
)
@click.option("--loops", type=click.Path(path_type=Path), metavar="YAML", help="The loops of a URDF, and its motors.")
@click.option(
    "--actuated", metavar="A,B,...", callback=comma_separated, help="Joints that are driven. Default: as the file says."
)
@click.option("--fixed", metavar="A,B,...", callback=comma_separated, help="Joints to hold where they are.")
@click.option("--within", type=Finite(), metavar="D", help="Make parallel, meet or equal what is off by less [m, rad].")
@click.option(
    "--leave-out", multiple=True, metavar="NAME", help="A loop, or a joint that follows, not to bind. May be repeated."
)
@click.option(
    "--task",
    metavar="A,B,...",
    callback=comma_separated,
    help="What targets set, such as z,tilt. Default: what the end effector can do.",
)
@click.option(
    "--configuration", metavar="KEY", help="Home: a keyframe of MuJoCo, or JOINT=VALUE,... [deg or m] of a URDF."
)
@click.option("--unit", default="m", show_default=True, help="Unit of length of the mechanism.")
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@force_option
@json_option("One JSON object on stdout: what was found, and the file's text.")
def import_(file: Path, output: Path, force: bool, as_json: bool, **choices: Any) -> int:
    """Turn a MuJoCo model (MJCF), a URDF or an SDF into a mechanism file.

    FILE is the model. Without --end-effector, its loops are listed, with what they move, and commands to go on with.
    Of a robot, what the end effector does not depend on is left out; loops that are open are closed;
    collision geometry becomes shapes of bodies.
    With --stand, what held the trunk goes, and the feet stay on the ground: the trunk is the end effector.
    All that is left out or changed is told on stderr, by name, with the remarks of `check` on what came out.
    """
    refuse_existing(output, force)
    check_outputs([("-o", output)], [file])
    try:
        model = imported(file, **choices)
    except pf.interop.NoEndEffector as error:
        lines = [commands(each, file, choices) for each in error.choices]
        every = list(zip(error.choices, lines, strict=True))
        if as_json:
            print_json({"choices": [{**dataclasses.asdict(each), "commands": way} for each, way in every]})
        elif every:
            click.echo("\n\n".join("\n".join([str(each), *way]) for each, way in every) + "\n", err=True)
        raise
    except pf.errors.PfabrikError as error:
        for remark in getattr(error, "__notes__", []):
            complain(remark)
        raise
    from ..machine.files import dumps
    from .remarks import remarks_on

    said = [*map(str, model.notes)]
    remarks = [pf.interop.Note(remark) for remark in remarks_on(model.mechanism) if not remark.startswith(tuple(said))]
    model = dataclasses.replace(model, notes=(*model.notes, *remarks))
    name = "".join(letter for letter in file.name if letter.isprintable())
    text = f"# imported from {name}; to compare: pfabrik verify THIS --original {name}\n\n{dumps(model.mechanism)}"
    if as_json:
        print_json(as_object(model, text))
        if output == STANDARD:
            return 0
    for remark in () if as_json else model.notes:
        note(str(remark))
    with whole_file(output, f"; next: pfabrik info {output}") as handle:
        handle.write(text)
    return 0


def commands(choice: Choice, file: Path, given: Mapping[str, Any]) -> list[str]:
    """The command that makes a mechanism of a choice, with the options that were given; none of a refused one."""
    if not choice.options:
        return []
    words = ["pfabrik", "import", str(file), *choice.options]
    for name in ("loops", "actuated", "fixed", "configuration", "unit", "within", "leave_out", "task"):
        option, value = f"--{name.replace('_', '-')}", given.get(name)
        if value is None or option in words or value in DEFAULTS:
            continue
        if name == "leave_out":
            words += [word for each in value for word in (option, each)]
        else:
            words += [option, ",".join(value) if isinstance(value, list) else str(value)]
    return [shlex.join([*words, "-o", f"{choice.base}-{choice.end_effector}.toml".replace("/", "_")])]


def as_object(model: Imported, text: str) -> dict[str, object]:
    """An imported mechanism's name, gap and notes, and the text of its file."""
    return {
        "name": model.mechanism.name,
        "gap": model.gap,
        "unit": model.mechanism.length_unit,
        "notes": [{"what": remark.what, "names": remark.names} for remark in model.notes],
        "file": text,
    }


def imported(
    file: Path,
    loops: Path | None,
    configuration: str | None,
    unit: str,
    fixed: list[str] | None,
    stand: str | None,
    **choices: Any,
) -> Imported:
    """The mechanism in a file, whose kind follows from its first element."""
    choices |= {"fixed": fixed or (), "length_unit": unit, "feet": None if stand is None else _feet(stand)}
    if pf.interop.kind_of(file) != "mjcf":
        home = None if configuration is None else _joint_values(file, configuration)
        return pf.interop.from_urdf(file, loops, configuration=home, **choices)
    if loops is not None:
        raise click.UsageError("--loops: a MuJoCo model tells its loops itself; expected none")
    return pf.interop.from_mjcf(file, configuration=configuration, **choices)


def _feet(given: str) -> dict[str, str]:
    """Contacts by the names of feet, points where nothing else is said: FL,FR or left_sole:flat."""
    words = [word.strip().rpartition(":") for word in given.split(",") if word.strip()]
    return {foot or touch: touch if foot else "point" for foot, _, touch in words}


def _joint_values(file: Path, given: str) -> dict[str, float]:
    """The values of joints of a description, in radians from degrees, slides in metres."""
    from ..exchange.interop.xml_reading import read_xml

    slides = {
        joint.get("name") for joint in read_xml(file, "urdf", "sdf").iter("joint") if joint.get("type") == "prismatic"
    }
    values = {}
    for word in given.split(","):
        name, is_given, value = (part.strip() for part in word.partition("="))
        if not (is_given and is_finite(value)):
            raise click.UsageError(f"--configuration: found '{word}'; expected JOINT=VALUE [deg or m]")
        values[name] = float(value) if name in slides else math.radians(float(value))
    return values


@click.command()
@click.argument("mech", type=MECH)
@click.option(
    "--with", "referee", type=click.Choice(["mujoco"]), default="mujoco", show_default=True, help="The referee."
)
@click.option("--poses", type=click.IntRange(min=1), default=100, show_default=True, help="How many to compare.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the random poses.")
@click.option(
    "--original", type=click.Path(path_type=Path), metavar="FILE", help="The MuJoCo model or URDF it was imported from."
)
@click.option("--loops", type=click.Path(path_type=Path), metavar="YAML", help="The loops of the original, if a URDF.")
@click.option("--configuration", metavar="KEY", default="qpos0", show_default=True, help="A keyframe of it: home.")
@printing_result
def verify(
    mech: str, referee: str, poses: int, seed: int, original: Path | None, loops: Path | None, configuration: str
) -> pf.interop.Verification:
    """Compare answers with those of MuJoCo.

    At random poses that are reached, MuJoCo says how far our loops are open, by its own constraint rows; then it closes
    the loops by itself, from elsewhere, and the poses are compared. With --original, the file that MECH was imported
    from closes its own loops there too, from its joints put by their names.

    Exit code 0 if all agree, 1 if some do not, none was found, or all are too near to home to say anything.
    """
    return pf.interop.verify(
        load(mech), poses=poses, seed=seed, original=original, loops=loops, configuration=configuration
    )
