"""Which commit code is from: of a checkout as git says, of an installed package as its build wrote down.

Nothing but the standard library is needed: the build, which runs before anything is installed, loads this file too.
"""

import importlib.metadata
import subprocess
from pathlib import Path

FILE = "commit.txt"
"""At the root of a source distribution, and in the metadata of an installed package."""
IN_METADATA = f"extra_metadata/{FILE}"
SHIPPED = ("walkerlab", "configs")
"""What of a checkout an installed package is made of."""


def commit_of_checkout(root: Path) -> str | None:
    """The commit of a source tree, '-dirty' if what a package has of it was changed; None if it is no checkout."""
    # Only the package's own repository: an environment inside somebody's checkout says nothing about this code.
    if not (root / ".git").exists():
        return None
    commit = git(root, "rev-parse", "HEAD")
    if commit is None:
        return None
    return f"{commit}-dirty" if git(root, "status", "--porcelain", "--", *SHIPPED) else commit


def commit_of_installation(package: Path) -> str | None:
    """The commit that an installed package was built from; None if `package` is no installed one, or nobody knew."""
    try:
        installed = importlib.metadata.distribution(package.name)
    except importlib.metadata.PackageNotFoundError:
        return None
    if Path(str(installed.locate_file(package.name))).resolve() != package.resolve():
        return None
    return (installed.read_text(IN_METADATA) or "").strip() or None


def commit_of_package(package: Path) -> str | None:
    """The commit that the package in a folder is run from, or was built from; None if nobody knows."""
    return commit_of_checkout(package.parent) or commit_of_installation(package)


def commit_of_source(root: Path) -> str | None:
    """The commit of a source tree that is to be built: a checkout, or an unpacked source distribution."""
    written = root / FILE
    return commit_of_checkout(root) or (written.read_text().strip() if written.exists() else None)


def git(root: Path, *arguments: str) -> str | None:
    """What a git command prints, or None if it cannot be had."""
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
