"""The pipeline on one page: every stage, what it reads of the config, and which results it needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from walkerlab.scene.left_out import of_adjustment, of_contact_walk, of_rigid_walk, of_the_compass, of_verification

# The table is also what the command line's help is made of, which loads no config and no pydantic.
if TYPE_CHECKING:
    from walkerlab.config.schema import Config

Inputs = Callable[["Config"], tuple[str, ...]]
Lacks = Callable[["Config"], tuple[dict[str, str], ...]]


def nothing(_config: Config) -> tuple[Any, ...]:
    """No results of other stages, or nothing that is left out."""
    return ()


def results_of(*names: str) -> Inputs:
    """The results of these stages, whatever the config."""
    return lambda _config: names


def gait_unless_start_is_given(config: Config) -> tuple[str, ...]:
    """The fixed point, unless the config has a start state: so a slope without a gait can be walked too."""
    return ("fixedpoint",) if config.start == "fixed-point" else ()


def gait_for_start_or_pads(config: Config) -> tuple[str, ...]:
    """The fixed point, if the start state or the pads' pitch is taken from it."""
    pitch_of_gait = config.contact is not None and config.contact.pad_pitch == "rigid"
    return ("fixedpoint",) if pitch_of_gait else gait_unless_start_is_given(config)


def known_and_start(config: Config) -> tuple[str, ...]:
    """The known problems, and for other walkers than the paper's compass, judged in their own scene, its start."""
    return ("known-problems", *(() if of_the_compass(config) else gait_for_start_or_pads(config)))


def engines_installed() -> Mapping[str, str]:
    """The engines that are installed, with their versions."""
    from walkerlab.benchmarks.engines.registry import installed

    return {engine.name: engine.version for engine in installed()}


@dataclass(frozen=True)
class Stage:
    """One stage of the pipeline.

    name           as on the command line, and of its artifact
    module         where its `run` is; imported only when it runs
    purpose        one line for the user
    reads          keys of the config that its result depends on; it is shown no others
    programs       the versions of other programs that its result depends on, by name
    reads_of_paper keys of the built-in paper config on which its own cases stand
    inputs         the stages whose results it needs under a config, earlier in the table
    if_current     the stages whose results it takes if they happen to be there and current
    needs_contact  whether it is left out when the config has no contact block
    reads_of_scene keys that it reads besides for another walker than the paper's compass
    draws          whether it writes files beside its artifact, from whatever results there are
    walks          whether `--strides` means something to it
    has_cells      whether it has independent cells for `--jobs`
    compiles_long  whether its kernels are worth compiling beside an earlier stage: its module has `compile_kernels`
    campaign_of    the stage whose `--full` runs it too; it is the user's choice, so nothing is stale without it
    on_demand      whether only its own command runs it; nothing is stale without it
    keeps_parts    whether it keeps parts of its result, to go on where a run was cut off
    alone          whether it measures times, and so runs with nothing beside it
    early_with     the results with which it is worth drawing while others are still being computed
    follows        whether it runs over a parameter: `--over`, `--from`, `--to`, `--model`, `--periods`
    does_without   what is left out of its scene under a config: what, why, and what that saves
    """

    name: str
    module: str
    purpose: str
    reads: tuple[str, ...]
    inputs: Inputs = nothing
    if_current: tuple[str, ...] = ()
    needs_contact: bool = False
    draws: bool = False
    walks: bool = False
    has_cells: bool = False
    compiles_long: bool = False
    campaign_of: str = ""
    on_demand: bool = False
    keeps_parts: bool = False
    alone: bool = False
    early_with: tuple[str, ...] = ()
    follows: bool = False
    does_without: Lacks = nothing
    reads_of_paper: tuple[str, ...] = ()
    reads_of_scene: tuple[str, ...] = ()
    programs: Callable[[], Mapping[str, str]] | None = None

    def reads_under(self, config: Config) -> tuple[str, ...]:
        """The keys that its result depends on under a config."""
        return self.reads if not self.reads_of_scene or of_the_compass(config) else (*self.reads, *self.reads_of_scene)

    @property
    def optional(self) -> bool:
        """Whether it runs only if the user asks for it."""
        return self.on_demand or bool(self.campaign_of)


class Graph:
    """Stages in an order in which they can run."""

    def __init__(self, *stages: Stage) -> None:
        """Keep the stages; ValueError if two have one name."""
        self.stages = stages
        self._by_name = {stage.name: stage for stage in stages}
        if len(self._by_name) != len(stages):
            raise ValueError("two stages have one name")

    def __getitem__(self, name: str) -> Stage:
        """The stage of a name; KeyError if there is none."""
        return self._by_name[name]

    def needed_for(self, target: str, config: Config) -> tuple[Stage, ...]:
        """The target and all it needs under a config, in the order in which they run."""
        needed = {target}
        for stage in reversed(self.stages):
            if stage.name in needed:
                needed.update(stage.inputs(config))
        return tuple(stage for stage in self.stages if stage.name in needed)

    def campaigns_of(self, target: str) -> tuple[Stage, ...]:
        """What `--full` runs besides."""
        return tuple(stage for stage in self.stages if stage.campaign_of == target)


