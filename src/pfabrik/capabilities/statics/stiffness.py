"""Cartesian stiffness from actuators and rods that give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats, Mask, shaped
from ...common.checks import require_known, require_positive
from ...common.printed import Printed, ResultTable, spanned, triple
from ...errors import InvalidArgument
from ...kinematics import actuator_units, generic_of, joint_centres
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .forces import Forces, along, rods_of
from .given_forces import loaded, slack_cables
from .joint_balance import pairs_of, responses_of
from .loads import Reasons, add_reason, has_reason, in_shape, positive_values, reasons_in_words
from .transmission import Maps, is_redundantly_actuated, maps_of, twist_units

SLACK = "slack cables leave a direction without stiffness"
TIPS = "the equilibrium is not stable: the load tips the end effector further than it gives"
UNKNOWN_FORCES = "the forces that say which cables are slack are not known"
OPEN_RODS = "equilibrium does not determine the forces along {}, for the loops are overconstrained or singular"


@dataclass(frozen=True, eq=False)
class Stiffness(Printed):
    """Stiffness of the end effector, as `stiffness` returns it; r is 6, or 3 for a joint end effector.

    Attributes
    ----------
    matrix : array (..., r, r)
        K: the wrench per displacement [of the reference point; rotation vector], in the base frame. In directions in
        which the machine is rigid, because its loops let it move in no such way, K has 0. Symmetric but for a moment
        that the forces hold: it is the wrench that changes, about the reference point as it moves.
    compliance : array (..., r, r)
        C: the displacement per wrench, 0 in rigid directions; K and C are inverses of each other in all others. NaN
        where slack cables leave a direction without stiffness, and where the load tips it.
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
        sizes, directions = np.linalg.eigh(_symmetric(self.compliance[:3, :3]))
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
    actuators work side by side, C = T (A' diag(k) A + G)^-1 T', with the motions' twists T and actuator rates A. G is
    what `forces` add as the geometry changes, -(dJ'/dx) t with the inverse Jacobian J; without them it is left out.

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
        Names of actuators that only pull: slack ones, which do not pull in `forces`, have no stiffness. If others
        cannot do without what they push, that is the reason why nothing is known.
    forces : Forces or array (..., n_a), optional
        What the actuators exert, as `forces` returns it of a load and `limits` of cables; or an array, which is held by
        what it takes to act on the end effector. Loads keep their directions, and their points on the bodies; what
        acts on the end effector does so at the reference point, with its moment.

    Raises
    ------
    InvalidArgument or UnknownName
        Stiffness that is not positive, names that are not known, cables without forces; forces of other configurations,
        and beside rods that stretch.
    UnsupportedMechanism
        Rods that stretch in a machine with redundant actuators.
    """
    mechanism = checked_solution(solution).mechanism
    values, by_rod = positive_values("k", k, mechanism.actuator_names), _of_rods(mechanism, rods)
    if by_rod.any() and forces is not None:
        raise InvalidArgument("rods", "a stiffness beside forces", "None: their change is known of rigid rods")
    maps, is_slack = maps_of(solution), slack_cables(solution, cables, forces)
    reasons, twists = maps.reasons, twist_units(mechanism)
    matrix = None
    if is_redundantly_actuated(mechanism) or forces is not None:
        held = None if forces is None else loaded(solution, forces, is_slack)
        springs = np.where(is_slack == 1.0, 0.0, values)
        compliance, matrix, is_tipped = _side_by_side(solution, maps, springs, held)
        if held is not None:
            add_reason(reasons, slice(None), np.ravel(np.asarray(held.reason, object)))
        add_reason(reasons, is_tipped, TIPS)
        add_reason(reasons, np.isnan(compliance).any(axis=(1, 2)), SLACK)
    else:
        forward = maps.forward / twists[:, None]
        compliance = forward / values @ np.swapaxes(forward, -1, -2)
    if by_rod.any():
        matrix, is_open = None, _give_rods(solution, maps, compliance, by_rod)
        add_reason(reasons, is_open, OPEN_RODS.format(", ".join(np.array(rods_of(mechanism).names)[by_rod > 0.0])))
        compliance[is_open] = np.nan
    add_reason(reasons, np.isnan(is_slack).any(axis=1), UNKNOWN_FORCES)
    is_unknown = has_reason(reasons) & ~np.isin(reasons.astype(str), (SLACK, TIPS))
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


def _side_by_side(solution: Solution, maps: Maps, values: Floats, held: Forces | None) -> tuple[Floats, Floats, Mask]:
    """Compliance and stiffness (n, r, r) of actuators with stiffness (n_a,) or (n, n_a), and where a load tips, (n,).

    Lengths are in L. Compliance is NaN where a direction has no stiffness, or a load tips; then stiffness is too, if
    joints move beside the end effector.
    """
    mechanism = solution.mechanism
    if held is None:
        pairs, more = pairs_of(mechanism, np.where(maps.is_valid[:, None], solution._coordinates, 0.0)), np.zeros(())
    else:
        pairs, more = held._geometric_stiffness()
    twists, springs = pairs.twists, np.broadcast_to(values * actuator_units(mechanism) ** 2, pairs.rates.shape[:2])
    inner = np.swapaxes(pairs.rates, -1, -2) @ (springs[..., None] * pairs.rates) + more
    sizes = np.linalg.eigvalsh(_symmetric(inner))
    least = TOLERANCES.rank * sizes[:, -1:]
    is_lost = np.abs(np.concatenate(pairs, axis=1)).max(axis=1, initial=0.0) == 0.0  # at a serial singularity: rigid
    is_loose = np.asarray((sizes <= least).sum(axis=1) > is_lost.sum(axis=1))
    compliance = twists @ np.linalg.pinv(inner, TOLERANCES.rank) @ np.swapaxes(twists, -1, -2)
    back = np.linalg.pinv(twists)
    matrix = np.swapaxes(back, -1, -2) @ inner @ back
    if generic_of(mechanism).mobility.internal:
        matrix[is_loose] = np.nan
    compliance[is_loose] = np.nan
    return compliance, matrix, np.asarray((sizes < -least).any(axis=1))


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


def _symmetric(matrix: Floats) -> Floats:
    return 0.5 * (matrix + np.swapaxes(matrix, -1, -2))


def _inverse(compliance: Floats, usual: float) -> tuple[Floats, NDArray[np.int64]]:
    """Inverses of compliance (n, r, r), 0 in the directions in which that is 0, and the number of these, (n,).

    Parameters
    ----------
    usual : the compliance of an actuator, beside which that of an end effector at a serial singularity is none.
    """
    is_known = np.asarray(~np.isnan(compliance).any(axis=(1, 2)))
    known = np.where(is_known[:, None, None], compliance, 0.0)
    sizes, vectors = np.linalg.eigh(_symmetric(known))
    gives = np.asarray(sizes > TOLERANCES.rank * np.maximum(sizes[:, -1:], usual))
    of_vectors = np.swapaxes(vectors, -1, -2) @ known @ vectors
    of_vectors = np.where(gives[:, None] & gives[..., None], of_vectors, np.eye(known.shape[1]))
    inverse = (vectors * gives[:, None]) @ np.linalg.inv(of_vectors) @ np.swapaxes(vectors, -1, -2)
    inverse[~is_known] = np.nan
    return inverse, np.where(is_known, (~gives).sum(axis=1), 0).astype(np.int64)
