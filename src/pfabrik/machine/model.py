"""The model of a machine: its description, with what the solvers derive from it."""

from __future__ import annotations

from functools import cached_property, lru_cache

from ..common.arrays import Floats
from .decomposition.leg_forms import NoLeg
from .decomposition.leg_table import LegTable, leg_table
from .description.geometry import Geometry, geometry_of, home_numbers, numbers_with, with_numbers
from .description.mechanism import Mechanism
from .description.task import Task, task_of
from .motion.loops import Closure, closure_of


class Model:
    """A machine, with what the solvers derive from its description, each computed once and when it is needed.

    Rooms above add what they derive by functions of a model, marked `derived`.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self._like, self._numbers = mechanism, mechanism, home_numbers(mechanism)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The description."""
        mechanism = with_numbers(self._like, self._numbers)
        mechanism.__dict__["_model"] = self
        return mechanism

    @property
    def length(self) -> float:
        """The characteristic length L."""
        return float(self._numbers[0])

    def with_geometry(
        self,
        points: Floats | None = None,
        axes: Floats | None = None,
        home: Floats | None = None,
        reference_point: Floats | None = None,
    ) -> Model:
        """The machine with other numbers, unchecked: no fault of theirs is found, nor a lack of freedom.

        Answers are those of a machine made anew, to the last bit.

        Parameters
        ----------
        points, axes, home, reference_point : as of `description.geometry.Geometry`; what is left out stays.
        """
        given = {"points": points, "axes": axes, "home": home, "reference_point": reference_point}
        geometry = self._geometry._replace(**{name: array for name, array in given.items() if array is not None})
        model = object.__new__(Model)
        model._like, model._numbers = self._like, numbers_with(self._like, geometry)
        return model

    @cached_property
    def _geometry(self) -> Geometry:
        return geometry_of(self.mechanism)

    @cached_property
    def task(self) -> Task:
        """The components of a pose that targets set."""
        return task_of(self.mechanism)

    @cached_property
    def closure(self) -> Closure:
        """All loops, compiled for the closure kernels."""
        return closure_of(self.mechanism, whole=True)

    @cached_property
    def path_closure(self) -> Closure:
        """The loops on paths to the end effector; the joints of other loops (a gripper's) are idle."""
        return closure_of(self.mechanism, whole=False)

    @property
    def legs(self) -> LegTable:
        """The table of legs in closed form.

        Raises
        ------
        NoLeg : some chain has no closed form; `has_legs` is then False.
        """
        if isinstance(self._legs, LegTable):
            return self._legs
        raise NoLeg(self._legs)

    @property
    def has_legs(self) -> bool:
        """True if all chains are legs in closed form: these answer first."""
        return isinstance(self._legs, LegTable)

    @property
    def why_no_legs(self) -> str:
        """The reason why there is no table of legs; empty if there is one."""
        return "" if isinstance(self._legs, LegTable) else self._legs

    @property
    def why_poses_do_not_suffice(self) -> str:
        """The reason why a pose does not determine the coordinates of legs, and what would help; empty if it does."""
        if self.has_legs and self.legs.has_free_redundant:
            joints = ", ".join(self.legs.redundant_joints)
            return f"poses leave joints {joints} open, which are redundant: where these are fixed, closed forms answer"
        return f"no legs in closed form, {self.why_no_legs}" if self.why_no_legs else ""

    @cached_property
    def _legs(self) -> LegTable | str:
        try:
            return leg_table(self.mechanism)
        except NoLeg as reason:
            return str(reason)


def model_of(mechanism: Mechanism) -> Model:
    """The model of a mechanism, the same each time; equal descriptions share one."""
    model: Model | None = mechanism.__dict__.get("_model")
    if model is None:
        model = mechanism.__dict__["_model"] = _shared(mechanism)
    return model


@lru_cache(maxsize=64)
def _shared(mechanism: Mechanism) -> Model:
    return Model(mechanism)
