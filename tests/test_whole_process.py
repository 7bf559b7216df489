"""Compare the packages that a process of `walkerlab simulate` loads with the minimum."""

import runpy
import subprocess
import sys
from pathlib import Path

SCRIPT = runpy.run_path(str(Path(__file__).parents[1] / "scripts" / "whole_process.py"))
# packages that are not needed for a walk if the gait exists already
HEAVY = ("scipy.integrate", "scipy.optimize", "matplotlib", "heyoka", "sksundae", "sympy")
LOADED = "\nimport sys\nprint(*(name for name in {heavy!r} if name in sys.modules), file=sys.stderr)\n"


def loaded_by(code, *arguments):
    """Return the heavy packages that a process has loaded at its end."""
    told = code + LOADED.format(heavy=HEAVY)
    done = subprocess.run([sys.executable, "-c", told, *arguments], capture_output=True, text=True, check=True)
    return done.stderr.splitlines()[-1].split()


def test_walking_from_a_bare_script_imports_no_heavy_package(tmp_path):
    assert loaded_by(SCRIPT["BARE"], str(tmp_path / "bare.h5")) == []
    assert (tmp_path / "bare.h5").stat().st_size > 0


def test_warm_simulate_loads_no_more_packages_than_the_bare_process(tmp_path):
    simulate = (
        "from walkerlab.views.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
    )
    arguments = ("simulate", "--quiet", "--runs", str(tmp_path))
    loaded_by(simulate, *arguments)
    (tmp_path / "paper" / "simulate.h5").unlink()
    assert loaded_by(simulate, *arguments) == []
    assert (tmp_path / "paper" / "simulate.h5").exists()
