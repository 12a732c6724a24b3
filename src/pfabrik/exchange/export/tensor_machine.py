"""A machine as its file of tensors knows it: its dimensions by name, and what the kernels' routines make of them.

The routines of `kernels.legs` and `kernels.pose` are run once on numbers that note their steps: at a pose as the legs
answer it in closed form; at a pose and given proximal coordinates, with nothing eliminated, as Newton's method takes
it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...engines.pose.table import kernel_table
from ...engines.varied.placed_legs import noted_records
from ...errors import UnsupportedMechanism, counted
from ...kernels import vectors, walk_path
from ...kernels.legs import answer, frames, pivots, rods
from ...kernels.legs import records as K
from ...kernels.pose import equations, limits
from ...machine.decomposition.home_numbers import Fields, HomeNumbers
from ...machine.decomposition.leg_forms import ElementaryJoint, Ending, KeptAxis, LegForm, Pivot, Rod
from ...machine.decomposition.leg_records import leg_records
from ...machine.description.geometry import AT_POINTS, AT_REFERENCE, home_numbers, limit_numbers
from ...machine.description.mechanism import Mechanism
from ...machine.model import model_of
from ...machine.noted_numbers import Trace, of_numbers, where
from ...machine.noted_vectors import Vector, norm
from .machine_data import Machine, fitting_path
from .source import targets_around_home
from .tensor_steps import names_of_routines, note_names

FAR = 1e30
"""The bound of a coordinate without one [L or rad]: finite, so that no derivative of what is beyond is NaN."""

DEAD = 1e-12
"""Square of the sine of an angle from a dead point below which a proximal joint is clamped."""

SIDES = ("side", "base_end_side", "platform_end_side")
"""Fields that stay as at home, whatever the dimensions are."""

AXES = {K.HINGE: 1, K.CROSS: 2, K.TRIPLE: 3}
"""The number of hinges of an ending whose axes count."""


class Dimension(NamedTuple):
    """Numbers of one name: a vector, or a row for each of some legs, actuators or joints."""

    name: str
    values: Any
    of: list[str]


class NotedLegs(NamedTuple):
    """Legs in closed form at a pose; a list for each number, by twists of the platform in L and rad.

    Attributes
    ----------
    actuators : [length or rad].
    rates : their rates by each of the six, [L or rad].
    row_rates : slopes of the constraints.
    rooms : the room before every limit [length or rad].
    gaps : by how much legs do not close [L or rad].
    """

    actuators: list[Any]
    rates: list[list[Any]]
    row_rates: list[list[Any]]
    rooms: list[Any]
    gaps: list[Any]


class NotedEquations(NamedTuple):
    """Equations [L or rad], and their slopes by the six of a twist, then by each proximal joint that is solved for."""

    rows: list[Any]
    slopes: list[list[Any]]


class TensorMachine:
    """A machine whose legs are in closed form, and the coordinates that its file takes.

    Attributes
    ----------
    path : the named joints; None where poses of the platform are the coordinates.
    dimensions : the dimensions; `given` are their numbers by name, `constants` those that are no dimensions: sides,
        senses, bounds of legs.
    R, p : of the pose, the rotation by rows and the position [L].
    actuators, proximal, joints : values of actuators [length or rad], of proximal joints that are solved for [L or
        rad], and of the joints of `path` [length or rad].
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[str] | None) -> None:
        self.mechanism, self.machine = mechanism, Machine(mechanism)
        self.path = None if names is None else fitting_path(mechanism, names)
        if reason := self._refused():
            raise UnsupportedMechanism(mechanism.name, [reason], "exported")
        self.trace = Trace()
        self.size = mechanism.characteristic_length
        self.dimensions: list[Dimension] = []
        self.given: list[tuple[str, Any]] = []
        self.constants: list[tuple[str, Any]] = []
        self._table, model = kernel_table(model_of(mechanism).legs), model_of(mechanism)
        self._task: dict[str, Any] = {"rows": int(self._table.task[0]["rows"])}
        self._records = self._noted(model.legs.forms)
        self._homes = self._dimension("actuators.home", [d.home for d in self.machine.driven], mechanism.actuator_names)
        self._motions = None if self.path is None else self._noted_path()
        n_open = int(self._table.columns.max(initial=5)) - 5

        homes = [driven.home for driven in self.machine.driven]
        pose = np.eye(3), np.array(mechanism.reference_point) / self.size
        given: Any = (*pose, homes, np.zeros(n_open), [] if self.path is None else self.path.home)
        self.R, self.p, self.actuators, self.proximal, self.joints = (
            self._inputs(values, is_open=True).ravel().tolist() for values in given
        )

    def _refused(self) -> str:
        machine = self.machine
        arms = dict.fromkeys(leg.joints[0] for leg in machine.legs if leg.record["makes"] > 0)
        if arms:
            return f"legs on joints {', '.join(arms)}, which poses do not set in one step"
        if self.path is None and machine.uncontrolled:
            return f"its actuators leave the end effector {counted(machine.uncontrolled, 'freedom')}"
        if self.path is None and machine.rotations == 1:
            return "its task sets a yaw alone: name joints in series instead"
        return ""

    # Dimensions

    def _dimension(self, name: str, values: Any, of: Sequence[str] = ()) -> Any:
        """Inputs for the numbers of a dimension, in an array of its shape."""
        array = np.asarray(values, float) + 0.0
        self.dimensions.append(Dimension(name, array.tolist(), list(of)))
        self.given.append((name.replace(".", "_"), self._inputs(array)))
        return self.given[-1][1]

    def _inputs(self, values: Any, is_open: bool = False) -> Any:
        """Inputs at values, in an array of their shape."""
        numbers = np.empty(np.shape(values), object)
        for place, value in np.ndenumerate(values):
            numbers[place] = self.trace.input(float(value), is_open)
        return numbers

    def _noted(self, forms: Sequence[LegForm]) -> dict[str, Any]:
        """Records of the table of legs, filled from dimensions by name."""
        numbers: list[Any] = [*home_numbers(self.mechanism).tolist(), *limit_numbers(self.mechanism)]
        numbers[AT_REFERENCE:AT_POINTS] = self._dimension("reference_point", self.mechanism.reference_point)
        home = HomeNumbers(self.mechanism, numbers)
        self._task["reference"] = np.array([*home.reference_point, None], object)[:3]
        noted, more = list(forms), [Fields() for _ in forms]
        for name, legs in self._groups():
            read: Any = self._rods if isinstance(forms[legs[0]], Rod) else self._pivots
            for leg, (form, fields) in zip(legs, read(name, legs, [forms[leg] for leg in legs]), strict=True):
                noted[leg], more[leg] = form, fields
        fields = [own | each for own, each in zip(leg_records(home, noted).fields, more, strict=True)]
        for name in SIDES:
            for _, legs in self._groups():
                sides = self._alike(name, [float(self._table.legs[leg][name]) for leg in legs])
                for leg, side in zip(legs, sides, strict=True):
                    fields[leg][name] = side
        records = {name: noted_records(getattr(self._table, name), [{}] * len(getattr(self._table, name)))
                   for name in ("limited", "cones", "driven")}  # fmt: skip
        for each in (*records["limited"], *records["driven"]):
            each["lo"], each["hi"] = max(each["lo"], -FAR), min(each["hi"], FAR)
        for each in records["driven"]:
            if each["hi"] - each["lo"] == 2.0 * FAR:  # counted to within half a turn of home
                each["lo"], each["hi"] = -math.pi, math.pi
        for name, coordinates in records.items():
            for field in ("sense", "lo", "hi", "half_angle") if len(coordinates) else ():
                if field in coordinates[0]:
                    values = self._alike(f"{name}_{field}", [each[field] for each in coordinates])
                    for each, value in zip(coordinates, values, strict=True):
                        each[field] = value
        for k in range(3):
            axes = self._alike(f"cones_axis_{'xyz'[k]}", [float(each["axis"][k]) for each in records["cones"]])
            for each, value in zip(records["cones"], axes, strict=True):
                each["axis"][k] = value
        return records | {"legs": noted_records(self._table.legs, fields)}

    def _alike(self, name: str, values: Sequence[float]) -> list[Any]:
        """Values as they are if they are one value, else as inputs: legs that are alike keep one formula."""
        if len(set(values)) <= 1:
            return list(values)
        self.constants.append((name, self._inputs(values)))
        return list(self.constants[-1][1])

    def _groups(self) -> list[tuple[str, list[int]]]:
        """The legs that are alike, by a name of theirs."""
        alike: dict[tuple[int, ...], list[int]] = {}
        for place, leg in enumerate(self._table.legs):
            alike.setdefault(tuple(int(leg[name]) for name in LIKENESS), []).append(place)
        named: dict[str, list[int]] = {}
        for legs in sorted(alike.values(), key=lambda legs: bool(self._table.legs[legs[0]]["proximal"] == K.SHARED)):
            name = _name(self._table.legs[legs[0]])
            n_so_named = sum(each.rstrip("0123456789_") == name for each in named)
            named[f"{name}_{n_so_named + 1}" if n_so_named else name] = legs
        return list(named.items())

    def _joints_of(self, legs: Sequence[int]) -> list[str]:
        return [", ".join(self.machine.legs[leg].joints) for leg in legs]

    def _rods(self, name: str, legs: Sequence[int], forms: Sequence[Rod]) -> Iterator[tuple[LegForm, Fields]]:
        """Rods at their dimensions: ends, length, and the axes of their joints."""
        records, of = self._table.legs[legs], self._joints_of(legs)

        def read(what: str, values: Any) -> Any:
            return self._dimension(f"{name}.{what}", values, of)

        base_ends = read("base_end", np.array([form.base_end for form in forms]) * self.size) / self.size
        platform_ends = read("platform_end", np.array([form.platform_end for form in forms]) * self.size) / self.size
        lengths = read("length", records["length"] * self.size) / self.size
        first = records[0]
        axes = read("axis", records["proximal_axis"]) if first["has_proximal"] else [None] * len(legs)
        centres: Any = [None] * len(legs)
        if first["proximal"] == K.CRANK:
            centres = read("centre", records["proximal_point"] * self.size) / self.size
        hinges = {
            end: read(f"{end}_axes", records[f"{end}_end_axes"][:, : AXES[int(first[f"{end}_end"])]])
            for end in ("base", "platform")
            if first[f"{end}_end"] in (K.HINGE, K.CROSS)
        }
        for row, form in enumerate(forms):
            made: dict[str, Any] = {"base_end": Vector(base_ends[row]), "platform_end": Vector(platform_ends[row])}
            if form.proximal is not None:
                point = form.proximal.point if centres[row] is None else Vector(centres[row])
                made["proximal"] = replace(form.proximal, axis=_unit(axes[row]), point=point)
            for end, rows in hinges.items():
                ending: Ending = getattr(form, f"{end}_ending")
                made[f"{end}_ending"] = _with_axes(ending, rows[row] if end == "base" else rows[row][::-1])
            yield replace(form, **made), {"length": lengths[row]}

    def _pivots(
        self, name: str, legs: Sequence[int], forms: Sequence[Pivot | KeptAxis]
    ) -> Iterator[tuple[LegForm, Fields]]:
        """Pivots at their dimensions: centre, slides, and hinges."""
        records, of = self._table.legs[legs], self._joints_of(legs)
        first = forms[0]
        centres: Any = [None] * len(legs)
        slides, axes = None, None
        if first.ending.centre is not None and isinstance(first, Pivot):
            values = [form.ending.centre for form in forms]
            centres = self._dimension(f"{name}.centre", np.array(values) * self.size, of) / self.size
        if isinstance(first, Pivot) and first.slides:
            rows = [[slide.axis for slide in form.slides] for form in forms if isinstance(form, Pivot)]
            slides = self._dimension(f"{name}.slides", rows, of)
        if n := AXES.get(int(records[0]["base_end"])):
            axes = self._dimension(f"{name}.axes", records["base_end_axes"][:, :n], of)
        for row, form in enumerate(forms):
            ending = form.ending if axes is None else _with_axes(form.ending, axes[row])
            if centres[row] is not None:
                ending = replace(ending, centre=Vector(centres[row]))
            made = replace(form, ending=ending)
            if slides is not None and isinstance(made, Pivot):
                made = replace(made, slides=_turned(made.slides, slides[row]))
            yield made, {}

    def _noted_path(self) -> Any:
        """The motions of the path as `kernels.walk_path` takes them [L]."""
        assert self.path is not None
        motions = self.path.motions
        of = [self.path.names[motion.place] for motion in motions]
        axes = self._dimension("joints.axis", [motion.axis for motion in motions], of)
        points = self._dimension("joints.point", [motion.point for motion in motions], of) / self.size
        self._joint_homes = self._dimension("joints.home", self.path.home, self.path.names)
        kinds = [walk_path.TURN if motion.kind == "turn" else walk_path.SLIDE for motion in motions]
        rows = [
            [kind, motion.place, motion.sign, *_unit(axis), *point]
            for kind, motion, axis, point in zip(kinds, motions, axes, points, strict=True)
        ]
        return np.array(rows, object)

    # What the routines make of them

    @cached_property
    def names(self) -> dict[int, tuple[str, str]]:
        """Names of numbers by their places: of fields of legs, and those that routines give them."""
        names: dict[int, tuple[str, str]] = {}
        for leg in self._records["legs"]:
            for field, value in leg.items():
                note_names(names, field, value)
        with names_of_routines(names):
            for part in ("placed", "forward", *(("closing", "proximal_places") if self.completes else ())):
                getattr(self, part)
            if self.path is not None:
                _ = self.walked
        return names

    @cached_property
    def walked(self) -> tuple[list[Any], list[list[Any]]]:
        """Rotation by rows and position [L] at the joints, and the six of the twist by each of them [L and rad]."""
        assert self.path is not None and self._motions is not None
        deviations = [
            (q - home) / (1.0 if is_angle else self.size)
            for q, home, is_angle in zip(self.joints, self._joint_homes, self.path.is_angle, strict=True)
        ]
        T, twists = np.empty((4, 4), object), np.zeros((6, len(self.joints))).astype(object)
        of_numbers(walk_path.walk_row)(
            self._motions, self._task["reference"], np.array([*deviations, None], object)[:-1], T, twists
        )
        return [*T[:3, :3].ravel(), *T[:3, 3]], twists.tolist()

    def _legs_at_a_pose(self) -> SimpleNamespace:
        """The arrays of a leg evaluation, with the frames of a pose."""
        table = self._table
        n, m = len(table.legs), len(self.proximal)
        made = SimpleNamespace(
            frames=frames.new_frames(table.legs).astype(object),
            values=np.zeros((n, K.N_VALUES)).astype(object),
            lines=np.zeros((n, 3)).astype(object),
            rows=np.zeros(self._task["rows"] + m).astype(object),
            slopes=np.zeros((self._task["rows"] + m, 6 + m)).astype(object),
            slope=np.zeros(6 + m).astype(object),
        )
        pose = np.array([*self.R, *self.p], object)
        pose = np.concatenate([pose[:9].reshape(3, 3), pose[9:, None]], axis=1)
        of_numbers(frames.set_frames)(pose, self._task, made.frames)
        return made

    @property
    def _noted_table(self) -> Any:
        return SimpleNamespace(**self._records, columns=self._table.columns, task=[self._task])

    @cached_property
    def placed(self) -> NotedLegs:
        """Legs at a pose, in closed form and in home's working mode."""
        at, table, legs = self._legs_at_a_pose(), self._noted_table, self._records["legs"]
        of_numbers(answer.place_legs)(legs, at.frames, [leg["side"] for leg in legs], at.values, at.lines)
        of_numbers(answer.put_leg_rows)(legs, at.frames, at.values, at.lines, at.rows)
        of_numbers(equations.put_slopes)(table, at)
        margins = {k: margin for k, margin in enumerate(self._singularity_margins(at)) if margin is not None}
        follow = {self._table.columns[k]: self._follow(k, margins[k], at) for k in margins if legs[k]["has_proximal"]}

        def eliminated(slope: Any) -> list[Any]:
            return [sum((slope[c] * rate[j] for c, rate in follow.items()), slope[j]) for j in range(6)]

        actuators, rates = [], []
        for each, home in zip(self._in_order(), self._homes, strict=True):
            of_numbers(limits.coordinate_slope)(table, each, at)
            rates.append(eliminated(at.slope))
            actuators.append(home + of_numbers(answer.deviation)(each, at.values) * each["unit"])
        n_rows = self._task["rows"]
        row_rates = [eliminated(at.slopes[row]) for row in range(n_rows)]
        gaps = [*at.rows[:n_rows], *(at.values[k, K.SLIDE] for k in margins if legs[k]["has_proximal"])]
        rooms = [*self._rooms(at), *margins.values()]
        return NotedLegs(actuators, _turned_over(rates), _turned_over(row_rates), rooms, gaps)

    def _singularity_margins(self, at: SimpleNamespace) -> Iterator[Any]:
        """Of every leg the margin of its proximal joint, or of a pivot's three hinges; None of other legs."""
        for leg in self._records["legs"]:
            scratch = np.zeros(K.N_VALUES).astype(object)
            if leg["has_proximal"] == 1:
                platform_end = of_numbers(vectors.move)(at.frames[leg["frame"]], tuple(leg["platform_end_point"]))
                yield of_numbers(rods.solve_proximal)(leg, platform_end, leg["side"], scratch)
            elif leg["kind"] == K.PIVOT and leg["base_end"] == K.TRIPLE:
                yield of_numbers(pivots.place_pivot)(leg, at.frames[leg["frame"]], leg["side"], scratch)
            else:
                yield None

    def _follow(self, k: int, margin: Any, at: SimpleNamespace) -> list[Any]:
        """The rate of a proximal coordinate by each of the six; at a dead point and beyond it, of the clamped one."""
        leg, frame, values = self._records["legs"][k], at.frames[self._records["legs"][k]["frame"]], at.values[k]
        u, is_clear = of_numbers(equations.direction)(at.lines[k]), margin > DEAD
        rate = of_numbers(rods.proximal_rate)(leg, of_numbers(rods.base_end_of)(leg, leg, values), u, frames.ZERO)
        platform_end = of_numbers(vectors.move)(frame, tuple(leg["platform_end_point"]))
        clamped = of_numbers(rods.clamped_rate)(leg, platform_end, values)
        rate = where(is_clear, -rate, 1.0)
        pull = tuple(where(is_clear, x / rate, y) for x, y in zip(u, clamped, strict=True))
        slope = np.zeros(6).astype(object)
        of_numbers(frames.put_pose_slope)(leg, frame, pull, frames.ZERO, slope)
        return list(slope)

    def _in_order(self) -> list[Any]:
        """The driven coordinates."""
        return sorted(self._records["driven"], key=lambda each: int(each["column"]))

    def _rooms(self, at: SimpleNamespace) -> Iterator[Any]:
        """The room before the ends of ranges and the edges of cones."""
        for each in self._records["limited"]:
            value = of_numbers(answer.deviation)(each, at.values)
            yield (value - each["lo"]) * each["unit"]
            yield (each["hi"] - value) * each["unit"]
        for cone in self._records["cones"]:
            place = cone["place"]
            line = tuple(at.values[cone["leg"], place : place + 3])
            yield cone["half_angle"] - of_numbers(vectors.angle_between)(tuple(cone["axis"]), line)

    def _equations(self, q: Sequence[Any], kept: Sequence[int], columns: Sequence[int], more: bool) -> NotedEquations:
        """Equations at proximal coordinates, and their slopes by the twist and by some of these.

        Parameters
        ----------
        kept : which of the legs' equations: constraints, then lengths of rods on proximal joints.
        more : with those of actuators that drive no proximal joint.
        """
        at, table, legs = self._legs_at_a_pose(), self._noted_table, self._records["legs"]
        by_leg = np.zeros(len(legs)).astype(object)
        for k, column in enumerate(self._table.columns.tolist()):
            by_leg[k] = q[column - 6] if column >= 0 else 0.0
        state = SimpleNamespace(q=by_leg, sides=[leg["side"] for leg in legs])
        owner = 0
        for k, leg in enumerate(legs):
            owner = owner if leg["proximal"] == K.SHARED else k
            of_numbers(equations.evaluate_leg)(table, k, owner, state, at)
        of_numbers(equations.put_slopes)(table, at)
        rows, slopes = [at.rows[row] for row in kept], [at.slopes[row] for row in kept]
        for driven, own, home in zip(self._in_order() if more else (), self.actuators, self._homes, strict=False):
            if driven["place"] == K.Q_PROXIMAL:
                continue
            of_numbers(limits.coordinate_slope)(table, driven, at)
            gap = driven["sense"] * at.values[driven["leg"], driven["place"]] - (own - home) / driven["unit"]
            rows.append(of_numbers(vectors.wrap)(gap, 0.0) if driven["turns"] == 1 else gap)
            slopes.append(at.slope.copy())
        chosen = [*range(6), *columns]
        return NotedEquations(rows, _turned_over([[slope[c] for c in chosen] for slope in slopes]))

    @cached_property
    def open_columns(self) -> list[int]:
        """The columns of proximal joints without a motor: forward kinematics solve for them too."""
        driven = {int(self._table.columns[each["leg"]]) for each in self._in_order() if each["place"] == K.Q_PROXIMAL}
        return [column for column in range(6, 6 + len(self.proximal)) if column not in driven]

    @cached_property
    def forward(self) -> NotedEquations:
        """The equations that say where the end effector is at given actuators.

        Of joints in series, which keep the other constraints, the lengths of rods on proximal joints are enough.
        """
        q = dict(zip(self.open_columns, self.proximal, strict=False))
        for each, own, home in zip(self._in_order(), self.actuators, self._homes, strict=True):
            if each["place"] == K.Q_PROXIMAL:
                q[int(self._table.columns[each["leg"]])] = each["sense"] * (own - home) / each["unit"]
        n, m = self._task["rows"], len(self.proximal)
        kept = range(n if self.path is not None else 0, n + m)
        return self._equations([q[6 + k] for k in range(m)], kept, self.open_columns, more=True)

    @cached_property
    def closing(self) -> NotedEquations:
        """The equations of all legs, at coordinates of all proximal joints."""
        m = len(self.proximal)
        return self._equations(self.proximal, range(self._task["rows"] + m), range(6, 6 + m), more=False)

    @cached_property
    def proximal_places(self) -> list[Any]:
        """The coordinate of each proximal joint in closed form at a pose [L or rad]."""
        at, legs = self._legs_at_a_pose(), self._records["legs"]
        of_numbers(answer.place_legs)(legs, at.frames, [leg["side"] for leg in legs], at.values, at.lines)
        order = sorted((int(c), k) for k, c in enumerate(self._table.columns) if c >= 0)
        return [at.values[k, K.Q_PROXIMAL] for _, k in order]

    # What a file says of itself

    @cached_property
    def limit_names(self) -> list[str]:
        """The names of limits."""
        names = [f"{joint} {bound}" for joint, bound in self.machine.limits]
        for leg, record in zip(self.machine.legs, self._table.legs, strict=True):
            if record["has_proximal"] or (leg.is_pivot and record["base_end"] == K.TRIPLE):
                names.append(f"dead point of {leg.joints[0]}")
        return names + (["legs do not close"] if self.closes else [])

    @property
    def reference(self) -> list[Any]:
        """The reference point at home [L]."""
        return list(self._task["reference"])

    @property
    def joint_homes(self) -> list[Any]:
        """The joints of the path at home [length or rad]."""
        return [] if self.path is None else list(self._joint_homes)

    @property
    def closes(self) -> bool:
        """True if a pose may be one at which legs do not close."""
        return self.path is None and self.machine.equations > 0

    @property
    def completes(self) -> bool:
        """True if the task leaves some of a pose open."""
        return self.path is None and self.machine.unset > 0

    @property
    def is_point(self) -> bool:
        """True if the end effector is a joint, and poses have no rotation."""
        return self.path is None and self.mechanism.end_effector_is_joint

    @property
    def rate_units(self) -> Floats:
        """Rates of actuators by those of coordinates in the mechanism's units, from those in L and rad, (k, n_a)."""
        units = np.array([self.size if each.is_length else 1.0 for each in self.machine.driven])
        if self.path is None:
            return np.asarray(units / np.repeat([self.size, 1.0], 3)[:, None])
        return np.asarray(units / np.where(self.path.is_angle, 1.0, self.size)[:, None])

    def samples(self, n: int) -> Floats:
        """Coordinates of joints (n, k) all over their ranges, around home where they have none; or poses (n, 4, 4)."""
        random = np.random.default_rng(0)
        if self.path is None:
            return targets_around_home(self.mechanism, n, random)
        reach = np.array([0.5 if is_angle else 0.3 * self.size for is_angle in self.path.is_angle])
        low = np.where(np.isfinite(self.path.low), self.path.low, self.path.home - reach)
        high = np.where(np.isfinite(self.path.high), self.path.high, self.path.home + reach)
        return np.asarray(random.uniform(low, high, (n, len(reach))))


LIKENESS = ("kind", "frame", "proximal", "base_end", "platform_end", "slides", "twists", "n_rows", "upright")
"""Fields in which legs that are alike agree."""


def _name(record: Any) -> str:
    """What a leg's dimensions are named by."""
    if record["kind"] == K.PIVOT:
        return "pivots"
    if record["proximal"] == K.SHARED:
        return "shared"
    if record["has_proximal"]:
        return "cranks" if record["proximal"] == K.CRANK else "carriages"
    return "struts" if record["slides"] else "rods"


def _unit(axis: Any) -> Vector:
    vector = Vector(axis)
    return vector / norm(vector)


def _turned(elements: Sequence[ElementaryJoint], axes: Any) -> tuple[ElementaryJoint, ...]:
    """Elementary joints about or along other axes."""
    return tuple(replace(element, axis=_unit(axis)) for element, axis in zip(elements, axes, strict=True))


def _with_axes(ending: Ending, axes: Any) -> Ending:
    """An ending with other hinges, as many as count."""
    n = len(axes)
    return replace(ending, elements=(*_turned(ending.elements[:n], axes), *ending.elements[n:]))


def _turned_over(rows: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Columns of rows."""
    return [list(column) for column in zip(*rows, strict=True)] if rows else []
