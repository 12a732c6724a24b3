"""What capabilities build on beside the public verbs: names that stay while the engines below them change.

A capability (statics, say, or timing) is a thin room over the verbs, `solve_ik`, `track` or `margins`, each imported
from its public module. What it asks of the machine itself it imports from here, and reaches no deeper: the import
contracts in `pyproject.toml` name the few that search or prove by the engines' own parts. Each name is documented where
it is defined.

Machine       model_of, Model; task_of, Task; drive_limits
Engine        engine_of, kind_of_engine, Grower, Starts, LegsRead, Configurations, legs_decide
              why_not_measured
Targets       Target, as_targets, carrying_joint; POSITION_ERROR
Shown as      readouts, readout, Readout; plane_of
Graph         tree_of, column_joints, columns; passive_series; links_of
Masses        inertias_of, BodyInertia
Motion        home_coordinates, displacements, joint_centres, placed, end_effector_pose; joint_path, JointPath
              tilt_axis, has_weak_coordinates, task_remark
First order   around_home, generic_of, internal_rates, require_determined; JointRates, cycle_basis; cut_loops
              actuator_units, rate_units; parallel_signs
Varied        varied, VariedMachine, MachineAt; VariedGeometry; leg_slopes, LegSlopes
"""

from .engines.engine import (
    POSITION_ERROR,
    Grower,
    LegsRead,
    Starts,
    engine_of,
    kind_of_engine,
    legs_decide,
    why_not_measured,
)
from .engines.joints.configurations import Configurations
from .engines.joints.first_order import JointRates
from .engines.targets import Target, as_targets, carrying_joint
from .engines.varied import LegSlopes, MachineAt, VariedGeometry, VariedMachine, leg_slopes, varied
from .machine.description.body_inertias import BodyInertia, inertias_of
from .machine.description.drive_bounds import drive_limits
from .machine.description.graph import tree_of
from .machine.description.home_mobility import column_joints
from .machine.description.links import links_of
from .machine.description.plane import plane_of
from .machine.description.readouts import Readout, readout, readouts
from .machine.description.task import Task, task_of
from .machine.model import Model, model_of
from .machine.motion.cut_loops import cut_loops
from .machine.motion.determined import require_determined
from .machine.motion.displacements import (
    actuator_units,
    columns,
    displacements,
    end_effector_pose,
    home_coordinates,
    joint_centres,
    placed,
    rate_units,
)
from .machine.motion.fitting_task import has_weak_coordinates, task_remark, tilt_axis
from .machine.motion.joint_path import JointPath, joint_path, passive_series
from .machine.motion.loops import cycle_basis
from .machine.motion.mobility import around_home, generic_of, internal_rates
from .machine.motion.singularities import parallel_signs

__all__ = [
    "POSITION_ERROR",
    "BodyInertia",
    "Configurations",
    "Grower",
    "JointPath",
    "JointRates",
    "LegSlopes",
    "LegsRead",
    "MachineAt",
    "Model",
    "Readout",
    "Starts",
    "Target",
    "Task",
    "VariedGeometry",
    "VariedMachine",
    "actuator_units",
    "around_home",
    "as_targets",
    "carrying_joint",
    "column_joints",
    "columns",
    "cut_loops",
    "cycle_basis",
    "displacements",
    "drive_limits",
    "end_effector_pose",
    "engine_of",
    "generic_of",
    "has_weak_coordinates",
    "home_coordinates",
    "inertias_of",
    "internal_rates",
    "joint_centres",
    "joint_path",
    "kind_of_engine",
    "leg_slopes",
    "legs_decide",
    "links_of",
    "model_of",
    "parallel_signs",
    "passive_series",
    "placed",
    "plane_of",
    "rate_units",
    "readout",
    "readouts",
    "require_determined",
    "task_of",
    "task_remark",
    "tilt_axis",
    "tree_of",
    "varied",
    "why_not_measured",
]
