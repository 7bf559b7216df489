"""Writes the commit that a package is built from into it; run by the build (pyproject.toml), not by hand."""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CommitHook(BuildHookInterface[Any]):
    """Adds a file with the commit: to a wheel's metadata, to the root of a source distribution."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add it, if anybody knows the commit; an editable installation has its checkout to ask."""
        commit = commit_module(Path(self.root))
        known = commit.commit_of_source(Path(self.root))
        if known is None or version == "editable":
            return
        self.folder = tempfile.TemporaryDirectory()  # gone when the build is
        path = Path(self.folder.name, commit.FILE)
        path.write_text(f"{known}\n")
        place = "extra_metadata" if self.target_name == "wheel" else "force_include"
        build_data[place][str(path)] = commit.FILE


def commit_module(root: Path) -> Any:
    """The package's own module about commits, loaded without the package."""
    spec = importlib.util.spec_from_file_location("commit", root / "walkerlab" / "pipeline" / "store" / "commit.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
