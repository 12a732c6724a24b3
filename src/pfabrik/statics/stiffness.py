"""Cartesian stiffness from actuators and rods that give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..answers.solution import Solution, checked_solution
from ..arguments import as_floats
from ..arrays import Floats, Mask, shaped
from ..checks import require_known, require_names, require_positive
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..kinematics import actuator_units, generic_of, joint_centres
from ..printed import Printed, ResultTable, spanned, triple
from ..tolerances import TOLERANCES
from .forces import Forces, along, rods_of
from .joint_balance import pairs_of, responses_of
from .loads import Reasons, add_reason, has_reason, in_shape, positive_values, reasons_in_words
from .transmission import Maps, is_redundantly_actuated, maps_of, twist_units

SLACK = "slack cables leave a direction without stiffness"
UNKNOWN_FORCES = "the forces that say which cables are slack are not known"
OPEN_RODS = "equilibrium does not determine the forces along {}, for the loops are overconstrained or singular"


@dataclass(frozen=True, eq=False)
class Stiffness(Printed):
    """Stiffness of the end effector, as `stiffness` returns it; r is 6, or 3 for a joint end effector.

    Attributes
    ----------
    matrix : array (..., r, r)
        K: the wrench per displacement [of the reference point; rotation vector], in the base frame. In directions in
        which the machine is rigid, because its loops let it move in no such way, K has 0.
    compliance : array (..., r, r)
        C: the displacement per wrench, 0 in rigid directions; K and C are inverses of each other in all others. NaN
        where slack cables leave a direction without stiffness.
    rigid : int or array of int (...)
        Number of rigid directions.
    reason : str or array of str (...)
        Why something is not known, with NaN in its place; empty elsewhere. A text for a single answer.
    """

    matrix: Floats
    compliance: Floats
    rigid: int | NDArray[np.int64]
    reason: str | Reasons
    _mechanism: Mechanism = field(repr=False)

    def table(self) -> ResultTable:
        """The force or moment along each axis that displaces along it by one unit; of a batch, its range."""
        gives, unit = np.diagonal(self.compliance, axis1=-2, axis2=-1), self._mechanism.length_unit
        shares = gives / twist_units(self._mechanism) ** 2
        is_rigid = shares <= TOLERANCES.rank * shares.max(axis=-1, initial=0.0, keepdims=True)
        stiff = np.divide(1.0, gives, out=np.full(gives.shape, np.inf), where=~is_rigid)
        units = [f"force/{unit}", f"force {unit}/rad"]
        rows = [
            (f"{way} {axis}", spanned(np.ravel(stiff[..., place])).replace("inf", "rigid"), units[place // 3])
            for place, (way, axis) in enumerate(list(product(("along", "about"), "xyz"))[: gives.shape[-1]])
        ]
        remarks = [] if stiff.ndim > 1 or np.isnan(stiff).any() or is_rigid[:3].all() else [self._softest()]
        lines = reasons_in_words(self.reason, "nothing known")
        return ResultTable("Stiffness", lines, ("", "stiffness", "unit"), rows, remarks)

    def _softest(self) -> str:
        sizes, directions = np.linalg.eigh(self.compliance[:3, :3])
        softest = directions[:, -1] * np.sign(directions[np.argmax(np.abs(directions[:, -1])), -1])
        along = triple(softest, TOLERANCES.alignment)
        return f"gives most to a force along {along}: {1.0 / sizes[-1]:.6g} force/{self._mechanism.length_unit}"


def stiffness(
    solution: Solution,
    k: ArrayLike | Mapping[str, float],
    *,
    rods: float | Mapping[str, float] | None = None,
    cables: Sequence[str] = (),
    forces: Forces | ArrayLike | None = None,
) -> Stiffness:
    """Cartesian stiffness at a configuration or a batch, from what gives: actuators, and rods that stretch.

    C = F diag(1/k) F' + sum u u' / k_rod, with the forward Jacobian F and the force u along a rod per wrench. Where
    actuators work side by side, C = T (A' diag(k) A)^-1 T', with the motions' twists T and actuator rates A. What loads
    change of the geometry is left out.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    k : float or array (n_a,) or mapping of str to float
        Stiffness of the actuators, force per length or torque per rad: a number for all, an array (n_a,), or by name.
    rods : float or mapping of str to float, optional
        Stiffness of links between two joints that are not driven, force per length: a number for all, or by the names
        of their bodies. None: they are rigid.
    cables : sequence of str, optional
        Names of actuators that only pull: slack ones, which do not pull in `forces`, have no stiffness.
    forces : Forces or array (..., n_a), optional
        What the actuators exert, as `forces` returns it.

    Raises
    ------
    InvalidArgument or UnknownName
        Stiffness that is not positive, names that are not known, cables without forces.
    UnsupportedMechanism
        Rods that stretch in a machine with redundant actuators.
    """
    mechanism = checked_solution(solution).mechanism
    values, by_rod = positive_values("k", k, mechanism.actuator_names), _of_rods(mechanism, rods)
    maps, is_slack = maps_of(solution), _slack(solution, cables, forces)
    reasons, twists = maps.reasons, twist_units(mechanism)
    matrix = None
    if is_slack.any() or is_redundantly_actuated(mechanism):
        compliance, matrix = _side_by_side(solution, maps, np.where(is_slack == 1.0, 0.0, values))
        add_reason(reasons, np.isnan(compliance).any(axis=(1, 2)), SLACK)
    else:
        forward = maps.forward / twists[:, None]
        compliance = forward / values @ np.swapaxes(forward, -1, -2)
    if by_rod.any():
        matrix, is_open = None, _give_rods(solution, maps, compliance, by_rod)
        add_reason(reasons, is_open, OPEN_RODS.format(", ".join(np.array(rods_of(mechanism).names)[by_rod > 0.0])))
        compliance[is_open] = np.nan
    add_reason(reasons, np.isnan(is_slack).any(axis=1), UNKNOWN_FORCES)
    is_unknown = has_reason(reasons) & np.asarray(np.not_equal(reasons, SLACK), bool)
    for array in (compliance,) if matrix is None else (compliance, matrix):
        array[is_unknown] = np.nan
    inverse, rigid = _inverse(compliance, float((1.0 / (values * actuator_units(mechanism) ** 2)).max()))
    if matrix is not None:
        inverse = np.where(np.isnan(compliance), matrix, inverse)
    units = twists[:, None] * twists
    return Stiffness(
        shaped(inverse / units, solution.shape),
        shaped(compliance * units, solution.shape),
        shaped(rigid, solution.shape),
        in_shape(reasons, solution.shape),
        mechanism,
    )


def _of_rods(mechanism: Mechanism, given: float | Mapping[str, float] | None) -> Floats:
    """Stiffness of each rod, (rods,); 0 for those that are rigid."""
    names = rods_of(mechanism).names
    if given is None:
        return np.zeros(len(names))
    if not names:
        raise InvalidArgument("rods", "a stiffness", f"None: '{mechanism.name}' has no link between two passive joints")
    if not isinstance(given, Mapping):
        return np.full(len(names), require_positive("rods", given))
    require_known("rod", given, names)
    return np.array([require_positive(f"rods['{name}']", given[name]) if name in given else 0.0 for name in names])


def _slack(solution: Solution, cables: Sequence[str], forces: Forces | ArrayLike | None) -> Floats:
    """1 for actuators that are slack cables, 0 for all others, NaN where that is not known, (n, n_a)."""
    names = solution.mechanism.actuator_names
    slack = np.zeros((len(solution._rows.poses), len(names)))
    chosen = require_names("cables", cables)
    require_known("actuator", chosen, names)
    places = [names.index(cable) for cable in chosen]
    if not places:
        return slack
    expected = "what actuators exert, (..., n_a) or of `forces`, which says what cables are slack"
    if forces is None:
        raise InvalidArgument("forces", "None", expected)
    values = forces.actuators if isinstance(forces, Forces) else as_floats("forces", forces, expected)
    shape = (*solution.shape, len(names))
    if values.shape not in (shape, shape[-1:]):
        raise InvalidArgument("forces", f"shape {values.shape}", f"shape {shape}")
    pulls = np.broadcast_to(values, shape).reshape(slack.shape)[:, places]
    slack[:, places] = np.where(np.isnan(pulls), np.nan, pulls >= 0.0)
    return slack


def _side_by_side(solution: Solution, maps: Maps, values: Floats) -> tuple[Floats, Floats]:
    """Compliance and stiffness (n, r, r) of actuators with stiffness (n_a,) or (n, n_a), lengths in L.

    Compliance is NaN where a direction has no stiffness; then stiffness is too, if joints move beside the end effector.
    """
    mechanism = solution.mechanism
    pairs = pairs_of(mechanism, np.where(maps.is_valid[:, None], solution._coordinates, 0.0))
    twists, springs = pairs.twists, np.broadcast_to(values * actuator_units(mechanism) ** 2, pairs.rates.shape[:2])
    inner = np.swapaxes(pairs.rates, -1, -2) @ (springs[..., None] * pairs.rates)
    sizes, vectors = np.linalg.eigh(inner)
    is_lost = np.abs(np.concatenate(pairs, axis=1)).max(axis=1, initial=0.0) == 0.0  # at a serial singularity: rigid
    is_loose = np.asarray((sizes <= TOLERANCES.rank * sizes[:, -1:]).sum(axis=1) > is_lost.sum(axis=1))
    softness = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > TOLERANCES.rank * sizes[:, -1:])
    shown = twists @ vectors
    compliance = (shown * softness[:, None]) @ np.swapaxes(shown, -1, -2)
    back = np.linalg.pinv(twists)
    matrix = np.swapaxes(back, -1, -2) @ inner @ back
    if generic_of(mechanism).mobility.internal:
        matrix[is_loose] = np.nan
    compliance[is_loose] = np.nan
    return compliance, matrix


def _give_rods(solution: Solution, maps: Maps, compliance: Floats, by_rod: Floats) -> Mask:
    """Add what rods give to compliance (n, r, r), lengths in L; mask of the rows at which that is not known, (n,)."""
    found, stretched = responses_of(solution, maps, "given the stiffness of its rods"), by_rod > 0.0
    mechanism, rods = solution.mechanism, rods_of(solution.mechanism)
    lines = along(rods, joint_centres(mechanism, solution._configurations.coordinates_at(found.places)))[:, stretched]
    ends = rods.ends[stretched]
    by_length = np.einsum("nri,nrai->nra", lines, found.twists[:, ends]) / twist_units(mechanism)
    compliance[found.places] += np.einsum("nra,nrb,r->nab", by_length, by_length, 1.0 / by_rod[stretched])
    is_open = np.zeros(len(compliance), bool)
    opened = np.linalg.norm(np.einsum("nri,nriz->nrz", lines, found.open[:, ends]), axis=-1) > TOLERANCES.alignment
    is_open[found.places] = opened.any(axis=1) | found.is_singular
    return is_open


def _inverse(compliance: Floats, usual: float) -> tuple[Floats, NDArray[np.int64]]:
    """Inverses of compliance (n, r, r), 0 in the directions in which that is 0, and the number of these, (n,).

    Parameters
    ----------
    usual : the compliance of an actuator, beside which that of an end effector at a serial singularity is none.
    """
    is_known = np.asarray(~np.isnan(compliance).any(axis=(1, 2)))
    sizes, vectors = np.linalg.eigh(np.where(is_known[:, None, None], compliance, 0.0))
    gives = np.asarray(sizes > TOLERANCES.rank * np.maximum(sizes[:, -1:], usual))
    stiff = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=gives)
    inverse = (vectors * stiff[:, None]) @ np.swapaxes(vectors, -1, -2)
    inverse[~is_known] = np.nan
    return inverse, np.where(is_known, (~gives).sum(axis=1), 0).astype(np.int64)
