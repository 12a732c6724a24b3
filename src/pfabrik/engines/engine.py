"""The choice of the engine that solves a mechanism, made nowhere else, and what rooms above need to speak with it."""

from __future__ import annotations

from typing import Literal

from ..common.arrays import Floats
from ..common.derived import derived
from ..kernels.pose.search_records import Starts as Starts
from ..kernels.rows import POSITION_ERROR as POSITION_ERROR
from ..machine.description.mechanism import Mechanism
from ..machine.model import Model, model_of
from ..options import Options
from .chains.chain_engine import ChainEngine
from .chains.serial_chain import is_chain
from .joints.closure_engine import ClosureEngine
from .joints.configurations import Configurations as Configurations
from .joints.driven_joints import DrivenJoints
from .joints.engine_contract import Driven as Driven
from .joints.engine_contract import Engine as Engine
from .joints.engine_contract import Grower as Grower
from .joints.engine_contract import LegsRead as LegsRead
from .pose.branch import poses_decide
from .pose.driven_legs import DrivenLegs
from .pose.legs_engine import LegsApartByJoints, LegsEngine
from .pose.links_of_legs import keeps_links
from .pose.seeds import seeds_of_other_assemblies
from .pose.tip_engine import TipEngine, measured, read_at_tip


def engine_of(mechanism: Mechanism) -> Engine:
    """The engine that solves a mechanism: closed forms if every chain is a leg that has one, else joint coordinates.

    Of a mechanism without loops these are solved in time linear in the number of joints.
    """
    return _engine(model_of(mechanism))


def kind_of_engine(mechanism: Mechanism) -> Literal["legs", "chains", "closure"]:
    """The kind of engine that completes what a task leaves open: closed forms of legs, or joint coordinates."""
    model = model_of(mechanism)
    return "legs" if model.has_legs else "chains" if is_chain(model) else "closure"


def why_not_measured(mechanism: Mechanism) -> str:
    """The reason why no closed forms give the margins of poses; empty if they do."""
    return measured(model_of(mechanism)).why_poses_do_not_suffice


def legs_decide(mechanism: Mechanism) -> bool:
    """True if closed forms alone tell whether a target is reached in a working mode; else what they miss is asked."""
    model = measured(model_of(mechanism))
    return not model.why_poses_do_not_suffice and poses_decide(model)


def knows_all_modes(mechanism: Mechanism) -> bool:
    """True if closed forms list every configuration on a target, or if a chain without loops is searched as a whole."""
    return _knows_all_modes(model_of(mechanism))


@derived
def _knows_all_modes(model: Model) -> bool:
    if measured(model) is not model:
        return True
    if not model.has_legs:
        return is_chain(model)
    return not model.legs.is_completed or not len(seeds_of_other_assemblies(model).poses)


@derived
def _engine(model: Model) -> Engine:
    at_tip = read_at_tip(model)
    return _completing(model) if at_tip is None else TipEngine(model, _completing(model), LegsEngine(at_tip))


def driven_by(mechanism: Mechanism, options: Options, speeds: Floats, accelerations: Floats) -> Driven:
    """A machine that streams drive, as fast as its drives may [per s, per s^2]."""
    model = model_of(mechanism)
    if model.has_legs and keeps_links(model) and LegsEngine(model).searches:
        return DrivenLegs(model, options, speeds, accelerations)
    return DrivenJoints(model, options, speeds, accelerations)


def _completing(model: Model) -> Engine:
    """The engine that completes what a task leaves open of a pose."""
    if model.has_legs:
        return LegsEngine(model) if keeps_links(model) else LegsApartByJoints(model)
    return ChainEngine(model) if is_chain(model) else ClosureEngine(model)
