"""The kernel's subdivision of a region: its arguments from a region or a track, and calls of the kernel."""

from __future__ import annotations

import math

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...common.rotations import from_rotvec, to_rotvec
from ...common.telling import OnProgress
from ...engines.pose.table import kernel_table, table_handle
from ...kernels.certify.implicit_pose import new_implicit, solve_middle
from ...kernels.certify.link_rows import new_cell_links
from ...kernels.certify.parallel_rows import new_parallel, put_middle, put_parallel
from ...kernels.certify.pose_cells import (
    AXIS,
    BALL,
    BOX,
    CYLINDER,
    JOINTS,
    N_JOINT_COLUMNS,
    POINT,
    ROTATION_VECTOR,
    SLIDES,
    STEPS,
    TILT,
    TILT_BOX,
    CellParameters,
    put_cell,
)
from ...kernels.certify.prove import (
    BUDGET,
    ENCLOSE,
    GAP,
    HALF,
    N_CELLS,
    N_STACK,
    PROVED_LEGS,
    SPENT,
    Subdivision,
    new_rows,
    new_subdivision,
    no_parameters,
    prove,
)
from ...kernels.clearance.link_records import NO_LINKS
from ...kernels.handle import Handle
from ...kinematics import JointPath, Model
from .links_over_cells import cell_links
from .pose_region import PoseRegion

DEPTH = 256
"""Cells on the stack beside those that it begins with: two for each halving of six parameters down to the smallest."""

CELLS_A_REPORT = 20_000
"""Cells between two reports of progress."""

MOST_PROVED, MOST_LEFT = 100_000, 256
"""Proved cells that are kept, and cells too small to be halved that may be left open before a proof is given up."""

MOST_CONDITION = 1e10
"""Condition up to which the sign of a determinant is more than rounding."""

SHAPES = {"box": BOX, "cylinder": CYLINDER, "ball": BALL}


def region_parameters(
    model: Model,
    region: PoseRegion,
    uncertain: float,
    implicit: Ints | None = None,
    is_regular: bool = False,
) -> CellParameters:
    """A region as arrays of the kernel, in terms of L; of joints, in terms of how far they are from home.

    Parameters
    ----------
    implicit : (6,): 1 of coordinates that follow from the legs.
    is_regular : True to prove that there is no parallel singularity.
    """
    units, origin = units_of(model, region)
    follows = np.zeros(6, np.int64) if implicit is None else implicit
    middle, half = (region.middle - origin) / units, region.half / units
    turning, n = TILT if region.turning == "tilt" else ROTATION_VECTOR, 6 if half[3:].any() or follows.any() else 3
    joints, ranges = np.zeros((1, N_JOINT_COLUMNS)), np.zeros(0, np.int64)
    if region.path is not None:
        turning, n, joints = JOINTS, len(region.names), _joints(model, region.path)
        columns = region.path.columns.tolist()
        ranges = np.array([columns.index(c) if c in columns else -1 for c in model.legs.limited["column"]], np.int64)
    elif follows[3]:  # a yaw is what is left of a rotation when its tilt is turned back
        turning = ROTATION_VECTOR if follows[5] else TILT_BOX
    elif follows[5] and turning == ROTATION_VECTOR:
        turning = TILT_BOX
    parameters = CellParameters(
        np.array([turning, SHAPES[region.shape], n, 0, int(is_regular)]),
        middle,
        half,
        np.zeros((1, 12)),
        np.zeros((1, 6)),
        np.array([uncertain / model.length]),
        joints,
        ranges,
        follows,
        np.zeros(2),
    )
    return parameters._replace(signs=home_signs(model, tuple(follows.tolist()), is_regular).copy())


def units_of(model: Model, region: PoseRegion) -> tuple[Floats, Floats]:
    """Units (6,) and origin (6,) of the kernel's parameters [length, rad]."""
    if region.path is None:
        return np.array([model.length] * 3 + [1.0] * 3), np.zeros(6)
    units, origin, n = np.ones(6), np.zeros(6), len(region.names)
    units[:n] = np.where(region.path.is_angle, 1.0, model.length)
    origin[:n] = region.path.home
    return units, origin


