"""Measure how much time, compile time and storage is saved by what a config omits.

Times are processor times. `benchmark.py` prints the table and writes it into docs/performance.md.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from statistics import median

from walkerlab.config import loader
from walkerlab.config.schema import Config
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.store.artifact import Identity, write
from walkerlab.pipeline.store.provenance import Provenance, begin
from walkerlab.scene.contact import contact_scene, start_state

ROOT = Path(__file__).resolve().parent.parent
# The start state and the pads are given, so that no other stage has to run.
GAIT = (-0.2042, 0.1694, -0.6, -0.86)
GIVEN = (f"start={list(GAIT)}", "contact.pad_pitch=0.3714")
BUDGET = 10_000_000  # right-hand sides
IDENTITY = Identity("measured", {}, {}, "")
NO_FRICTION = ("contact.static_friction=0", "contact.dynamic_friction=0")
ALIKE = 0.05  # Times that differ by less than this fraction count as equal.
HEAD = ("left out", "against", "right-hand side, ns", "run, ms", "import, s", "compile, s", "file, kB", "conclusion")
QUANTITIES = ("a right-hand side", "a run", "importing", "compiling", "the file")

Pair = tuple[float, float]


@dataclass(frozen=True)
class Scene:
    """A stage and settings, as in `walkerlab STAGE --set ...`."""

    stage: str
    sets: tuple[str, ...]

    def once(self, artifact: Path) -> None:
        """Run the stage alone, and store its result."""
        content = import_module(PIPELINE[self.stage].module).run(self.config, {}, Silent())
        write(artifact, content, IDENTITY, self.origin)

    @cached_property
    def config(self) -> Config:
        """Return the paper's config with the changes."""
        return loader.load(None, self.sets).config

    @cached_property
    def origin(self) -> Provenance:
        """Return the identity to store with the result."""
        return begin(self.config, {})

    def command(self, runs: Path) -> list[str]:
        """Return the command line of a run."""
        sets = [word for one in self.sets for word in ("--set", one)]
        return [sys.executable, "-m", "walkerlab", self.stage, "--quiet", "--force", "--runs", str(runs), *sets]


def with_books(kept: bool) -> None:
    """Simulate the paper's walk. If `kept` is true, also keep the energy balance: losses to damping, friction and
    edges.
    """
    scene = contact_scene(contact().config, 0.3714)
    settings = contact().config.solver.contact
    tolerances = Tolerances(settings.method, settings.rtol, settings.atol, BUDGET)
    replace(scene, pinned=False).walk(start_state(scene, GAIT), 10, replace(tolerances, track_energy=kept))


@dataclass(frozen=True)
class Reduction:
    """An omission: a full and a reduced scene, their right-hand sides, and remarks.

    sides    names of the full and the reduced right-hand side
    scenes   the full and the reduced scene, run for time and size
    works    calls to time in place of scenes
    compile  whether to compile the two separately
    imports  Python code of the imports of both
    note     remark next to the measured conclusion
    """

    what: str
    against: str
    sides: tuple[str, str] | None = None
    scenes: tuple[Scene, Scene] | None = None
    works: tuple[Callable[[], None], Callable[[], None]] | None = None
    compile: bool = False
    imports: tuple[str, str] | None = None
    note: str = ""
    found: dict[str, Pair] = field(default_factory=dict)


def contact(*sets: str, strides: int = 5) -> Scene:
    """Build a scene with a walk of the contact model."""
    return Scene("contact-sim", (*GIVEN, f"strides={strides}", *sets))


def rigid(*sets: str) -> Scene:
    """Build a scene with a walk of the rigid model."""
    return Scene("simulate", (GIVEN[0], "strides=5", *sets))


def outputs(*names: str) -> str:
    """Return the setting for these outputs alone."""
    return f"outputs=[{','.join(names)}]"


