"""Print the lowest versions that pyproject.toml allows, as constraints for pip: NAME==VERSION on each line.

python scripts/floors.py > floors.txt && pip install -c floors.txt .
"""

import re
import tomllib
from pathlib import Path

FLOOR = re.compile(r"([\w.-]+)>=([\w.]+)")


def floors():
    """Yield each dependency of the package with its lowest version."""
    project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for dependency in project["dependencies"]:
        yield FLOOR.match(dependency).groups()


if __name__ == "__main__":
    for name, version in floors():
        print(f"{name}=={version}")
