"""pfabrik: the kinematics of parallel mechanisms, from a small file to exact, honest answers.

    import pfabrik as pf

    m = pf.load("my_machine.toml")               # the path of a file, or one of pf.catalog()
    sol = pf.solve_ik(m, [10, 0, 190])           # REACHED, or PROJECTED to the nearest feasible pose
    fk = pf.solve_fk(m, sol.actuators)           # from actuator values to the pose

Describe   load, save, catalog; Mechanism, Joint, Cone, Leg, Shape, Mass
           stand (a robot on its feet), grasp (hands on an object), join (machines as one)
Ask        solve_ik, solve_fk, track, configuration, travel; assembly_modes, working_modes; pose, Options
           Solver (one machine, asked again and again), Live (one that follows any stream); sweep (millions, into files)
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

The package, a folder a layer; each imports what stands above it alone:

common         what knows no machine: arrays, poses, checks, printed results
kernels        the numerics, in a subset of Python that `to_c` translates to C
machine        what a machine is: its description, files, decomposition, motions
engines        what answers: legs at a pose, joint coordinates, chains
answers        what is answered: Solution, Track, margins, first order
ik, fk, …      the verbs, one a file; `kinematics` is what capabilities ask beside them
passes         the paper's method, which no engine uses
capabilities   what else is asked of a machine, from workspaces to designs
view           pictures, the viewer, the page
exchange       robot files in and out, code for controllers
cli            the command
"""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    (name.asname or name.name): node.module
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for name in node.names
}
"""The module or package that each public name is from; imported when the name is first used, for a quick start."""

__all__ = [*sorted(_HOMES), "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    home = _HOMES[name]
    if home is None:
        value: Any = importlib.import_module(f".{name}", __name__)
    else:
        value = getattr(__import__(f"{__name__}.{home}", fromlist=[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*_HOMES, *(name for name in globals() if name.startswith("__"))})


class _Package(ModuleType):
    """Keeps a function from being hidden by the module of the same name when that module is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (_HOMES.get(name) and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by name, as plain modules are by those who send functions with what they use to other processes."""
        return importlib.import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Package