def reductions() -> list[Reduction]:
    """Return all omissions, and one that was tried and saves nothing."""
    whole, none = contact(), contact(outputs())
    import_stage = "import walkerlab.{}, walkerlab.pipeline.run.runner"
    walking, drawing = import_stage.format("pipeline.stages.simulate"), import_stage.format("views.figures.stage")
    return [
        Reduction(
            "the contact model: no contact block",
            "contact-sim, which simulate alone does without",
            ("contact", "rigid"),
            (contact(), rigid("contact=null")),
            compile=True,
            imports=(import_stage.format("stages.contact_sim"), walking),
        ),
        Reduction(
            "floating base and stance contact: first step pinned",
            "free first step",
            ("contact", "contact, pinned"),
            (contact(strides=1), contact("contact.stance=pinned", strides=1)),
            compile=True,
            note="one compiled walk serves both kinds of step",
        ),
        Reduction(
            "tangential velocity and force: frictionless",
            "coefficients of zero",
            ("contact, friction of zero", "contact, frictionless"),
            (contact(*NO_FRICTION), contact("contact.friction=none")),
            compile=True,
        ),
        Reduction(
            "leg inertia",
            "0.1 kg m^2",
            ("contact, inertia", "contact"),
            note="the inertia is summed into constants before anything runs, so that there is no term to leave out",
        ),
        Reduction("energies", "all outputs", scenes=(whole, contact(outputs("states", "forces")))),
        Reduction("forces", "all outputs", scenes=(whole, contact(outputs("states", "energies")))),
        Reduction("states", "all outputs", scenes=(whole, contact(outputs("energies", "forces")))),
        Reduction("all outputs, so dense states", "all outputs", scenes=(whole, none)),
        Reduction("all outputs of the rigid walk", "all outputs", scenes=(rigid(), rigid(outputs()))),
        Reduction(
            "dissipation: the energy balance",
            "kept along the walk",
            works=(partial(with_books, True), partial(with_books, False)),
            note="contact-sim keeps them, and so do searches and maps: a walk that does not balance is no answer",
        ),
        Reduction("matplotlib: nothing is drawn", "a command that draws", imports=(drawing, walking)),
        Reduction(
            "all science: help is shown",
            "a command that walks",
            imports=(
                walking,
                "import sys; sys.argv = ['walkerlab', 'schema', '--help']; import walkerlab.views.cli.main",
            ),
        ),
    ]


def leaving_out_rows(sides: dict[str, float], repeats: int) -> list[list[str]]:
    """Return the rows of the table. `sides` has the times of all right-hand sides."""
    with tempfile.TemporaryDirectory() as place:
        found = [measured(one, sides, repeats, Path(place)) for one in reductions()]
    return [row_of(one) for one in found]


def measured(one: Reduction, sides: dict[str, float], repeats: int, place: Path) -> Reduction:
    """Measure one omission."""
    found: dict[str, Pair] = {}
    if one.sides is not None:
        found["a right-hand side"] = (sides[one.sides[0]], sides[one.sides[1]])
    if one.scenes is not None:
        full, reduced = one.scenes
        files = place / "full.h5", place / "reduced.h5"
        took = in_turn(repeats, partial(full.once, files[0]), partial(reduced.once, files[1]))
        found["a run"] = (1e3 * took[0], 1e3 * took[1])
        found["the file"] = (files[0].stat().st_size / 1e3, files[1].stat().st_size / 1e3)
        if one.compile:
            found["compiling"] = (compile_s(full, place), compile_s(reduced, place))
    if one.works is not None:
        took = in_turn(repeats, *one.works)
        found["a run"] = (1e3 * took[0], 1e3 * took[1])
    if one.imports is not None:
        found["importing"] = in_turn(repeats, *(partial(run, [sys.executable, "-c", code]) for code in one.imports))
    one.found.update(found)
    return one


def in_turn(repeats: int, full: Callable[[], object], reduced: Callable[[], object]) -> Pair:
    """Return medians of the processor times (s) of two calls that take turns, after one uncounted call of each."""
    full(), reduced()
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        for work, taken in zip((full, reduced), times, strict=True):
            start = processor_s()
            work()
            taken.append(processor_s() - start)
    return median(times[0]), median(times[1])


def processor_s() -> float:
    """Return the processor time (s) of this process and its finished children."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def run(command: Sequence[str], cache: Path | None = None) -> None:
    """Run a process to its end."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)} | ({"WALKERLAB_CACHE": str(cache)} if cache else {})
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)


def compile_s(scene: Scene, place: Path) -> float:
    """Return the processor time of compiling (s): that of a first run minus that of a second one."""
    with tempfile.TemporaryDirectory(dir=place) as cache:
        work = partial(run, scene.command(place), Path(cache))
        start = processor_s()
        work()
        first = processor_s() - start
        start = processor_s()
        work()
        return first - (processor_s() - start)


def row_of(one: Reduction) -> list[str]:
    """Format a row, with each quantity as full → reduced."""
    pairs = [one.found.get(name) for name in QUANTITIES]
    cells = ["" if pair is None else f"{digits(pair[0])} → {digits(pair[1])}" for pair in pairs]
    note = f"; {one.note}" if one.note else ""
    return [one.what, one.against, *cells, conclusion(one.found) + note]


def digits(value: float) -> str:
    """Format a number with three digits, or all digits before the point."""
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.3g}"


def conclusion(found: dict[str, Pair]) -> str:
    """State what is saved, what is not, and what is slower."""
    saved = {name: 1.0 - reduced / full for name, (full, reduced) in found.items()}
    gains = [f"{100 * share:.0f} % of {name}" for name, share in saved.items() if share > ALIKE]
    losses = [f"{-100 * share:.0f} % to {name}" for name, share in saved.items() if share < -ALIKE]
    said = [f"saves {', '.join(gains)}" if gains else "saves nothing"]
    return "; ".join([*said, *([f"**adds {', '.join(losses)}**"] if losses else [])])
