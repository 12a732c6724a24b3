"""pfabrik: the kinematics of parallel mechanisms, from a small file to exact, honest answers.

    import pfabrik as pf

    m = pf.load("my_machine.toml")               # the path of a file, or one of pf.catalog()
    sol = pf.solve_ik(m, [10, 0, 190])           # REACHED, or PROJECTED to the nearest feasible pose
    fk = pf.solve_fk(m, sol.actuators)           # from actuator values to the pose

Describe   load, save, catalog; Mechanism, Joint, Cone, Leg
Ask        solve_ik, solve_fk, track, configuration, travel; assembly_modes, working_modes; pose, Options
           Solver (one machine, asked again and again)
Answers    Solution, Status, Track, Travel, ActiveLimit; margins, closure_residual
Look over   workspace, singularity_map
To first order   mobility, inverse_jacobian, forward_jacobian, singularity
See        plot, plot_track, plot_travel, animate; view (in the browser)
Structure  decompose, SubChain; geometric (closed forms of the paper's machines); errors
Exchange   interop (MuJoCo and URDF, in and out)

Lengths are in the mechanism's own unit, angles in radians; a pose is a 4x4 matrix from platform to base coordinates;
batch axes come first.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Where each public name lives. Modules are imported when a name is first used, so that `import pfabrik` is quick.
_HOMES = {
    "Cone": "description.mechanism",
    "Joint": "description.mechanism",
    "Leg": "description.legs",
    "Mechanism": "description.mechanism",
    "load": "files",
    "save": "files",
    "catalog": "catalog",
    "pose": "poses",
    "Options": "options",
    "Solution": "answers.solution",
    "Status": "answers.status",
    "ActiveLimit": "answers.limits",
    "SubChain": "decomposition.decompose",
    "decompose": "decomposition.decompose",
    "solve_ik": "ik",
    "track": "track",
    "Track": "answers.tracked",
    "Travel": "travel",
    "travel": "travel",
    "configuration": "configuration",
    "margins": "answers.margins",
    "Feasibility": "feasibility",
    "feasibility": "feasibility",
    "AssemblyModes": "modes.assembly",
    "assembly_modes": "modes.assembly",
    "WorkingModes": "modes.working",
    "working_modes": "modes.working",
    "closure_residual": "answers.residual",
    "Mobility": "answers.differential",
    "Singularity": "answers.differential",
    "mobility": "answers.differential",
    "inverse_jacobian": "answers.differential",
    "forward_jacobian": "answers.differential",
    "singularity": "answers.differential",
    "solve_fk": "fk",
    "Solver": "solver",
    "warm_up": "warm_up",
    "Inscribed": "workspace.inscribed",
    "SingularityMap": "workspace.singular",
    "SingularityTrack": "workspace.singular",
    "singularity_map": "workspace.singular",
    "Workspace": "workspace.result",
    "workspace": "workspace.ask",
    "export_c": "export.export_c",
    "animate": "view.animation",
    "Viewer": "view.live.viewer",
    "view": "view.live.viewer",
    "plot": "view.machine",
    "plot_track": "view.track",
    "plot_travel": "view.travel",
    "PlatformSpeed": "timing.platform_speed",
    "platform_speed": "timing.platform_speed",
    "read_path": "paths.read_path",
    "Timed": "timing.timed",
    "time_path": "timing.time_path",
}
# Modules that are themselves public.
_MODULES = ("errors", "geometric", "interop")

__all__ = [
    "ActiveLimit",
    "AssemblyModes",
    "Cone",
    "Feasibility",
    "Inscribed",
    "Joint",
    "Leg",
    "Mechanism",
    "Mobility",
    "Options",
    "PlatformSpeed",
    "Singularity",
    "SingularityMap",
    "SingularityTrack",
    "Solution",
    "Solver",
    "Status",
    "SubChain",
    "Timed",
    "Track",
    "Travel",
    "Viewer",
    "WorkingModes",
    "Workspace",
    "__version__",
    "animate",
    "assembly_modes",
    "catalog",
    "closure_residual",
    "configuration",
    "decompose",
    "errors",
    "export_c",
    "feasibility",
    "forward_jacobian",
    "geometric",
    "interop",
    "inverse_jacobian",
    "load",
    "margins",
    "mobility",
    "platform_speed",
    "plot",
    "plot_track",
    "plot_travel",
    "pose",
    "read_path",
    "save",
    "singularity",
    "singularity_map",
    "solve_fk",
    "solve_ik",
    "time_path",
    "track",
    "travel",
    "view",
    "warm_up",
    "working_modes",
    "workspace",
]

if TYPE_CHECKING:
    from . import errors, geometric, interop
    from .answers.differential import Mobility, Singularity, forward_jacobian, inverse_jacobian, mobility, singularity
    from .answers.limits import ActiveLimit
    from .answers.margins import margins
    from .answers.residual import closure_residual
    from .answers.solution import Solution
    from .answers.status import Status
    from .answers.tracked import Track
    from .catalog import catalog
    from .configuration import configuration
    from .decomposition.decompose import SubChain, decompose
    from .description.legs import Leg
    from .description.mechanism import Cone, Joint, Mechanism
    from .export.export_c import export_c
    from .feasibility import Feasibility, feasibility
    from .files import load, save
    from .fk import solve_fk
    from .ik import solve_ik
    from .modes.assembly import AssemblyModes, assembly_modes
    from .modes.working import WorkingModes, working_modes
    from .options import Options
    from .paths.read_path import read_path
    from .poses import pose
    from .solver import Solver
    from .timing.platform_speed import PlatformSpeed, platform_speed
    from .timing.time_path import time_path
    from .timing.timed import Timed
    from .track import track
    from .travel import Travel, travel
    from .view.animation import animate
    from .view.live.viewer import Viewer, view
    from .view.machine import plot
    from .view.track import plot_track
    from .view.travel import plot_travel
    from .warm_up import warm_up
    from .workspace.ask import workspace
    from .workspace.inscribed import Inscribed
    from .workspace.result import Workspace
    from .workspace.singular import SingularityMap, SingularityTrack, singularity_map


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
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


sys.modules[__name__].__class__ = _Package
