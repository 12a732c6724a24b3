"""The public names, each once: what type checkers and editors read, and from which `pfabrik` finds them."""

from . import errors as errors
from . import interop as interop
from . import passes as passes
from .answers.active_limits import ActiveLimit as ActiveLimit
from .answers.differential import (
    Mobility as Mobility,
)
from .answers.differential import (
    NearlyFree as NearlyFree,
)
from .answers.differential import (
    Singularity as Singularity,
)
from .answers.differential import (
    forward_jacobian as forward_jacobian,
)
from .answers.differential import (
    inverse_jacobian as inverse_jacobian,
)
from .answers.differential import (
    mobility as mobility,
)
from .answers.differential import (
    singularity as singularity,
)
from .answers.margins import closure_residual as closure_residual
from .answers.margins import margins as margins
from .answers.solution import Solution as Solution
from .answers.status import Status as Status
from .answers.tracked import Track as Track
from .capabilities.actuation.actuation import Actuation as Actuation
from .capabilities.actuation.actuation import actuation as actuation
from .capabilities.calibration.calibration import Calibration as Calibration
from .capabilities.calibration.least_squares import calibrate as calibrate
from .capabilities.calibration.measurements import Measurements as Measurements
from .capabilities.calibration.parameters import Parameters as Parameters
from .capabilities.calibration.parameters import parameters as parameters
from .capabilities.calibration.plot_calibration import plot_calibration as plot_calibration
from .capabilities.calibration.printer_settings import read_printer as read_printer
from .capabilities.calibration.read_measurements import read_measurements as read_measurements
from .capabilities.calibration.sensitivity import Sensitivity as Sensitivity
from .capabilities.calibration.sensitivity import sensitivity as sensitivity
from .capabilities.certify.certificates import Certificate as Certificate
from .capabilities.certify.enclosure import Enclosure as Enclosure
from .capabilities.certify.pose_region import PoseRegion as PoseRegion
from .capabilities.certify.question import certify as certify
from .capabilities.clearance.clearance import Clearance as Clearance
from .capabilities.clearance.clearance import clearance as clearance
from .capabilities.design import keep as keep
from .capabilities.design.by_counterexample import design as design
from .capabilities.design.found_design import Design as Design
from .capabilities.design.found_design import Designs as Designs
from .capabilities.dynamics.efforts import Efforts as Efforts
from .capabilities.dynamics.identification import BaseParameter as BaseParameter
from .capabilities.dynamics.identification import Identification as Identification
from .capabilities.dynamics.identify import identify as identify
from .capabilities.dynamics.inverse_dynamics import inverse_dynamics as inverse_dynamics
from .capabilities.dynamics.mass_matrix import mass_matrix as mass_matrix
from .capabilities.dynamics.sizing import Sizing as Sizing
from .capabilities.modes.assembly import AssemblyModes as AssemblyModes
from .capabilities.modes.assembly import assembly_modes as assembly_modes
from .capabilities.modes.working import WorkingModes as WorkingModes
from .capabilities.modes.working import working_modes as working_modes
from .capabilities.paths.read_path import read_path as read_path
from .capabilities.statics.accuracy import PoseAccuracy as PoseAccuracy
from .capabilities.statics.accuracy import accuracy as accuracy
from .capabilities.statics.capacity import WrenchCapacity as WrenchCapacity
from .capabilities.statics.capacity import wrench_capacity as wrench_capacity
from .capabilities.statics.forces import Forces as Forces
from .capabilities.statics.forces import forces as forces
from .capabilities.statics.stiffness import Stiffness as Stiffness
from .capabilities.statics.stiffness import stiffness as stiffness
from .capabilities.statics.transmission import (
    Factors as Factors,
)
from .capabilities.statics.transmission import (
    Transmission as Transmission,
)
from .capabilities.statics.transmission import (
    transmission as transmission,
)
from .capabilities.timing.platform_speed import PlatformSpeed as PlatformSpeed
from .capabilities.timing.platform_speed import platform_speed as platform_speed
from .capabilities.timing.time_path import time_path as time_path
from .capabilities.timing.timed import Timed as Timed
from .capabilities.workspace.ask import workspace as workspace
from .capabilities.workspace.inscribed import Inscribed as Inscribed
from .capabilities.workspace.largest import Largest as Largest
from .capabilities.workspace.largest import largest as largest
from .capabilities.workspace.result import Workspace as Workspace
from .capabilities.workspace.singular import (
    SingularityMap as SingularityMap,
)
from .capabilities.workspace.singular import (
    SingularityTrack as SingularityTrack,
)
from .capabilities.workspace.singular import (
    singularity_map as singularity_map,
)
from .configuration import configuration as configuration
from .exchange.contacts.grasping import grasp as grasp
from .exchange.contacts.joining import join as join
from .exchange.contacts.stand import stand as stand
from .exchange.export.export_c import export_c as export_c
from .exchange.export.ros2_control import export_ros2_control as export_ros2_control
from .exchange.export.ros2_node import export_ros2_node as export_ros2_node
from .exchange.export.tensors import (
    export_jax as export_jax,
)
from .exchange.export.tensors import (
    export_numpy as export_numpy,
)
from .exchange.export.tensors import (
    export_tensors as export_tensors,
)
from .exchange.export.tensors import (
    export_torch as export_torch,
)
from .feasibility import Feasibility as Feasibility
from .feasibility import feasibility as feasibility
from .fk import solve_fk as solve_fk
from .ik import solve_ik as solve_ik
from .live import Live as Live
from .machine.catalog import catalog as catalog
from .machine.decomposition.decompose import SubChain as SubChain
from .machine.decomposition.decompose import decompose as decompose
from .machine.description.legs import Leg as Leg
from .machine.description.mechanism import (
    Cone as Cone,
)
from .machine.description.mechanism import (
    Joint as Joint,
)
from .machine.description.mechanism import (
    Mass as Mass,
)
from .machine.description.mechanism import (
    Mechanism as Mechanism,
)
from .machine.description.mechanism import (
    Shape as Shape,
)
from .machine.files import load as load
from .machine.files import save as save
from .machine.poses import pose as pose
from .options import Options as Options
from .search_log import SearchLog as SearchLog
from .search_log import search_log as search_log
from .solver import Solver as Solver
from .sweep import sweep as sweep
from .track import track as track
from .travel import Travel as Travel
from .travel import travel as travel
from .view.animation import animate as animate
from .view.machine import plot as plot
from .view.page.export_web import export_web as export_web
from .view.page.viewer import Viewer as Viewer
from .view.page.viewer import view as view
from .view.plot_track import plot_track as plot_track
from .view.plot_travel import plot_travel as plot_travel

__all__: list[str]
__version__: str