def _joints(model: Model, path: JointPath) -> Floats:
    """Joints in series as rows of the kernel; a slide's point, which does not matter, is the next one's."""
    reference = np.array(model.mechanism.reference_point) / model.length
    rows = np.zeros((len(path.motions) + 1, N_JOINT_COLUMNS))
    rows[-1, POINT:] = reference
    for i in range(len(path.motions) - 1, -1, -1):
        motion = path.motions[i]
        is_slide = motion.kind == "slide"
        rows[i, SLIDES], rows[i, AXIS:POINT] = float(is_slide), motion.sign * np.array(motion.axis)
        rows[i, POINT:] = rows[i + 1, POINT:] if is_slide else np.array(motion.point) / model.length
    return rows


@derived
def home_signs(model: Model, implicit: tuple[int, ...], is_regular: bool) -> Floats:
    """The signs, (2,), at home: of the determinant by which coordinates follow from the legs, and of the whole machine
    with its drivers locked; 0 of what is not asked for, or vanishes."""
    table, sides, signs = kernel_table(model.legs), model.legs.home_sides[0], np.zeros(2)
    home = np.zeros(2 * HALF)
    home[:3] = model.mechanism.home_pose[:3, 3] / model.length
    follows = np.array(implicit, np.int64)
    parameters = no_parameters()._replace(implicit=follows)
    rows, scratch, n = new_rows(table), new_implicit(int(table.task["rows"][0])), int(follows.sum())
    if n and solve_middle(table, sides, parameters, home, rows, scratch):
        signs[0] = np.sign(np.linalg.det(scratch.inverse[:n, :n]))
    if is_regular:
        work = new_parallel()
        put_cell(parameters, home, rows.cell)
        if put_parallel(table, sides, HALF, rows, work):
            put_middle(work)
            signs[1] = np.sign(np.linalg.det(work.matrix[:, :HALF]))
    return signs


def track_parameters(model: Model, poses: Floats, uncertain: float, is_regular: bool = False) -> CellParameters:
    """The steps between poses (n, 4, 4) as arrays of the kernel."""
    positions, rotations = poses[:, :3, 3] / model.length, poses[:, :3, :3]
    turns = to_rotvec(rotations[1:] @ np.swapaxes(rotations[:-1], 1, 2))
    return CellParameters(
        np.array([STEPS, BOX, 1, 0, int(is_regular)]),
        np.zeros(6),
        np.zeros(6),
        np.concatenate([positions[:-1], rotations[:-1].reshape(-1, 9)], axis=1),
        np.concatenate([np.diff(positions, axis=0), turns], axis=1),
        np.array([uncertain / model.length]),
        np.zeros((1, N_JOINT_COLUMNS)),
        np.zeros(0, np.int64),
        np.zeros(6, np.int64),
        home_signs(model, (0,) * 6, is_regular).copy(),
    )


def step_poses(model: Model, parameters: CellParameters, points: Floats) -> Floats:
    """The poses (n, 4, 4) of a track at numbers of steps and shares of the way along them, (n, 2)."""
    steps, shares = points[:, 0].astype(int), points[:, 1:]
    begin, moves = parameters.steps[steps], parameters.moves[steps]
    poses = np.zeros((len(points), 4, 4))
    poses[:, 3, 3] = 1.0
    poses[:, :3, 3] = (begin[:, :3] + shares * moves[:, :3]) * model.length
    poses[:, :3, :3] = from_rotvec(shares * moves[:, 3:]) @ begin[:, 3:].reshape(-1, 3, 3)
    return poses


def first_cells(parameters: CellParameters) -> Floats:
    """The cells (n, HALF + 6) that subdivision begins with: the region, or each step of a track, the first last."""
    if parameters.kinds[0] != STEPS:
        return np.concatenate([parameters.middle, parameters.half])[None]
    cells = np.zeros((len(parameters.steps), 2 * HALF))
    cells[:, 0] = cells[:, HALF] = 0.5
    cells[:, 1] = np.arange(len(cells))[::-1]
    return cells


