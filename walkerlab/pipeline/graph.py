"""The pipeline on one page: every stage, what it reads of the config, and which results it needs."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from walkerlab.config import reads
from walkerlab.config.reads import RigidConfig, SceneConfig, StartConfig
from walkerlab.errors import ConfigError
from walkerlab.registration import later
from walkerlab.scene.omissions import contact_walk_omissions, rigid_walk_omissions
from walkerlab.scene.studies import is_studied

# The table is also what the command line's help is made of, which loads no config and no pydantic.
if TYPE_CHECKING:
    from walkerlab.config.schema import Config

NO_CONTACT = "the config has no contact block"
Inputs = Callable[["Config"], tuple[str, ...]]
Lacks = Callable[["Config"], tuple[dict[str, str], ...]]


def nothing(_config: object) -> tuple[Any, ...]:
    """No results of other stages, or nothing that is left out."""
    return ()


def results_of(*names: str) -> Inputs:
    """The results of these stages, whatever the config."""
    return lambda _config: names


def gait_unless_start_is_given(config: StartConfig) -> tuple[str, ...]:
    """The fixed point, unless the config has a start state: so a slope without a gait can be walked too."""
    return ("fixedpoint",) if config.start == "fixed-point" else ()


def gait_for_start_or_pads(config: SceneConfig) -> tuple[str, ...]:
    """The fixed point, if the start state or the pads' pitch is taken from it."""
    pitch_of_gait = config.contact is not None and config.contact.pad_pitch == "rigid"
    return ("fixedpoint",) if pitch_of_gait else gait_unless_start_is_given(config)


def known_and_start(config: SceneConfig) -> tuple[str, ...]:
    """The known problems, and for walkers that are no study's, judged in their own scene, its start."""
    return ("known-problems", *(() if is_studied(config) else gait_for_start_or_pads(config)))


@dataclass(frozen=True)
class Stage:
    """One stage of the pipeline.

    name           as on the command line, and of its artifact
    module         where its `run` is; imported only when it runs
    purpose        one line for the user
    takes          type of the config that its `run` takes, and so what its result depends on; None for all of it
    takes_of_scene the same for a walker that is no study's, where it is another type
    takes_of_paper what its own cases stand on of the built-in paper config
    programs       the versions of other programs that its result depends on, by name
    inputs         the stages whose results it needs under a config, earlier in the table
    if_current     the stages whose results it takes if they happen to be there and current
    needs_contact  whether it is left out when the config has no contact block
    draws          whether it writes files beside its artifact, from whatever results there are
    walks          whether `--strides` means something to it; its `run` walks a second time for the numerical error,
                   unless told not to: `again`
    compiles_long  whether its kernels are worth compiling beside an earlier stage: its module has `compile_kernels`
    campaign_of    the stage whose `--full` runs it too; it is the user's choice, so nothing is stale without it
    on_demand      whether only its own command runs it; nothing is stale without it
    alone          whether it measures times, and so runs with nothing beside it
    early_with     the results with which it is worth drawing while others are still being computed
    follows        whether it runs over a parameter: `--over`, `--from`, `--to`, `--periods`; `again` is for it, too
    of_a_model     whether it asks about gaits of a model that is to be named: `--model`
    designs        whether it has a question of its own: `--minimise`, `--maximise`, `--over`, `--keep`
    does_without   what is left out of its scene under a config: what, why, and what that saves
    """

    name: str
    module: str
    purpose: str
    takes: type | None
    inputs: Inputs = nothing
    if_current: tuple[str, ...] = ()
    needs_contact: bool = False
    draws: bool = False
    walks: bool = False
    compiles_long: bool = False
    campaign_of: str = ""
    on_demand: bool = False
    alone: bool = False
    early_with: tuple[str, ...] = ()
    follows: bool = False
    of_a_model: bool = False
    designs: bool = False
    does_without: Lacks = nothing
    takes_of_scene: type | None = None
    takes_of_paper: type | None = None
    programs: Callable[[], Mapping[str, str]] | None = None

    @property
    def reads(self) -> tuple[str, ...]:
        """The keys of the config that its result depends on, dotted."""
        if self.takes is not None:
            return tuple(reads.dotted_keys(self.takes))
        from walkerlab.config.schema import Config  # not for the help of the command line

        return tuple(Config.model_fields)

    def takes_under(self, config: RigidConfig) -> type | None:
        """What its result depends on under a config."""
        return self.takes if self.takes_of_scene is None or is_studied(config) else self.takes_of_scene

    def results(self, config: Config) -> tuple[str, ...]:
        """The stages whose results it gets: those that it needs, and those that it takes if they are current."""
        return (*self.inputs(config), *self.if_current)

    def why_unsuited(self, config: Config) -> str | None:
        """Why it means nothing under a config; None if it does."""
        return NO_CONTACT if self.needs_contact and config.contact is None else None

    def refuse_unsuited(self, asked: str, config: Config) -> None:
        """Raise ConfigError if it means nothing under a config, being what is asked for or what this needs."""
        from walkerlab.config.walkers import contact_to_add, without_contact  # not for the help of the command line

        if self.why_unsuited(config) is not None:
            block = f"`{contact_to_add(config.walker)}`"
            instead = f"Add one to the config, such as the paper's by this walker's mass: {block}."
            raise without_contact(asked, config.walker, f"{instead} `walkerlab schema contact` explains its keys.")

    def refuse_question(self, config: Config) -> None:
        """Raise ConfigError, before anything runs, for what `refuse` of its module refuses: of stages on demand."""
        refuse = getattr(importlib.import_module(self.module), "refuse", None) if self.on_demand else None
        if refuse is not None:
            refuse(reads.only(config, self.takes_under(config)))

    @property
    def command(self) -> str:
        """What is typed to have its result."""
        return f"{self.campaign_of} --full" if self.campaign_of else self.name

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

    def needed_in_memory(self, target: str, config: Config) -> tuple[Stage, ...]:
        """The same for a result without files.

        Raises ConfigError if the config lacks what a stage needs, and for a stage that draws the files of its run.
        """
        stages = self.needed_for(target, config)
        for stage in stages:
            if stage.draws:
                raise ConfigError(f"{stage.name} draws the files of its run; it has no result without them.")
            stage.refuse_unsuited(target, config)
        return stages

    def campaigns_of(self, target: str) -> tuple[Stage, ...]:
        """What `--full` runs besides."""
        return tuple(stage for stage in self.stages if stage.campaign_of == target)


