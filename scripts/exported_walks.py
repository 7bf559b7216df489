#!/usr/bin/env python3
"""Integrate ADAMS models from nothing but the exported text, and compare the touch times with those of our walk.

Usage: python scripts/exported_walks.py [number of random walkers, 10 by default]
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "exchange"))

from adams_dataset import Dataset
from exported_walkers import export_of, files_of, random_walker, touches_of

TOUCHES = 3


def main(count: int) -> None:
    """Print the largest difference of touch times (s) over three steps of each walker."""
    for seed in range(count):
        walker = random_walker(seed)
        export = export_of(*walker)
        text = next(iter(files_of("adm", "functions", *walker).files.values()))
        steps = min(TOUCHES, export.walk.steps)
        touches = touches_of(Dataset(text), export, steps)[:steps]
        print(f"{seed} {' '.join(walker)}", flush=True)
        print(f"  {steps} steps: {np.max(np.abs(touches - export.touches_s[:steps])):.1e} s", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
