"""Stage `stability`: extreme cases and known problems, judged by measures that the walk itself does not use."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeGuard

from walkerlab.config.reads import CompassCasesConfig, SceneCasesConfig, WalksConfig, keys_of
from walkerlab.config.schema import Config
from walkerlab.labels import labels_of
from walkerlab.pipeline.progress import Progress, track
from walkerlab.scene.contact import scene_on_pads
from walkerlab.scene.studies import is_studied
from walkerlab.stages.walk import rigid_start
from walkerlab.store.columns import rows_group
from walkerlab.store.content import Content
from walkerlab.verification.catalogue import judged, scene_cases
from walkerlab.verification.judge import CaseCell, run_cells
from walkerlab.verification.left_out import of_verification
from walkerlab.verification.ordinary import CAP, FINE, Choice
from walkerlab.verification.verdict import CaseResult


def run(
    config: CompassCasesConfig | SceneCasesConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1
) -> Content:
    """Judge the catalogue and the config's own cases, try ordinary methods, and report the known problems.

    For a walker other than the paper's compass the catalogue consists of variations of the scene.

    Raises ConfigError if two cases share a name.
    """
    if judged_in_its_scene(config):
        own = scene_cases(spelled_out(config, inputs))
        judged(config.stability.cases, [case for case, _ in own])
        cells = [*(CaseCell(*case) for case in own), *map(CaseCell, config.stability.cases)]
    else:
        cells = [*map(CaseCell, judged(config.stability.cases))]
    every = track(progress, "stability", len(cells), run_cells(cells, jobs))
    found: list[CaseResult | Choice] = [result for results in every for result in results]
    cases = [item for item in found if isinstance(item, CaseResult)]
    known = inputs["known-problems"]
    said = summary_of(cases, known.summary["known"], [item for item in found if isinstance(item, Choice)])
    group = rows_group(cases, labels_of(CaseResult), "case", "number of the row")
    return Content({"cases": group, "known": known["known"]}, {**said, "left_out": list(of_verification(config))})


def judged_in_its_scene(config: CompassCasesConfig | SceneCasesConfig) -> TypeGuard[SceneCasesConfig]:
    """Whether the walker is not the paper's compass."""
    return not is_studied(config)


def spelled_out(config: WalksConfig, inputs: Mapping[str, Content]) -> Config:
    """Scene with start and pitch of pads given as numbers, shared by its cases."""
    step, start = rigid_start(config, inputs)
    scene = Config().model_copy(update={key: getattr(config, key) for key in keys_of(WalksConfig)} | {"start": start})
    contact = config.contact
    if contact is None or contact.terrain != "checkerboard":
        return scene
    pitch = scene_on_pads(config, step, start).pitch_m
    return scene.model_copy(update={"contact": contact.model_copy(update={"pad_pitch": pitch})})


def summary_of(
    cases: Sequence[CaseResult], known: Sequence[Mapping[str, Any]], ordinary: Sequence[Choice]
) -> dict[str, Any]:
    """Build the summary; a failure adds `no_answer`.

    known  the known problems, as stored by their stage
    """
    failed = [*(case.name for case in cases if not case.ok), *(one["name"] for one in known if not one["ok"])]
    of = len(cases) + len(known)
    said = {
        "cases": [case_row(case) for case in cases],
        "known": list(known),
        "passed": of - len(failed),
        "failed": len(failed),
        # an ordinary method that did not arrive has no error
        "ordinary": [{name: value for name, value in asdict(one).items() if value is not None} for one in ordinary],
        "ordinary_cap": CAP,
        "ordinary_fine": FINE,
    }
    if failed:
        message = f"{len(failed)} of {of} did not end as expected: {', '.join(failed)}"
        advice = "`walkerlab report` explains failures in red; `walkerlab stability --json` has every measure."
        said["no_answer"] = {"message": message, "advice": advice}
    return said


def case_row(case: CaseResult) -> dict[str, Any]:
    told = {name: value for name, value in asdict(case).items() if name not in ("findings", "remarks")}
    told |= {name: list(told[name]) for name in ("expected", "not_measured")}
    measures = [{"measure": one.measure, "value": one.value, "limit": one.limit, "ok": one.ok} for one in case.findings]
    return {**told, "ok": case.ok, "note": "; ".join(case.failures), "measures": measures}
