"""Build hook: wheels get the module of compiled kernels; editable installs have what `make` builds in place.

Where there is no C compiler, or with PFABRIK_PURE in the environment, the wheel has none, and Numba compiles: see
`docs/install.md`.
"""

import os
import subprocess
import sys
import sysconfig

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Kernels(BuildHookInterface):
    def initialize(self, version, build_data):
        if version == "editable" or os.environ.get("PFABRIK_PURE"):
            return
        script = os.path.join(self.root, "building", "compile_kernels.py")
        if subprocess.run([sys.executable, script], check=False).returncode:
            self.app.display_warning("kernels were not compiled: this wheel needs Numba, the extra jit")
            return
        platform = sysconfig.get_platform()
        build_data["artifacts"] += ["/src/pfabrik/kernels/_compiled.*"]
        build_data["pure_python"] = False
        build_data["tag"] = f"cp311-abi3-{platform.replace('-', '_').replace('.', '_')}"