MODEL = ("walker", "gravity", "slope", "equations", "start", "strides", "outputs")
PAPERS_WALK = (*MODEL, "contact", "solver", "seed")
EVERYTHING = (
    "name",
    "source",
    *MODEL,
    "contact",
    "solver",
    "tune",
    "stability",
    "continuation",
    "basin",
    "sweep",
    "seed",
)

PIPELINE = Graph(
    Stage(
        "fixedpoint",
        "walkerlab.stages.fixedpoint",
        "Find the periodic gait of the rigid model and its multipliers.",
        reads=("walker", "gravity", "slope", "equations", "seed"),
    ),
    Stage(
        "simulate",
        "walkerlab.stages.simulate",
        "Walk the rigid model.",
        reads=(*MODEL, "solver.rigid"),
        inputs=gait_unless_start_is_given,
        walks=True,
        does_without=of_rigid_walk,
    ),
    Stage(
        "contact-sim",
        "walkerlab.stages.contact_sim",
        "Walk the contact model, its contact forces as in ADAMS.",
        reads=(*MODEL, "contact", "solver.contact"),
        inputs=gait_for_start_or_pads,
        needs_contact=True,
        walks=True,
        compiles_long=True,
        does_without=of_contact_walk,
    ),
    Stage(
        "tune",
        "walkerlab.stages.tune",
        "Adjust the initial velocities until the contact model walks: whether, how much, and why.",
        reads=("walker", "gravity", "slope", "equations", "start", "strides", "contact", "solver.contact", "tune"),
        inputs=results_of("fixedpoint"),
        needs_contact=True,
        has_cells=True,
        does_without=of_adjustment,
    ),
    Stage(
        "compare",
        "walkerlab.stages.compare",
        "Compare both models with each other and with every number of the paper.",
        reads=("walker", "gravity", "slope", "equations", "contact"),
        inputs=results_of("fixedpoint", "simulate", "contact-sim"),
        needs_contact=True,
    ),
    Stage(
        "accuracy",
        "walkerlab.stages.accuracy",
        "Measure error against run time, method by method.",
        reads=("walker", "gravity", "slope", "equations", "start", "contact"),
        inputs=gait_for_start_or_pads,
        has_cells=True,
        alone=True,
    ),
    Stage(
        "engines",
        "walkerlab.stages.engines",
        "Walk in other engines (MuJoCo, Drake, Exudyn): our law in their integrators, and their own contact.",
        reads=("walker", "gravity", "slope", "equations", "start", "contact"),
        inputs=gait_for_start_or_pads,
        needs_contact=True,
        has_cells=True,
        on_demand=True,
        programs=engines_installed,
    ),
    Stage(
        "known-problems",
        "walkerlab.stages.known_problems",
        "Answer problems with known answers through the contact code, once for every scene.",
        reads=(),
    ),
    Stage(
        "stability",
        "walkerlab.stages.stability",
        "Judge extreme cases and problems with known answers.",
        reads=("stability.cases",),
        reads_of_paper=PAPERS_WALK,
        reads_of_scene=PAPERS_WALK,
        inputs=known_and_start,
        has_cells=True,
        does_without=of_verification,
    ),
    Stage(
        "stability-maps",
        "walkerlab.stages.stability_maps",
        "Map stability over stiffness, stiction velocity and step size; goes on where it was interrupted.",
        reads=("stability.map_cells",),
        reads_of_paper=PAPERS_WALK,
        has_cells=True,
        campaign_of="stability",
        keeps_parts=True,
    ),
    Stage(
        "continuation",
        "walkerlab.stages.continuation",
        "Follow families of gaits over a parameter: branches, bifurcations, cascades, chaos.",
        reads=("walker", "gravity", "slope", "equations", "contact", "seed", "continuation"),
        on_demand=True,
        follows=True,
    ),
    Stage(
        "basin",
        "walkerlab.stages.basin",
        "Map which starts come to which attractor, and which fall; goes on where it was interrupted.",
        reads=("walker", "gravity", "slope", "equations", "start", "contact", "solver.contact", "basin", "seed"),
        inputs=results_of("fixedpoint"),
        has_cells=True,
        on_demand=True,
        keeps_parts=True,
    ),
    Stage(
        "plot",
        "walkerlab.stages.plot",
        "Draw the paper's figures from the stored results.",
        reads=("name",),
        inputs=results_of("fixedpoint", "simulate", "contact-sim", "compare"),
        if_current=("accuracy", "engines", "tune", "stability-maps", "continuation", "basin"),
        draws=True,
    ),
    Stage(
        "report",
        "walkerlab.stages.report",
        "Write the report, one HTML file.",
        reads=EVERYTHING,
        inputs=results_of("fixedpoint", "simulate", "contact-sim", "tune", "compare", "accuracy", "stability", "plot"),
        if_current=("engines", "stability-maps", "continuation", "basin"),
        draws=True,
        early_with=("fixedpoint", "simulate", "contact-sim"),
    ),
)
STAGES = PIPELINE.stages
