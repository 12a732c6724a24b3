"""pfabrik: the kinematics of parallel mechanisms, from a small file to exact, honest answers.

    import pfabrik as pf

    m = pf.load("my_machine.toml")               # the path of a file, or one of pf.catalog()
    sol = pf.solve_ik(m, [10, 0, 190])           # REACHED, or PROJECTED to the nearest feasible pose
    fk = pf.solve_fk(m, sol.actuators)           # from actuator values to the pose

Describe   load, save, catalog; Mechanism, Joint, Cone, Leg, Shape, Mass
Ask        solve_ik, solve_fk, track, configuration, travel; assembly_modes, working_modes; pose, Options
           Solver (one machine, asked again and again)
Answers    Solution, Status, Track, Travel, ActiveLimit; margins, closure_residual
Look over   workspace, singularity_map
Prove      certify, largest; PoseRegion, Certificate
To first order   mobility, inverse_jacobian, forward_jacobian, singularity
Load        forces, wrench_capacity, transmission, stiffness, accuracy
Move        inverse_dynamics, mass_matrix (what motors exert in motion), identify (masses, from what they did)
Apart       clearance (the least distance between links)
Look into  search_log (every attempt behind an answer)
Real machines   parameters, sensitivity, Measurements, calibrate
Drive      actuation (a serial model's joints to motors, and back: torques, inertia, limits)
See        plot, plot_track, plot_travel, animate; view (in the browser); export_web (a page to send)
Structure  decompose, SubChain; errors
Exchange   interop (MuJoCo and URDF, in and out)
Paper      passes (P-FABRIK's passes, plain or with half-spaces)

Lengths are in the mechanism's own unit, angles in radians; a pose is a 4x4 matrix from platform to base coordinates;
batch axes come first.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# The public names of each module. Modules are imported when a name is first used, so that `import pfabrik` is quick.
_NAMES = {
    "capabilities.actuation.actuation": ("Actuation", "actuation"),
    "answers.differential": (
        "Mobility",
        "NearlyFree",
        "Singularity",
        "forward_jacobian",
        "inverse_jacobian",
        "mobility",
        "singularity",
    ),
    "answers.active_limits": ("ActiveLimit",),
    "answers.margins": ("closure_residual", "margins"),
    "answers.solution": ("Solution",),
    "answers.status": ("Status",),
    "answers.tracked": ("Track",),
    "capabilities.calibration.least_squares": ("calibrate",),
    "capabilities.calibration.calibration": ("Calibration",),
    "capabilities.calibration.csv_measurements": ("read_measurements",),
    "capabilities.calibration.printer_settings": ("read_printer",),
    "capabilities.calibration.measurements": ("Measurements",),
    "capabilities.calibration.parameters": ("Parameters", "parameters"),
    "capabilities.calibration.plot_calibration": ("plot_calibration",),
    "capabilities.calibration.sensitivity": ("Sensitivity", "sensitivity"),
    "machine.catalog": ("catalog",),
    "capabilities.certify.certificates": ("Certificate",),
    "capabilities.certify.question": ("certify",),
    "capabilities.certify.enclosure": ("Enclosure",),
    "capabilities.certify.pose_region": ("PoseRegion",),
    "capabilities.clearance.clearance": ("Clearance", "clearance"),
    "configuration": ("configuration",),
    "machine.decomposition.decompose": ("SubChain", "decompose"),
    "machine.description.legs": ("Leg",),
    "machine.description.mechanism": ("Cone", "Joint", "Mass", "Mechanism", "Shape"),
    "capabilities.design.by_counterexample": ("design",),
    "capabilities.design.found_design": ("Design", "Designs"),
    "capabilities.dynamics.efforts": ("Efforts",),
    "capabilities.dynamics.identification": ("BaseParameter", "Identification"),
    "capabilities.dynamics.identify": ("identify",),
    "capabilities.dynamics.inverse_dynamics": ("inverse_dynamics",),
    "capabilities.dynamics.mass_matrix": ("mass_matrix",),
    "exchange.export.export_c": ("export_c",),
    "view.page.export_web": ("export_web",),
    "exchange.export.ros2_control": ("export_ros2_control",),
    "exchange.export.ros2_node": ("export_ros2_node",),
    "exchange.export.tensors": ("export_jax", "export_numpy", "export_tensors", "export_torch"),
    "feasibility": ("Feasibility", "feasibility"),
    "machine.files": ("load", "save"),
    "fk": ("solve_fk",),
    "ik": ("solve_ik",),
    "capabilities.modes.assembly": ("AssemblyModes", "assembly_modes"),
    "capabilities.modes.working": ("WorkingModes", "working_modes"),
    "options": ("Options",),
    "capabilities.paths.read_path": ("read_path",),
    "common.poses": ("pose",),
    "search_log": ("SearchLog", "search_log"),
    "solver": ("Solver",),
    "capabilities.statics.accuracy": ("PoseAccuracy", "accuracy"),
    "capabilities.statics.capacity": ("WrenchCapacity", "wrench_capacity"),
    "capabilities.statics.forces": ("Forces", "forces"),
    "capabilities.statics.stiffness": ("Stiffness", "stiffness"),
    "capabilities.statics.transmission": ("Factors", "Transmission", "transmission"),
    "capabilities.timing.platform_speed": ("PlatformSpeed", "platform_speed"),
    "capabilities.timing.time_path": ("time_path",),
    "capabilities.timing.timed": ("Timed",),
    "track": ("track",),
    "travel": ("Travel", "travel"),
    "view.animation": ("animate",),
    "view.live.viewer": ("Viewer", "view"),
    "view.machine": ("plot",),
    "view.plot_track": ("plot_track",),
    "view.plot_travel": ("plot_travel",),
    "capabilities.workspace.ask": ("workspace",),
    "capabilities.workspace.inscribed": ("Inscribed",),
    "capabilities.workspace.largest": ("Largest", "largest"),
    "capabilities.workspace.result": ("Workspace",),
    "capabilities.workspace.singular": ("SingularityMap", "SingularityTrack", "singularity_map"),
}
_HOMES = {name: home for home, names in _NAMES.items() for name in names}
# Modules that are themselves public.
_MODULES = {"errors": "errors", "interop": "exchange.interop", "keep": "capabilities.design.keep", "passes": "passes"}

__all__ = [*sorted([*_HOMES, *_MODULES]), "__version__"]

if TYPE_CHECKING:
    from . import errors as errors, passes as passes
    from .exchange import interop as interop
    from .capabilities.actuation.actuation import Actuation as Actuation, actuation as actuation
    from .answers.differential import (
        Mobility as Mobility,
        NearlyFree as NearlyFree,
        Singularity as Singularity,
        forward_jacobian as forward_jacobian,
        inverse_jacobian as inverse_jacobian,
        mobility as mobility,
        singularity as singularity,
    )
    from .answers.active_limits import ActiveLimit as ActiveLimit
    from .answers.margins import margins as margins
    from .answers.margins import closure_residual as closure_residual
    from .answers.solution import Solution as Solution
    from .answers.status import Status as Status
    from .answers.tracked import Track as Track
    from .capabilities.calibration.least_squares import calibrate as calibrate
    from .capabilities.calibration.calibration import Calibration as Calibration
    from .capabilities.calibration.csv_measurements import read_measurements as read_measurements
    from .capabilities.calibration.printer_settings import read_printer as read_printer
    from .capabilities.calibration.measurements import Measurements as Measurements
    from .capabilities.calibration.parameters import Parameters as Parameters, parameters as parameters
    from .capabilities.calibration.plot_calibration import plot_calibration as plot_calibration
    from .capabilities.calibration.sensitivity import Sensitivity as Sensitivity, sensitivity as sensitivity
    from .machine.catalog import catalog as catalog
    from .capabilities.certify.certificates import Certificate as Certificate
    from .capabilities.certify.question import certify as certify
    from .capabilities.certify.enclosure import Enclosure as Enclosure
    from .capabilities.certify.pose_region import PoseRegion as PoseRegion
    from .capabilities.clearance.clearance import Clearance as Clearance, clearance as clearance
    from .configuration import configuration as configuration
    from .machine.decomposition.decompose import SubChain as SubChain, decompose as decompose
    from .machine.description.legs import Leg as Leg
    from .machine.description.mechanism import (
        Cone as Cone,
        Joint as Joint,
        Mass as Mass,
        Mechanism as Mechanism,
        Shape as Shape,
    )
    from .capabilities.design import keep as keep
    from .capabilities.design.by_counterexample import design as design
    from .capabilities.design.found_design import Design as Design, Designs as Designs
    from .capabilities.dynamics.efforts import Efforts as Efforts
    from .capabilities.dynamics.identification import BaseParameter as BaseParameter
    from .capabilities.dynamics.identification import Identification as Identification
    from .capabilities.dynamics.identify import identify as identify
    from .capabilities.dynamics.inverse_dynamics import inverse_dynamics as inverse_dynamics
    from .capabilities.dynamics.mass_matrix import mass_matrix as mass_matrix
    from .exchange.export.export_c import export_c as export_c
    from .view.page.export_web import export_web as export_web
    from .exchange.export.ros2_control import export_ros2_control as export_ros2_control
    from .exchange.export.ros2_node import export_ros2_node as export_ros2_node
    from .exchange.export.tensors import (
        export_jax as export_jax,
        export_numpy as export_numpy,
        export_tensors as export_tensors,
        export_torch as export_torch,
    )
    from .feasibility import Feasibility as Feasibility, feasibility as feasibility
    from .machine.files import load as load, save as save
    from .fk import solve_fk as solve_fk
    from .ik import solve_ik as solve_ik
    from .capabilities.modes.assembly import AssemblyModes as AssemblyModes, assembly_modes as assembly_modes
    from .capabilities.modes.working import WorkingModes as WorkingModes, working_modes as working_modes
    from .options import Options as Options
    from .capabilities.paths.read_path import read_path as read_path
    from .common.poses import pose as pose
    from .search_log import SearchLog as SearchLog, search_log as search_log
    from .solver import Solver as Solver
    from .capabilities.statics.accuracy import PoseAccuracy as PoseAccuracy, accuracy as accuracy
    from .capabilities.statics.capacity import WrenchCapacity as WrenchCapacity, wrench_capacity as wrench_capacity
    from .capabilities.statics.forces import Forces as Forces, forces as forces
    from .capabilities.statics.stiffness import Stiffness as Stiffness, stiffness as stiffness
    from .capabilities.statics.transmission import (
        Factors as Factors,
        Transmission as Transmission,
        transmission as transmission,
    )
    from .capabilities.timing.platform_speed import PlatformSpeed as PlatformSpeed, platform_speed as platform_speed
    from .capabilities.timing.time_path import time_path as time_path
    from .capabilities.timing.timed import Timed as Timed
    from .track import track as track
    from .travel import Travel as Travel, travel as travel
    from .view.animation import animate as animate
    from .view.live.viewer import Viewer as Viewer, view as view
    from .view.machine import plot as plot
    from .view.plot_track import plot_track as plot_track
    from .view.plot_travel import plot_travel as plot_travel
    from .capabilities.workspace.ask import workspace as workspace
    from .capabilities.workspace.inscribed import Inscribed as Inscribed
    from .capabilities.workspace.largest import Largest as Largest, largest as largest
    from .capabilities.workspace.result import Workspace as Workspace
    from .capabilities.workspace.singular import (
        SingularityMap as SingularityMap,
        SingularityTrack as SingularityTrack,
        singularity_map as singularity_map,
    )


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{_MODULES[name]}", __name__)
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    value = getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*_HOMES, *_MODULES, *(name for name in globals() if name.startswith("__"))})


class _Package(ModuleType):
    """Keeps a function from being hidden by the module of the same name when that module is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by name, as plain modules are by those who send functions with what they use to other processes."""
        return importlib.import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Package
