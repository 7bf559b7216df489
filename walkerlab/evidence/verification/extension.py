"""The verification as an extension: extreme cases and problems with known answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from walkerlab.config import reads
from walkerlab.extensions import INTERFACE, Extension, lazy_function
from walkerlab.pipeline.plan.stage import DRAWINGS, Stage, gait_for_start_or_pads
from walkerlab.scene.studies import is_studied

if TYPE_CHECKING:
    from walkerlab.config.schema import Config


def cases_config(config: reads.SceneConfig) -> type:
    """Return the slice of the config that `stability` reads. For the walker of a study it is smaller."""
    return reads.CompassCasesConfig if is_studied(config) else reads.SceneCasesConfig


def paper_walks(_config: object) -> dict[str, Any]:
    """Return the part of the paper's config that the cases depend on."""
    # Imported here, because the help of the command line would otherwise load it.
    from walkerlab.config.loader import paper_config_with

    return {"paper": reads.slice_of(paper_config_with({}), reads.WalksConfig)}


def known_problems_and_start(config: reads.SceneConfig) -> tuple[str, ...]:
    """Return the required stages: `known-problems` and, if no study covers the walker, any needed to find its gait."""
    return ("known-problems", *(() if is_studied(config) else gait_for_start_or_pads(config)))


def check_cases(config: Config) -> None:
    """Raise ConfigError if a case of the config is unusable."""
    if config.stability.cases:
        # imported here, because most configs have no cases
        from walkerlab.evidence.verification.catalogue import all_cases

        all_cases(config.stability.cases)


STAGES = (
    Stage(
        "known-problems", "walkerlab.evidence.verification.known_problems",
        "Check the contact code on problems whose answers are known, once for all scenes.", object,
    ),
    Stage(
        "stability", "walkerlab.evidence.verification.stability",
        "Verify extreme cases and problems with known answers.",
        cases_config, known_problems_and_start, depends_on=paper_walks, needed_by=("report",), checks=check_cases,
        does_without=lazy_function("walkerlab.evidence.verification.stability:verification_omissions"),
    ),
    Stage(
        "stability-maps", "walkerlab.evidence.verification.stability_maps",
        "Map stability over stiffness, stiction velocity and step size; resumes where it was interrupted.",
        reads.MapsConfig, only_by="stability --full", shown_by=DRAWINGS, depends_on=paper_walks,
    ),
)  # fmt: skip
EXTENSION = Extension(
    INTERFACE,
    STAGES,
    sections={"evidence": ("walkerlab.evidence.verification.section:section",)},
    answers={"stability": "walkerlab.evidence.verification.section:answer"},
)