WALKED = ("fixedpoint", "simulate", "contact-sim")
PIPELINE = Graph(
    Stage(
        "fixedpoint", "walkerlab.stages.fixedpoint",
        "Find the periodic gait of the rigid model and its multipliers.", reads.FixedPointConfig,
    ),
    Stage(
        "simulate", "walkerlab.stages.simulate", "Walk the rigid model.", reads.SimulateConfig,
        gait_unless_start_is_given, walks=True, does_without=rigid_walk_omissions,
    ),
    Stage(
        "contact-sim", "walkerlab.stages.contact_sim", "Walk the contact model, its contact forces as in ADAMS.",
        reads.ContactSimConfig, gait_for_start_or_pads, needs_contact=True, walks=True, compiles_long=True,
        does_without=contact_walk_omissions,
    ),
    Stage(
        "tune", "walkerlab.paper.tune",
        "Adjust the initial velocities until the contact model walks; say whether, how much, and why.",
        reads.TuneConfig, results_of("fixedpoint"), needs_contact=True,
        does_without=later("walkerlab.paper.left_out", "of_adjustment"),
    ),
    Stage(
        "compare", "walkerlab.paper.compare",
        "Compare both models with each other and with every number of the paper.", reads.CompareConfig,
        results_of(*WALKED), needs_contact=True,
    ),
    Stage(
        "accuracy", "walkerlab.benchmarks.accuracy", "Measure error against run time, method by method.",
        reads.SceneConfig, gait_for_start_or_pads, alone=True,
    ),
    Stage(
        "engines", "walkerlab.benchmarks.engines.stage",
        "Walk in other engines (MuJoCo, Drake, Exudyn): our contact law in their integrators, then their own contact.",
        reads.SceneConfig, gait_for_start_or_pads, needs_contact=True, on_demand=True,
        programs=later("walkerlab.benchmarks.engines.registry", "installed_versions"),
    ),
    Stage(
        "known-problems", "walkerlab.verification.known_problems",
        "Check the contact code on problems whose answers are known, once for all scenes.", object,
    ),
    Stage(
        "stability", "walkerlab.verification.stability", "Verify extreme cases and problems with known answers.",
        reads.CompassCasesConfig, known_and_start, takes_of_scene=reads.SceneCasesConfig,
        takes_of_paper=reads.WalksConfig, does_without=later("walkerlab.verification.left_out", "of_verification"),
    ),
    Stage(
        "stability-maps", "walkerlab.verification.stability_maps",
        "Map stability over stiffness, stiction velocity and step size; resumes where it was interrupted.",
        reads.MapsConfig, campaign_of="stability", takes_of_paper=reads.WalksConfig,
    ),
    Stage(
        "continuation", "walkerlab.stages.continuation",
        "Follow families of gaits over a parameter: branches, bifurcations, cascades, chaos.",
        reads.ContinuationConfig, on_demand=True, follows=True, of_a_model=True,
    ),
    Stage(
        "basin", "walkerlab.stages.basin",
        "Map which starts reach which attractor, and which fall; resumes where it was interrupted.",
        reads.BasinConfig, results_of("fixedpoint"), on_demand=True,
    ),
    Stage(
        "robustness", "walkerlab.stages.robustness",
        "Ask what a gait withstands: drops, pushes, rough ground, and which number of the walker moves it most.",
        reads.RobustnessConfig, results_of("fixedpoint"), on_demand=True, of_a_model=True,
    ),
    Stage(
        "design", "walkerlab.stages.design",
        "Find the walker whose gait has the least or largest of a number, within bounds.",
        reads.DesignConfig, results_of("fixedpoint"), on_demand=True, designs=True, of_a_model=True,
    ),
    Stage(
        "plot", "walkerlab.figures.stage", "Draw the figures from the stored results.", reads.NamedConfig,
        results_of(*WALKED, "compare"), draws=True,
        if_current=("accuracy", "engines", "tune", "stability-maps", "continuation", "basin", "robustness"),
    ),
    Stage(
        "report", "walkerlab.report.stage", "Write the report, one HTML file.", None,
        results_of(*WALKED, "tune", "compare", "accuracy", "stability", "plot"), draws=True, early_with=WALKED,
        if_current=("engines", "stability-maps", "continuation", "basin", "robustness"),
    ),
)  # fmt: skip
STAGES = PIPELINE.stages
