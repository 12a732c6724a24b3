"""A machine as moving bodies: unit motions along trees, cuts that close the loops, masses, and the memory of a row.

Trees grow from the base and from the end effector, whose twist V is an unknown of its own; a loop is closed where two
trees meet, at a cut. Frames are the base, the end effector, and what is beyond each unit motion. Lengths are in L,
twists are [velocity of what is at the present reference point; angular velocity], and wrenches [force; moment about
that point] in kg L/s² and kg L²/s².
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import opener

BASE, END = 0, 1
"""Frames of the base and of the end effector; unit motion k leads to frame FIRST + k."""

FIRST = 2

KIND, PARENT, COORDINATE, COLUMN, SENSE = 0, 1, 2, 3, 4
"""Columns of `units`: the kind of `Loops`, the frame before it, its place among the coordinates, its first column, and
+1 or -1 as it is passed in its own direction or against it."""

FROM, TO, ROWS, OF_END, VISITS = 0, 1, 2, 3, 4
"""Columns of `cuts`: the two frames; 3 conditions at a ball, 6 where they are one body; the sign of V in them; and
the first of its visits."""

SINGULAR, NOT_MADE, FREE_PART, NOT_HELD = 1, 2, 4, 8
"""Marks of a row: the loops gain a motion; the machine does not move so; loads move a part without inertia; actuators
do not hold the machine."""


class MovingMachine(NamedTuple):
    """A machine at home, in base coordinates."""

    units: Ints  # (units, 5), each after the one before it
    axes: Floats  # (units, 3)
    points: Floats  # (units, 3)
    way: Ints  # (k, 5): the unit motions that pose the end effector, in their order, as `units`
    way_axes: Floats  # (k, 3)
    way_points: Floats  # (k, 3)
    end: Floats  # (3,): the reference point
    cuts: Ints  # (cuts + 1, 5), group by group
    cut_points: Floats  # (cuts, 3): the centre of the ball
    visits: Ints  # (visits, 2): column, and its sign in the cut's conditions
    groups: Ints  # (groups + 1, 3): first column, first cut, first row; cuts of different groups share no column
    actuated: Ints  # (n_a,): columns
    asked: Ints  # columns of the motions that are asked for after those of the end effector
    counts: Ints  # (5,): twists of the end effector, motions, motions that it or actuators show; see ASKED, DUTY
    frames: Ints  # (b,): of the masses
    masses: Floats  # (b,): [kg]
    centres: Floats  # (b, 3)
    inertias: Floats  # (b, 3, 3)
    gravity: Floats  # (3,): [L/s²]
    probed: Ints  # (p,): frames of points of 1 kg whose efforts are asked for
    probes: Floats  # (p, 3)
    loaded: Ints  # (loads,): frames of other loads
    load_points: Floats  # (loads, 3)
    loads: Floats  # (loads, 6): forces, and moments about these points, in base axes
    drives: Floats  # (n_a, 4): unit of effort [N or N m], rotor, dry and viscous friction per rate, in this unit
    limits: Floats  # (3,): see LEAST


TWISTS, MOTIONS, SHOWN, DUTY, ALONE = 0, 1, 2, 3, 4
"""Places in `counts`. DUTY is 1 where the motion that is asked for has to be made; ALONE is 1 where the actuators
are asked for and nothing else."""

LEAST, LEAST_MASS, ALIGNED = 0, 1, 2
"""Places in `limits`: a singular value that counts as none, the least inertia of a free part [kg L²], and a share
that is rounding."""


class Exerted(NamedTuple):
    """Results of n rows. No rows without a request."""

    actuators: Floats  # (n, n_a): forces that make the motion [N, N m]
    rates: Floats  # (n, n_a): of the actuators [L or rad]
    gains: Floats  # (n, n_a): their accelerations
    signs: Floats  # (n, n_a): of the rates, 0 at rest
    marks: Ints  # (n,)
    wrenches: Floats  # (n, b + loads, 6): of masses and loads
    resting: Floats  # (n, n_a): forces at rest [N, N m]
    matrices: Floats  # (n, k, k): mass matrix of what is asked for, rotors included [kg L²]
    probes: Floats  # (n, n_a, p): forces by the points that are asked for, in the same motion
    twists: Floats  # (n, 6): of the end effector
    motions: Floats  # (n, n_a, shown): rates of the actuators by motions


class MovingScratch(NamedTuple):
    """Memory of a row."""

    T: Floats  # (frames, 3, 4): displacements from home
    reference: Floats  # (3,): the present reference point
    screws: Floats  # (columns, 6)
    rows: Floats  # (rows, columns + 6): conditions of the cuts by columns of their group, then by V
    pivot_of: Ints  # (rows,): column that a row gives; -1 for a row that is left
    pivots: Ints  # (rows,): rows in the order in which they were eliminated
    n_pivots: Ints  # (groups,)
    slots: Ints  # (columns,): place of a free column among the parameters, V first; negative for others
    left: Floats  # (rows, 6 + columns): what the rows left ask of the parameters
    left_of: Ints  # (rows,): their rows
    left_pivot: Ints  # (6 + columns,): left row that gives a parameter; -1 for others
    pivots_left: Ints  # (rows,): the parameter that each gives
    order: Ints  # (6 + columns,): parameters in the order of their elimination
    opened: Floats  # (rows,): right-hand sides
    parameters: Floats  # (6 + columns, motions): by motions, those shown first
    by_motions: Floats  # (columns, motions)
    shown: Floats  # (twists + n_a, motions)
    u: Floats  # (columns,)
    du: Floats
    V: Floats  # (6 + columns,): parameters, those of the end effector's twist first
    dV: Floats
    twists: Floats  # (frames, 6)
    gains: Floats  # (frames, 6)
    carried: Floats  # (frames, 6)
    arms: Floats  # (b, 3): from the reference point to the centres of mass
    turned: Floats  # (b, 3, 3): inertias as bodies stand
    h: Floats  # (columns,)
    work: Floats  # (motions,)
    idle: Floats  # (idle, idle + 1): mass matrix of the idle motions, and a right-hand side
    inertia: Floats  # (idle, idle)
    coupling: Floats  # (idle, shown): between idle motions and the others
    asked: Floats  # (k, shown)
    table: Floats  # (shown, twists + n_a + k + shown)
    sizes: Floats  # (shown,)
    square: Floats  # (shown, 2 shown)
    following: Floats  # (shown, k): motions by what is asked for
    by_actuators: Floats  # (shown, n_a)
    z: Floats  # (shown,)
    wanted: Floats  # (k,)
    efforts: Floats  # (n_a,): by points
    product: Floats  # (shown, k)


def new_moving_scratch(moving: MovingMachine, k: int) -> MovingScratch:
    """Memory of a row, for k components that are asked for."""
    frames, b, n_a = FIRST + len(moving.units), len(moving.frames), len(moving.actuated)
    columns, rows, groups = int(moving.groups[-1, 0]), int(moving.groups[-1, 2]), len(moving.groups) - 1
    twists, motions, shown = (int(x) for x in moving.counts[:3])
    idle, width, n = motions - shown, 6 + columns, twists + n_a
    parts: tuple[tuple[str, tuple[int, ...]], ...] = (
        ("pivot_of pivots left_of pivots_left opened", (rows,)),
        ("rows left", (rows, width)),
        ("n_pivots", (groups,)),
        ("slots u du h", (columns,)),
        ("screws", (columns, 6)),
        ("left_pivot order V dV", (width,)),
        ("twists gains carried", (frames, 6)),
        ("T", (frames, 3, 4)),
        ("parameters", (width, motions)),
        ("by_motions", (columns, motions)),
        ("shown", (n, motions)),
        ("work", (motions,)),
        ("idle", (idle, idle + 1)),
        ("inertia", (idle, idle)),
        ("coupling", (idle, shown)),
        ("sizes z", (shown,)),
        ("square", (shown, 2 * shown)),
        ("table", (shown, n + k + shown)),
        ("by_actuators", (shown, n_a)),
        ("efforts", (n_a,)),
        ("asked", (k, motions)),
        ("following product", (shown, k)),
        ("wanted", (k,)),
        ("reference", (3,)),
        ("arms", (b, 3)),
        ("turned", (b, 3, 3)),
    )
    shapes = {name: shape for names, shape in parts for name in names.split()}
    whole = {"pivot_of", "pivots", "n_pivots", "slots", "left_of", "left_pivot", "pivots_left", "order"}
    return MovingScratch(
        **{name: np.zeros(shape, np.int64 if name in whole else float) for name, shape in shapes.items()}
    )


def new_exerted(moving: MovingMachine, n: int, k: int, requests: Sequence[str] = (), fill: float = np.nan) -> Exerted:
    """Results of n rows, for k components that are asked for; of those after the marks the ones in `requests`."""
    n_a, loads = len(moving.actuated), len(moving.frames) + len(moving.loaded)
    shapes = {
        **dict.fromkeys(("actuators", "rates", "gains", "signs", "resting"), (n_a,)),
        "wrenches": (loads, 6),
        "matrices": (k, k),
        "probes": (n_a, len(moving.probed)),
        "twists": (6,),
        "motions": (n_a, int(moving.counts[SHOWN])),
    }
    always = ("actuators", "rates", "gains", "signs", *requests)
    found = {name: np.empty((n if name in always else 0, *shape)) for name, shape in shapes.items()}
    for name in always:
        found[name].fill(fill)
    return Exerted(marks=np.zeros(n, np.int64), **found)


def _sample(codes: str) -> list[Any]:
    return [np.zeros((5,) * int(code[1]), f"{code[0]}8") for code in codes.split()]


MOVING_MACHINE = MovingMachine(
    *_sample("i2 f2 f2 i2 f2 f2 f1 i2 f2 i2 i2 i1 i1 i1 i1 f1 f2 f3 f1 i1 f2 i1 f2 f2 f2 f1")
)
SCRATCH = new_moving_scratch(MOVING_MACHINE, 0)
"""Records of the types that kernels are compiled for."""

open_moving, open_moving_scratch = opener(MOVING_MACHINE), opener(SCRATCH)
