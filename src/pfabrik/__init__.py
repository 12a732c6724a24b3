"""pfabrik: the kinematics of parallel mechanisms, from a small file to exact, honest answers."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Where each public name lives. Modules are imported when a name is first used, so that `import pfabrik` is quick.
_HOMES = {
    "Cone": "mechanism",
    "Joint": "mechanism",
    "Leg": "legs",
    "Mechanism": "mechanism",
    "load": "files",
    "save": "files",
    "catalog": "catalog",
    "pose": "poses",
    "Options": "options",
    "Solution": "solution",
    "Status": "solution",
    "ActiveLimit": "limits",
    "SubChain": "decompose",
    "decompose": "decompose",
    "solve_ik": "ik",
    "track": "track",
    "Track": "tracked",
    "reach": "reach",
    "margins": "margins",
    "AssemblyModes": "assembly",
    "assembly_modes": "assembly",
    "WorkingModes": "working",
    "working_modes": "working",
    "closure_residual": "residual",
    "Mobility": "differential",
    "Singularity": "differential",
    "mobility": "differential",
    "inverse_jacobian": "differential",
    "forward_jacobian": "differential",
    "singularity": "differential",
    "solve_fk": "fk",
}
# Modules that are themselves public.
_MODULES = ("errors", "geometric")

__all__ = [
    "ActiveLimit",
    "AssemblyModes",
    "Cone",
    "Joint",
    "Leg",
    "Mechanism",
    "Mobility",
    "Options",
    "Singularity",
    "Solution",
    "Status",
    "SubChain",
    "Track",
    "WorkingModes",
    "__version__",
    "assembly_modes",
    "catalog",
    "closure_residual",
    "decompose",
    "errors",
    "forward_jacobian",
    "geometric",
    "inverse_jacobian",
    "load",
    "margins",
    "mobility",
    "pose",
    "reach",
    "save",
    "singularity",
    "solve_fk",
    "solve_ik",
    "track",
    "working_modes",
]

if TYPE_CHECKING:
    from . import errors, geometric
    from .assembly import AssemblyModes, assembly_modes
    from .catalog import catalog
    from .decompose import SubChain, decompose
    from .differential import Mobility, Singularity, forward_jacobian, inverse_jacobian, mobility, singularity
    from .files import load, save
    from .fk import solve_fk
    from .ik import solve_ik
    from .legs import Leg
    from .limits import ActiveLimit
    from .margins import margins
    from .mechanism import Cone, Joint, Mechanism
    from .options import Options
    from .poses import pose
    from .reach import reach
    from .residual import closure_residual
    from .solution import Solution, Status
    from .track import track
    from .tracked import Track
    from .working import WorkingModes, working_modes


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
