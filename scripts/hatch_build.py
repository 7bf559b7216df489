"""Add the commit and the machine code of the kernels to a package, since both are known only when it is built (see
pyproject.toml).
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MACHINE_CODE = "walkerlab/physics/machine_code"
# The oldest systems on which the wheel works. They suffice, because the machine code calls only functions that every C
# library has.
OLDEST_SYSTEMS = ("manylinux_2_17_", "macosx_11_0_")


class PackageHook(BuildHookInterface[Any]):
    """Build hook that adds the commit to the metadata of a wheel or to the root of a source distribution, and machine
    code to a wheel.
    """

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add both. An editable installation needs neither, because it reads the commit from its checkout and compiles
        when it runs.
        """
        if version == "editable":
            return
        self.folder = tempfile.TemporaryDirectory()  # The folder is deleted after the build.
        self.add_commit(build_data)
        if self.target_name == "wheel" and os.environ.get("WALKERLAB_BUILD_KERNELS") != "0":
            self.add_machine_code(build_data)

    def add_commit(self, build_data: dict[str, Any]) -> None:
        commit = commit_module(Path(self.root))
        known = commit.commit_of_source(Path(self.root))
        if known is not None:
            path = Path(self.folder.name, commit.FILE)
            path.write_text(f"{known}\n")
            place = "extra_metadata" if self.target_name == "wheel" else "force_include"
            build_data[place][str(path)] = commit.FILE

    def add_machine_code(self, build_data: dict[str, Any]) -> None:
        """Compile all kernels of the built-in walkers, except those that are already in $WALKERLAB_CACHE."""
        code = Path(self.folder.name, "machine_code")
        environment = {"WALKERLAB_CACHE": str(Path(self.folder.name, "cache")), "OMP_NUM_THREADS": "1", **os.environ}
        call = f"from walkerlab.pipeline.run.compile_ahead import build; build({str(code)!r})"
        # an isolated build has its requirements on this path
        path = os.pathsep.join(filter(None, (self.root, os.environ.get("PYTHONPATH"))))
        done = subprocess.run(
            [sys.executable, "-c", call], cwd=self.root, env=environment | {"PYTHONPATH": path}, text=True
        )
        if done.returncode:
            raise SystemExit("walkerlab's kernels do not compile here; WALKERLAB_BUILD_KERNELS=0 builds without them.")
        if code.is_dir():
            build_data["force_include"][str(code)] = MACHINE_CODE
            build_data["pure_python"] = False
            build_data["tag"] = wheel_tag()


def wheel_tag() -> str:
    """Return the tag of a wheel for this Python on the oldest systems that its machine code supports."""
    from packaging.tags import interpreter_name, interpreter_version, platform_tags

    platforms = list(platform_tags())
    chosen = next((each for each in platforms if each.startswith(OLDEST_SYSTEMS)), platforms[0])
    return f"{interpreter_name()}{interpreter_version()}-none-{chosen}"


def commit_module(root: Path) -> Any:
    """Load the package's module about commits without the package."""
    spec = importlib.util.spec_from_file_location("commit", root / "walkerlab" / "pipeline" / "store" / "commit.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
