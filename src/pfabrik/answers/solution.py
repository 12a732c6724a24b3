"""The solution that users get: its fields, its rows, and its representations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import EllipsisType
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import as_plain
from ..common.checks import require_type
from ..common.printed import ResultTable
from ..kernels.rows import REACHED
from .answer_fields import Answer
from .status import Status
from .words import answer_table, as_sentence, what_blocks

_AlongAxis: TypeAlias = int | slice | EllipsisType | Sequence[int] | NDArray[np.integer] | NDArray[np.bool_]
Index: TypeAlias = _AlongAxis | tuple[_AlongAxis, ...]
"""An index of the batch axes, as NumPy takes them."""


class Solution(Answer):
    """The answer to one target or, with leading batch axes on every field, to a batch.

    The status rests on measurements of the configuration: `residual` and `limit_excess`. Where it is INVALID (a row
    that was no pose, and is to be marked), numbers are NaN.

    Attributes
    ----------
    status : Status or array of int (...)
        The `Status`; for a batch an integer array of them.
    pose : array (..., 4, 4)
        T_base_platform achieved [length].
    actuators : array (..., n_a)
        Actuated coordinates in the order of `mechanism.actuator_names` [length or rad].
    q : array (..., nq)
        All joint coordinates in the order of `mechanism.coordinate_names`, with the zeros of the description [rad or
        length]: one for R and P, two for U and C, three for S, whose rotation vector turns its second body against its
        first, from home. What a configuration leaves open (a rod's spin about itself) is nearest to the start, or to
        home; along a path, angles continue beyond full turns.
    joints : mapping of str to array
        Joint name -> its part of `q`: (...) for R and P, (..., 2) for U and C, (..., 3) for S.
    points : mapping of str to array (..., 3)
        Joint name -> position of its centre in the base frame [length].
    position_error, rotation_error : float or array (...)
        Distance of the pose from the target [length], [rad]; 0 in forward kinematics.
    actuator_error : float or array (...)
        Largest difference of an actuated coordinate from the given value; lengths relative to L, angles in rad; 0 in
        inverse kinematics.
    residual : float or array (...)
        Largest gap of any loop: open ends, stretched rigid links, links out of their plane [length].
    limit_excess : float or array (...)
        Largest excess over any limit; lengths relative to L, angles in rad; 0 if all are kept.
    held : str or None or array of str (...)
        The part of the target that a projected answer has exactly: "orientation", "position", or None. It is that of
        `Options.hold`, or None where holding it costs more than `Options.hold_price`.
    jumped : bool or array of bool (...)
        True if no motion leads to the answer from the `start` that was given: as the target goes on, the nearest pose
        has become another one, and drives would jump there. False without a start.
    certified : bool or array of bool (...)
        True if there is a proof that no feasible pose of the same orientation is nearer, in any working mode. REACHED
        answers are certified, and most projected ones of machines whose legs are struts, or rods on cranks and
        carriages, if the platform does not rotate or its orientation is held. False if only searches say so.
    is_complete : bool or array of bool (...)
        False for a projection without a certificate where `Options.most_steps` bounded the search.
    iterations, rounds : int or array of int (...)
        Passes over the chains, and revisions of the target.
    active_limits : tuple of ActiveLimit or list
        Limits that block a projected answer from its target, the largest multiplier first, or that another answer
        exceeds; for a batch, one tuple per row, in row order. Limits on which a projected answer lies, but whose
        relaxation would not bring it nearer, are not listed. Where none blocks it, but links are stretched out or
        folded, this is listed, as bound "stretched" of the joint between them.
    """

    @property
    def reason(self) -> str:
        """Why a single target is not reached, in words: the limits that block it, or another cause, such as a task that
        asks for more than the mechanism can do; in forward kinematics after the distance from the values asked for.
        Empty if it is reached.

        Raises
        ------
        TypeError
            The solution is a batch; its rows have one reason each: `solution[row].reason`.
        """
        if self.shape != ():
            raise TypeError("a batch has a reason a row: solution[row].reason")
        if self:
            return ""
        return "; ".join(what_blocks(self)) if self.status == Status.PROJECTED else as_sentence(self)

    def __bool__(self) -> bool:
        """True if the target, or every target of the batch, is REACHED."""
        return not np.count_nonzero(self._rows.status != REACHED)

    def __len__(self) -> int:
        if self.shape == ():
            raise TypeError("the answer to one target has no length")
        return self.shape[0]

    def __getitem__(self, index: Index) -> Solution:
        """The answer at `index` of the batch axes; NumPy's rules for integers, slices and arrays."""
        if self.shape == ():
            raise TypeError("the answer to one target cannot be indexed")
        chosen = np.arange(len(self._configurations)).reshape(self.shape)[cast(Any, index)]
        places = np.ravel(chosen)
        request = None if self._request is None else self._request._replace(targets=self._request.targets[places])
        values = None if self._values is None else self._values[places]
        before = None if self._before is None else self._before.at(places)
        return Solution(self.mechanism, self._configurations.at(places), np.shape(chosen), request, values, before)

    def __iter__(self) -> Iterator[Solution]:
        return (self[i] for i in range(len(self)))

    def to_dict(self) -> dict[str, Any]:
        """The fields as plain numbers, lists and dicts, ready for JSON; NaN (an INVALID row) becomes None."""
        names = (
            "pose",
            "actuators",
            "q",
            "position_error",
            "rotation_error",
            "residual",
            "actuator_error",
            "limit_excess",
            "iterations",
            "rounds",
        )
        plain: dict[str, Any] = {"status": _plain_status(self.status)}
        plain |= {name: as_plain(getattr(self, name)) for name in names}
        plain["held"] = as_plain(self.held)
        plain["jumped"] = as_plain(self.jumped)
        plain["certified"] = as_plain(self.certified)
        plain["joints"] = {name: as_plain(value) for name, value in self.joints.items()}
        plain["points"] = {name: as_plain(point) for name, point in self.points.items()}
        limits = [[vars(limit) for limit in row] for row in self._limits]
        plain["active_limits"] = limits[0] if self.shape == () else limits
        return plain

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in self._counts().items())
        return f"<{type(self).__name__} of '{self.mechanism.name}': {counts or 'empty'}>"

    def table(self) -> ResultTable:
        """Status, pose, actuators and, for notebooks, a small drawing; of a batch, the number of rows per status."""
        return answer_table(self, self._counts())

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def _counts(self) -> dict[str, int]:
        """Status name -> number of rows, for those that occur."""
        counts = {status.name: int((self._rows.status == status).sum()) for status in Status}
        return {name: count for name, count in counts.items() if count}


def checked_solution(solution: Any) -> Solution:
    """The argument, if it is a Solution; raises InvalidArgument otherwise."""
    return require_type("solution", solution, Solution, "a Solution, as `solve_ik` returns")


def _plain_status(status: Any) -> Any:
    return (
        status.name
        if isinstance(status, Status)
        else np.vectorize(lambda s: Status(s).name, otypes=[object])(status).tolist()
    )
