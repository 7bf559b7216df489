"""Declare the built-in stages, walks and questions, with their parts of the config, options and inputs.

The command line builds its help from this file, so the file imports no stage, no config schema and no NumPy.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

from walkerlab.config import reads
from walkerlab.extensions import INTERFACE, WORDS, Extension, load
from walkerlab.pipeline.plan.stage import (
    DRAWINGS,
    STRIDES,
    Option,
    Stage,
    dependency,
    gait_for_start_or_pads,
    gait_unless_start_is_given,
    recording_options,
    results_of,
)
from walkerlab.scene.omissions import contact_walk_omissions, rigid_walk_omissions

if TYPE_CHECKING:
    from walkerlab.config.schema import Config


def check_laws(config: "Config") -> None:
    """Raise ConfigError if a law of another package is incomplete, before anything is compiled."""
    contact = config.contact
    if config.walker.hip.hinge_law not in WORDS["hinge_law"]:
        load("walkerlab.scene.parts:hinge_law_of")(config.walker)
    if contact is not None and any(getattr(contact, key) not in WORDS[key] for key in ("normal_force", "friction")):
        load("walkerlab.scene.contact:ground_laws")(contact)


MODEL_HELP = "Model whose gaits are studied."
ESTIMATED = (
    Option("--fit", "identify.fit", "KEY[=A:B]", "Key to estimate, with optional bounds.", "bounds-or-none"),
    Option("--prior", "identify.prior", "KEY=VALUE:SIGMA", "Known value, and its standard deviation.", "bounds"),
    Option("--nuisance", "identify.nuisance", "NAME", "Property of clock or sensors to estimate as well.", "texts"),
    Option("--model", "identify.model", "rigid|contact|both", "Model to fit."),
)
ERRORS_TO_REACH = Option(
    "--error", "plan.errors", "KEY=SIGMA,...", "Standard error to plan for, in the key's unit.", "numbers"
)
WALKS = (
    Stage(
        "recorded-walk", "walkerlab.pipeline.stages.recorded_walk",
        "Read a walk recorded elsewhere and find its steps.", reads.RecordedWalkConfig, requires=("recording",),
        depends_on=dependency("files", "walkerlab.pipeline.stages.recorded_walk:digests"),
    ),
    Stage(
        "fixedpoint", "walkerlab.pipeline.stages.fixedpoint",
        "Find the periodic gait of the rigid model and its multipliers.", reads.FixedPointConfig,
        depends_on=dependency("equation_sets", "walkerlab.scene.studies:equation_sets"),
    ),
    Stage(
        "simulate", "walkerlab.pipeline.stages.simulate", "Simulate a walk of the rigid model.", reads.SimulateConfig,
        gait_unless_start_is_given, options=(STRIDES,), does_without=rigid_walk_omissions,
    ),
    Stage(
        "contact-sim", "walkerlab.pipeline.stages.contact_sim",
        "Simulate a walk of the contact model, with contact forces as in ADAMS.",
        reads.ContactSimConfig, gait_for_start_or_pads, options=(STRIDES,), requires=("contact",),
        does_without=contact_walk_omissions, checks=check_laws,
    ),
)  # fmt: skip
QUESTIONS = (
    Stage(
        "continuation", "walkerlab.pipeline.stages.continuation",
        "Follow families of gaits as a parameter varies: branches, bifurcations, cascades, chaos.",
        reads.ContinuationConfig, only_by="continuation", shown_by=DRAWINGS,
        options=(
            Option("--over", "continuation.over", "KEY", "Key to vary, e.g. slope_deg.", "key", ("--from", "--to")),
            Option("--from", "continuation.from", "A", "First value, in the key's unit.", "float"),
            Option("--to", "continuation.to", "B", "Last value.", "float"),
            Option("--model", "continuation.model", "rigid|contact|both", MODEL_HELP),
            Option("--periods", "continuation.periods", "N", "Maximum number of steps in a gait's period.", "int"),
        ),
    ),
    Stage(
        "basin", "walkerlab.pipeline.stages.basin",
        "Map which starts reach which attractor, and which fall; resumes where it was interrupted.",
        reads.BasinConfig, results_of("fixedpoint"), only_by="basin", shown_by=DRAWINGS,
    ),
    Stage(
        "robustness", "walkerlab.pipeline.stages.robustness",
        "Find the largest drop, push and roughness that a gait survives, and the parameter that matters most.",
        reads.RobustnessConfig, results_of("fixedpoint"), only_by="robustness", shown_by=DRAWINGS,
        options=(Option("--model", "robustness.model", "rigid|contact|both", MODEL_HELP),),
    ),
    Stage(
        "design", "walkerlab.pipeline.stages.design",
        "Optimise walker parameters within bounds.",
        reads.DesignConfig, results_of("fixedpoint"), only_by="design", finds="optimum",
        options=(
            Option("--minimise", "design.minimise", "QUANTITY", "Gait quantity to minimise."),
            Option("--maximise", "design.maximise", "QUANTITY", "Gait quantity to maximise."),
            Option("--over", "design.over", "KEY=A:B", "Key to vary, with its bounds.", "bounds"),
            Option("--keep", "design.keep", "QUANTITY=A:B", "Gait quantity to keep within bounds.", "bounds"),
            Option("--model", "design.model", "rigid|contact", "Model whose gait to design."),
        ),
    ),
    Stage(
        "identify", "walkerlab.pipeline.stages.identify",
        "Estimate parameters of the walker from a measured walk, with error bars.",
        reads.IdentifyConfig, results_of("fixedpoint"), only_by="identify", shown_by=DRAWINGS, finds="identified",
        depends_on=dependency("files", "walkerlab.pipeline.stages.measured_walk:digests"),
        options=(
            Option("--data", "identify.data", "FILE", "Measured walk: a table of steps, or angles over time.", "text"),
            *ESTIMATED,
            Option("--level", "identify.level", "steps|angles", "Kind of data."),
            Option("--first-leg", "identify.first_leg", "1|2", "Leg of the first step in a table of steps.", "int"),
            Option("--loss", "identify.loss", "linear|soft_l1", "soft_l1 for data with outliers."),
            Option("--robustness", "identify.robustness", "", "Also report the gait's sensitivity.", "switch"),
            *recording_options("identify"),
            Option("--plan", "", "", "Without data, predict errors for each way of measuring.", "switch", runs="plan"),
            replace(ERRORS_TO_REACH, needs=("--plan",)),
        ),
    ),
    Stage(
        "plan", "walkerlab.pipeline.stages.plan",
        "Find out which measurements, and how many steps, determine the walker's parameters.",
        reads.PlanConfig, results_of("fixedpoint"), only_by="plan", shown_by=DRAWINGS,
        options=(
            *ESTIMATED, ERRORS_TO_REACH,
            Option("--steps", "plan.steps", "N", "Number of steps to report errors for.", "int"),
        ),
    ),
)  # fmt: skip
WALKING = Extension(INTERFACE, WALKS)
ASKING = Extension(INTERFACE, QUESTIONS)
