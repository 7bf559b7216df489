"""Find the commit of a checkout (from git) or of an installed package (recorded by its build).

This file imports only the standard library, because the build loads it before anything is installed.
"""

import importlib.metadata
import subprocess
from pathlib import Path

FILE = "commit.txt"
"""Name of the file that states the commit.

It is at the root of a source distribution and in the metadata of an installed package.
"""
IN_METADATA = f"extra_metadata/{FILE}"
SHIPPED = ("walkerlab", "configs")
"""Parts of a checkout that an installed package contains."""


def commit_of_checkout(root: Path) -> str | None:
    """Return the commit of a source tree, followed by '-dirty' if package files have changed, or None if it is not
    a checkout."""
    # Without this check, git would report the commit of another checkout that contains the environment.
    if not (root / ".git").exists():
        return None
    commit = git(root, "rev-parse", "HEAD")
    if commit is None:
        return None
    return f"{commit}-dirty" if git(root, "status", "--porcelain", "--", *SHIPPED) else commit


def commit_of_installation(package: Path) -> str | None:
    """Return the commit from which an installed package was built, or None if it is unknown or there is no such
    package."""
    try:
        installed = importlib.metadata.distribution(package.name)
    except importlib.metadata.PackageNotFoundError:
        return None
    if Path(str(installed.locate_file(package.name))).resolve() != package.resolve():
        return None
    return (installed.read_text(IN_METADATA) or "").strip() or None


def commit_of_package(package: Path) -> str | None:
    """Return the commit of the source from which the package in a folder runs or was built, or None if it is
    unknown."""
    return commit_of_checkout(package.parent) or commit_of_installation(package)


def commit_of_source(root: Path) -> str | None:
    """Return the commit of a source tree to build: a checkout or an unpacked source distribution."""
    written = root / FILE
    return commit_of_checkout(root) or (written.read_text().strip() if written.exists() else None)


def git(root: Path, *arguments: str) -> str | None:
    """Return the output of a git command, or None if it fails."""
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
