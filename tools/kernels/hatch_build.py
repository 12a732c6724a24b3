"""Build hook: wheels get the module of compiled kernels, and an sdist their C, from which it is built without NumPy.

Editable installs have what `make` builds in place. Where there is no C compiler, or with PFABRIK_PURE in the
environment, a wheel has none, and kernels are plain Python: see `docs/install.md`.
"""

import os
import subprocess
import sys
import sysconfig

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Kernels(BuildHookInterface):
    def initialize(self, version, build_data):
        script = [sys.executable, os.path.join(self.root, "tools", "kernels", "compile_kernels.py")]
        if self.target_name == "sdist":
            subprocess.run([*script, "--translate"], check=True)
            folder = os.path.join(self.root, "build", "kernels")
            for name in os.listdir(folder):
                if name.endswith((".c", ".h", ".sha256")):
                    build_data["force_include"][os.path.join(folder, name)] = f"build/kernels/{name}"
        if self.target_name != "wheel" or version == "editable" or os.environ.get("PFABRIK_PURE"):
            return
        if subprocess.run(script, check=False).returncode:
            self.app.display_warning("kernels were not compiled: in this wheel they are plain Python, far slower")
            return
        platform = sysconfig.get_platform()
        build_data["artifacts"] += ["/src/pfabrik/kernels/_compiled.*"]
        build_data["pure_python"] = False
        build_data["tag"] = f"cp311-abi3-{platform.replace('-', '_').replace('.', '_')}"