def side_at(model: Model, parameters: CellParameters, point: Floats) -> float:
    """Side of the parallel singularities of a pose, given by parameters (6,): 1 as home, -1, or 0 if too near."""
    table, rows, work = kernel_table(model.legs), new_rows(kernel_table(model.legs)), new_parallel()
    box = np.concatenate([point, np.zeros(HALF)])
    put_cell(parameters, box, rows.cell)
    if not put_parallel(table, model.legs.home_sides[0], int(parameters.kinds[2]), rows, work):
        return 0.0
    put_middle(work)
    matrix = work.matrix[:, :HALF]
    if not np.linalg.cond(matrix) < MOST_CONDITION:
        return 0.0
    return float(np.sign(np.linalg.det(matrix)) * parameters.signs[1])


class Subdividing:
    """A subdivision in memory, and the kernel that goes on with it."""

    def __init__(
        self,
        model: Model,
        parameters: CellParameters,
        cells: Floats,
        gap: float,
        budget: int,
        most_proved: int = MOST_PROVED,
    ) -> None:
        """Put cells on the stack.

        Parameters
        ----------
        gap : by how much the proved margin may be less than the least one found; infinite if only its sign counts.
        budget : cells to look at, at most.
        """
        table = model.legs
        sizes = (len(cells) + DEPTH, min(budget, most_proved), MOST_LEFT)
        self.work: Subdivision = new_subdivision(
            kernel_table(table), parameters, table.home_sides[0].copy(), cell_links(model), sizes
        )
        self.work.stack[: len(cells), :PROVED_LEGS] = cells
        self.work.stack[: len(cells), PROVED_LEGS] = 0.0
        self.work.counters[N_STACK], self._budget, self._n_first = len(cells), budget, len(cells)
        self._whole = cells[0, HALF:PROVED_LEGS].copy()
        self.work.measures[GAP] = gap
        self._legs, self._handle = table_handle(table), Handle(self.work)

    def proceed(self, tell: OnProgress | None) -> int:
        """Go on until the stack is empty, a pose breaks a limit, or the budget is spent; as `kernels.certify.prove`."""
        counters = self.work.counters
        while True:
            counters[BUDGET] = self._budget if tell is None else min(self._budget, self.n_cells + CELLS_A_REPORT)
            result = int(prove(self._legs.address, self._handle.address))
            if tell is not None:
                share = max(1.0 - self._open_share(), self.n_cells / self._budget)
                tell(self.n_cells, math.ceil(self.n_cells / max(share, 1e-9)))
            if result != SPENT or self.n_cells >= self._budget:
                return result

    def _open_share(self) -> float:
        """The share of the cells that it began with that is still on the stack, by their size."""
        stack = self.work.stack[: int(self.work.counters[N_STACK])]
        sides = HALF + np.flatnonzero(self._whole)
        return float(np.prod(stack[:, sides] / self._whole[sides - HALF], axis=1).sum()) / self._n_first

    @property
    def n_cells(self) -> int:
        """Number of cells looked at so far."""
        return int(self.work.counters[N_CELLS])


class Enclosing:
    """Shares of cells that are within all limits but the clearance of links, by the kernel."""

    def __init__(self, model: Model, parameters: CellParameters) -> None:
        self._model, self._parameters = model, parameters._replace(kinds=parameters.kinds.copy())
        self._parameters.kinds[3] = ENCLOSE

    def shares(self, cells: Floats) -> Floats:
        """Shares (n, 2), at least and at most; what is proved on each cell (n, N_COLUMNS) is noted in it."""
        table = self._model.legs
        sides = table.home_sides[0].copy()
        work = new_subdivision(
            kernel_table(table), self._parameters, sides, new_cell_links(NO_LINKS), (0, 0, 1), n_shares=len(cells)
        )
        work = work._replace(stack=cells)
        work.counters[N_STACK] = len(cells)
        handle = Handle(work)
        prove(table_handle(table).address, handle.address)
        return work.shares
